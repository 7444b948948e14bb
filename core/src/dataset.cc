#include "core/dataset.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/atomic_file.h"
#include "core/camera_config.h"
#include "core/csv.h"
#include "core/error.h"
#include "core/physical_ranges.h"
#include "core/resolved_config.h"

namespace plumbline::core {

namespace {

constexpr std::string_view kSchema = "plumbline-dataset/1";
constexpr std::string_view kImuFile = "mav0/imu0/data.csv";
constexpr std::string_view kImuSensor = "mav0/imu0/sensor.yaml";
constexpr std::string_view kFramesFile = "mav0/cam0/data.csv";
constexpr std::string_view kPointsFile = "mav0/cam0/points.csv";
constexpr std::string_view kLinesFile = "mav0/cam0/lines.csv";
constexpr std::string_view kCameraSensor = "mav0/cam0/sensor.yaml";

// meta.yaml: the parts that say how to read the rest.
struct MetaFile {
  std::string schema{kSchema};
  std::string stamp_clock = "imu and camera, each its own; t_imu = t_cam + td";
  RowReference td_reference_row = RowReference::kMiddle;
  double gravity_m_s2 = 9.81;
  std::string config_hash;
  std::uint64_t seed = 0;
  std::uint64_t trial = 0;
};

struct ImuSensorFile {
  ImuNoise noise;
};

struct CameraSensorFile {
  PinholeCamera model;
  double pixel_sigma_px = 0.0;
  std::optional<double> line_sigma_px;  // where there is a file of lines
};

void visit(ConfigVisitor& v, MetaFile& c) {
  v.value("schema", c.schema, "version of this layout");
  v.value("stamp_clock", c.stamp_clock, "of the files of measurements");
  v.choice("td_reference_row", c.td_reference_row, kRowReferenceNames, "the row that every td speaks of");
  v.value("gravity_m_s2", c.gravity_m_s2, up_to(kMostGravityMS2), "along -z of the world");
  v.value("config_hash", c.config_hash, "of the scenario");
  v.value("seed", c.seed, any(), "of the experiment");
  v.value("trial", c.trial, any(), "of the draw");
}

void visit(ConfigVisitor& v, ImuSensorFile& c) {
  const Range density = up_to(kMostNoiseDensity);
  v.value("gyroscope_noise_density", c.noise.gyro_noise_density, density, "rad/s/sqrt(Hz)");
  v.value("gyroscope_random_walk", c.noise.gyro_bias_walk, density, "rad/s^2/sqrt(Hz)");
  v.value("accelerometer_noise_density", c.noise.accel_noise_density, density, "m/s^2/sqrt(Hz)");
  v.value("accelerometer_random_walk", c.noise.accel_bias_walk, density, "m/s^3/sqrt(Hz)");
}

void visit(ConfigVisitor& v, CameraSensorFile& c) {
  visit(v, c.model);
  v.value("pixel_sigma_px", c.pixel_sigma_px, up_to(kMostPixels), "noise of u and v");
  if (c.line_sigma_px) {
    v.value("line_sigma_px", *c.line_sigma_px, up_to(kMostPixels), "noise of u and v of each end of a segment");
  }
}

}  // namespace

void visit(ConfigVisitor& v, Pose& c) {
  v.value("position_m", c.p, within(kMostPathM), "origin of the inner frame in the outer");
  Eigen::Vector4d q = c.q.coeffs();
  v.value("quaternion_xyzw", q, between(-1.000001, 1.000001), "Hamilton, unit");
  c.q.coeffs() = q;
}

void visit(ConfigVisitor& v, RigCalibration& c) {
  v.section("T_B_C", c.T_B_C, "extrinsics");
  v.value("td_s", c.td_s, within(kMostTimeOffsetS), "middle row");
  v.value("readout_s", c.readout_s, within(kMostTimeOffsetS), "first row to last");
  if (c.intrinsics) v.value("intrinsics_px", *c.intrinsics, within(1e6), "fx, fy, cx, cy");
}

static void visit(ConfigVisitor& v, State& c) {
  v.section("T_W_B", c.T_W_B, "pose");
  v.value("velocity_m_s", c.v_W, within(kMostPathM), "world axes");  // the longest path in a second
  v.value("gyro_bias_rad_s", c.bias.gyro_rad_s, within(kMostGyroReadingRadS), "body axes");
  v.value("accel_bias_m_s2", c.bias.accel_m_s2, within(kMostAccelReadingMS2), "body axes");
}

static void visit(ConfigVisitor& v, StateSigmas& c) {
  v.value("position_m", c.position_m, sigma_up_to(kMostM), "each axis");
  v.value("orientation_rad", c.orientation_rad, sigma_up_to(kMostAngleRad), "each axis");
  v.value("velocity_m_s", c.velocity_m_s, sigma_up_to(kMostSpeedMS), "each axis");
  v.value("gyro_bias_rad_s", c.gyro_bias_rad_s, sigma_up_to(kMostRateRadS), "each axis");
  v.value("accel_bias_m_s2", c.accel_bias_m_s2, sigma_up_to(kMostAccelerationMS2), "each axis");
}

static void visit(ConfigVisitor& v, CalibrationSigmas& c) {
  v.value("td_s", c.td_s, up_to(kMostTimeOffsetSigmaS), "middle row");
  v.value("readout_s", c.readout_s, up_to(kMostTimeOffsetSigmaS), "first row to last");
  v.value("extrinsic_position_m", c.extrinsic_position_m, up_to(kMostM), "each axis");
  v.value("extrinsic_rotation_rad", c.extrinsic_rotation_rad, up_to(kMostAngleRad), "each axis");
  if (c.has_intrinsics()) {
    v.value("focal_px", c.focal_px, up_to(kMostPixels), "of fx and fy");
    v.value("principal_point_px", c.principal_point_px, up_to(kMostPixels), "of cx and cy");
  }
}

static void visit(ConfigVisitor& v, InitialPrior& c) {
  auto t_ns = static_cast<std::uint64_t>(c.t_ns);
  v.value("t_ns", t_ns, any(), "IMU clock, the stamp of an IMU sample");
  c.t_ns = static_cast<TimeNs>(t_ns);
  v.section("mean", c.mean, "the state at t_ns");
  v.section("sigma", c.sigma, "of the state");
  v.section("calibration", c.calibration, "mean");
  v.section("calibration_sigma", c.calibration_sigma, "0: exactly known");
  v.section("start", c.start, "where to start iterating");
  v.section("start_calibration", c.start_calibration, "likewise");
}

namespace {

void append_yaml(const nlohmann::ordered_json& value, int indent, std::string& out) {
  for (const auto& [key, child] : value.items()) {
    out.append(static_cast<std::size_t>(indent), ' ');
    if (child.is_object()) {
      out += key + ":\n";
      append_yaml(child, indent + 2, out);
    } else {
      out += fmt::format("{}: {}\n", key, child.dump());
    }
  }
}

template <class Config>
void write_yaml(const std::filesystem::path& file, const Config& config) {
  write_file_atomically(file, to_yaml(resolved_config(config)));
}

// A dataset states everything: a key that is missing is a file cut short, not a default.
void require_keys(const ConfigTree& tree, const nlohmann::ordered_json& resolved, const std::string& prefix) {
  for (const auto& [key, value] : resolved.items()) {
    const std::string dotted = prefix.empty() ? key : fmt::format("{}.{}", prefix, key);
    if (find_value(tree, dotted) == nullptr) throw config_error(tree.origin, dotted, "is missing");
    if (value.is_object()) require_keys(tree, value, dotted);
  }
}

template <class Config>
Config read_all_keys(const ConfigTree& tree, Config config = {}) {
  read_config(tree, "", config);
  require_keys(tree, resolved_config(config), "");
  return config;
}

template <class Config>
Config read_yaml(const std::filesystem::path& file) {
  return read_all_keys<Config>(load_config_file(file));
}

// Differences of stamps must not overflow.
constexpr TimeNs kLargestStampNs = 4'000'000'000'000'000'000;  // 126 years

void check_increasing(const CsvReader& csv, TimeNs previous, TimeNs now, bool first) {
  if (now < -kLargestStampNs || now > kLargestStampNs) csv.fail(fmt::format("stamp {} is beyond 126 years", now));
  if (!first && now <= previous) csv.fail(fmt::format("stamp {} does not come after {}", now, previous));
}

bool has_lines(const MeasurementLog& log) {
  return log.line_sigma_px > 0.0 ||
         std::any_of(log.frames.begin(), log.frames.end(), [](const Frame& frame) { return !frame.lines.empty(); });
}

std::string lines_text(const std::vector<Frame>& frames) {
  std::string text = "#frame_ns,track_id,u0 [px],v0 [px],u1 [px],v1 [px],vx0 [s^-1],vy0 [s^-1],vx1 [s^-1],vy1 [s^-1]\n";
  for (const Frame& frame : frames) {
    for (const LineObservation& line : frame.lines) {
      text += fmt::format("{},{}", frame.t_cam_ns, line.track_id);
      for (const Eigen::Vector2d& end : line.ends_px) text += fmt::format(",{},{}", end.x(), end.y());
      if (line.velocities) {
        for (const Eigen::Vector2d& v : *line.velocities) text += fmt::format(",{},{}", v.x(), v.y());
        text += '\n';
      } else {
        text += ",,,,\n";
      }
    }
  }
  return text;
}

// Walks through the frames beside a file of observations, which has them in the same order.
class FrameWalk {
 public:
  FrameWalk(std::vector<Frame>& frames, const CsvReader& csv) : frames_(frames), csv_(csv), frame_(frames.begin()) {}

