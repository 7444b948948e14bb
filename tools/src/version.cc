#include "tools/version.h"

#include "version_info.h"

namespace plumbline::tools {

std::string_view version() { return PLUMBLINE_VERSION; }
std::string_view commit() { return PLUMBLINE_COMMIT; }

}  // namespace plumbline::tools
