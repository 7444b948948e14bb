#include "core/distortion.h"

#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include <Eigen/LU>
#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>

#include "core/camera.h"

namespace plumbline::core {
namespace {

// EuRoC's cam0, a fisheye of TUM-VI, and lenses that fold: at r = 0.816 but for the tangential part, at theta = 1.17.
const Distortion kEuroc(DistortionModel::kRadtan, {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05});
const Distortion kTumVi(DistortionModel::kEquidistant,
                        {0.0034823894022493434, 0.0007150348452162257, -0.0020532361418706202, 0.00020293673591811182});
const Distortion kBarrel(DistortionModel::kRadtan, {-0.5, 0.0, 0.01, -0.02});
const Distortion kFoldedFisheye(DistortionModel::kEquidistant, {-0.2, -0.02, 0.0, 0.0});

const std::vector<const Distortion*>& lenses() {
  static const std::vector<const Distortion*> all = {&kEuroc, &kTumVi, &kBarrel, &kFoldedFisheye};
  return all;
}

// A grid out to r = 1.5 in steps that miss nothing of interest.
std::vector<Eigen::Vector2d> grid() {
  std::vector<Eigen::Vector2d> points;
  for (int i = -30; i <= 30; ++i) {
    for (int j = -30; j <= 30; ++j) points.emplace_back(0.05 * i, 0.05 * j);
  }
  return points;
}

PinholeCamera camera_with(const Distortion& lens) {
  return {.width_px = 752,
          .height_px = 480,
          .fx_px = 458.654,
          .fy_px = 457.296,
          .cx_px = 367.215,
          .cy_px = 248.375,
          .distortion = lens};
}

// What OpenCV makes of the same camera, and d(u, v)/dP.
Eigen::Vector2d opencv_pixel(const PinholeCamera& camera, const Eigen::Vector3d& P) {
  const cv::Matx33d K(camera.fx_px, 0, camera.cx_px, 0, camera.fy_px, camera.cy_px, 0, 0, 1);
  const std::array<double, 4>& k = camera.distortion.coefficients();
  const cv::Vec4d coefficients(k[0], k[1], k[2], k[3]);
  const std::vector<cv::Point3d> points = {{P.x(), P.y(), P.z()}};
  const cv::Vec3d zero(0, 0, 0);
  std::vector<cv::Point2d> pixels;
  if (camera.distortion.model() == DistortionModel::kEquidistant) {
    cv::fisheye::projectPoints(points, pixels, zero, zero, K, coefficients);
  } else {
    cv::projectPoints(points, zero, zero, K, coefficients, pixels);
  }
  return {pixels[0].x, pixels[0].y};
}

TEST(Distortion, AgreesWithOpenCv) {
  for (const Distortion* lens : lenses()) {
    const PinholeCamera camera = camera_with(*lens);
    int n = 0;
    for (const Eigen::Vector2d& xy : grid()) {
      const Eigen::Vector3d P(2.0 * xy.x(), 2.0 * xy.y(), 2.0);
      const auto pixel = camera.project(P);
      if (!pixel) continue;
      EXPECT_LT((*pixel - opencv_pixel(camera, P)).norm(), 1e-10) << xy.transpose();  // rounding of pixels
      ++n;
    }
    EXPECT_GT(n, 700);
  }
}

TEST(Distortion, OfNoneIsThePinhole) {
  const PinholeCamera plain = camera_with({});
  const PinholeCamera zero = camera_with({DistortionModel::kRadtan, {}});
  for (const Eigen::Vector2d& xy : grid()) {
    EXPECT_EQ(*plain.distortion.apply(xy), xy);
    EXPECT_EQ(*zero.distortion.apply(xy), xy);
    EXPECT_LT((zero.distortion.remove(xy).value() - xy).norm(), 1e-14);  // rounding of numbers up to 2
    EXPECT_EQ(*plain.project({xy.x(), xy.y(), 1.0}), *zero.project({xy.x(), xy.y(), 1.0}));
  }
}

// Of 4th-order differences: h^4 f^(5)/30 with derivatives of order 1e2 near a fold, 1e-12 * 1e2; rounding 1e-16/1e-3.
TEST(Distortion, JacobianMatchesDifferences) {
  constexpr double kStep = 1e-3;
  for (const Distortion* lens : lenses()) {
    std::vector<Eigen::Vector2d> points = grid();
    points.emplace_back(3e-5, -4e-5);  // the series about the axis
    for (const Eigen::Vector2d& xy : points) {
      Eigen::Matrix2d J;
      if (!lens->apply(xy, &J) || !lens->apply(1.01 * xy)) continue;
      EXPECT_GT(J.determinant(), 0.0);
      for (int i = 0; i < 2; ++i) {
        const auto at = [&](double s) { return lens->apply(xy + s * kStep * Eigen::Vector2d::Unit(i)).value(); };
        const Eigen::Vector2d numeric = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * kStep);
        EXPECT_LT((J.col(i) - numeric).norm(), 1e-9) << xy.transpose();
      }
    }
  }
}

TEST(Distortion, CameraJacobianMatchesDifferences) {
  constexpr double kStep = 1e-3;
  for (const Distortion* lens : lenses()) {
    const PinholeCamera camera = camera_with(*lens);
    const Eigen::Vector3d P(0.5, -0.7, 1.9);
    Eigen::Matrix<double, 2, 3> J;
    ASSERT_TRUE(camera.project(P, &J).has_value());
    for (int i = 0; i < 3; ++i) {
      const auto at = [&](double s) { return camera.project(P + s * kStep * Eigen::Vector3d::Unit(i)).value(); };
      const Eigen::Vector2d numeric = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * kStep);
      EXPECT_LT((J.col(i) - numeric).norm(), 1e-7) << i;  // of entries of 250 px/m
    }
    EXPECT_LT((J * P).norm(), 1e-11);  // the distance along the ray changes nothing
  }
}

