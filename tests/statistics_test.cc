#include "eval/statistics.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "core/random.h"
#include "eval/anees.h"
#include "eval/nees.h"

namespace plumbline::eval {
namespace {

// Standard normal numbers, one after the other.
class Gaussian {
 public:
  explicit Gaussian(std::uint64_t seed) : stream_({seed, 0}, "statistics_test") {}
  double operator()() { return stream_.normal(drawn_++); }

 private:
  core::RandomStream stream_;
  std::uint64_t drawn_ = 0;
};

TEST(Statistics, ByHand) {
  const std::vector<double> values = {3.0, -1.0, 2.0, 0.0};
  EXPECT_DOUBLE_EQ(mean(values), 1.0);
  EXPECT_DOUBLE_EQ(root_mean_square(values), std::sqrt(3.5));
  EXPECT_DOUBLE_EQ(median(values), 1.0);
  EXPECT_DOUBLE_EQ(median({5.0, 1.0, 2.0}), 2.0);
  EXPECT_DOUBLE_EQ(quantile(values, 0.25), -0.25);  // numpy.quantile
  EXPECT_DOUBLE_EQ(quantile(values, 1.0), 3.0);
  EXPECT_DOUBLE_EQ(quantile(values, 0.0), -1.0);
  EXPECT_DOUBLE_EQ(sample_std(values).value_or(-1.0), std::sqrt(10.0 / 3.0));
  EXPECT_FALSE(sample_std({1.0}).has_value());
  EXPECT_THROW(mean({}), std::invalid_argument);
  EXPECT_THROW(median({}), std::invalid_argument);
  EXPECT_THROW(quantile(values, 1.5), std::invalid_argument);
}

// Percentage points from printed tables.
TEST(Statistics, IntervalsMatchTables) {
  const Interval one = chi_square_mean_band(1, 100, 0.95);
  EXPECT_NEAR(one.lo, 0.742219, 1e-6);
  EXPECT_NEAR(one.hi, 1.295612, 1e-6);
  const Interval six = chi_square_mean_band(6, 5, 0.95);  // chi-square of 30: 16.791, 46.979
  EXPECT_NEAR(six.lo, 16.791 / 5, 1e-4);
  EXPECT_NEAR(six.hi, 46.979 / 5, 1e-4);

  const Interval sigma = rmse_interval(2.0, 10, 0.95);  // chi-square of 10: 3.247, 20.483
  EXPECT_NEAR(sigma.lo, 2.0 * std::sqrt(10.0 / 20.483), 1e-4);
  EXPECT_NEAR(sigma.hi, 2.0 * std::sqrt(10.0 / 3.247), 1e-4);

  const Interval t = mean_interval({1.0, 2.0, 3.0, 4.0, 5.0}, 0.95).value_or(Interval{});  // t of 4: 2.7764
  EXPECT_NEAR(t.hi - 3.0, 2.7764 * std::sqrt(2.5 / 5.0), 1e-4);
  EXPECT_NEAR(3.0 - t.lo, t.hi - 3.0, 1e-12);

  EXPECT_NEAR(binomial_interval(5, 10, 0.95).lo, 0.1871, 1e-4);
  EXPECT_NEAR(binomial_interval(5, 10, 0.95).hi, 0.8129, 1e-4);
  EXPECT_EQ(binomial_interval(0, 10, 0.95).lo, 0.0);
  EXPECT_NEAR(binomial_interval(0, 10, 0.95).hi, 1.0 - std::pow(0.025, 0.1), 1e-9);
  EXPECT_NEAR(binomial_interval(10, 10, 0.95).lo, std::pow(0.025, 0.1), 1e-9);
  EXPECT_EQ(binomial_interval(10, 10, 0.95).hi, 1.0);
}

TEST(Statistics, RmsIntervalByHand) {
  // Squares 1, 4, 9: mean 14/3, sample variance 49/3; t of 2: 4.30265.
  const Interval i = rms_interval({1.0, -2.0, 3.0}, 0.95).value_or(Interval{});
  const double factor = std::exp(4.30265 * std::sqrt(49.0 / 3.0 / 3.0) / (2.0 * 14.0 / 3.0));
  EXPECT_NEAR(i.lo, std::sqrt(14.0 / 3.0) / factor, 1e-4);
  EXPECT_NEAR(i.hi, std::sqrt(14.0 / 3.0) * factor, 1e-4);
  EXPECT_FALSE(rms_interval({1.0}, 0.95).has_value());
  EXPECT_EQ(rms_interval({0.0, 0.0}, 0.95).value_or(Interval{1.0, 1.0}).hi, 0.0);
}

TEST(Statistics, RefusesWhatHasNoMeaning) {
  EXPECT_THROW(chi_square_mean_band(0, 10, 0.95), std::invalid_argument);
  EXPECT_THROW(chi_square_mean_band(1, 0, 0.95), std::invalid_argument);
  EXPECT_THROW(rmse_interval(1.0, 10, 95.0), std::invalid_argument);
  EXPECT_THROW(binomial_interval(11, 10, 0.95), std::invalid_argument);
  EXPECT_THROW(mean_interval({1.0, 2.0}, 1.0), std::invalid_argument);
}

// ATE-like values: the root of a weighted sum of squared Gaussians. 2,000 sets of 10; the seed is fixed and the range
// is the stated .90-.95 with 3 sigma of the binomial about it.
TEST(Statistics, RmsIntervalCoversAsStated) {
  constexpr std::array kWeights = {1.0, 0.5, 0.25, 0.12, 0.06, 0.03};
  constexpr int kSets = 2000;
  double truth = 0.0;
  for (const double w : kWeights) truth += w;
  Gaussian gaussian(7);
  int covered = 0;
  for (int set = 0; set < kSets; ++set) {
    std::vector<double> values;
    for (int k = 0; k < 10; ++k) {
      double square = 0.0;
      for (const double w : kWeights) square += w * std::pow(gaussian(), 2);
      values.push_back(std::sqrt(square));
    }
    covered += rms_interval(values, 0.95).value_or(Interval{}).contains(std::sqrt(truth)) ? 1 : 0;
  }
  EXPECT_GT(covered, 0.88 * kSets);
  EXPECT_LT(covered, 0.97 * kSets);
}

TEST(Nees, ByHand) {
  EXPECT_NEAR(nees(Eigen::Vector2d(3.0, 4.0), Eigen::Vector2d(9.0, 4.0).asDiagonal().toDenseMatrix()).value_or(-1.0),
              5.0, 1e-14);
  // P = [2 1; 1 2], P^-1 = [2 -1; -1 2] / 3
  const Eigen::Matrix2d P{{2.0, 1.0}, {1.0, 2.0}};
  EXPECT_NEAR(nees(Eigen::Vector2d(1.0, -1.0), P).value_or(-1.0), 2.0, 1e-14);
  EXPECT_NEAR(nees(Eigen::Vector2d(1.0, 1.0), P).value_or(-1.0), 2.0 / 3.0, 1e-14);
}

TEST(Nees, UnitsDoNotMatter) {
  const Eigen::Matrix2d P{{2.0, 1.0}, {1.0, 2.0}};
  const Eigen::Vector2d units(1e-9, 1e6);
  EXPECT_NEAR(
      nees(units.cwiseProduct(Eigen::Vector2d(1.0, -1.0)), units.asDiagonal() * P * units.asDiagonal()).value_or(-1.0),
      2.0, 1e-12);
}

TEST(Nees, RefusesWhatIsNoCovariance) {
  const Eigen::Vector2d e(1.0, 1.0);
  for (const Eigen::Matrix2d& P : {Eigen::Matrix2d{{1.0, 1.0}, {1.0, 1.0}}, Eigen::Matrix2d{{1.0, 2.0}, {2.0, 1.0}},
                                   Eigen::Matrix2d{{1.0, 0.0}, {0.0, 0.0}}, Eigen::Matrix2d{{1.0, 0.0}, {0.0, -1.0}},
                                   Eigen::Matrix2d{{1.0, 0.5}, {0.1, 1.0}}, Eigen::Matrix2d{{NAN, 0.0}, {0.0, 1.0}}}) {
    EXPECT_FALSE(nees(e, P).has_value()) << P;
  }
}

// Least squares of a linear Gaussian problem with a prior: y = H x + n, posterior covariance (P0^-1 + H^T H)^-1.
class LinearGaussian : public testing::Test {
 protected:
  static constexpr int kTrials = 200;

