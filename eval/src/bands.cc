#include "eval/bands.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "eval/statistics.h"

namespace plumbline::eval {
namespace {

// The nearest of the sorted instants, where it is nearer than half of the step on that side.
std::optional<std::size_t> nearest_instant(const std::vector<double>& instants, double t_s) {
  const auto after = std::lower_bound(instants.begin(), instants.end(), t_s);
  if (after != instants.end() && *after == t_s) return static_cast<std::size_t>(after - instants.begin());
  if (after == instants.begin() || after == instants.end()) {
    const std::size_t end = after == instants.begin() ? 0 : instants.size() - 1;
    const std::size_t neighbour = end == 0 ? std::min<std::size_t>(1, instants.size() - 1) : end - 1;
    const double step = std::abs(instants[neighbour] - instants[end]);
    return std::abs(t_s - instants[end]) < 0.5 * step ? std::optional(end) : std::nullopt;
  }
  const auto before = after - 1;
  return static_cast<std::size_t>((*after - t_s < t_s - *before ? after : before) - instants.begin());
}

}  // namespace

void BandOverTrials::add(const std::vector<double>& t_s, const std::vector<double>& values) {
  if (t_s.size() != values.size()) throw std::invalid_argument("BandOverTrials: as many values as instants");
  if (values_.empty()) {
    t_s_ = t_s;
    values_.resize(t_s.size());
  }
  for (std::size_t i = 0; i < t_s.size(); ++i) {
    if (const auto at = nearest_instant(t_s_, t_s[i])) values_[*at].push_back(values[i]);
  }
}

Band BandOverTrials::band() const {
  Band band;
  for (std::size_t i = 0; i < t_s_.size(); ++i) {
    const std::vector<double>& values = values_[i];
    if (values.empty()) continue;
    band.t_s.push_back(t_s_[i]);
    band.n.push_back(static_cast<int>(values.size()));
    band.q05.push_back(quantile(values, 0.05));
    band.median.push_back(median(values));
    band.q95.push_back(quantile(values, 0.95));
    band.rms.push_back(root_mean_square(values));
    band.mean.push_back(eval::mean(values));
  }
  return band;
}

}  // namespace plumbline::eval
