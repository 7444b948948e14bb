// Where the recorded data is that some tests use and few machines have: the folder of trajectories/ and bal/, named by
// the environment variable PLUMBLINE_DATA.
#pragma once

#include <cstdlib>
#include <filesystem>

namespace plumbline {

inline std::filesystem::path data_folder() {
  const char* named = std::getenv("PLUMBLINE_DATA");
  return named != nullptr ? std::filesystem::path(named)
                          : std::filesystem::path(PLUMBLINE_SOURCE_DIR "/../shared/data");
}

}  // namespace plumbline
