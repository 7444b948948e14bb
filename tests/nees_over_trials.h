// The NEES of every block over trials, with the covariance as it is and four times too large and too small; and the
// squared residuals of all trials together.
#pragma once

#include <initializer_list>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "eval/evaluate.h"
#include "eval/statistics.h"

namespace plumbline::testing {

class NeesOverTrials {
 public:
  void add(core::EstimateLog estimate, const sim::GroundTruth& truth) {
    const core::PosteriorCovariance honest = estimate.covariance;
    for (const double scale : {1.0, 4.0, 0.25}) {
      estimate.covariance = scale * honest;
      const eval::TrialResult result = eval::evaluate(estimate, truth, {});
      ASSERT_TRUE(result.ok) << "trial " << trials_ << ": " << result.reason;
      for (const eval::Metric& m : result.metrics) {
        if (!m.nees) continue;
        Nees& nees = nees_[scale][m.name];
        nees.values.push_back(*m.nees);
        nees.dof = m.nees_dof;
      }
    }
    squares_ += 2.0 * estimate.summary.final_cost;
    dof_ += estimate.summary.residuals - estimate.summary.parameters;
    ++trials_;
  }

  void expect_inside_bands(int joint_dof = core::kCovIntrinsics) const {
    EXPECT_EQ(nees_.at(1.0).at("joint").dof, joint_dof);
    for (const auto& [name, nees] : nees_.at(1.0)) {
      const eval::Interval band = band_of(name);
      const double mean = eval::mean(nees.values);
      EXPECT_TRUE(band.contains(mean)) << name << ": " << mean << " not in [" << band.lo << ", " << band.hi << "]";
    }
  }

  void expect_scaled_outside(std::initializer_list<const char*> blocks) const {
    for (const char* name : blocks) {
      const eval::Interval band = band_of(name);
      EXPECT_LT(eval::mean(nees_.at(4.0).at(name).values), band.lo) << name;
      EXPECT_GT(eval::mean(nees_.at(0.25).at(name).values), band.hi) << name;
    }
  }

  // A chi-square variable of residuals - parameters.
  void expect_residuals_as_large_as_their_noise() const {
    EXPECT_TRUE(eval::chi_square_mean_band(dof_, 1, 0.999).contains(squares_)) << squares_ / dof_;
  }

 private:
  struct Nees {
    std::vector<double> values;
    int dof = 0;
  };

  eval::Interval band_of(const std::string& name) const {
    return eval::chi_square_mean_band(nees_.at(1.0).at(name).dof, trials_, 0.999);
  }

  std::map<double, std::map<std::string, Nees>> nees_;  // by the covariance's scale and the block
  double squares_ = 0.0;
  int dof_ = 0;
  int trials_ = 0;
};

}  // namespace plumbline::testing
