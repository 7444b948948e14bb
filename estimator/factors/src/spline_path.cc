#include "estimator/factors/spline_path.h"

#include "estimator/factors/parameter_blocks.h"

namespace plumbline::estimator {
namespace {

Eigen::Quaterniond rotation(const double* control) { return unpack_pose(control).q; }

core::RotationSpline::Steps steps(int order, double const* const* controls) {
  core::RotationSpline::Steps d;
  for (int j = 1; j < order; ++j) {
    d[static_cast<std::size_t>(j)] =
        core::log_so3(Eigen::Quaterniond(rotation(controls[j - 1]).conjugate() * rotation(controls[j])));
  }
  return d;
}

}  // namespace

SplinePath::SplinePath(const SplineKnots& knots, int segment, double const* const* controls)
    : interval_s_(knots.interval_s),
      order_(knots.order),
      segment_(segment),
      rotation_(knots.order, rotation(controls[0]), steps(knots.order, controls)) {
  for (std::size_t j = 0; j < static_cast<std::size_t>(order_); ++j) {
    positions_[j] = Eigen::Map<const Eigen::Vector3d>(controls[j]);
  }
}

bool SplinePath::at(double t_s, TimedBody& body) {
  const double u = t_s / interval_s_ - segment_;
  if (!(u >= -1.0 && u <= 2.0)) return false;
  weights_ = core::bspline::weights(order_, u, interval_s_);
  rotation_.to(weights_);
  body.R = rotation_.q().toRotationMatrix();
  body.omega = rotation_.omega();
  const auto sum = [&](std::size_t derivative) {
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    for (std::size_t j = 0; j < static_cast<std::size_t>(order_); ++j) {
      p += weights_.plain[derivative][static_cast<int>(j)] * positions_[j];
    }
    return p;
  };
  body.p = sum(0);
  body.velocity = sum(1);
  acceleration_ = sum(2);
  return true;
}

}  // namespace plumbline::estimator
