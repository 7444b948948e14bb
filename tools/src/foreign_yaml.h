// The YAML of Kalibr, of EuRoC and of OpenCV's FileStorage (VINS, OpenVINS), as a tree whose values know their lines:
// `%YAML:1.0`, `---` and `!!opencv-matrix` mean nothing here.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "core/config_tree.h"
#include "core/lie.h"

namespace plumbline::tools::foreign {

// Throws core::ConfigError or core::DataError.
core::ConfigTree load(const std::filesystem::path& file);

// The value under a dotted key; core::ConfigError `file:line: key: rule` where it is missing or of another kind.
const core::ConfigTree& at(const core::ConfigTree& tree, std::string_view key);
double number(const core::ConfigTree& tree, std::string_view key);
std::optional<double> maybe_number(const core::ConfigTree& tree, std::string_view key);
std::string word(const core::ConfigTree& tree, std::string_view key);

// A list, a list of lists, or an OpenCV or EuRoC matrix {rows, cols, data: [...]}, row by row.
std::vector<double> numbers(const core::ConfigTree& tree, std::string_view key, std::size_t count);
Eigen::Matrix3d rotation(const core::ConfigTree& tree, std::string_view key);  // 3 x 3
core::Pose transform(const core::ConfigTree& tree, std::string_view key);      // 4 x 4

// The unit quaternion of a rotation to 1e-3, w >= 0; ConfigError at the key's value where it is none.
Eigen::Quaterniond quaternion(const Eigen::Matrix3d& R, const core::ConfigTree& tree, std::string_view key);

}  // namespace plumbline::tools::foreign