// 1e-12 in (x, y), where the map is not flatter than a hundredth; the rest is rounding over that slope.
TEST(Distortion, RemoveInvertsApply) {
  for (const Distortion* lens : lenses()) {
    int n = 0;
    for (const Eigen::Vector2d& xy : grid()) {
      Eigen::Matrix2d J;
      const auto seen = lens->apply(xy, &J);
      if (!seen) continue;
      const auto back = lens->remove(*seen);
      ASSERT_TRUE(back.has_value()) << xy.transpose();
      const double slope = std::min(1.0, J.determinant() / J.norm());
      EXPECT_LT((*back - xy).norm(), slope > 1e-2 ? 1e-12 : 1e-15 / (slope * slope)) << xy.transpose();
      ++n;
    }
    EXPECT_GT(n, 700);
  }
}

TEST(Distortion, NothingIsSeenBeyondTheFold) {
  // r - r^3/2 without a tangential part: its fold is at r^2 = 2/3, of height 0.544.
  const Distortion barrel(DistortionModel::kRadtan, {-0.5, 0.0, 0.0, 0.0});
  const double fold = std::sqrt(2.0 / 3.0);
  const double height = fold * 2.0 / 3.0;
  for (const double angle : {0.0, 1.0, 2.5, 4.0}) {
    const Eigen::Vector2d ray(std::cos(angle), std::sin(angle));
    EXPECT_TRUE(barrel.apply((fold - 1e-6) * ray).has_value());
    EXPECT_FALSE(barrel.apply((fold + 1e-6) * ray).has_value());
    EXPECT_FALSE(barrel.apply(5.0 * ray).has_value());
    EXPECT_NEAR(barrel.remove((height - 1e-9) * ray).value().norm(), fold, 1e-3);
    EXPECT_FALSE(barrel.remove((height + 1e-9) * ray).has_value());
  }
  // theta - 0.3 theta^3 + 0.05 theta^5 never folds before 90 degrees if its slope 1 - 0.9 s + 0.25 s^2 > 0: always.
  const Distortion wide(DistortionModel::kEquidistant, {-0.3, 0.05, 0.0, 0.0});
  EXPECT_TRUE(wide.apply({1e5, 0.0}).has_value());
}

// A polynomial whose slope turns positive again: what lies out there would be seen twice.
TEST(Distortion, TheSecondRiseIsNotReal) {
  const Distortion lens(DistortionModel::kRadtan, {-0.6, 0.15, 0.0, 0.0});  // slope 1 - 1.8 s + 0.75 s^2
  const double fold = std::sqrt((1.8 - std::sqrt(1.8 * 1.8 - 3.0)) / 1.5);
  EXPECT_TRUE(lens.apply({fold - 1e-6, 0.0}).has_value());
  EXPECT_FALSE(lens.apply({fold + 1e-6, 0.0}).has_value());
  EXPECT_FALSE(lens.apply({2.0, 0.0}).has_value());  // 1 - 1.8 * 4 + 0.75 * 16 > 0
  const Distortion fisheye(DistortionModel::kEquidistant, {-0.6, 0.15, 0.0, 0.0});
  EXPECT_TRUE(fisheye.apply({std::tan(fold - 1e-6), 0.0}).has_value());
  EXPECT_FALSE(fisheye.apply({std::tan(fold + 1e-6), 0.0}).has_value());
}

// What is seen is seen once: the determinant alone, which the tangential part moves, keeps the map one-to-one.
TEST(Distortion, WhatIsRefusedIsBeyondTheFold) {
  for (const Distortion* lens : lenses()) {
    for (int i = 0; i < 64; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / 64;
      const Eigen::Vector2d ray(std::cos(angle), std::sin(angle));
      // Along a ray the seen part is an interval from the axis.
      bool seen = true;
      for (int step = 0; step < 300; ++step) {
        const double r = 0.01 * step;
        const bool now = lens->apply(r * ray).has_value();
        EXPECT_TRUE(seen || !now) << r;
        seen = now;
      }
    }
  }
}

TEST(Distortion, PixelsWithoutARayAreNamed) {
  const PinholeCamera camera = camera_with({DistortionModel::kRadtan, {-0.5, 0.0, 0.0, 0.0}});
  const Eigen::Vector2d corner(751.0, 479.0);
  EXPECT_FALSE(camera.try_unproject(corner).has_value());
  EXPECT_THROW(camera.unproject(corner), std::domain_error);
  EXPECT_TRUE(camera.try_unproject({367.0, 248.0}).has_value());
}

}  // namespace
}  // namespace plumbline::core
