// Consistency over time: the NEES of the same instant averaged over independent trials (ANEES), with the band of
// eval/statistics.h. Instants of one trial depend on each other, so averages are over trials only, and the share of
// instants inside their 95 % bands is itself no test: it is 95 % in expectation, with a spread that the correlation
// decides. Bar-Shalom, Li, Kirubarajan, 2001, section 5.4.
#pragma once

#include <vector>

#include "eval/statistics.h"

namespace plumbline::eval {

struct Anees {
  std::vector<double> mean;  // one an instant, not divided by dof
  Interval band;             // the same for all instants
  double share_inside = 0.0;
};

// nees[trial][instant]. Throws std::invalid_argument where trials differ in length, or there is nothing to average.
Anees average_nees(const std::vector<std::vector<double>>& nees, int dof, double confidence);

}  // namespace plumbline::eval
