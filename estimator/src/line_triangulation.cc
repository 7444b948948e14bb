#include "estimator/line_triangulation.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "estimator/factors/line_chain.h"
#include "estimator/factors/line_residual.h"

namespace plumbline::estimator {
namespace {

// Depths of the anchor's ends that are plausible.
constexpr double kNearestEndM = 0.1;
constexpr double kFarthestEndM = 200.0;

// An observed end in the world, about the line's origin.
struct Ray {
  Ray(const core::PinholeCamera& camera, const View& view, const Eigen::Vector3d& origin_W)
      : end(camera, view.pixel), R(view.T_W_C.q.toRotationMatrix()), c(view.T_W_C.p - origin_W), a(R * end.b) {}

  LineEndPoint end;
  Eigen::Matrix3d R;
  Eigen::Vector3d c;
  Eigen::Vector3d a;  // of depth 1
};

// Distance of an end from the line [px] and its derivatives.
template <int kDof>
struct Row {
  double r_px = 0.0;
  Eigen::Matrix<double, kDof, 1> J;
};

template <int kDof>
struct NormalEquations {
  Eigen::Matrix<double, kDof, kDof> H = Eigen::Matrix<double, kDof, kDof>::Zero();
  Eigen::Matrix<double, kDof, 1> g = Eigen::Matrix<double, kDof, 1>::Zero();
  double squares = 0.0;

