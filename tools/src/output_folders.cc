#include "output_folders.h"

#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/pose_file.h"
#include "core/resolved_config.h"
#include "sim/truth_files.h"
#include "tools/version.h"

namespace plumbline::tools {

using nlohmann::ordered_json;

void write_simulation(const std::filesystem::path& folder, const sim::Simulation& simulation,
                      const core::DatasetMeta& meta) {
  core::write_dataset(folder, simulation.measurements, meta);
  sim::write_truth(folder, simulation.truth);
}

void write_estimate(const std::filesystem::path& folder, const core::EstimateLog& estimate) {
  std::filesystem::create_directories(folder);
  std::vector<core::StampedPose> poses;
  poses.reserve(estimate.states.size());
  for (const core::StampedState& s : estimate.states) poses.push_back({s.t_ns, s.state.T_W_B});
  core::write_tum(folder / "estimate.tum", poses);
  const auto sigma = [&](int i) { return std::sqrt(estimate.covariance(i, i)); };
  ordered_json covariance = ordered_json::array();
  const bool intrinsics = estimate.calibration.intrinsics.has_value();
  const int dim = intrinsics ? core::kCovDim : core::kCovIntrinsics;
  for (int r = 0; r < dim; ++r) {
    for (int c = 0; c < dim; ++c) covariance.push_back(estimate.covariance(r, c));
  }
  ordered_json meta = {{"schema", "plumbline-estimate/1"},
                       {"version", version()},
                       {"status", core::kSolveStatusNames[static_cast<std::size_t>(estimate.status)]},
                       {"reason", estimate.reason},
                       {"stamp_clock", "imu"},
                       {"td_reference_row", "middle"},
                       {"calibration", core::resolved_config(estimate.calibration)},
                       {"td_sigma_s", sigma(core::kCovTd)},
                       {"readout_sigma_s", sigma(core::kCovReadout)},
                       {"iterations", estimate.summary.iterations},
                       {"final_cost", estimate.summary.final_cost},
                       {"cost_per_dof", estimate.summary.cost_per_dof()},
                       {"covariance_order", std::string("p_B_C, theta_B_C, td, readout, last state (p, theta, v, b_g, "
                                                        "b_a)") +
                                                (intrinsics ? ", fx, fy, cx, cy" : "")},
                       {"covariance", covariance}};
  core::write_file_atomically(folder / "meta.yaml", core::to_yaml(meta));
}

void refuse_existing(const std::filesystem::path& folder) {
  core::require_no_file_above(folder);
  const bool empty = std::filesystem::is_directory(folder) && std::filesystem::is_empty(folder);
  if (std::filesystem::exists(folder) && !empty) {
    throw core::DataError(fmt::format("{}: exists and is not an empty folder", folder.generic_string()));
  }
}

}  // namespace plumbline::tools
