#include "core/camera.h"

#include <cmath>

#include <gtest/gtest.h>

#include "core/calibration.h"

namespace plumbline::core {
namespace {

constexpr PinholeCamera kCamera{
    .width_px = 640, .height_px = 480, .fx_px = 450.0, .fy_px = 470.0, .cx_px = 310.0, .cy_px = 250.0};

// NaN where there is no pixel, which compares false with everything.
Eigen::Vector2d pixel_of(const Eigen::Vector3d& P_C) {
  return kCamera.project(P_C).value_or(Eigen::Vector2d::Constant(std::nan("")));
}

TEST(Camera, ByHand) {
  EXPECT_EQ(pixel_of({0.0, 0.0, 2.0}), Eigen::Vector2d(310.0, 250.0));
  EXPECT_EQ(pixel_of({1.0, 0.0, 2.0}), Eigen::Vector2d(310.0 + 225.0, 250.0));  // x to the right
  EXPECT_EQ(pixel_of({0.0, 1.0, 2.0}), Eigen::Vector2d(310.0, 250.0 + 235.0));  // y down
}

TEST(Camera, UnprojectInvertsProject) {
  for (const double u : {-0.5, 17.0, 310.0, 639.4}) {
    for (const double v : {-0.5, 123.0, 479.4}) {
      const Eigen::Vector3d ray = kCamera.unproject({u, v});
      EXPECT_EQ(ray.z(), 1.0);
      for (const double depth : {1e-3, 1.0, 250.0}) {
        // Rounding of numbers up to 640.
        EXPECT_LT((pixel_of(depth * ray) - Eigen::Vector2d(u, v)).norm(), 1e-12);
      }
    }
  }
}

TEST(Camera, JacobianMatchesDifferences) {
  const Eigen::Vector3d P_C(0.7, -0.4, 1.9);
  Eigen::Matrix<double, 2, 3> J;
  ASSERT_TRUE(kCamera.project(P_C, &J).has_value());
  // Fourth order: h^4 f^(5)/30 = 1e-12 * 4 * 470/1.9^5, and rounding 1e-13/h: below 1e-9 together, of entries of 200.
  constexpr double kStep = 1e-3;
  for (int i = 0; i < 3; ++i) {
    const auto at = [&](double s) -> Eigen::Vector2d { return pixel_of(P_C + s * kStep * Eigen::Vector3d::Unit(i)); };
    const Eigen::Vector2d numeric = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * kStep);
    EXPECT_LT((J.col(i) - numeric).norm(), 1e-8) << i;
  }
  // The distance along the ray changes nothing.
  EXPECT_LT((J * P_C).norm(), 1e-12);
}

TEST(Camera, IntrinsicsJacobianMatchesDifferences) {
  const Eigen::Vector3d P_C(0.7, -0.4, 1.9);
  PinholeCamera lens = kCamera;
  lens.distortion = Distortion(DistortionModel::kRadtan, {-0.283, 0.074, 2e-4, 2e-5});
  for (const PinholeCamera& camera : {kCamera, lens}) {
    EXPECT_EQ(camera.with(camera.intrinsics()).project(P_C), camera.project(P_C));
    const Eigen::Matrix<double, 2, 4> J = camera.intrinsics_jacobian(*camera.project(P_C));
    for (int i = 0; i < 4; ++i) {
      const Intrinsics d = Intrinsics::Unit(i);
      const Eigen::Vector2d numeric = 0.5 * (*camera.with(camera.intrinsics() + d).project(P_C) -
                                             *camera.with(camera.intrinsics() - d).project(P_C));
      EXPECT_LT((J.col(i) - numeric).norm(), 1e-12) << i;  // a picture is linear in them
    }
  }
}

TEST(Camera, BehindOrBesideGivesNothing) {
  for (const Eigen::Vector3d& P_C :
       {Eigen::Vector3d(0.0, 0.0, -1.0), Eigen::Vector3d(0.1, 0.2, -2.0), Eigen::Vector3d(1.0, 0.0, 0.0),
        Eigen::Vector3d(0.0, 0.0, 0.0), Eigen::Vector3d(1.0, 1.0, 1e-7), Eigen::Vector3d(0.0, 0.0, std::nan("")),
        Eigen::Vector3d(std::nan(""), 0.0, 1.0)}) {
    EXPECT_FALSE(kCamera.project(P_C).has_value()) << P_C.transpose();
  }
  EXPECT_TRUE(kCamera.project({0.0, 0.0, 1e-9}).has_value());
}

// A power of two scales without rounding.
TEST(Camera, OnlyTheDirectionCounts) {
  const Eigen::Vector3d P_C(0.7, -0.4, 1.9);
  EXPECT_EQ(pixel_of(P_C), pixel_of(0x1p-40 * P_C));
  EXPECT_EQ(pixel_of(P_C), pixel_of(0x1p30 * P_C));
}

// The picture ends at the edges of its outer pixels; (0, 0) is the centre of the first.
TEST(Camera, EdgesOfThePicture) {
  EXPECT_TRUE(kCamera.contains({-0.5, -0.5}));
  EXPECT_TRUE(kCamera.contains({639.49, 479.49}));
  EXPECT_FALSE(kCamera.contains({-0.51, 100.0}));
  EXPECT_FALSE(kCamera.contains({100.0, -0.51}));
  EXPECT_FALSE(kCamera.contains({639.5, 100.0}));
  EXPECT_FALSE(kCamera.contains({100.0, 479.5}));
}

// td_middle = td_first + readout/2: the middle row is exposed half a readout after the first.
TEST(Camera, TimeOffsetOfTheMiddleRow) {
  EXPECT_EQ(td_middle_from(0.005, 0.03, RowReference::kFirst), 0.005 + 0.015);
  EXPECT_EQ(td_middle_from(0.005, 0.03, RowReference::kMiddle), 0.005);
  EXPECT_EQ(row_phase(240.0, 480), 0.0);
  EXPECT_EQ(row_phase(0.0, 480), -0.5);
  EXPECT_EQ(row_phase(480.0, 480), 0.5);
}

}  // namespace
}  // namespace plumbline::core
