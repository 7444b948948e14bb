#include "foreign_yaml.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>

#include <fmt/format.h>

#include "core/error.h"

namespace plumbline::tools::foreign {
namespace {

using core::ConfigTree;

// Lines stay where they are.
std::string plain_yaml(std::string_view text) {
  std::string plain;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string line(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.starts_with('%') || line.starts_with("---")) line.clear();
    if (const std::size_t tag = line.find("!!opencv-matrix"); tag != std::string::npos) line.erase(tag);
    plain += line + '\n';
  }
  return plain;
}

double parse_scalar(const ConfigTree& value, std::string_view key) {
  double x = 0.0;
  std::string_view text = value.scalar;
  if (text.starts_with('+')) text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), x);
  if (value.kind != ConfigTree::Kind::kScalar || error != std::errc() || end != text.data() + text.size() ||
      !std::isfinite(x)) {
    throw core::config_error(value.origin, key, "must be a number");
  }
  return x;
}

void append_numbers(const ConfigTree& value, std::string_view key, std::vector<double>& out) {
  if (value.kind == ConfigTree::Kind::kSequence) {
    for (const ConfigTree& item : value.items) append_numbers(item, key, out);
  } else {
    out.push_back(parse_scalar(value, key));
  }
}

}  // namespace

ConfigTree load(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (!stream || text.empty()) throw core::DataError(file.generic_string() + ": cannot be read");
  return core::parse_config(plain_yaml(text), file.generic_string());
}

const ConfigTree& at(const ConfigTree& tree, std::string_view key) {
  const ConfigTree* value = core::find_value(tree, key);
  if (value == nullptr) throw core::config_error(tree.origin, key, "is missing");
  return *value;
}

double number(const ConfigTree& tree, std::string_view key) { return parse_scalar(at(tree, key), key); }

std::optional<double> maybe_number(const ConfigTree& tree, std::string_view key) {
  const ConfigTree* value = core::find_value(tree, key);
  return value != nullptr ? std::optional(parse_scalar(*value, key)) : std::nullopt;
}

std::string word(const ConfigTree& tree, std::string_view key) { return at(tree, key).scalar; }

std::vector<double> numbers(const ConfigTree& tree, std::string_view key, std::size_t count) {
  const ConfigTree& value = at(tree, key);
  const ConfigTree* data = core::find_value(value, "data");
  std::vector<double> result;
  append_numbers(data != nullptr ? *data : value, key, result);
  if (result.size() != count) {
    throw core::config_error(value.origin, key, fmt::format("must hold {} numbers, not {}", count, result.size()));
  }
  return result;
}

Eigen::Quaterniond quaternion(const Eigen::Matrix3d& R, const ConfigTree& tree, std::string_view key) {
  constexpr double kMaxError = 1e-3;
  const double error = (R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (error > kMaxError || R.determinant() < 0.0) {
    throw core::config_error(
        at(tree, key).origin, key,
        fmt::format("is not a rotation: R R^T is off the identity by {:.3g}, its determinant {:.3g}", error,
                    R.determinant()));
  }
  Eigen::Quaternion<long double> q(R.cast<long double>());
  q.normalize();
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();
  return q.cast<double>();
}

Eigen::Matrix3d rotation(const ConfigTree& tree, std::string_view key) {
  const std::vector<double> data = numbers(tree, key, 9);
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(data.data());
}

core::Pose transform(const ConfigTree& tree, std::string_view key) {
  const std::vector<double> data = numbers(tree, key, 16);
  const Eigen::Matrix4d T = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(data.data());
  if (T.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) {
    throw core::config_error(at(tree, key).origin, key, "must end with the row 0, 0, 0, 1");
  }
  return {quaternion(T.topLeftCorner<3, 3>(), tree, key), T.topRightCorner<3, 1>()};
}

}  // namespace plumbline::tools::foreign
