// Covariances beside the poses of a TUM file: 21 further columns, the upper triangle row by row (P11 P12 ... P16 P22
// ... P66) of the covariance of a pose's error
//   e = [ p_est - p_true (m, world) | Log(R_true^T R_est) (rad, body) ],
// the perturbation of core/state.h.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace plumbline::core {

using PoseCovariance = Eigen::Matrix<double, 6, 6>;

// One a pose of read_tum, or empty where the first pose has eight columns or any number but 29. Throws DataError
// `file:line: rule` where a later pose has another number of columns than the first, or a value is no finite number.
std::vector<PoseCovariance> read_tum_covariances(const std::filesystem::path& path);
std::vector<PoseCovariance> parse_tum_covariances(std::string_view text, const std::string& name);

}  // namespace plumbline::core
