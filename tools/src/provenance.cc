#include "provenance.h"

#include <fstream>
#include <thread>

#include <Eigen/Core>
#include <boost/version.hpp>
#include <ceres/version.h>
#include <fmt/format.h>
#include <opencv2/core/version.hpp>
#include <sqlite3.h>
#include <sys/utsname.h>

#include "tools/version.h"

namespace plumbline::tools {
namespace {

// The value of the first line that begins with `key`, after its colon or equals sign; "unknown" without one.
std::string value_in(const char* file, std::string_view key) {
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    if (!line.starts_with(key)) continue;
    std::size_t begin = line.find_first_of(":=");
    if (begin == std::string::npos) continue;
    begin = line.find_first_not_of(" \t\"", begin + 1);
    if (begin == std::string::npos) continue;
    return line.substr(begin, line.find_last_not_of(" \t\"") - begin + 1);
  }
  return "unknown";
}

}  // namespace

std::string processor_model() { return value_in("/proc/cpuinfo", "model name"); }

Provenance provenance() {
  utsname system{};
  ::uname(&system);
  return {{"Plumbline", fmt::format("{} ({})", version(), commit())},
          {"Compiler", __VERSION__},
          {"Libraries", fmt::format("Eigen {}.{}.{}, Ceres {}, OpenCV {}, Boost {}.{}, SQLite {}", EIGEN_WORLD_VERSION,
                                    EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION, CERES_VERSION_STRING, CV_VERSION,
                                    BOOST_VERSION / 100000, BOOST_VERSION / 100 % 1000, SQLITE_VERSION)},
          {"Processor", fmt::format("{}, {} threads", processor_model(), std::thread::hardware_concurrency())},
          {"System", fmt::format("{}, {} {}, {}", value_in("/etc/os-release", "PRETTY_NAME"), system.sysname,
                                 system.release, system.machine)}};
}

}  // namespace plumbline::tools
