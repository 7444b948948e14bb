#include "eval/line_error.h"

#include <cmath>

#include <gtest/gtest.h>

#include "eval/evaluate.h"
#include "eval/summary.h"

namespace plumbline::eval {
namespace {

core::LineEstimate through(const Eigen::Vector3d& P, const Eigen::Vector3d& direction, std::int64_t track = 0) {
  const Eigen::Vector3d d = direction.normalized();
  return {.track_id = track, .moment_W = P.cross(d), .direction_W = d};
}

const sim::Segment kSegment{{Eigen::Vector3d(1.0, 2.0, 3.0), Eigen::Vector3d(3.0, 2.0, 3.0)}};

TEST(LineError, ByHand) {
  // Parallel at a distance of 0.5 m, told in the opposite direction.
  const LineError parallel = line_error(through({7.0, 2.3, 3.4}, {-1.0, 0.0, 0.0}), kSegment);
  EXPECT_NEAR(parallel.angle_deg, 0.0, 1e-12);
  EXPECT_NEAR(parallel.distance_m, 0.5, 1e-12);
  // Through the first end at 30 degrees: the other end is 2 m sin 30 from it, and sqrt((0 + 1)/2) the rms.
  const double a = 30.0 / core::kDegreesPerRadian;
  const LineError turned = line_error(through({1.0, 2.0, 3.0}, {std::cos(a), 0.0, std::sin(a)}), kSegment);
  EXPECT_NEAR(turned.angle_deg, 30.0, 1e-10);
  EXPECT_NEAR(turned.distance_m, std::sqrt(0.5), 1e-12);
  // A microdegree is not lost.
  const double small = 1e-6 / core::kDegreesPerRadian;
  EXPECT_NEAR(line_error(through({1.0, 2.0, 3.0}, {1.0, small, 0.0}), kSegment).angle_deg, 1e-6, 1e-12);
}

struct Trial {
  core::EstimateLog estimate;
  sim::GroundTruth truth;
};

// An exact estimate of a circle, with lines: one exact, one 0.2 m off, one askew and
// 1 m off at its middle, one of an unknown track, and one not estimated.
Trial trial() {
  Trial t;
  t.truth.segments_W = {kSegment, kSegment, kSegment};
  t.truth.track_segment = {{4, 0}, {5, 1}, {7, 2}};
  for (int k = 0; k < 50; ++k) {
    const double a = 0.1 * k;
    core::StampedState s{.t_ns = core::to_ns(0.1 * k), .state = {}};
    s.state.T_W_B.p = {std::cos(a), std::sin(a), 0.1 * std::sin(3.0 * a)};
    t.truth.states.push_back(s);
  }
  t.estimate.status = core::SolveStatus::kConverged;
  t.estimate.states = t.truth.states;
  t.estimate.lines = {through({0.0, 2.0, 3.0}, {1.0, 0.0, 0.0}, 4), through({0.0, 2.2, 3.0}, {1.0, 0.0, 0.0}, 5),
                      through({0.0, 0.0, 9.0}, {0.0, 1.0, 0.0}, 6), through({2.0, 3.0, 3.0}, {1.0, 0.0, 1.0}, 7)};
  t.estimate.line_tracks = 5;
  return t;
}

const Metric* find(const std::vector<Metric>& metrics, std::string_view name) {
  const auto at = std::find_if(metrics.begin(), metrics.end(), [&](const Metric& m) { return m.name == name; });
  return at == metrics.end() ? nullptr : &*at;
}

TEST(LineErrors, AreMediansOverTheLinesWithATruth) {
  const Trial t = trial();
  const LineErrors e = line_errors(t.estimate, t.truth);
  EXPECT_EQ(e.lines, 3);
  EXPECT_NEAR(e.distance_m, 0.2, 1e-12);
  EXPECT_NEAR(e.angle_deg, 0.0, 1e-12);
  EXPECT_DOUBLE_EQ(e.share, 0.8);
}

TEST(LineErrors, AreMetricsWhereLinesWereUsed) {
  Trial t = trial();
  const TrialResult with = evaluate(t.estimate, t.truth, {});
  ASSERT_TRUE(with.ok) << with.reason;
  ASSERT_NE(find(with.metrics, kLineDistance), nullptr);
  EXPECT_NEAR(find(with.metrics, kLineDistance)->value, 0.2, 1e-12);
  EXPECT_DOUBLE_EQ(find(with.metrics, kLineShare)->value, 0.8);

  t.estimate.lines.clear();
  const TrialResult none = evaluate(t.estimate, t.truth, {});
  EXPECT_EQ(find(none.metrics, kLineAngle), nullptr);
  EXPECT_EQ(find(none.metrics, kLineShare)->value, 0.0);

  t.estimate.line_tracks = 0;
  const TrialResult without = evaluate(t.estimate, t.truth, {});
  EXPECT_EQ(find(without.metrics, kLineShare), nullptr);
  EXPECT_EQ(without.metrics.size() + 3, with.metrics.size());
}

// One trial without any line leaves none over all; the share tells of it.
TEST(LineErrors, AreSummarisedWhereEachTrialHasThem) {
  Trial t = trial();
  Row row;
  row.run_id = "a";
  std::vector<Row> rows = {with_result(row, evaluate(t.estimate, t.truth, {}))};
  t.estimate.lines.clear();
  rows.push_back(with_result(row, evaluate(t.estimate, t.truth, {})));
  const auto has = [](const CellSummary& cell, std::string_view name) {
    return std::any_of(cell.metrics.begin(), cell.metrics.end(),
                       [&](const MetricSummary& m) { return m.name == name; });
  };
  const CellSummary first = summarise({rows[0]}, {});
  EXPECT_TRUE(has(first, kLineAngle) && has(first, kLineDistance) && has(first, kLineShare));
  const CellSummary both = summarise(rows, {});
  EXPECT_FALSE(has(both, kLineAngle) || has(both, kLineDistance));
  EXPECT_TRUE(has(both, kLineShare));
}

// A robust loss: bounds are shown, nothing is claimed, and the summary says why.
TEST(Summary, ARobustLossWithholdsClaims) {
  Row row;
  row.ok = true;
  row.run_id = "a";
  row.metrics = {{"td_error_s", 1e-4, 1.2, 1, 1e-4}};
  row.solver.final_cost = 50.0;
  row.solver.cost_per_dof = 1.0;
  const CellSummary honest = summarise({row, row}, {});
  ASSERT_TRUE(honest.metrics[0].nees && honest.metrics[0].bound->efficiency && honest.nis);
  EXPECT_TRUE(honest.note.empty());
  const CellSummary robust = summarise({row, row}, {}, "the estimator has a robust loss");
  EXPECT_FALSE(robust.metrics[0].nees);
  EXPECT_FALSE(robust.nis);
  EXPECT_EQ(robust.metrics[0].bound->crlb, honest.metrics[0].bound->crlb);
  EXPECT_FALSE(robust.metrics[0].bound->efficiency);
  EXPECT_EQ(robust.note, "no NEES or efficiency is claimed: the estimator has a robust loss");
}

}  // namespace
}  // namespace plumbline::eval
