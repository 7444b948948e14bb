// How far an initialisation from scratch is off, in what no choice of the world's origin and heading changes.
//   scale     sum_k (p_true,k - mean) . e_k / sum_k |p_true,k - mean|^2,   e the error of positions, aligned by posyaw
//   gravity   angle between R_est^T e_z and R_true^T e_z                    of the newest state, and so are
//   velocity  |R_est^T v_est - R_true^T v_true|,   gyro bias |b_est - b_true|
#pragma once

#include <vector>

#include "core/estimate.h"
#include "eval/metrics.h"
#include "sim/ground_truth.h"

namespace plumbline::eval {

// The metrics init_* of eval/metrics.h.
std::vector<Metric> initialisation_errors(const core::Initialisation& found, const sim::GroundTruth& truth);

}  // namespace plumbline::eval
