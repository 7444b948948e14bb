#include "tools/ba_command.h"

#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/atomic_file.h"
#include "core/bal_file.h"
#include "core/error.h"
#include "core/lie.h"
#include "eval/alignment.h"
#include "tools/commands.h"

namespace plumbline::tools {
namespace {

using nlohmann::ordered_json;

// Root mean squares after the Sim3 alignment of camera centres and points together.
struct BundleErrors {
  double camera_position = 0.0;  // in the truth's unit of length
  double camera_rotation_deg = 0.0;
  double point = 0.0;
};

BundleErrors compare(const core::BalProblem& estimate, const core::BalProblem& truth, const std::string& truth_name) {
  if (estimate.cameras.size() != truth.cameras.size() || estimate.points.size() != truth.points.size()) {
    throw core::DataError(fmt::format("{}: {} cameras and {} points, but the problem has {} and {}", truth_name,
                                      truth.cameras.size(), truth.points.size(), estimate.cameras.size(),
                                      estimate.points.size()));
  }
  const auto places = [](const core::BalProblem& bal) {
    std::vector<Eigen::Vector3d> x;
    x.reserve(bal.cameras.size() + bal.points.size());
    for (const core::BalCamera& camera : bal.cameras) x.push_back(camera.centre());
    x.insert(x.end(), bal.points.begin(), bal.points.end());
    return x;
  };
  const std::vector<Eigen::Vector3d> estimated = places(estimate);
  const std::vector<Eigen::Vector3d> true_places = places(truth);
  const eval::AlignmentResult alignment = eval::align(estimated, true_places, eval::Alignment::kSim3);
  if (!alignment.ok) throw core::DataError(fmt::format("{}: {}", truth_name, alignment.reason));

  const std::size_t cameras = truth.cameras.size();
  double camera2 = 0.0;
  double rotation2 = 0.0;
  double point2 = 0.0;
  for (std::size_t i = 0; i < true_places.size(); ++i) {
    const double e2 = (alignment.truth_from_estimate * estimated[i] - true_places[i]).squaredNorm();
    (i < cameras ? camera2 : point2) += e2;
  }
  for (std::size_t i = 0; i < cameras; ++i) {
    // R_C_W of both, the estimate's world turned into the truth's.
    const Eigen::Matrix3d R_estimate =
        core::exp_so3(estimate.cameras[i].w) * alignment.truth_from_estimate.R.transpose();
    const Eigen::Matrix3d dR = R_estimate * core::exp_so3(truth.cameras[i].w).transpose();
    const double angle = core::rotation_angle(Eigen::Quaterniond(dR));
    rotation2 += angle * angle;
  }
  const auto rms = [](double sum, std::size_t n) { return std::sqrt(sum / static_cast<double>(n)); };
  return {rms(camera2, cameras), core::kDegreesPerRadian * rms(rotation2, cameras), rms(point2, truth.points.size())};
}

ordered_json to_json(const estimator::BundleResult& result) {
  const core::BalProblem& bal = result.problem;
  return {{"cameras", bal.cameras.size()},
          {"points", bal.points.size()},
          {"observations", bal.observations.size()},
          {"initial_cost", result.initial_cost},
          {"final_cost", result.final_cost},
          {"iterations", result.iterations},
          {"rmse_px", result.rmse_px},
          {"time_s", result.time_s}};
}

void print(const estimator::BundleResult& result) {
  const core::BalProblem& bal = result.problem;
  fmt::print("{} cameras, {} points, {} observations\n", bal.cameras.size(), bal.points.size(),
             bal.observations.size());
  fmt::print("cost {:.6e} -> {:.6e} in {} iterations, {:.3f} s ({})\n", result.initial_cost, result.final_cost,
             result.iterations, result.time_s, estimator::kBundleSolverNames[static_cast<std::size_t>(result.solver)]);
  fmt::print("reprojection RMSE {:.6f} px\n", result.rmse_px);
  if (result.behind > 0) fmt::print("{} observations of points behind their camera\n", result.behind);
  if (result.status != core::SolveStatus::kConverged) {
    fmt::print("{}: {}\n", core::kSolveStatusNames[static_cast<std::size_t>(result.status)], result.reason);
  }
}

}  // namespace

int ba(const BaOptions& options) {
  core::BalProblem problem = core::read_bal(options.problem);
  std::optional<core::BalProblem> truth;
  if (options.truth) truth = core::read_bal(*options.truth);
  const estimator::BundleResult result = estimator::adjust_bundle(std::move(problem), options.adjustment);
  std::optional<BundleErrors> errors;
  if (options.truth && truth) errors = compare(result.problem, *truth, options.truth->generic_string());
  if (options.out) core::write_bal(*options.out, result.problem);
  if (options.json) {
    ordered_json json = to_json(result);
    if (errors) {
      json["truth"] = {{"camera_position_rmse", errors->camera_position},
                       {"camera_rotation_rmse_deg", errors->camera_rotation_deg},
                       {"point_rmse", errors->point}};
    }
    fmt::print("{}\n", json.dump(2));
  } else {
    print(result);
    if (errors) {
      fmt::print("after Sim3 alignment with the truth, RMSE: cameras {:.6g} and {:.6g} deg, points {:.6g}\n",
                 errors->camera_position, errors->camera_rotation_deg, errors->point);
    }
  }
  return result.status == core::SolveStatus::kConverged ? kExitOk : kExitWorse;
}

int simulate_ba(const SimulateBaOptions& options) {
  core::require_no_file_above(options.out / "problem.txt");
  for (const char* name : {"problem.txt", "truth.txt"}) {
    if (std::filesystem::exists(options.out / name)) {
      throw core::DataError(fmt::format("{}: exists already", (options.out / name).generic_string()));
    }
  }
  const sim::BalSimulation simulation = sim::simulate_bal(options.world, {options.seed, 0});
  if (simulation.truth.points.empty()) throw core::DataError("no point is seen by two cameras");
  std::filesystem::create_directories(options.out);
  core::write_bal(options.out / "problem.txt", simulation.problem);
  core::write_bal(options.out / "truth.txt", simulation.truth);
  fmt::print("{} cameras, {} points, {} observations\nproblem: {}\n", simulation.truth.cameras.size(),
             simulation.truth.points.size(), simulation.truth.observations.size(), options.out.generic_string());
  return kExitOk;
}

}  // namespace plumbline::tools
