#include "eval/summary.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "eval/bootstrap.h"
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

TEST(Summary, BiasQuantilesAndThreeSigmaCoverage) {
  const CellSummary cell = summarise(kRows, {});
  const MetricSummary& td = cell.metrics[1];
  EXPECT_NEAR(td.q05, -0.85e-5, 1e-18);  // numpy.quantile
  EXPECT_NEAR(td.q95, 2.85e-5, 1e-18);
  EXPECT_EQ(td.mean_ci95.value_or(Interval{}).hi,
            mean_interval({3e-5, -1e-5, 2e-5, 0.0}, 0.95).value_or(Interval{}).hi);
  EXPECT_FALSE(cell.metrics[0].mean_ci95.has_value());  // no signed error
  EXPECT_EQ(td.nees.value_or(NeesSummary{}).within_3_sigma, 1.0);
  EXPECT_NEAR(td.nees.value_or(NeesSummary{}).within_3_sigma_ci95.lo, std::pow(0.025, 0.25), 1e-9);

  std::vector<Row> rows = kRows;
  rows[0].metrics[1].nees = 8.99;   // |e| just within 3 sigma
  rows[1].metrics[1].nees = 9.01;   // just beyond
  rows[2].metrics[2].nees = 20.05;  // chi-square of 6 at 0.9973: 20.0621
  rows[3].metrics[2].nees = 20.07;
  const CellSummary beyond = summarise(rows, {});
  EXPECT_EQ(beyond.metrics[1].nees.value_or(NeesSummary{}).within_3_sigma, 0.75);
  EXPECT_EQ(beyond.metrics[2].nees.value_or(NeesSummary{}).within_3_sigma, 0.75);
}

// Trials in which td never settled count as later than all others, never as fast or as absent.
TEST(Summary, ConvergenceCountsThoseThatNeverDid) {
  std::vector<Row> rows(5, kRows[0]);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i].metrics.push_back({std::string(kTdConvergence), 1.0 + static_cast<double>(i)});
  }
  rows[0].metrics.back().censored = true;
  rows[1].metrics.back().censored = true;
  const ConvergenceSummary three = summarise(rows, {}).td_convergence.value_or(ConvergenceSummary{});
  EXPECT_EQ(three.n_converged, 3);
  EXPECT_EQ(three.median_s.value_or(0.0), 5.0);  // 3, 4, 5, never, never
  EXPECT_NEAR(three.share_ci95.lo, 0.1466, 1e-4);
  rows[2].metrics.back().censored = true;
  const CellSummary two = summarise(rows, {});
  EXPECT_FALSE(two.td_convergence.value_or(ConvergenceSummary{}).median_s.has_value());
  EXPECT_EQ(to_json(two).at("td_convergence").at("n_converged"), 2);
  EXPECT_FALSE(to_json(two).at("metrics").contains("td_convergence_s"));
}

TEST(Summary, ResidualsOfAllTrialsTogether) {
  std::vector<Row> rows = kRows;
  for (Row& r : rows) {
    r.solver = {.iterations = 1, .final_cost = 45.0, .cost_per_dof = 0.9, .observations = 1, .landmarks = 1};
  }
  const NisSummary nis = summarise(rows, {}).nis.value_or(NisSummary{});
  EXPECT_EQ(nis.dof, 400.0);
  EXPECT_NEAR(nis.mean, 0.9, 1e-12);
  EXPECT_NEAR(nis.band95.lo, 0.8662, 1e-3);  // chi-square of 400: 346.48 and 457.31
  EXPECT_NEAR(nis.band95.hi, 1.1433, 1e-3);
  rows.push_back(failed());
  EXPECT_FALSE(summarise(rows, {}).nis.has_value());
}

TEST(Summary, ManyTrialsHaveABootstrapInterval) {
  std::vector<Row> rows;
  std::vector<double> ate;
  for (int i = 0; i < 200; ++i) {
    ate.push_back(0.01 * (1.0 + 0.5 * std::sin(i * i)));
    rows.push_back(row(1e-5 * std::sin(i), 1.0, ate.back()));
  }
  const Interval interval = summarise(rows, {}).metrics[0].rmse_ci95.value_or(Interval{});
  EXPECT_EQ(interval.lo, bca_interval(ate, root_mean_square, 0.95).lo);
  rows.pop_back();
  ate.pop_back();
  EXPECT_EQ(summarise(rows, {}).metrics[0].rmse_ci95.value_or(Interval{}).lo,
            rms_interval(ate, 0.95).value_or(Interval{}).lo);
}

