#include <fstream>
#include <sstream>
#include <stdexcept>

#include <fmt/format.h>

#include "core/atomic_file.h"
#include "core/dataset.h"
#include "core/error.h"
#include "output_folders.h"
#include "sim/truth_files.h"
#include "tools/commands.h"
#include "tools/rig.h"

namespace plumbline::tools {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPosesSay =
    "# T_W_B: the IMU in the world (z up), at the stamps of the IMU's clock; unit quaternions, Hamilton";

// 17 significant digits, which name a double, and never fewer than nine decimals.
std::string digits(double x) { return fmt::format("{:#.17g}", x); }

std::string seconds_text(core::TimeNs t_ns) {
  const core::TimeNs part = ((t_ns % core::kNsPerSecond) + core::kNsPerSecond) % core::kNsPerSecond;
  return fmt::format("{}.{:09}", (t_ns - part) / core::kNsPerSecond, part);
}

// As evo and OpenVINS read it.
std::string tum_text(const std::vector<core::StampedState>& states) {
  std::string text = fmt::format("{}\n# timestamp_s tx ty tz qx qy qz qw\n", kPosesSay);
  for (const auto& [t_ns, s] : states) {
    const Eigen::Quaterniond q = s.T_W_B.q.normalized();
    text += seconds_text(t_ns);
    for (const double x : {s.T_W_B.p.x(), s.T_W_B.p.y(), s.T_W_B.p.z(), q.x(), q.y(), q.z(), q.w()}) {
      text += ' ';
      text += digits(x);
    }
    text += '\n';
  }
  return text;
}

// As VINS writes its results, with its comma at the end.
std::string vins_text(const std::vector<core::StampedState>& states) {
  std::string text = fmt::format("{}\n# t_ns,px,py,pz,qw,qx,qy,qz,vx,vy,vz,\n", kPosesSay);
  for (const auto& [t_ns, s] : states) {
    const Eigen::Quaterniond& q = s.T_W_B.q;
    text += fmt::format("{},", t_ns);
    for (const double x :
         {s.T_W_B.p.x(), s.T_W_B.p.y(), s.T_W_B.p.z(), q.w(), q.x(), q.y(), q.z(), s.v_W.x(), s.v_W.y(), s.v_W.z()}) {
      text += fmt::format("{},", x);
    }
    text += '\n';
  }
  return text;
}

void write_text(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  core::write_file_atomically(file, text);
}

// The dataset's own table below a comment.
void copy_table(const fs::path& from, const fs::path& to, std::string_view comment) {
  std::ostringstream text;
  text << "# " << comment << '\n' << std::ifstream(from, std::ios::binary).rdbuf();
  write_text(to, text.str());
}

constexpr std::string_view kImuSays = "the IMU's clock; the IMU is the body";
constexpr std::string_view kCameraSays =
    "the camera's clock, t_imu = t_cam + td (of the middle row); pixel (0, 0) is the centre of the upper left pixel";
constexpr const char* kTruth = "truth/mav0/state_groundtruth_estimate0/data.csv";

void write_euroc_tables(const fs::path& dataset, const core::MeasurementLog& log, const fs::path& out) {
  copy_table(dataset / "mav0/imu0/data.csv", out / "mav0/imu0/data.csv", kImuSays);
  std::string frames = fmt::format("# {}\n#timestamp [ns],filename\n", kCameraSays);
  for (const core::Frame& frame : log.frames) frames += fmt::format("{0},{0}.png\n", frame.t_cam_ns);
  write_text(out / "mav0/cam0/data.csv", frames);
  if (fs::exists(dataset / kTruth)) {
    copy_table(dataset / kTruth, out / "mav0/state_groundtruth_estimate0/data.csv", kImuSays);
  }
}

void write_csv_tables(const fs::path& dataset, const fs::path& out) {
  copy_table(dataset / "mav0/imu0/data.csv", out / "imu.csv", kImuSays);
  for (const char* name : {"points.csv", "lines.csv"}) {
    const fs::path table = dataset / "mav0/cam0" / name;
    if (fs::exists(table)) copy_table(table, out / name, kCameraSays);
  }
  copy_table(dataset / "mav0/cam0/data.csv", out / "frames.csv", kCameraSays);
  if (fs::exists(dataset / kTruth)) copy_table(dataset / kTruth, out / "trajectory.csv", kImuSays);
}

// Tables have no layout of their own for a calibration: Kalibr's is the one that most programs read.
RigFormat rig_format_of(ExportFormat format) {
  switch (format) {
    case ExportFormat::kTum:
    case ExportFormat::kCsv:
    case ExportFormat::kKalibr:
      return RigFormat::kKalibr;
    case ExportFormat::kOpenvins:
      return RigFormat::kOpenvins;
    case ExportFormat::kVins:
      return RigFormat::kVins;
    case ExportFormat::kEuroc:
      return RigFormat::kEuroc;
  }
  throw std::logic_error("rig_format_of: unknown format");
}

}  // namespace

int export_dataset(const ExportOptions& options) {
  refuse_existing(options.out);
  const core::MeasurementLog log = core::read_dataset(options.dataset);
  const Rig rig = rig_of(log);
  std::vector<core::StampedState> states;
  if (fs::exists(options.dataset / kTruth)) {
    states = sim::read_truth(options.dataset).states;
  } else if (options.format == ExportFormat::kTum) {
    throw core::DataError(fmt::format("{}: holds no truth, of which the poses are", options.dataset.generic_string()));
  }
  fs::create_directories(options.out);
  write_rig(options.out, rig, rig_format_of(options.format));
  switch (options.format) {
    case ExportFormat::kTum:
    case ExportFormat::kKalibr:
      if (!states.empty()) write_text(options.out / "trajectory.tum", tum_text(states));
      break;
    case ExportFormat::kOpenvins:
      if (!states.empty()) write_text(options.out / "groundtruth.txt", tum_text(states));
      break;
    case ExportFormat::kVins:
      if (!states.empty()) write_text(options.out / "groundtruth.csv", vins_text(states));
      break;
    case ExportFormat::kEuroc:
      write_euroc_tables(options.dataset, log, options.out);
      break;
    case ExportFormat::kCsv:
      write_csv_tables(options.dataset, options.out);
      break;
  }
  fmt::print("{}\n", options.out.generic_string());
  return kExitOk;
}

}  // namespace plumbline::tools
