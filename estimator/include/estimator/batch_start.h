// First values of a batch estimate: states from the ones before by the IMU, landmarks from the states.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <vector>

#include "core/time.h"
#include "estimator/batch_values.h"

namespace plumbline::estimator {

// No estimate where there is no starting point; what() is the reason.
class NoStart : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The IMU sample nearest to origin_ns + t_s.
std::size_t nearest_sample(const std::vector<core::ImuSample>& imu, double t_s, core::TimeNs origin_ns);

// Puts the states of the first `keyframes` keyframes at the samples nearest to t_cam + td, carried there by the IMU:
// those that exist from where they were, new ones from the one before. Between two states there must be motion, else
// NoStart.
void place_states(const BatchInput& input, std::size_t keyframes, double td_s, BatchValues& values);

// Gives a value to each point and line without one that two of the placed keyframes have seen. A line that cannot be
// triangulated yet, or that has been given up, stays without.
void triangulate_missing(const BatchInput& input, BatchValues& values);

// The tracks of lines that lie behind a camera which saw them: a solver that knows images only may leave them there.
std::vector<std::size_t> lines_behind(const BatchInput& input, const BatchValues& values);

}  // namespace plumbline::estimator
