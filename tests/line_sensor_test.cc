// Tracks of segments through a recording: what is observed, what is wrong with it, and the truth beside it.
#include "sim/line_sensor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/time.h"
#include "sim/simulate.h"

namespace plumbline::sim {
namespace {

constexpr core::TrialId kId{.seed = 1, .trial = 0};

// Strong motion, so that a millisecond is worth more than half a pixel; no noise.
ScenarioConfig some_config() {
  ScenarioConfig config;
  config.duration_s = 6.0;
  config.trajectory.handheld = {.speed_rms_m_s = 0.7, .rate_rms_rad_s = 0.75};
  config.camera.td_s = 0.02;
  config.camera.readout_s = 0.03;
  config.world.landmarks = 300;
  config.world.lines.random = 500;
  config.points.per_frame = 20;
  config.lines.per_frame = 40;
  config.lines.sigma_px = 0.0;
  config.lines.velocity_source = VelocitySource::kNone;
  return config;
}

// A recording with the truth of each of its line observations.
struct Recorded {
  ScenarioConfig config;
  std::unique_ptr<const Trajectory> trajectory;
  Simulation simulation;

  explicit Recorded(const ScenarioConfig& c, core::TrialId id = kId)
      : config(c), trajectory(make_trajectory(c.trajectory, c.duration_s, id)), simulation(simulate(c, id)) {}

  const Segment& segment(int i) const { return simulation.truth.segments_W[static_cast<std::size_t>(i)]; }
  int followed(std::int64_t track) const { return simulation.truth.track_segment.at(track); }

  Eigen::Vector2d project(const Eigen::Vector3d& P_W, double t_imu_s) const {
    const core::Pose T_W_C = trajectory->pose_at(t_imu_s) * config.calibration().T_B_C;
    return config.camera.model.project(T_W_C.inverse() * P_W).value_or(Eigen::Vector2d::Constant(std::nan("")));
  }

