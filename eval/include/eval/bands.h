// One quantity over time in many trials: how it is spread at each instant.
//   band   quantiles 0.05, 0.5, 0.95 (type 7), root of the mean square, and the mean, over the trials that have a value
// The instants are those of the first trial. A value of another trial goes to the nearest of them if it lies within
// half the distance to the next; trials of one cell nearly always have the same instants.
#pragma once

#include <vector>

namespace plumbline::eval {

struct Band {
  std::vector<double> t_s;  // those with at least one value
  std::vector<int> n;
  std::vector<double> q05;
  std::vector<double> median;
  std::vector<double> q95;
  std::vector<double> rms;
  std::vector<double> mean;
};

class BandOverTrials {
 public:
  // Sorted instants, and as many values (std::invalid_argument).
  void add(const std::vector<double>& t_s, const std::vector<double>& values);
  Band band() const;

 private:
  std::vector<double> t_s_;
  std::vector<std::vector<double>> values_;  // a list an instant
};

}  // namespace plumbline::eval
