// Lens distortion, from the normalised plane (x, y) = (X/Z, Y/Z) of the ideal pinhole to that of the lens:
//   radtan       r2 = x^2 + y^2,  d = 1 + k1 r2 + k2 r2^2
//                x_d = d x + 2 p1 x y + p2 (r2 + 2 x^2)
//                y_d = d y + p1 (r2 + 2 y^2) + 2 p2 x y                coefficients k1, k2, p1, p2
//   equidistant  theta = atan(r),  theta_d = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8)
//                (x_d, y_d) = theta_d/r (x, y)                          coefficients k1, k2, k3, k4
// Sources: Brown, "Close-range camera calibration", 1971; Kannala and Brandt, PAMI 2006; the order of coefficients is
// that of OpenCV (calib3d and fisheye) and of Kalibr.
//
// A polynomial may fold: from some angle on, what lies further out is seen further in again. Only the part about the
// axis where the picture still moves outwards is real, and there the map is one-to-one; beyond it nothing is seen.
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <string_view>

#include <Eigen/Core>

namespace plumbline::core {

enum class DistortionModel { kNone, kRadtan, kEquidistant };
inline constexpr std::array<std::string_view, 3> kDistortionModelNames = {"none", "radtan", "equidistant"};

class Distortion {
 public:
  constexpr Distortion() = default;
  Distortion(DistortionModel model, const std::array<double, 4>& coefficients);

  DistortionModel model() const { return model_; }
  const std::array<double, 4>& coefficients() const { return k_; }

  // (x_d, y_d), and d(x_d, y_d)/d(x, y) in J; nothing at or beyond the fold.
  std::optional<Eigen::Vector2d> apply(const Eigen::Vector2d& xy, Eigen::Matrix2d* J = nullptr) const;

  // The inverse, to 1e-12 (next to the fold, where the inverse has no derivative, to what the rounding of (x_d, y_d)
  // leaves); nothing for what no (x, y) before the fold is mapped to.
  std::optional<Eigen::Vector2d> remove(const Eigen::Vector2d& xy_d) const;

 private:
  struct Radial {
    double value;
    double slope;
  };
  // Distorted radius over r (radtan, without its tangential part) or theta (equidistant).
  Radial radial(double x) const;
  std::optional<double> invert_radial(double distorted) const;
  std::optional<Eigen::Vector2d> remove_radtan(const Eigen::Vector2d& xy_d) const;

  DistortionModel model_ = DistortionModel::kNone;
  std::array<double, 4> k_{};
  double fold_ = std::numeric_limits<double>::infinity();  // the r or theta where the slope vanishes
};

}  // namespace plumbline::core