  void add(const Row<kDof>& row) {
    H += row.J * row.J.transpose();
    g += row.J * row.r_px;
    squares += row.r_px * row.r_px;
  }
};

// By the inverse depths of the anchor's ends, m held. Nothing where the plane has no image.
std::optional<Row<2>> depth_row(const Ray& a0, const Ray& a1, const Ray& ray, const Eigen::Vector2d& rho) {
  const Eigen::Vector3d b0 = a0.c - ray.c;
  const Eigen::Vector3d b1 = a1.c - ray.c;
  const Eigen::Vector3d P0 = a0.a + rho[0] * b0;
  const Eigen::Vector3d P1 = a1.a + rho[1] * b1;
  const Eigen::Vector3d N = P0.cross(P1);
  const double m = (ray.end.D.transpose() * (ray.R.transpose() * N).head<2>()).norm();
  if (!(m > kSmallestLineGradient * P0.norm() * P1.norm() * ray.end.D.norm())) return std::nullopt;
  return Row<2>{ray.a.dot(N) / m, {ray.a.dot(b0.cross(P1)) / m, ray.a.dot(P0.cross(b1)) / m}};
}

struct Depths {
  Eigen::Vector2d rho = Eigen::Vector2d::Zero();
  LineDeferral deferral = LineDeferral::kNone;
};

Depths depths_of_anchor(const std::vector<Ray>& rays, const LineStartRules& rules) {
  const Ray& a0 = rays[0];
  const Ray& a1 = rays[1];
  // A millionth of the picture: no direction to speak of.
  if (!(a0.a.cross(a1.a).norm() > 1e-6 * a0.a.norm() * a1.a.norm())) return {{}, LineDeferral::kNoDirection};
  // The first step solves the linear system weighted as for a line at infinity, the others weigh it anew.
  constexpr int kSteps = 4;
  const std::size_t views = rays.size() / 2;
  Depths depths;
  Eigen::Matrix2d covariance;
  for (int step = 0; step < kSteps; ++step) {
    NormalEquations<2> normal;
    for (std::size_t i = 2; i < rays.size(); ++i) {
      const auto row = depth_row(a0, a1, rays[i], depths.rho);
      if (!row) return {depths.rho, LineDeferral::kNoDirection};
      normal.add(*row);
    }
    // Rounding leaves about 1e-16 of the product of the diagonal where the planes are all one.
    const double determinant = normal.H.determinant();
    if (!(determinant > 1e-12 * normal.H(0, 0) * normal.H(1, 1))) return {depths.rho, LineDeferral::kNoParallax};
    // What poses are off by is in the residuals, where two views leave none.
    const double variance_px = views > 2 ? normal.squares / static_cast<double>(2 * views - 4) : 0.0;
    const bool settled = step > 0;  // the first residuals are those of a line at infinity
    covariance = std::max(rules.sigma_px * rules.sigma_px, settled ? variance_px : 0.0) * normal.H.inverse();
    depths.rho -= normal.H.inverse() * normal.g;
  }
  for (int k = 0; k < 2; ++k) {
    const double rho = depths.rho[k];
    const bool is_known = std::sqrt(covariance(k, k)) < rules.largest_depth_sigma * std::abs(rho);
    if (!is_known) return {depths.rho, LineDeferral::kNoParallax};
    if (rho < 0.0) return {depths.rho, LineDeferral::kBehind};
    if (!(rho > 1.0 / kFarthestEndM && rho < 1.0 / kNearestEndM)) return {depths.rho, LineDeferral::kOutOfRange};
  }
  return depths;
}

LineChain chain_to(const Ray& ray, const OrthonormalLine& line) {
  // The camera is its own body.
  return {line.plucker(), ray.R, ray.c, Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero()};
}

std::optional<NormalEquations<kLineDof>> linearise(const std::vector<Ray>& rays, const LineBlock& block) {
  const OrthonormalLine line(block.data());
  if (line.degenerate()) return std::nullopt;
  NormalEquations<kLineDof> normal;
  for (const Ray& ray : rays) {
    const LineChain chain = chain_to(ray, line);
    LineDistance distance;
    if (!line_distance(chain.n_c, ray.end.b, ray.end.D, distance)) return std::nullopt;
    const LineGradient gradient(chain, distance.dr_dn);
    normal.add({distance.r_px, line.to_tangent(gradient.line_n(), gradient.line_d(chain)).transpose()});
  }
  return normal;
}

// While the squares fall.
LineBlock refine(const std::vector<Ray>& rays, LineBlock line) {
  constexpr int kMaxSteps = 5;
  auto at = linearise(rays, line);
  for (int step = 0; at && step < kMaxSteps; ++step) {
    const Eigen::LDLT<Eigen::Matrix4d> solver(at->H);
    if (solver.info() != Eigen::Success || !(solver.vectorD().minCoeff() > 0.0)) break;
    const Eigen::Vector4d delta = -solver.solve(at->g);
    if (!delta.allFinite()) break;
    LineBlock moved;
    OrthonormalLineManifold().Plus(line.data(), delta.data(), moved.data());
    auto there = linearise(rays, moved);
    if (!there || !(there->squares < at->squares)) break;
    line = moved;
    at = there;
  }
  return line;
}

// The depth at which a ray passes the line nearest.
double depth_along(const Ray& ray, const PluckerLine& L) {
  const Eigen::Vector3d across = ray.a.cross(L.d);
  return (L.n - ray.c.cross(L.d)).dot(across) / across.squaredNorm();
}

}  // namespace

bool in_front(const core::PinholeCamera& camera, const SegmentView& view, const PluckerLine& L,
              const Eigen::Vector3d& origin_W) {
  return depth_along(Ray(camera, view[0], origin_W), L) > 0.0 && depth_along(Ray(camera, view[1], origin_W), L) > 0.0;
}

TriangulatedLine triangulate_line(const core::PinholeCamera& camera, const std::vector<SegmentView>& views,
                                  const LineStartRules& rules) {
  TriangulatedLine result;
  const auto defer = [&](LineDeferral why) {
    result.deferral = why;
    return result;
  };
  if (views.size() < 2) return defer(LineDeferral::kTooFewViews);
  result.origin_W = views.front()[0].T_W_C.p;
  std::vector<Ray> rays;
  for (const SegmentView& view : views) {
    for (const View& end : view) rays.emplace_back(camera, end, result.origin_W);
  }
  const Depths depths = depths_of_anchor(rays, rules);
  if (depths.deferral != LineDeferral::kNone) return defer(depths.deferral);
  const auto start =
      orthonormal_line(line_through(rays[0].c + rays[0].a / depths.rho[0], rays[1].c + rays[1].a / depths.rho[1]));
  if (!start) return defer(LineDeferral::kNoDirection);
  const LineBlock line = refine(rays, *start);
  const PluckerLine L = OrthonormalLine(line.data()).plucker();
  for (const Ray& ray : rays) {
    if (!(depth_along(ray, L) > 0.0)) return defer(LineDeferral::kBehind);
  }
  result.line = line;
  return result;
}

}  // namespace plumbline::estimator
