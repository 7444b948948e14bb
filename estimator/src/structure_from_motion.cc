#include "estimator/structure_from_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

#include <Eigen/SVD>
#include <fmt/format.h>
#include <opencv2/calib3d.hpp>

#include "core/camera.h"
#include "estimator/batch_start.h"
#include "estimator/ray_bundle.h"
#include "estimator/triangulation.h"

namespace plumbline::estimator {
namespace {

constexpr std::size_t kLeastShared = 20;  // rays of the pair
constexpr int kLeastPoints = 10;          // that a view is placed by
constexpr double kGate = 4.0;             // sigmas: what agrees

// A camera whose pixels are rays.
core::PinholeCamera ray_camera() { return {.fx_px = 1.0, .fy_px = 1.0, .cx_px = 0.0, .cy_px = 0.0}; }

struct RayPair {
  std::int64_t track = 0;
  Eigen::Vector2d a;
  Eigen::Vector2d b;
};

std::vector<RayPair> shared_rays(const PictureRays& a, const PictureRays& b) {
  std::vector<RayPair> pairs;
  for (const auto& [track, ray] : a) {
    if (const auto other = b.find(track); other != b.end()) pairs.push_back({track, ray, other->second});
  }
  return pairs;
}

// R with b ~ R a (Wahba's problem, by singular values).
Eigen::Matrix3d best_rotation(std::span<const RayPair> pairs) {
  Eigen::Matrix3d B = Eigen::Matrix3d::Zero();
  for (const RayPair& p : pairs) B += p.b.homogeneous().normalized() * p.a.homogeneous().normalized().transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(B, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
  return svd.matrixU() * Eigen::Vector3d(1.0, 1.0, sign).asDiagonal() * svd.matrixV().transpose();
}

double moved(const RayPair& p, const Eigen::Matrix3d& R) {
  const Eigen::Vector3d turned = R * p.a.homogeneous();
  if (!(turned.z() > 0.0)) return std::numeric_limits<double>::infinity();
  return (turned.hnormalized() - p.b).norm();
}

core::Pose pose_of(const cv::Mat& R_C_W, const cv::Mat& t_C_W) {
  Eigen::Matrix3d R;
  Eigen::Vector3d t;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) R(i, j) = R_C_W.at<double>(i, j);
    t[i] = t_C_W.at<double>(i);
  }
  return core::Pose{Eigen::Quaterniond(R).normalized(), t}.inverse();
}

class Reconstruction {
 public:
  Reconstruction(const std::vector<PictureRays>& pictures, const StructureRules& rules)
      : pictures_(pictures), rules_(rules), poses_(pictures.size()) {}

  // The newest picture and the earliest that shares enough with it and has parallax to it.
  void find_pair() {
    const std::size_t newest = pictures_.size() - 1;
    double largest = 0.0;
    for (std::size_t k = 0; k < newest; ++k) {
      const std::vector<RayPair> pairs = shared_rays(pictures_[k], pictures_[newest]);
      if (pairs.size() < kLeastShared) continue;
      const double here = parallax(pictures_[k], pictures_[newest]);
      largest = std::max(largest, here);
      if (here < rules_.least_parallax || !relate(k, newest, pairs)) continue;
      first_ = k;
      return;
    }
    if (largest < rules_.least_parallax) {
      throw NoStart(
          fmt::format("too little parallax: {:.3g} sigma of a pixel, rotation taken out, where {:.3g} are needed",
                      largest / rules_.ray_sigma, rules_.least_parallax / rules_.ray_sigma));
    }
    throw NoStart("no two pictures agree on how the camera has moved");
  }

  void place_others() {
    triangulate_new();
    for (std::size_t k = first_ + 1; k + 1 < pictures_.size(); ++k) place(k, k - 1);
    for (std::size_t k = first_; k-- > 0;) place(k, k + 1);
  }

  // All together, about the first picture.
  std::vector<core::Pose> adjust() {
    points_.clear();
    triangulate_new();
    std::vector<core::Pose> poses;
    const core::Pose T_0_W = poses_.front()->inverse();
    for (const auto& pose : poses_) poses.push_back(T_0_W * *pose);
    std::vector<RayPoint> points;
    for (const auto& [track, X] : points_) {
      RayPoint point{T_0_W * X, {}};
      for (std::size_t k = 0; k < pictures_.size(); ++k) {
        const auto sight = pictures_[k].find(track);
        if (sight != pictures_[k].end() && agrees(*poses_[k], X, sight->second)) {
          point.sights.push_back({k, sight->second});
        }
      }
      points.push_back(std::move(point));
    }
    if (!adjust_rays(poses, points, rules_.ray_sigma)) throw NoStart("the bundle adjustment diverges");
    return poses;
  }

