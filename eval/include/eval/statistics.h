// Figures over n independent trials, and intervals for them. `confidence` is the two-sided one, 0.95 for 95 %.
#pragma once

#include <optional>
#include <vector>

namespace plumbline::eval {

// Of every interval and band that is reported.
inline constexpr double kConfidence = 0.95;

struct Interval {
  double lo = 0.0;
  double hi = 0.0;

  bool contains(double x) const { return lo <= x && x <= hi; }
};

// Of values that are not empty (std::invalid_argument).
double mean(const std::vector<double>& values);
double root_mean_square(const std::vector<double>& values);
double median(const std::vector<double>& values);
// Empirical, linear between order statistics (type 7 of Hyndman & Fan, as numpy); p in [0, 1].
double quantile(std::vector<double> values, double p);
// sqrt(sum (x - mean)^2 / (n - 1)); nothing for n < 2.
std::optional<double> sample_std(const std::vector<double>& values);

// Where the mean of n independent chi-square variables of `dof` degrees of freedom lies:
//   [ chi2inv(a/2, n dof) / n,  chi2inv(1 - a/2, n dof) / n ],   a = 1 - confidence.
// The mean NEES of a consistent estimator is in it; Bar-Shalom, Li, Kirubarajan, 2001, section 5.4.
Interval chi_square_mean_band(int dof, int n, double confidence);

// For sigma, from the RMSE e of n errors that are N(0, sigma^2): n e^2 / sigma^2 ~ chi2_n. Exact; too wide where a
// bias makes up most of e.
Interval rmse_interval(double rmse, int n, double confidence);

// For the root of the mean square of quantities that are no signed Gaussian errors: a trial's ATE, the norm of a
// vector. A t-interval of the logarithm of the mean square m, with s^2 the sample variance of the squares:
//   sqrt(m) exp(-+ t_{n-1} s / (2 m sqrt(n)))
// Chosen by simulation of sums of 2 to 12 weighted squared Gaussians, 4,000 sets each; coverage of nominal 95 % at
// n = 5, 10, 20, 50:   this one              .91-.95  .90-.95  .92-.95  .94-.95
//                      t-interval of m       .84-.94  .86-.94  .90-.95  .93-.95   (about as wide, may reach below 0)
//                      percentile bootstrap  .74-.83  .83-.90  .89-.92  .92-.94
// With gross outliers (variance x9 in one trial of ten) none is trustworthy: .75-.86, .68-.84, .58-.85.
// Nothing for n < 2.
std::optional<Interval> rms_interval(const std::vector<double>& values, double confidence);

// For the mean, by Student's t; nothing for n < 2.
std::optional<Interval> mean_interval(const std::vector<double>& values, double confidence);

// For the p quantile of a continuous distribution, between two order statistics [x_(l), x_(u)], so at least
// `confidence` without any assumption: the number of values below the quantile is binomial(n, p). Nothing where n is
// too small for an end on either side.
std::optional<Interval> quantile_interval(std::vector<double> values, double p, double confidence);

// For the probability of a success, from `successes` of n >= 1: Clopper & Pearson 1934.
Interval binomial_interval(int successes, int n, double confidence);

}  // namespace plumbline::eval
