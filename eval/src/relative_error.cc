#include "eval/relative_error.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/lie.h"
#include "eval/attitude_error.h"

namespace plumbline::eval {
namespace {

constexpr double kTolerance = 0.1;  // of delta
constexpr double kRounding = 1e-9;  // of delta: what the sum of a path may lack
constexpr std::array<char, 4> kUnits = {'f', 's', 'm', '%'};

Delta parse_delta(std::string_view text) {
  const auto fail = [text](std::string_view rule) -> core::DataError {
    return core::DataError(fmt::format("relative error over '{}': {}", text, rule));
  };
  const auto unit = text.empty() ? kUnits.end() : std::find(kUnits.begin(), kUnits.end(), text.back());
  if (unit == kUnits.end()) throw fail("must end in f (frames), s, m or %");
  const std::string_view number = text.substr(0, text.size() - 1);
  Delta delta{.value = 0.0, .unit = static_cast<DeltaUnit>(unit - kUnits.begin())};
  const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), delta.value);
  if (error != std::errc() || end != number.data() + number.size()) throw fail("is not a number with a unit");
  if (!(delta.value > 0.0) || !std::isfinite(delta.value)) throw fail("must be > 0");
  if (delta.unit == DeltaUnit::kFrames && (delta.value != std::floor(delta.value) || delta.value > 1e9)) {
    throw fail("frames are whole");
  }
  if (delta.unit == DeltaUnit::kPercentOfPath && delta.value > 100.0) throw fail("more than the whole path");
  return delta;
}

// What delta is measured along, at each pose; it never falls.
std::vector<double> measure(const std::vector<PosePair>& pairs, DeltaUnit unit) {
  std::vector<double> m(pairs.size(), 0.0);
  for (std::size_t k = 1; k < pairs.size(); ++k) {
    switch (unit) {
      case DeltaUnit::kFrames:
        m[k] = static_cast<double>(k);
        break;
      case DeltaUnit::kSeconds:
        m[k] = core::to_seconds(pairs[k].t_ns - pairs.front().t_ns);
        break;
      case DeltaUnit::kMetres:
      case DeltaUnit::kPercentOfPath:
        m[k] = m[k - 1] + (pairs[k].truth.p - pairs[k - 1].truth.p).norm();
        break;
    }
  }
  return m;
}

// The pose after i that is nearest to `delta` from it; m.size() where none is near enough, or all end before it.
std::size_t partner(const std::vector<double>& m, std::size_t i, double delta) {
  const double target = m[i] + delta;
  const double reached = target - kRounding * delta;
  const auto first = m.begin() + static_cast<std::ptrdiff_t>(i) + 1;
  auto j = std::lower_bound(first, m.end(), reached);
  if (j == m.end()) return m.size();
  if (j != first && target - *(j - 1) <= *j - target) --j;
  return std::abs(*j - target) <= kTolerance * delta ? static_cast<std::size_t>(j - m.begin()) : m.size();
}

}  // namespace

std::string to_string(const Delta& delta) {
  return fmt::format("{}{}", delta.value, kUnits[static_cast<std::size_t>(delta.unit)]);
}

std::vector<Delta> parse_deltas(std::string_view text) {
  std::vector<Delta> deltas;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    deltas.push_back(parse_delta(text.substr(begin, end - begin)));
    begin = end + 1;
  }
  return deltas;
}

RelativeErrors relative_errors(const std::vector<PosePair>& pairs, const Delta& delta, PairStarts starts) {
  const std::vector<double> m = measure(pairs, delta.unit);
  const bool percent = delta.unit == DeltaUnit::kPercentOfPath;
  const double length = percent && !m.empty() ? 0.01 * delta.value * m.back() : delta.value;
  RelativeErrors result;
  result.delta = delta;
  if (!(length > 0.0)) return result;  // per cent of no path

  std::vector<double> position_m;
  std::vector<double> rotation_deg;
  std::vector<double> yaw_deg;
  std::vector<double> gravity_deg;
  for (std::size_t i = 0; i < m.size();) {
    const std::size_t j = partner(m, i, length);
    if (j == m.size()) {
      ++i;
      continue;
    }
    const core::Pose true_motion = pairs[i].truth.inverse() * pairs[j].truth;
    const core::Pose motion = pairs[i].estimate.inverse() * pairs[j].estimate;
    const core::Pose E = true_motion.inverse() * motion;
    const Eigen::Quaterniond& q_W = pairs[j].truth.q;
    const AttitudeError attitude = attitude_error(q_W * E.q, q_W);
    position_m.push_back(E.p.norm());
    rotation_deg.push_back(core::log_so3(E.q).norm() * core::kDegreesPerRadian);
    yaw_deg.push_back(std::abs(attitude.yaw_rad) * core::kDegreesPerRadian);
    gravity_deg.push_back(attitude.gravity_rad * core::kDegreesPerRadian);
    i = starts == PairStarts::kConsecutive ? j : i + 1;
  }
  result.pairs = static_cast<int>(position_m.size());
  if (result.pairs == 0) return result;
  result.position_m = error_statistics(position_m);
  result.rotation_deg = error_statistics(rotation_deg);
  result.yaw_deg = error_statistics(yaw_deg);
  result.gravity_deg = error_statistics(gravity_deg);
  return result;
}

nlohmann::ordered_json to_json(const RelativeErrors& errors) {
  nlohmann::ordered_json json = {{"delta", to_string(errors.delta)}, {"pairs", errors.pairs}};
  if (errors.pairs > 0) {
    json["position_m"] = to_json(errors.position_m);
    json["rotation_deg"] = to_json(errors.rotation_deg);
    json["yaw_deg"] = to_json(errors.yaw_deg);
    json["gravity_deg"] = to_json(errors.gravity_deg);
  }
  return json;
}

}  // namespace plumbline::eval
