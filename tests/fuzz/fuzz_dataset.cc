// A sound dataset with one file replaced: the first byte chooses the file, the others are its text. What the reader
// accepts is estimated, a few iterations long: whatever the numbers are, the answer is a status.
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "core/dataset.h"
#include "core/error.h"
#include "estimator/estimate.h"
#include "sim/simulate.h"

namespace {

namespace fs = std::filesystem;
using namespace plumbline;

// The order that tools/fuzz makes its seeds in.
constexpr std::array<const char*, 8> kFiles = {
    "meta.yaml",          "prior.yaml",           "mav0/imu0/data.csv",  "mav0/imu0/sensor.yaml",
    "mav0/cam0/data.csv", "mav0/cam0/points.csv", "mav0/cam0/lines.csv", "mav0/cam0/sensor.yaml"};

class Folder {
 public:
  Folder() {
    std::string name = (fs::temp_directory_path() / "plumbline-fuzz-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) std::abort();
    path_ = name;
    sim::ScenarioConfig scenario;
    scenario.duration_s = 1.0;
    scenario.imu.rate_hz = 20.0;
    scenario.imu.noise = {1e-3, 1e-4, 1e-2, 1e-3};
    scenario.points.per_frame = 3;
    scenario.lines.per_frame = 3;
    scenario.world.lines.random = 500;
    core::write_dataset(path_ / "dataset", sim::simulate(scenario, {}).measurements, {});
  }
  ~Folder() { fs::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  fs::path dataset() const { return path_ / "dataset"; }

 private:
  fs::path path_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  static const Folder folder;
  if (size == 0) return 0;
  const fs::path file = folder.dataset() / kFiles[data[0] % kFiles.size()];
  std::ifstream in(file, std::ios::binary);
  const std::string sound{std::istreambuf_iterator<char>(in), {}};
  std::ofstream(file, std::ios::binary).write(reinterpret_cast<const char*>(data + 1), static_cast<long>(size - 1));
  try {
    const core::MeasurementLog log = core::read_dataset(folder.dataset());
    estimator::EstimatorConfig config;
    config.max_iterations = 2;
    estimator::estimate(log, config);
  } catch (const core::InputError&) {
  }
  std::ofstream(file, std::ios::binary).write(sound.data(), static_cast<long>(sound.size()));
  return 0;
}