TEST(Summary, SignedErrorsHaveExactIntervalsOthersDoNot) {
  const CellSummary cell = summarise(kRows, {});
  const Interval exact = rmse_interval(cell.metrics[1].rmse, 4, 0.95);
  EXPECT_EQ(cell.metrics[1].rmse_ci95.value_or(Interval{}).hi, exact.hi);
  EXPECT_FALSE(cell.metrics[0].rmse_ci95.has_value());  // too few for the logarithm
  std::vector<Row> rows;
  std::vector<double> ate;
  for (int i = 0; i < 20; ++i) {
    ate.push_back(0.01 + 1e-4 * i);
    rows.push_back(row(1e-5, 1.0, ate.back()));
  }
  EXPECT_EQ(summarise(rows, {}).metrics[0].rmse_ci95.value_or(Interval{}).hi,
            rms_interval(ate, 0.95).value_or(Interval{-1.0, -1.0}).hi);
  rows.pop_back();
  EXPECT_FALSE(summarise(rows, {}).metrics[0].rmse_ci95.has_value());
}

// efficiency = sqrt(sum e^2 / sum b^2): errors of 30, -10, 20 and 0 us against bounds of 10, 10, 20 and 20 us.
TEST(Summary, EfficiencyIsClaimedWhereTheBoundIsTheBound) {
  std::vector<Row> rows = kRows;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i].metrics[1].crlb = i < 2 ? 1e-5 : 2e-5;
    rows[i].metrics.push_back({std::string(kKappa2), 0.049});
  }
  const CellSummary cell = summarise(rows, {});
  const MetricSummary& td = cell.metrics[1];
  ASSERT_TRUE(td.bound.has_value());
  EXPECT_NEAR(td.bound->crlb, std::sqrt(2.5) * 1e-5, 1e-18);
  EXPECT_NEAR(td.bound->efficiency.value_or(0.0), std::sqrt(14.0 / 10.0), 1e-12);
  const Interval interval = td.bound->efficiency_ci95.value_or(Interval{});
  EXPECT_NEAR(interval.hi, rmse_interval(td.rmse, 4, 0.95).hi / td.bound->crlb, 1e-12);
  EXPECT_FALSE(cell.metrics[0].bound.has_value());
  EXPECT_EQ(cell.note, "");
  EXPECT_TRUE(to_json(cell).at("metrics").at("td_error_s").contains("efficiency_ci95"));
  EXPECT_NE(summary_table({cell}).find("1.18"), std::string::npos);

  const auto expect_withheld = [](const CellSummary& c, const std::string& note) {
    ASSERT_TRUE(c.metrics[1].bound.has_value());
    EXPECT_FALSE(c.metrics[1].bound->efficiency.has_value());
    EXPECT_FALSE(c.metrics[1].bound->efficiency_ci95.has_value());
    EXPECT_NE(c.note.find(note), std::string::npos) << c.note;
  };
  std::vector<Row> partly = rows;
  partly.push_back(failed());
  expect_withheld(summarise(partly, {}), "1 of 5 trials failed");
  rows[2].metrics.back().value = 0.051;
  expect_withheld(summarise(rows, {}), "kappa2");
  rows[2].metrics[1].crlb.reset();  // one trial without
  EXPECT_FALSE(summarise(rows, {}).metrics[1].bound.has_value());
}

TEST(Summary, AFailedTrialCountsAndTakesNeesAway) {
  std::vector<Row> rows = kRows;
  rows.insert(rows.begin() + 1, failed());
  const CellSummary cell = summarise(rows, {});
  EXPECT_EQ(cell.n, 5);
  EXPECT_EQ(cell.n_ok, 4);
  EXPECT_NEAR(cell.metrics[1].mean, 1e-5, 1e-18);
  for (const MetricSummary& m : cell.metrics) EXPECT_FALSE(m.nees.has_value());
  EXPECT_EQ(cell.note, "no NEES or efficiency is claimed: 1 of 5 trials failed");
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
  ATE position [mm]            20.00     21.21                          20.00
  td error [us]                10.00     18.71 [11.21, 53.76]           10.00   0.70  (0.12, 2.79)
  extrinsic, joint                                                              6.00  (3.10, 9.84)

scenario.camera.td_s = 0.01                                                                   4/5 ok
  metric                        mean      rmse [95 % interval]         median   NEES  (95 % band)
  ATE position [mm]            20.00     21.21                          20.00
  td error [us]                10.00     18.71 [11.21, 53.76]           10.00
  no NEES or efficiency is claimed: 1 of 5 trials failed

all trials                                                                                    0/1 ok
  no trial succeeded

all trials                                                                                    4/4 ok
  metric                        mean      rmse [95 % interval]         median   NEES  (95 % band)
  ATE position [mm]            20.00     21.21                          20.00
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
