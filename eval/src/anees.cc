#include "eval/anees.h"

#include <algorithm>
#include <stdexcept>

namespace plumbline::eval {

Anees average_nees(const std::vector<std::vector<double>>& nees, int dof, double confidence) {
  if (nees.empty() || nees.front().empty()) throw std::invalid_argument("average_nees: nothing to average");
  Anees result;
  result.mean.assign(nees.front().size(), 0.0);
  const auto n = static_cast<double>(nees.size());
  for (const std::vector<double>& trial : nees) {
    if (trial.size() != result.mean.size()) throw std::invalid_argument("average_nees: trials of different length");
    for (std::size_t k = 0; k < trial.size(); ++k) result.mean[k] += trial[k] / n;
  }
  result.band = chi_square_mean_band(dof, static_cast<int>(nees.size()), confidence);
  const auto inside =
      std::count_if(result.mean.begin(), result.mean.end(), [&](double x) { return result.band.contains(x); });
  result.share_inside = static_cast<double>(inside) / static_cast<double>(result.mean.size());
  return result;
}

}  // namespace plumbline::eval
