// Text as a file of poses.
#include <string_view>

#include "core/error.h"
#include "core/pose_file.h"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  using namespace plumbline;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  for (const bool allow_unusable : {false, true}) {
    try {
      core::parse_tum(text, "fuzz.tum", {.allow_unusable = allow_unusable});
    } catch (const core::InputError&) {
    }
  }
  return 0;
}
