#include "tools/rig.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "core/atomic_file.h"
#include "foreign_yaml.h"
#include "rig_formats.h"

namespace plumbline::tools {
namespace {

namespace fs = std::filesystem;
using core::ConfigTree;

// Of the median interval.
double rate_hz(std::vector<core::TimeNs> stamps) {
  std::adjacent_difference(stamps.begin(), stamps.end(), stamps.begin());
  if (stamps.size() < 2) throw core::DataError("a recording with fewer than two samples has no rate");
  const auto middle = stamps.begin() + 1 + (std::ssize(stamps) - 1) / 2;
  std::nth_element(stamps.begin() + 1, middle, stamps.end());
  return 1.0 / core::to_seconds(*middle);
}

std::vector<rig_formats::TextFile> files_of(const Rig& rig, RigFormat format) {
  switch (format) {
    case RigFormat::kKalibr:
      return rig_formats::kalibr_files(rig);
    case RigFormat::kOpenvins:
      return rig_formats::openvins_files(rig);
    case RigFormat::kVins:
      return rig_formats::vins_files(rig);
    case RigFormat::kEuroc:
      return rig_formats::euroc_files(rig);
  }
  throw std::logic_error("files_of: unknown format");
}

bool has(const ConfigTree& tree, std::string_view key) { return core::find_value(tree, key) != nullptr; }

}  // namespace

Rig rig_of(const core::MeasurementLog& log) {
  std::vector<core::TimeNs> imu;
  std::vector<core::TimeNs> frames;
  imu.reserve(log.imu.size());
  frames.reserve(log.frames.size());
  for (const core::ImuSample& s : log.imu) imu.push_back(s.t_ns);
  for (const core::Frame& f : log.frames) frames.push_back(f.t_cam_ns);
  return {.camera = log.camera,
          .calibration = log.prior.calibration,
          .imu_noise = log.imu_noise,
          .imu_rate_hz = rate_hz(std::move(imu)),
          .camera_rate_hz = rate_hz(std::move(frames)),
          .gravity_m_s2 = log.gravity_m_s2,
          .pixel_sigma_px = log.pixel_sigma_px};
}

void write_rig(const fs::path& folder, const Rig& rig, RigFormat format) {
  for (const rig_formats::TextFile& file : files_of(rig, format)) {
    fs::create_directories((folder / file.name).parent_path());
    core::write_file_atomically(folder / file.name, file.text);
  }
}

void read_rig(const fs::path& path, std::optional<double> imu_rate_hz, PartialRig& rig) {
  if (fs::is_directory(path)) {
    const fs::path sensors = fs::is_directory(path / "mav0") ? path / "mav0" : path;
    for (const char* name : {"cam0/sensor.yaml", "imu0/sensor.yaml"}) read_rig(sensors / name, imu_rate_hz, rig);
    return;
  }
  const ConfigTree tree = foreign::load(path);
  if (has(tree, "sensor_type")) {
    rig_formats::read_euroc_sensor(tree, rig);
  } else if (has(tree, "relative_config_imucam")) {
    rig_formats::read_openvins(tree, path.parent_path(), rig);
  } else if (has(tree, "cam0")) {
    rig_formats::read_camchain(tree, rig);
  } else if (has(tree, "imu0") || has(tree, "update_rate")) {
    rig_formats::read_imu(tree, rig);
  } else if (has(tree, "acc_n")) {
    rig_formats::read_vins(tree, path.parent_path(), imu_rate_hz, rig);
  } else {
    throw core::DataError(
        fmt::format("{}: neither cam0, imu0, update_rate (Kalibr), relative_config_imucam (OpenVINS), "
                    "acc_n (VINS) nor sensor_type (EuRoC) is a key of it",
                    path.generic_string()));
  }
}

}  // namespace plumbline::tools