  // The frame of the reader's present row, whose first columns are its stamp and a track that it has not named yet.
  Frame& of_row() {
    const TimeNs t_ns = csv_.integer(0);
    for (; frame_ != frames_.end() && frame_->t_cam_ns < t_ns; ++frame_) tracks_.clear();
    if (frame_ == frames_.end() || frame_->t_cam_ns != t_ns) {
      csv_.fail(fmt::format("frame {} is not in {}, or out of order", t_ns, kFramesFile));
    }
    if (!tracks_.insert(csv_.integer(1)).second) {
      csv_.fail(fmt::format("track {} is in frame {} already", csv_.integer(1), t_ns));
    }
    return *frame_;
  }

 private:
  std::vector<Frame>& frames_;
  const CsvReader& csv_;
  std::vector<Frame>::iterator frame_;
  std::set<std::int64_t> tracks_;  // of the frame
};

void read_points(const std::filesystem::path& file, std::vector<Frame>& frames) {
  CsvReader csv(file, 4, 2);
  FrameWalk walk(frames, csv);
  while (csv.next()) {
    PointObservation& point = walk.of_row().points.emplace_back();
    point.track_id = csv.integer(1);
    point.pixel = {csv.number(2), csv.number(3)};
    if (csv.has(4) || csv.has(5)) point.velocity = {csv.number(4), csv.number(5)};
  }
}

void read_lines(const std::filesystem::path& file, std::vector<Frame>& frames) {
  CsvReader csv(file, 6, 4);
  FrameWalk walk(frames, csv);
  const auto pair = [&](std::size_t column) -> Eigen::Vector2d { return {csv.number(column), csv.number(column + 1)}; };
  while (csv.next()) {
    LineObservation& line = walk.of_row().lines.emplace_back();
    line.track_id = csv.integer(1);
    line.ends_px = {pair(2), pair(4)};
    if (csv.has(6) || csv.has(7) || csv.has(8) || csv.has(9)) line.velocities = {pair(6), pair(8)};
  }
}

// What joins the prior with itself, with the IMU and, by its td, with the frames.
void check_prior(const MeasurementLog& log, const ConfigTree& tree) {
  const InitialPrior& prior = log.prior;
  const auto require = [&](bool holds, const std::string& key, std::string_view rule) {
    if (!holds) throw config_error(find_value(tree, key)->origin, key, rule);
  };
  const auto require_unit = [&](const Pose& pose, const std::string& key) {
    require(std::abs(pose.q.norm() - 1.0) <= 1e-3, key + ".quaternion_xyzw", "must be a unit quaternion");
  };
  require_unit(prior.mean.T_W_B, "mean.T_W_B");
  require_unit(prior.start.T_W_B, "start.T_W_B");
  require_unit(prior.calibration.T_B_C, "calibration.T_B_C");
  require_unit(prior.start_calibration.T_B_C, "start_calibration.T_B_C");
  if (prior.calibration.intrinsics) {
    require(*prior.calibration.intrinsics == log.camera.intrinsics(), "calibration.intrinsics_px",
            fmt::format("must be those of {}", kCameraSensor));
    require(prior.start_calibration.intrinsics->head<2>().minCoeff() > 0.0, "start_calibration.intrinsics_px",
            "must have positive focal lengths");
  }
  require(std::binary_search(log.imu.begin(), log.imu.end(), ImuSample{.t_ns = prior.t_ns},
                             [](const ImuSample& a, const ImuSample& b) { return a.t_ns < b.t_ns; }),
          "t_ns", fmt::format("{} is not the stamp of an IMU sample", prior.t_ns));
  if (log.frames.empty()) return;
  const double lead_s = to_seconds(log.frames.front().t_cam_ns - prior.t_ns) + prior.calibration.td_s;
  require(lead_s >= 0.0, "t_ns",
          fmt::format("must not be after the first frame, which t_cam + td puts {} s before it", -lead_s));
}

}  // namespace

std::string to_yaml(const nlohmann::ordered_json& value) {
  std::string out;
  append_yaml(value, 0, out);
  return out;
}

void write_dataset(const std::filesystem::path& folder, const MeasurementLog& log, const DatasetMeta& meta) {
  if (std::filesystem::exists(folder) &&
      !(std::filesystem::is_directory(folder) && std::filesystem::is_empty(folder))) {
    throw DataError(fmt::format("{}: exists and is not an empty folder", folder.generic_string()));
  }
  std::filesystem::create_directories(folder / "mav0/imu0");
  std::filesystem::create_directories(folder / "mav0/cam0");

  std::string imu =
      "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
      "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";
  for (const ImuSample& s : log.imu) {
    imu += fmt::format("{},{},{},{},{},{},{}\n", s.t_ns, s.gyro_rad_s.x(), s.gyro_rad_s.y(), s.gyro_rad_s.z(),
                       s.accel_m_s2.x(), s.accel_m_s2.y(), s.accel_m_s2.z());
  }
  write_file_atomically(folder / kImuFile, imu);
  write_yaml(folder / kImuSensor, ImuSensorFile{log.imu_noise});

  std::string frames = "#timestamp [ns] (camera clock)\n";
  std::string points = "#frame_ns,track_id,u [px],v [px],vx [s^-1],vy [s^-1]\n";
  for (const Frame& frame : log.frames) {
    frames += fmt::format("{}\n", frame.t_cam_ns);
    for (const PointObservation& point : frame.points) {
      points += fmt::format("{},{},{},{},", frame.t_cam_ns, point.track_id, point.pixel.x(), point.pixel.y());
      points += point.velocity ? fmt::format("{},{}\n", point.velocity->x(), point.velocity->y()) : ",\n";
    }
  }
  write_file_atomically(folder / kFramesFile, frames);
  write_file_atomically(folder / kPointsFile, points);
  CameraSensorFile sensor{.model = log.camera, .pixel_sigma_px = log.pixel_sigma_px, .line_sigma_px = std::nullopt};
  if (has_lines(log)) {
    sensor.line_sigma_px = log.line_sigma_px;
    write_file_atomically(folder / kLinesFile, lines_text(log.frames));
  }
  write_yaml(folder / kCameraSensor, sensor);
  write_yaml(folder / "prior.yaml", log.prior);
  MetaFile file;
  file.gravity_m_s2 = log.gravity_m_s2;
  file.config_hash = meta.config_hash;
  file.seed = meta.seed;
  file.trial = meta.trial;
  write_yaml(folder / "meta.yaml", file);
}

MeasurementLog read_dataset(const std::filesystem::path& folder) {
  const MetaFile meta = read_yaml<MetaFile>(folder / "meta.yaml");
  if (meta.schema != kSchema) {
    throw DataError(fmt::format("{}: schema is '{}', this program reads '{}'", (folder / "meta.yaml").generic_string(),
                                meta.schema, kSchema));
  }
  if (meta.td_reference_row != RowReference::kMiddle) {
    throw DataError(fmt::format("{}: td_reference_row must be middle", (folder / "meta.yaml").generic_string()));
  }
  const ConfigTree sensor = load_config_file(folder / kCameraSensor);
  CameraSensorFile expected;
  if (std::filesystem::exists(folder / kLinesFile) || find_value(sensor, "line_sigma_px") != nullptr) {
    expected.line_sigma_px = 0.0;
  }
  const CameraSensorFile camera = read_all_keys(sensor, expected);

  MeasurementLog log;
  log.gravity_m_s2 = meta.gravity_m_s2;
  log.camera = camera.model;
  log.pixel_sigma_px = camera.pixel_sigma_px;
  log.line_sigma_px = camera.line_sigma_px.value_or(0.0);
  log.imu_noise = read_yaml<ImuSensorFile>(folder / kImuSensor).noise;
  const ConfigTree prior = load_config_file(folder / "prior.yaml");
  InitialPrior prior_keys;
  if (find_value(prior, "calibration.intrinsics_px") != nullptr ||
      find_value(prior, "calibration_sigma.focal_px") != nullptr) {
    prior_keys.calibration.intrinsics = prior_keys.start_calibration.intrinsics = Intrinsics::Zero();
    prior_keys.calibration_sigma.focal_px = 1.0;
  }
  log.prior = read_all_keys(prior, prior_keys);

  CsvReader imu(folder / kImuFile, 7);
  while (imu.next()) {
    const TimeNs t_ns = imu.integer(0);
    check_increasing(imu, log.imu.empty() ? 0 : log.imu.back().t_ns, t_ns, log.imu.empty());
    log.imu.push_back(
        {t_ns, {imu.number(1), imu.number(2), imu.number(3)}, {imu.number(4), imu.number(5), imu.number(6)}});
    if (!is_physical(log.imu.back())) {
      imu.fail(fmt::format("no IMU reads more than {} rad/s or {} m/s^2", kMostGyroReadingRadS, kMostAccelReadingMS2));
    }
  }
  if (log.imu.size() < 2) imu.fail("an IMU needs two samples");
  CsvReader frames(folder / kFramesFile, 1);
  while (frames.next()) {
    const TimeNs t_ns = frames.integer(0);
    check_increasing(frames, log.frames.empty() ? 0 : log.frames.back().t_cam_ns, t_ns, log.frames.empty());
    log.frames.push_back({t_ns, {}});
  }
  check_prior(log, prior);
  read_points(folder / kPointsFile, log.frames);
  if (camera.line_sigma_px) read_lines(folder / kLinesFile, log.frames);
  return log;
}

}  // namespace plumbline::core
