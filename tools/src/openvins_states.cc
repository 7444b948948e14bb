#include "openvins_states.h"

#include <charconv>
#include <cmath>
#include <fstream>
#include <functional>
#include <iterator>
#include <sstream>
#include <string>

#include <fmt/format.h>

#include "core/error.h"

namespace plumbline::tools {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kHeader = "# timestamp(s) q p v bg ba cam_imu_dt";
constexpr std::size_t kTdOfStates = 17;      // the column, from 0
constexpr std::size_t kTdOfDeviations = 16;  // one less: an orientation has three

using Fields = std::vector<std::string>;

double finite_number(const std::string& word, const std::string& where) {
  double x = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), x);
  if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(x)) {
    throw core::DataError(fmt::format("{}: '{}' is not a finite number", where, word));
  }
  return x;
}

// Of each line but comments, which has more than `last_column` of them.
void for_each_line(const fs::path& file, std::size_t last_column,
                   const std::function<void(const Fields&, const std::string& where)>& use) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream || fs::is_directory(file)) throw core::DataError(file.generic_string() + ": cannot be read");
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number) {
    std::istringstream words(line);
    const Fields fields{std::istream_iterator<std::string>(words), {}};
    if (fields.empty() || fields[0].starts_with('#')) continue;
    const std::string where = fmt::format("{}:{}", file.generic_string(), number);
    if (fields.size() <= last_column) {
      throw core::DataError(
          fmt::format("{}: has {} columns; td is in column {}", where, fields.size(), last_column + 1));
    }
    use(fields, where);
  }
}

}  // namespace

bool is_openvins_states(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::string line;
  return std::getline(stream, line) && line.starts_with(kHeader);
}

OpenvinsStates read_openvins_states(const fs::path& file) {
  OpenvinsStates states;
  for_each_line(file, kTdOfStates, [&](const Fields& f, const std::string& where) {
    const std::string tum = fmt::format("{} {} {} {} {} {} {} {}", f[0], f[5], f[6], f[7], f[1], f[2], f[3], f[4]);
    states.poses.push_back(core::parse_tum(tum, where, {.allow_unusable = true}).front());
    states.td.push_back({.t_ns = states.poses.back().t_ns, .td_s = finite_number(f[kTdOfStates], where)});
  });
  if (states.poses.empty()) throw core::DataError(file.generic_string() + ": no states");
  return states;
}

void add_openvins_deviations(const fs::path& file, OpenvinsStates& states) {
  for_each_line(file, kTdOfDeviations, [&](const Fields& f, const std::string& where) {
    const std::size_t row = states.covariances.size();
    const std::string tum = fmt::format("{} 0 0 0 0 0 0 1", f[0]);
    if (row == states.poses.size() || core::parse_tum(tum, where).front().t_ns != states.poses[row].t_ns) {
      throw core::DataError(where + ": is not of the same instant as the state's line");
    }
    core::PoseCovariance P = core::PoseCovariance::Zero();
    for (std::size_t i = 0; i < 6; ++i) {  // the position's come after the orientation's there
      P.diagonal()[static_cast<Eigen::Index>((i + 3) % 6)] = std::pow(finite_number(f[1 + i], where), 2);
    }
    states.covariances.push_back(P);
    states.td[row].sigma_s = finite_number(f[kTdOfDeviations], where);
  });
  if (states.covariances.size() != states.poses.size()) {
    throw core::DataError(fmt::format("{}: {} lines for {} states", file.generic_string(), states.covariances.size(),
                                      states.poses.size()));
  }
}

}  // namespace plumbline::tools
