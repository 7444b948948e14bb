#include "sim/truth_files.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/atomic_file.h"
#include "core/csv.h"
#include "core/dataset.h"
#include "core/resolved_config.h"

namespace plumbline::sim {
namespace {

constexpr std::string_view kStates = "truth/mav0/state_groundtruth_estimate0/data.csv";
constexpr std::string_view kLandmarks = "truth/landmarks.csv";
constexpr std::string_view kTracks = "truth/tracks.csv";
constexpr std::string_view kSegments = "truth/segments.csv";
constexpr std::string_view kLineTracks = "truth/line_tracks.csv";
constexpr std::string_view kLineEnds = "truth/line_ends.csv";
constexpr std::string_view kCalibration = "truth/calibration.yaml";

void write_lines(const std::filesystem::path& folder, const GroundTruth& truth) {
  std::string segments = "#segment,x0 [m],y0 [m],z0 [m],x1 [m],y1 [m],z1 [m]\n";
  for (std::size_t i = 0; i < truth.segments_W.size(); ++i) {
    const auto& [p, q] = truth.segments_W[i].ends_W;
    segments += fmt::format("{},{},{},{},{},{},{}\n", i, p.x(), p.y(), p.z(), q.x(), q.y(), q.z());
  }
  core::write_file_atomically(folder / kSegments, segments);
  std::string tracks = "#track_id,segment\n";
  for (const auto& [track, segment] : truth.track_segment) tracks += fmt::format("{},{}\n", track, segment);
  core::write_file_atomically(folder / kLineTracks, tracks);
  std::string ends = "#frame_ns,track_id,segment,t_imu0 [s],t_imu1 [s],u0 [px],v0 [px],u1 [px],v1 [px]\n";
  for (const LineEnds& e : truth.line_ends) {
    ends += fmt::format("{},{},{},{},{},{},{},{},{}\n", e.frame_ns, e.track_id, e.segment, e.t_imu_s[0], e.t_imu_s[1],
                        e.ends_px[0].x(), e.ends_px[0].y(), e.ends_px[1].x(), e.ends_px[1].y());
  }
  core::write_file_atomically(folder / kLineEnds, ends);
}

// The index of one of the segments.
int segment_in(const core::CsvReader& csv, std::size_t column, const std::vector<Segment>& segments_W) {
  const std::int64_t segment = csv.integer(column);
  if (segment < 0 || segment >= std::ssize(segments_W)) csv.fail(fmt::format("there is no segment {}", segment));
  return static_cast<int>(segment);
}

void read_lines(const std::filesystem::path& folder, GroundTruth& truth) {
  core::CsvReader segments(folder / kSegments, 7);
  while (segments.next()) {
    const auto end = [&](std::size_t column) -> Eigen::Vector3d {
      return {segments.number(column), segments.number(column + 1), segments.number(column + 2)};
    };
    truth.segments_W.push_back({{end(1), end(4)}});
  }
  core::CsvReader tracks(folder / kLineTracks, 2);
  while (tracks.next()) truth.track_segment[tracks.integer(0)] = segment_in(tracks, 1, truth.segments_W);
  core::CsvReader ends(folder / kLineEnds, 9);
  while (ends.next()) {
    truth.line_ends.push_back({.frame_ns = ends.integer(0),
                               .track_id = ends.integer(1),
                               .segment = segment_in(ends, 2, truth.segments_W),
                               .t_imu_s = {ends.number(3), ends.number(4)},
                               .ends_px = {Eigen::Vector2d(ends.number(5), ends.number(6)),
                                           Eigen::Vector2d(ends.number(7), ends.number(8))}});
  }
}

}  // namespace

void write_truth(const std::filesystem::path& folder, const GroundTruth& truth) {
  std::filesystem::create_directories((folder / kStates).parent_path());
  std::string states =
      "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z [],"
      "v_RS_R_x [m s^-1],v_RS_R_y [m s^-1],v_RS_R_z [m s^-1],b_w_RS_S_x [rad s^-1],b_w_RS_S_y [rad s^-1],"
      "b_w_RS_S_z [rad s^-1],b_a_RS_S_x [m s^-2],b_a_RS_S_y [m s^-2],b_a_RS_S_z [m s^-2]\n";
  for (const auto& [t_ns, s] : truth.states) {
    const Eigen::Quaterniond& q = s.T_W_B.q;
    states += fmt::format("{},{},{},{},{},{},{},{}", t_ns, s.T_W_B.p.x(), s.T_W_B.p.y(), s.T_W_B.p.z(), q.w(), q.x(),
                          q.y(), q.z());
    for (const Eigen::Vector3d* x : {&s.v_W, &s.bias.gyro_rad_s, &s.bias.accel_m_s2}) {
      states += fmt::format(",{},{},{}", x->x(), x->y(), x->z());
    }
    states += '\n';
  }
  core::write_file_atomically(folder / kStates, states);

  std::string landmarks = "#landmark,x [m],y [m],z [m]\n";
  for (std::size_t i = 0; i < truth.landmarks_W.size(); ++i) {
    const Eigen::Vector3d& p = truth.landmarks_W[i];
    landmarks += fmt::format("{},{},{},{}\n", i, p.x(), p.y(), p.z());
  }
  core::write_file_atomically(folder / kLandmarks, landmarks);

  std::string tracks = "#track_id,landmark\n";
  for (const auto& [track, landmark] : truth.track_landmark) tracks += fmt::format("{},{}\n", track, landmark);
  core::write_file_atomically(folder / kTracks, tracks);
  if (!truth.segments_W.empty()) write_lines(folder, truth);
  core::write_file_atomically(folder / kCalibration, core::to_yaml(core::resolved_config(truth.calibration)));
}

GroundTruth read_truth(const std::filesystem::path& folder) {
  GroundTruth truth;
  const core::ConfigTree calibration = core::load_config_file(folder / kCalibration);
  if (core::find_value(calibration, "intrinsics_px") != nullptr)
    truth.calibration.intrinsics = core::Intrinsics::Zero();
  core::read_config(calibration, "", truth.calibration);

  core::CsvReader states(folder / kStates, 17);
  while (states.next()) {
    const auto vector = [&](std::size_t column) -> Eigen::Vector3d {
      return {states.number(column), states.number(column + 1), states.number(column + 2)};
    };
    const core::TimeNs t_ns = states.integer(0);
    if (!truth.states.empty() && t_ns <= truth.states.back().t_ns) states.fail("stamps must increase");
    truth.states.push_back(
        {t_ns,
         {.T_W_B = {{states.number(4), states.number(5), states.number(6), states.number(7)}, vector(1)},
          .v_W = vector(8),
          .bias = {vector(11), vector(14)}}});
  }
  core::CsvReader landmarks(folder / kLandmarks, 4);
  while (landmarks.next()) {
    truth.landmarks_W.emplace_back(landmarks.number(1), landmarks.number(2), landmarks.number(3));
  }
  core::CsvReader tracks(folder / kTracks, 2);
  while (tracks.next()) truth.track_landmark[tracks.integer(0)] = static_cast<int>(tracks.integer(1));
  if (std::filesystem::exists(folder / kSegments)) read_lines(folder, truth);
  return truth;
}

}  // namespace plumbline::sim