 private:
  // The pair's poses, the distance between them the unit. False where no motion suits most rays.
  bool relate(std::size_t k, std::size_t newest, const std::vector<RayPair>& pairs) {
    constexpr double kConfidence = 0.999;
    std::vector<cv::Point2d> a;
    std::vector<cv::Point2d> b;
    for (const RayPair& p : pairs) {
      a.emplace_back(p.a.x(), p.a.y());
      b.emplace_back(p.b.x(), p.b.y());
    }
    const cv::Mat I = cv::Mat::eye(3, 3, CV_64F);
    cv::Mat agree;
    const cv::Mat E = cv::findEssentialMat(a, b, I, cv::RANSAC, kConfidence, kGate * rules_.ray_sigma, agree);
    if (E.rows != 3 || E.cols != 3) return false;
    cv::Mat R;
    cv::Mat t;
    const int in_front = cv::recoverPose(E, a, b, I, R, t, agree);
    if (2 * in_front < static_cast<int>(pairs.size())) return false;
    poses_[k] = core::Pose{};
    poses_[newest] = pose_of(R, t);
    return true;
  }

  bool agrees(const core::Pose& T_W_C, const Eigen::Vector3d& X, const Eigen::Vector2d& ray) const {
    const Eigen::Vector3d q = T_W_C.q.conjugate() * (X - T_W_C.p);
    return q.z() > 0.0 && (q.hnormalized() - ray).norm() < kGate * rules_.ray_sigma;
  }

  std::optional<Eigen::Vector3d> triangulate_track(std::int64_t track) const {
    std::vector<View> views;
    for (std::size_t k = 0; k < pictures_.size(); ++k) {
      const auto sight = pictures_[k].find(track);
      if (poses_[k] && sight != pictures_[k].end()) views.push_back({*poses_[k], sight->second});
    }
    if (views.size() < 2) return std::nullopt;
    const auto landmark = triangulate_agreeing(ray_camera(), views, kGate * rules_.ray_sigma);
    if (!landmark) return std::nullopt;
    return views.front().T_W_C * Eigen::Vector3d(landmark->head<2>().homogeneous() / landmark->z());
  }

  void triangulate_new() {
    for (std::size_t k = 0; k < pictures_.size(); ++k) {
      if (!poses_[k]) continue;
      for (const auto& [track, ray] : pictures_[k]) {
        if (points_.contains(track)) continue;
        if (const auto X = triangulate_track(track)) points_.emplace(track, *X);
      }
    }
  }

  // From where its neighbour is.
  void place(std::size_t k, std::size_t neighbour) {
    constexpr int kTries = 200;
    constexpr double kConfidence = 0.999;
    std::vector<cv::Point3d> points;
    std::vector<cv::Point2d> rays;
    for (const auto& [track, ray] : pictures_[k]) {
      const auto X = points_.find(track);
      if (X == points_.end()) continue;
      points.emplace_back(X->second.x(), X->second.y(), X->second.z());
      rays.emplace_back(ray.x(), ray.y());
    }
    const auto lost = [&](std::size_t n) {
      return NoStart(fmt::format("a picture sees {} known points, too few to place it", n));
    };
    if (points.size() < static_cast<std::size_t>(kLeastPoints)) throw lost(points.size());
    const core::Pose start = poses_[neighbour]->inverse();
    const Eigen::Vector3d turn = core::log_so3(start.q);
    cv::Mat rotation = (cv::Mat_<double>(3, 1) << turn.x(), turn.y(), turn.z());
    cv::Mat t = (cv::Mat_<double>(3, 1) << start.p.x(), start.p.y(), start.p.z());
    std::vector<int> agree;
    const bool found = cv::solvePnPRansac(points, rays, cv::Mat::eye(3, 3, CV_64F), cv::noArray(), rotation, t, true,
                                          kTries, static_cast<float>(kGate * rules_.ray_sigma), kConfidence, agree);
    if (!found || static_cast<int>(agree.size()) < kLeastPoints) throw lost(agree.size());
    cv::Mat R;
    cv::Rodrigues(rotation, R);
    poses_[k] = pose_of(R, t);
    triangulate_new();
  }

  const std::vector<PictureRays>& pictures_;
  StructureRules rules_;
  std::vector<std::optional<core::Pose>> poses_;  // in the frame of the pair's first
  std::map<std::int64_t, Eigen::Vector3d> points_;
  std::size_t first_ = 0;
};

}  // namespace

double parallax(const PictureRays& a, const PictureRays& b) {
  const std::vector<RayPair> all = shared_rays(a, b);
  if (all.size() < kLeastShared) return 0.0;
  std::vector<RayPair> pairs = all;
  double median = 0.0;
  // Wrong matches, which would turn it along, leave after the first round.
  for (int round = 0; round < 3 && pairs.size() >= kLeastShared / 2; ++round) {
    const Eigen::Matrix3d R = best_rotation(pairs);
    std::vector<double> distances;
    for (const RayPair& p : all) distances.push_back(moved(p, R));
    std::nth_element(distances.begin(), distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2),
                     distances.end());
    median = distances[distances.size() / 2];
    pairs.clear();
    std::copy_if(all.begin(), all.end(), std::back_inserter(pairs),
                 [&](const RayPair& p) { return moved(p, R) <= 3.0 * median; });
  }
  return median;
}

std::vector<core::Pose> structure_from_motion(const std::vector<PictureRays>& pictures, const StructureRules& rules) {
  Reconstruction reconstruction(pictures, rules);
  reconstruction.find_pair();
  reconstruction.place_others();
  return reconstruction.adjust();
}

}  // namespace plumbline::estimator