  template <class F>
  void for_each_line(const F& f) const {
    auto ends = simulation.truth.line_ends.begin();
    for (const core::Frame& frame : simulation.measurements.frames) {
      for (const core::LineObservation& line : frame.lines) {
        ASSERT_EQ(ends->frame_ns, frame.t_cam_ns);
        ASSERT_EQ(ends->track_id, line.track_id);
        f(frame, line, *ends);
        ++ends;
      }
    }
    EXPECT_EQ(ends, simulation.truth.line_ends.end());
  }
};

// The standard score of a chi-square variable, by Wilson and Hilferty. |score| < 4.5 fails by chance in 7e-6 of cases.
constexpr double kLargestScore = 4.5;
double chi_square_score(double x, double dof) {
  return (std::cbrt(x / dof) - 1.0 + 2.0 / (9.0 * dof)) / std::sqrt(2.0 / (9.0 * dof));
}
double binomial_score(double count, double n, double p) { return (count - n * p) / std::sqrt(n * p * (1.0 - p)); }

// How far the projection of the whole line at an instant is from a pixel.
double off_line_px(const Recorded& r, const LineEnds& ends, std::size_t k) {
  const Segment& segment = r.segment(ends.segment);
  const core::Pose T_W_C = r.trajectory->pose_at(ends.t_imu_s[k]) * r.config.calibration().T_B_C;
  const Eigen::Vector3d a = T_W_C.inverse() * segment.ends_W[0];
  const Eigen::Vector3d b = T_W_C.inverse() * segment.ends_W[1];
  const Eigen::Vector3d n = a.cross(b).normalized();
  const auto& camera = r.config.camera.model;  // without a lens
  const Eigen::Vector3d l(n.x() / camera.fx_px, n.y() / camera.fy_px,
                          n.z() - n.x() * camera.cx_px / camera.fx_px - n.y() * camera.cy_px / camera.fy_px);
  return std::abs(l.dot(ends.ends_px[k].homogeneous())) / l.head<2>().norm();
}

// t_imu = t_cam + td + (v - rows/2) readout / rows, and the end is on the true line at that instant and at no other.
TEST(LineSensor, EachEndShowsTheLineAtItsOwnRowsTime) {
  for (const double slide_px : {0.0, 15.0}) {
    ScenarioConfig config = some_config();
    config.lines.slide_sigma_px = slide_px;
    const Recorded r(config);
    double flipped2 = 0.0;
    double one_time2 = 0.0;
    int n = 0;
    r.for_each_line([&](const core::Frame& frame, const core::LineObservation& line, const LineEnds& ends) {
      for (const std::size_t k : {std::size_t{0}, std::size_t{1}}) {
        EXPECT_EQ(line.ends_px[k], ends.ends_px[k]);  // no noise
        const double delay_s = (line.ends_px[k].y() / 480.0 - 0.5) * 0.03;
        EXPECT_NEAR(ends.t_imu_s[k], core::to_seconds(frame.t_cam_ns) + 0.02 + delay_s, 2e-12);
        EXPECT_LT(off_line_px(r, ends, k), 1e-9);
        LineEnds other = ends;
        other.t_imu_s[k] -= 0.04;  // td with the other sign
        flipped2 += std::pow(off_line_px(r, other, k), 2);
        other.t_imu_s[k] = ends.t_imu_s[1 - k];  // both ends at one time
        one_time2 += std::pow(off_line_px(r, other, k), 2);
        ++n;
      }
    });
    ASSERT_GT(n, 2000);
    EXPECT_GT(std::sqrt(flipped2 / n), 3.0);
    EXPECT_GT(std::sqrt(one_time2 / n), 0.3);
  }
}

TEST(LineSensor, FramesHoldAsManyAsAllowedAndEachTrackOnce) {
  const Recorded r(some_config());
  for (const core::Frame& frame : r.simulation.measurements.frames) {
    EXPECT_LE(frame.lines.size(), 40U);
    EXPECT_GE(frame.lines.size(), 20U);
    std::set<std::int64_t> tracks;
    std::set<int> segments;
    for (const core::LineObservation& line : frame.lines) {
      EXPECT_TRUE(tracks.insert(line.track_id).second);
      EXPECT_TRUE(segments.insert(r.followed(line.track_id)).second);
      EXPECT_GE((line.ends_px[1] - line.ends_px[0]).norm(), r.config.lines.shortest_px - 1e-9);
    }
  }
}

// The first frame of a track, its last, and how many have it.
struct Life {
  int first = 0;
  int last = 0;
  int frames = 0;
};

std::map<std::int64_t, Life> lives(const Recorded& r) {
  std::map<std::int64_t, Life> lives;
  for (int i = 0; i < std::ssize(r.simulation.measurements.frames); ++i) {
    for (const auto& line : r.simulation.measurements.frames[static_cast<std::size_t>(i)].lines) {
      Life& life = lives.try_emplace(line.track_id, Life{.first = i}).first->second;
      life.last = i;
      ++life.frames;
    }
  }
  return lives;
}

TEST(LineSensor, TracksAreUnbrokenBoundedAndHaveTheirTruth) {
  ScenarioConfig config = some_config();
  for (const int longest : {0, 6}) {
    config.lines.longest_track_frames = longest;
    const Recorded r(config);
    const auto all = lives(r);
    EXPECT_EQ(all.size(), r.simulation.truth.track_segment.size());
    int most = 0;
    for (const auto& [track, life] : all) {
      EXPECT_EQ(life.frames, life.last - life.first + 1) << track;
      most = std::max(most, life.frames);
    }
    EXPECT_EQ(most == 6, longest == 6) << most;
    r.for_each_line([&](const core::Frame&, const core::LineObservation& line, const LineEnds& ends) {
      EXPECT_EQ(r.followed(line.track_id), ends.segment);
    });
  }
}

TEST(LineSensor, TracksAreLostAtTheConfiguredRate) {
  ScenarioConfig config = some_config();
  config.lines.per_frame = 100000;
  config.lines.loss_probability = 0.1;
  const Recorded r(config);
  double kept = 0.0;
  double lost = 0.0;
  std::map<int, std::int64_t> before;  // by segment
  for (const core::Frame& frame : r.simulation.measurements.frames) {
    std::map<int, std::int64_t> now;
    for (const auto& line : frame.lines) {
      const int segment = r.followed(line.track_id);
      now[segment] = line.track_id;
      const auto last = before.find(segment);
      if (last != before.end()) (last->second == line.track_id ? kept : lost) += 1.0;
    }
    before = std::move(now);
  }
  ASSERT_GT(kept + lost, 2000.0);
  EXPECT_LT(std::abs(binomial_score(lost, kept + lost, 0.1)), kLargestScore);
}

TEST(LineSensor, NoiseIsWhiteNormalAndNotTruncated) {
  ScenarioConfig config = some_config();
  config.lines.sigma_px = 3.0;
  const Recorded r(config);
  std::vector<double> e;
  int outside = 0;
  double cross = 0.0;
  r.for_each_line([&](const core::Frame&, const core::LineObservation& line, const LineEnds& ends) {
    const Eigen::Vector2d a = (line.ends_px[0] - ends.ends_px[0]) / 3.0;
    const Eigen::Vector2d b = (line.ends_px[1] - ends.ends_px[1]) / 3.0;
    e.insert(e.end(), {a.x(), a.y(), b.x(), b.y()});
    cross += a.x() * b.x() + a.y() * b.y();
    for (const Eigen::Vector2d& end : line.ends_px) outside += config.camera.model.contains(end) ? 0 : 1;
  });
  const auto n = static_cast<double>(e.size());
  ASSERT_GT(n, 8000.0);
  double sum = 0.0;
  double sum2 = 0.0;
  for (const double x : e) {
    sum += x;
    sum2 += x * x;
  }
  EXPECT_LT(std::abs(sum) / std::sqrt(n), kLargestScore);
  EXPECT_LT(std::abs(chi_square_score(sum2, n)), kLargestScore);
  EXPECT_LT(std::abs(cross) / std::sqrt(0.5 * n), kLargestScore);  // of the two ends
  EXPECT_GT(outside, 100);                                         // ends at the border, half of them
}

// By frame and segment, whatever their tracks are called.
std::map<std::pair<core::TimeNs, int>, std::array<Eigen::Vector2d, 2>> by_segment(const Recorded& r) {
  std::map<std::pair<core::TimeNs, int>, std::array<Eigen::Vector2d, 2>> pixels;
  r.for_each_line([&](const core::Frame& frame, const core::LineObservation& line, const LineEnds& ends) {
    pixels[{frame.t_cam_ns, ends.segment}] = line.ends_px;
  });
  return pixels;
}

// A draw depends on frame and segment only: neither on the other tracks nor on the other defects.
TEST(LineSensor, DrawsDoNotDependOnTheTracks) {
  ScenarioConfig config = some_config();
  config.lines.sigma_px = 1.0;
  config.lines.slide_sigma_px = 5.0;
  const auto reference = by_segment(Recorded(config));
  const auto expect_same = [&](const ScenarioConfig& changed) {
    int common = 0;
    for (const auto& [key, ends] : by_segment(Recorded(changed))) {
      const auto same = reference.find(key);
      if (same == reference.end()) continue;
      EXPECT_EQ(same->second, ends);
      ++common;
    }
    EXPECT_GT(common, 500);
  };
  ScenarioConfig fewer = config;
  fewer.lines.per_frame = 15;
  expect_same(fewer);
  ScenarioConfig lossy = config;
  lossy.lines.loss_probability = 0.2;
  expect_same(lossy);
  ScenarioConfig confused = config;
  confused.lines.wrong_match_probability = 0.3;
  expect_same(confused);
}

// The bytes of points, IMU and prior do not change by lines, whatever is wrong with them.
TEST(LineSensor, LeavesPointsAndImuAlone) {
  ScenarioConfig config = some_config();
  config.imu.noise = {1e-3, 1e-4, 1e-2, 1e-3};
  config.camera.drop_probability = 0.1;
  const Simulation with = simulate(config, kId);
  config.lines.per_frame = 0;
  const Simulation without = simulate(config, kId);
  ASSERT_EQ(with.measurements.frames.size(), without.measurements.frames.size());
  bool any = false;
  for (std::size_t i = 0; i < with.measurements.frames.size(); ++i) {
    const core::Frame& a = with.measurements.frames[i];
    const core::Frame& b = without.measurements.frames[i];
    EXPECT_EQ(a.t_cam_ns, b.t_cam_ns);
    EXPECT_TRUE(std::ranges::equal(a.points, b.points, [](const auto& x, const auto& y) {
      return x.track_id == y.track_id && x.pixel == y.pixel && x.velocity == y.velocity;
    }));
    EXPECT_TRUE(b.lines.empty());
    any = any || !a.lines.empty();
  }
  EXPECT_TRUE(any);
  EXPECT_TRUE(std::ranges::equal(with.measurements.imu, without.measurements.imu, [](const auto& x, const auto& y) {
    return x.t_ns == y.t_ns && x.gyro_rad_s == y.gyro_rad_s && x.accel_m_s2 == y.accel_m_s2;
  }));
  EXPECT_EQ(with.measurements.prior.mean.T_W_B.p, without.measurements.prior.mean.T_W_B.p);
  EXPECT_EQ(with.truth.landmarks_W, without.truth.landmarks_W);
  EXPECT_EQ(without.measurements.line_sigma_px, 0.0);
}

// Lines go on being followed through frames that are lost.
TEST(LineSensor, DroppedFramesTakeNothingButThemselves) {
  ScenarioConfig config = some_config();
  config.lines.sigma_px = 1.0;
  const auto all = by_segment(Recorded(config));
  config.camera.drop_probability = 0.3;
  const Recorded dropped(config);
  const auto some = by_segment(dropped);
  EXPECT_LT(some.size(), 0.8 * static_cast<double>(all.size()));
  for (const auto& [key, ends] : some) EXPECT_EQ(all.at(key), ends);
  EXPECT_EQ(lives(dropped).size(), dropped.simulation.truth.track_segment.size());
}

// Ends move inwards, by the absolute value of a normal number, and stay on the line.
TEST(LineSensor, SlidEndsLieWithinWhatIsSeen) {
  ScenarioConfig config = some_config();
  config.camera.readout_s = 0.0;  // so that pictures of lines are straight and shares of them exact
  config.lines.shortest_px = 60.0;
  const auto whole = by_segment(Recorded(config));
  config.lines.slide_sigma_px = 3.0;
  const auto slid = by_segment(Recorded(config));
  double sum2 = 0.0;
  double n = 0.0;
  for (const auto& [key, ends] : slid) {
    const auto same = whole.find(key);
    if (same == whole.end()) continue;
    const Eigen::Vector2d along = (same->second[1] - same->second[0]).normalized();
    const double length_px = (same->second[1] - same->second[0]).norm();
    if (length_px < 100.0) continue;  // where 40 px, 9 sigma of the two, are to spare
    const Eigen::Vector2d first = ends[0] - same->second[0];
    const Eigen::Vector2d second = ends[1] - same->second[1];
    EXPECT_GE(first.dot(along), -1e-9);
    EXPECT_LE(second.dot(along), 1e-9);
    EXPECT_LT((first - along * first.dot(along)).norm(), 1e-7);
    EXPECT_LT((second - along * second.dot(along)).norm(), 1e-7);
    sum2 += (first.squaredNorm() + second.squaredNorm()) / 9.0;
    n += 2.0;
  }
  ASSERT_GT(n, 1000.0);
  EXPECT_LT(std::abs(chi_square_score(sum2, n)), kLargestScore);
}

TEST(LineSensor, SlidingLeavesTheShortestLength) {
  ScenarioConfig config = some_config();
  config.lines.slide_sigma_px = 200.0;
  const Recorded r(config);
  r.for_each_line([&](const core::Frame&, const core::LineObservation& line, const LineEnds&) {
    // The rows' different times bend the picture by some per cent of a pixel a pixel.
    EXPECT_GT((line.ends_px[1] - line.ends_px[0]).norm(), 0.9 * config.lines.shortest_px);
  });
}

// Parts of a segment are two tracks of it that meet at one place, and the longer one keeps the track.
TEST(LineSensor, FragmentsAreTwoTracksOfOneSegment) {
  ScenarioConfig config = some_config();
  config.lines.per_frame = 100000;
  config.lines.fragment_probability = 0.03;
  config.lines.shortest_px = 5.0;
  const Recorded r(config);
  int pairs = 0;
  int breaks = 0;
  double whole_before = 0.0;
  std::map<int, std::vector<std::int64_t>> before;
  for (const core::Frame& frame : r.simulation.measurements.frames) {
    std::map<int, std::vector<const core::LineObservation*>> now;
    for (const auto& line : frame.lines) now[r.followed(line.track_id)].push_back(&line);
    std::map<int, std::vector<std::int64_t>> tracks;
    for (const auto& [segment, lines] : now) {
      ASSERT_LE(lines.size(), 2U);
      for (const auto* line : lines) tracks[segment].push_back(line->track_id);
      if (lines.size() == 2) {
        ++pairs;
        // One ends where the other begins, at the same place and time.
        const double apart_px = std::min((lines[0]->ends_px[1] - lines[1]->ends_px[0]).norm(),
                                         (lines[1]->ends_px[1] - lines[0]->ends_px[0]).norm());
        EXPECT_LT(apart_px, 1e-9);
      }
      const auto last = before.find(segment);
      if (last == before.end() || last->second.size() != 1) continue;
      if (lines.size() == 1) {
        whole_before += 1.0;
        continue;
      }
      const bool first_is_old = lines[0]->track_id == last->second[0];
      EXPECT_TRUE(first_is_old || lines[1]->track_id == last->second[0]);
      ++breaks;
    }
    before = std::move(tracks);
  }
  EXPECT_GT(pairs, 300);
  EXPECT_GT(breaks, 30);
  // Segments of which one part is gone do not break again, so that the share is below the probability, not above.
  EXPECT_LT(binomial_score(breaks, breaks + whole_before, 0.03), kLargestScore);
}

// A part that begins when its segment breaks is the shorter one.
TEST(LineSensor, TheLongerPartKeepsTheTrack) {
  ScenarioConfig config = some_config();
  config.lines.fragment_probability = 0.05;
  config.lines.shortest_px = 5.0;
  config.lines.per_frame = 100000;
  config.camera.readout_s = 0.0;
  config.trajectory.type = TrajectoryType::kStatic;
  const Recorded r(config);
  std::map<int, std::int64_t> whole;
  int breaks = 0;
  for (const core::Frame& frame : r.simulation.measurements.frames) {
    std::map<int, std::vector<const core::LineObservation*>> now;
    for (const auto& line : frame.lines) now[r.followed(line.track_id)].push_back(&line);
    for (const auto& [segment, lines] : now) {
      if (lines.size() == 1) {
        whole[segment] = lines[0]->track_id;
        continue;
      }
      const auto old = whole.find(segment);
      if (old == whole.end()) continue;
      const auto length = [](const core::LineObservation& l) { return (l.ends_px[1] - l.ends_px[0]).norm(); };
      const bool first_is_old = lines[0]->track_id == old->second;
      EXPECT_GE(length(*lines[first_is_old ? 0 : 1]), length(*lines[first_is_old ? 1 : 0]) - 1e-9);
      whole.erase(old);
      ++breaks;
    }
  }
  EXPECT_GT(breaks, 20);
}

TEST(LineSensor, MergedPartsGoOnUnderTheOlderTrack) {
  ScenarioConfig config = some_config();
  config.trajectory.type = TrajectoryType::kStatic;
  config.lines.fragment_probability = 0.05;
  config.lines.merge_probability = 0.3;
  config.lines.per_frame = 100000;
  config.lines.shortest_px = 5.0;
  const Recorded r(config);
  std::map<int, std::vector<std::int64_t>> before;
  double merged = 0.0;
  double stayed = 0.0;
  for (const core::Frame& frame : r.simulation.measurements.frames) {
    std::map<int, std::vector<std::int64_t>> now;
    for (const auto& line : frame.lines) now[r.followed(line.track_id)].push_back(line.track_id);
    for (auto& [segment, tracks] : now) {
      std::ranges::sort(tracks);
      const auto last = before.find(segment);
      if (last == before.end() || last->second.size() != 2) continue;
      if (tracks.size() == 2) {
        EXPECT_EQ(tracks, last->second);
        stayed += 1.0;
      } else {
        EXPECT_EQ(tracks[0], last->second[0]);
        merged += 1.0;
      }
    }
    before = std::move(now);
  }
  ASSERT_GT(merged + stayed, 300.0);
  EXPECT_LT(std::abs(binomial_score(merged, merged + stayed, 0.3)), kLargestScore);
}

// Swapped in pairs, so that no track is twice in a frame; one of an odd number keeps its own.
TEST(LineSensor, MatchesAreWrongAtTheConfiguredRate) {
  ScenarioConfig config = some_config();
  config.lines.wrong_match_probability = 0.1;
  const Recorded r(config);
  double pairs = 0.0;
  for (const core::Frame& frame : r.simulation.measurements.frames) {
    pairs += static_cast<double>(frame.lines.size() / 2);
  }
  double wrong = 0.0;
  r.for_each_line([&](const core::Frame&, const core::LineObservation& line, const LineEnds& ends) {
    wrong += r.followed(line.track_id) != ends.segment ? 1.0 : 0.0;
    // What is observed is the segment that the truth names.
    for (const std::size_t k : {std::size_t{0}, std::size_t{1}}) EXPECT_LT(off_line_px(r, ends, k), 1e-9);
  });
  ASSERT_GT(pairs, 1000.0);
  EXPECT_LT(std::abs(binomial_score(0.5 * wrong, pairs, 0.1)), kLargestScore);
}

TEST(LineSensor, SameTrialSameNumbersAndOtherTrialsOtherNoise) {
  ScenarioConfig config = some_config();
  config.lines = {.per_frame = 40,
                  .sigma_px = 1.0,
                  .loss_probability = 0.02,
                  .slide_sigma_px = 4.0,
                  .fragment_probability = 0.02,
                  .merge_probability = 0.1,
                  .wrong_match_probability = 0.02};
  const auto a = by_segment(Recorded(config));
  EXPECT_EQ(by_segment(Recorded(config)), a);
  const Recorded other(config, {.seed = 1, .trial = 1});
  EXPECT_NE(by_segment(other), a);
}

}  // namespace
}  // namespace plumbline::sim
