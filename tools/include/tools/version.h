// Which build this is.
#pragma once

#include <string_view>

namespace plumbline::tools {

std::string_view version();  // as in CMakeLists.txt
std::string_view commit();   // git describe at build time, "unknown" outside a checkout

}  // namespace plumbline::tools
