#include "eval/summary.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "eval/summary_table.h"

namespace plumbline::eval {
namespace {

Row row(double td_error_s, double nees, double ate_m) {
  Row r;
  r.run_id = "run";
  r.ok = true;
  r.status = "converged";
  r.metrics = {{"ate_position_m", ate_m}, {"td_error_s", td_error_s, nees, 1}, {"extrinsic", 0.1, 6.0, 6}};
  return r;
}

Row failed() {
  Row r;
  r.run_id = "failed";
  r.status = "diverged";
  return r;
}

const std::vector<Row> kRows = {row(3e-5, 0.5, 0.01), row(-1e-5, 0.1, 0.02), row(2e-5, 1.5, 0.03), row(0.0, 0.7, 0.02)};

TEST(Summary, FiguresByHand) {
  const CellSummary cell = summarise(kRows, {{"scenario.camera.td_s", 0.005}});
  EXPECT_EQ(cell.n, 4);
  EXPECT_EQ(cell.n_ok, 4);
  ASSERT_EQ(cell.metrics.size(), 3U);
  const MetricSummary& td = cell.metrics[1];
  EXPECT_EQ(td.name, "td_error_s");
  EXPECT_NEAR(td.mean, 1e-5, 1e-18);
  EXPECT_NEAR(td.rmse, std::sqrt(3.5) * 1e-5, 1e-18);
  EXPECT_NEAR(td.median, 1e-5, 1e-18);
  EXPECT_NEAR(td.std.value_or(-1.0), std::sqrt(10.0 / 3.0) * 1e-5, 1e-18);
  const NeesSummary nees = td.nees.value_or(NeesSummary{});
  EXPECT_NEAR(nees.mean, 0.7, 1e-15);
  EXPECT_EQ(nees.dof, 1);
  EXPECT_NEAR(nees.band95.hi, 11.1433 / 4.0, 1e-4);                                          // chi-square of 4
  EXPECT_NEAR(cell.metrics[2].nees.value_or(NeesSummary{}).band95.hi, 39.3641 / 4.0, 1e-4);  // of 24
}

TEST(Summary, SignedErrorsHaveExactIntervalsOthersDoNot) {
  const CellSummary cell = summarise(kRows, {});
  const Interval exact = rmse_interval(cell.metrics[1].rmse, 4, 0.95);
  EXPECT_EQ(cell.metrics[1].rmse_ci95.value_or(Interval{}).hi, exact.hi);
  EXPECT_EQ(cell.metrics[0].rmse_ci95.value_or(Interval{}).hi,
            rms_interval({0.01, 0.02, 0.03, 0.02}, 0.95).value_or(Interval{-1.0, -1.0}).hi);
}

TEST(Summary, AFailedTrialCountsAndTakesNeesAway) {
  std::vector<Row> rows = kRows;
  rows.insert(rows.begin() + 1, failed());
  const CellSummary cell = summarise(rows, {});
  EXPECT_EQ(cell.n, 5);
  EXPECT_EQ(cell.n_ok, 4);
  EXPECT_NEAR(cell.metrics[1].mean, 1e-5, 1e-18);
  for (const MetricSummary& m : cell.metrics) EXPECT_FALSE(m.nees.has_value());
  EXPECT_EQ(cell.note, "no NEES is claimed: 1 of 5 trials failed");
  const auto json = to_json(cell);
  EXPECT_EQ(json.at("note"), cell.note);
  EXPECT_FALSE(json.at("metrics").at("td_error_s").contains("nees_mean"));
}

TEST(Summary, NothingIsMadeUpForNoTrialOrOne) {
  const CellSummary none = summarise({failed(), failed()}, {});
  EXPECT_EQ(none.n, 2);
  EXPECT_EQ(none.n_ok, 0);
  EXPECT_TRUE(none.metrics.empty());
  EXPECT_EQ(to_json(none).at("metrics"), nlohmann::ordered_json::object());

  const auto one = to_json(summarise({kRows[0]}, {})).at("metrics").at("td_error_s");
  EXPECT_FALSE(one.contains("std"));
  EXPECT_FALSE(one.contains("rmse_ci95"));
  EXPECT_TRUE(one.contains("nees_band95"));
}

TEST(Summary, RowsOfDifferentCellsAreRefused) {
  std::vector<Row> rows = kRows;
  rows[2].metrics.pop_back();
  EXPECT_THROW(summarise(rows, {}), std::invalid_argument);
  rows = kRows;
  rows[2].metrics[1] = {"td_error_s", 0.0};
  EXPECT_THROW(summarise(rows, {}), std::invalid_argument);
}

TEST(Summary, JsonHasTheDocumentedKeys) {
  const auto json = to_json(summarise(kRows, {{"a.b", "x"}}));
  EXPECT_EQ(json.at("axes").at("a.b"), "x");
  EXPECT_EQ(json.at("n"), 4);
  const auto& td = json.at("metrics").at("td_error_s");
  for (const char* key : {"mean", "rmse", "median", "std", "nees_dof", "nees_mean"}) {
    EXPECT_TRUE(td.at(key).is_number()) << key;
  }
  EXPECT_EQ(td.at("rmse_ci95").size(), 2U);
  EXPECT_EQ(td.at("nees_band95").size(), 2U);
  EXPECT_FALSE(json.contains("note"));
  EXPECT_FALSE(json.at("metrics").at("ate_position_m").contains("nees_mean"));
}

TEST(SummaryTable, ReadsAsMeant) {
  std::vector<Row> partly = kRows;
  partly.push_back(failed());
  std::vector<Row> wrong = kRows;
  for (Row& r : wrong) r.metrics[1].nees = 70.0;
  const std::string table = summary_table(
      {summarise(kRows, {{"scenario.camera.td_s", 0.005}, {"estimator.timing", "propagated"}}),
       summarise(partly, {{"scenario.camera.td_s", 0.01}}), summarise({failed()}, {}), summarise(wrong, {})});
  EXPECT_EQ(table,
            R"(scenario.camera.td_s = 0.005, estimator.timing = propagated                                   4/4 ok
  metric                        mean      rmse [95 % interval]         median   NEES  (95 % band)
  ATE position [mm]            20.00     21.21 [11.80, 38.13]           20.00
  td error [us]                10.00     18.71 [11.21, 53.76]           10.00   0.70  (0.12, 2.79)
  extrinsic, joint                                                              6.00  (3.10, 9.84)

scenario.camera.td_s = 0.01                                                                   4/5 ok
  metric                        mean      rmse [95 % interval]         median   NEES  (95 % band)
  ATE position [mm]            20.00     21.21 [11.80, 38.13]           20.00
  td error [us]                10.00     18.71 [11.21, 53.76]           10.00
  no NEES is claimed: 1 of 5 trials failed

all trials                                                                                    0/1 ok
  no trial succeeded

all trials                                                                                    4/4 ok
  metric                        mean      rmse [95 % interval]         median   NEES  (95 % band)
  ATE position [mm]            20.00     21.21 [11.80, 38.13]           20.00
  td error [us]                10.00     18.71 [11.21, 53.76]           10.00  70.00! (0.12, 2.79)
  extrinsic, joint                                                              6.00  (3.10, 9.84)
)");
}

TEST(SummaryTable, FitsItsWidth) {
  nlohmann::ordered_json axes;
  for (const char* key : {"scenario.camera.readout_s", "scenario.imu.rate_hz", "scenario.points.velocity_source"}) {
    axes[key] = "a rather long value";
  }
  std::vector<Row> rows = {row(1.5, 1e3, 12345.678), row(-1e-9, 1e-9, 1e-12)};
  rows[0].metrics.push_back({"ate_rotation_deg", 179.99});
  rows[1].metrics.push_back({"ate_rotation_deg", 1e-7});
  std::istringstream lines(summary_table({summarise(rows, axes)}));
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100U) << line;
}

}  // namespace
}  // namespace plumbline::eval