  double mean_nees(double covariance_scale) {
    Gaussian gaussian(42);
    Eigen::Matrix<double, 5, 3> H;
    for (double& h : H.reshaped()) h = gaussian();
    const Eigen::Vector3d prior_sigma(0.5, 1.0, 2.0);
    const Eigen::Matrix3d prior_information = prior_sigma.cwiseAbs2().cwiseInverse().asDiagonal();
    const Eigen::Matrix3d P = (prior_information + H.transpose() * H).inverse();
    std::vector<double> values;
    for (int trial = 0; trial < kTrials; ++trial) {
      const Eigen::Vector3d truth(1.0, -2.0, 3.0);
      Eigen::Vector3d prior = truth;
      for (int i = 0; i < 3; ++i) prior(i) += prior_sigma(i) * gaussian();
      Eigen::Matrix<double, 5, 1> y = H * truth;
      for (double& v : y) v += gaussian();
      const Eigen::Vector3d estimate = P * (prior_information * prior + H.transpose() * y);
      values.push_back(nees(estimate - truth, covariance_scale * P).value_or(-1.0));
    }
    return mean(values);
  }
};

TEST_F(LinearGaussian, HonestCovarianceIsInItsBand) {
  EXPECT_TRUE(chi_square_mean_band(3, kTrials, 0.999).contains(mean_nees(1.0)));
}

TEST_F(LinearGaussian, WrongCovarianceOrDimensionIsOutside) {
  const Interval band = chi_square_mean_band(3, kTrials, 0.999);
  EXPECT_LT(mean_nees(4.0), band.lo);
  EXPECT_GT(mean_nees(0.25), band.hi);
  EXPECT_FALSE(chi_square_mean_band(2, kTrials, 0.999).contains(mean_nees(1.0)));
  EXPECT_FALSE(chi_square_mean_band(4, kTrials, 0.999).contains(mean_nees(1.0)));
}

// A Kalman filter of a scalar random walk, q = 0.1 and r = 1, over 100 trials of 50 instants.
Anees filter_anees(double covariance_scale) {
  Gaussian gaussian(5);
  std::vector<std::vector<double>> nees(100);
  for (auto& trial : nees) {
    double P = 1.0;
    double x = 0.0;
    double estimate = x + gaussian();
    for (int k = 0; k < 50; ++k) {
      x += std::sqrt(0.1) * gaussian();
      P += 0.1;
      const double gain = P / (P + 1.0);
      estimate += gain * (x + gaussian() - estimate);
      P *= 1.0 - gain;
      trial.push_back((estimate - x) * (estimate - x) / (covariance_scale * P));
    }
  }
  return average_nees(nees, 1, 0.999);
}

// The band is that of one instant; of 50 all are inside but with probability 5 %, and the seed is fixed.
TEST(Anees, SeesAWrongCovarianceAtEveryInstant) {
  EXPECT_EQ(filter_anees(1.0).share_inside, 1.0);
  EXPECT_EQ(filter_anees(4.0).share_inside, 0.0);
  EXPECT_EQ(filter_anees(0.25).share_inside, 0.0);
  EXPECT_NEAR(mean(filter_anees(1.0).mean), 1.0, 0.1);
  EXPECT_THROW(average_nees({}, 1, 0.95), std::invalid_argument);
  EXPECT_THROW(average_nees({{1.0}, {1.0, 2.0}}, 1, 0.95), std::invalid_argument);
}

}  // namespace
}  // namespace plumbline::eval
