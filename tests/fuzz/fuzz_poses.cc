// Text as a file of poses.
#include <string_view>

#include "core/error.h"
#include "core/pose_covariance_file.h"
#include "core/pose_formats.h"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  using namespace plumbline;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  using core::PoseFormat;
  for (const PoseFormat format : {PoseFormat::kAuto, PoseFormat::kTum, PoseFormat::kEuroc, PoseFormat::kKitti}) {
    for (const bool allow_unusable : {false, true}) {
      try {
        core::parse_poses(text, "fuzz.txt",
                          {.format = format, .kitti_rate_hz = 10.0, .allow_unusable = allow_unusable});
      } catch (const core::InputError&) {
      }
    }
  }
  try {
    core::parse_tum_covariances(text, "fuzz.tum");
  } catch (const core::InputError&) {
  }
  return 0;
}
