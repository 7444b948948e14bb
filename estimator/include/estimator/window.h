// A sliding window: the states of some keyframes, what they see, and the prior that stands for all that has left.
//
// Points (three degrees of freedom) are tied to a state of the window, at first that of the keyframe that saw them
// first (factors/anchored_point.h). When that state leaves, a point that is still seen moves to the newest keyframe and
// stays with its uncertainty in the prior, as long as there is room; all others leave with all that was seen of them,
// and so do lines. No observation is used twice, and a track that goes on after that begins a new landmark.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <ceres/sized_cost_function.h>

#include "core/estimate.h"
#include "core/measurements.h"
#include "estimator/batch_values.h"
#include "estimator/config.h"
#include "estimator/factors/parameter_blocks.h"
#include "estimator/least_squares.h"
#include "estimator/line_terms.h"
#include "estimator/marginal_prior.h"
#include "estimator/point_terms.h"

namespace plumbline::estimator {

struct WindowFrame {
  std::optional<std::size_t> frame;  // of the log; none: the prior's state
  std::size_t sample = 0;            // of the IMU, where the state is
  StateBlock x;
  FrameTiming timing;
  // From the frame before, about `inertial_bias`.
  std::unique_ptr<const ceres::CostFunction> inertial;
  core::ImuBias inertial_bias;
};

struct WindowObservation {
  WindowFrame* frame = nullptr;
  Eigen::Vector2d pixel;
  std::optional<Eigen::Vector2d> velocity;
  std::unique_ptr<const ceres::CostFunction> factor;  // null: not used (no value yet, or the anchor's, taken as exact)
};

struct WindowPoint {
  WindowFrame* anchor = nullptr;
  core::Pose T_B_A;                                    // the camera that the anchor carries
  Eigen::Vector3d landmark = Eigen::Vector3d::Zero();  // (x, y, lambda)
  bool has_value = false;
  bool depth_is_known = false;  // once and for all
  bool in_prior = false;
  int rejected = 0;  // observations
  std::vector<WindowObservation> observations;
};

// A point whose depth no parallax has told yet: an inverse depth of 1/m, give or take as much, m what is usual. Without
// it the noise of two views would make the point as near as it likes, and what near points say of the motion is much.
// The second row is nothing.
template <int kSize>
class UsualDepthFactor final : public ceres::SizedCostFunction<2, kSize> {
 public:
  explicit UsualDepthFactor(double usual_m) : usual_m_(usual_m) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    residuals[0] = usual_m_ * parameters[0][kSize - 1] - 1.0;
    residuals[1] = 0.0;
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    std::fill_n(jacobians[0], 2 * kSize, 0.0);
    jacobians[0][kSize - 1] = usual_m_;
    return true;
  }

 private:
  double usual_m_;
};

struct WindowLineObservation {
  WindowFrame* frame = nullptr;
  SegmentPixels ends_px;
  std::optional<SegmentVelocities> velocities;
  std::unique_ptr<const ceres::CostFunction> factor;
};

struct WindowLine {
  std::optional<LineValue> value;
  std::vector<WindowLineObservation> observations;
};

struct WindowSolution {
  LeastSquaresResult result;
  int observations = 0;
  // Of the newest state and the calibration; nothing where the information is singular.
  std::optional<core::PosteriorCovariance> covariance;
};

// Residuals at the present values, without those beyond estimator.window.outlier_sigma.
struct WindowFit {
  core::ResidualSum visual;
  int outliers = 0;

  double squares_per_residual() const { return visual.residuals > 0 ? visual.squares / visual.residuals : 0.0; }
};

class Window {
 public:
  Window(const core::MeasurementLog& log, const EstimatorConfig& config) : Window(log, config, log.prior) {}
  // From another prior than the recording's.
  Window(const core::MeasurementLog& log, const EstimatorConfig& config, const core::InitialPrior& prior);
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  // The newest keyframe, its state carried by the IMU. False, and nothing added, where no IMU sample is left for it.
  bool add_frame(std::size_t frame);

  // Values for points and lines that have been seen often enough.
  void triangulate();

  // What solve() solves, on the window's own values.
  LeastSquares problem();

  // `doubtful`: with a loss that wrong matches cannot pull along, and without a covariance.
  WindowSolution solve(bool doubtful = false);

  // With `reject`, the observations that the present values speak against are taken out.
  WindowFit assess(bool reject);

  // The oldest state leaves.
  void fold_oldest();

  // How far points have moved in the picture from the keyframe before to the newest, the rotation between them and the
  // noise of pixels taken out [px]; the median. Nothing where they share none.
  std::optional<double> parallax_of_newest_px() const;

  // The newest frame leaves without a trace.
  void drop_newest() { remove_frame(frames_.size() - 1); }

  // While nothing has left: puts the states where td says that the frames were.
  void retime(double td_s);

  // sigma(s)/s of the scale by which the path of the frames is longer or shorter than it should be: that of
  //   s = sum_k (p_k - mean) . dp_k / sum_k |p_k - mean|^2
  // Nothing where the information is singular.
  std::optional<double> relative_scale_sigma();

  // Of the frames.
  std::vector<core::StampedState> states() const;

  std::size_t size() const { return frames_.size(); }
  bool folded() const { return prior_ != nullptr; }
  double timing_td_s() const { return timing_td_s_; }
  const WindowFrame& newest() const { return *frames_.back(); }
  const WindowFrame& oldest() const { return *frames_.front(); }
  core::RigCalibration calibration() const;
  core::PinholeCamera camera() const { return log_.camera.with(intrinsics_); }
  const MarginalPrior* prior() const { return prior_.get(); }
  int observations_of_newest() const;

 private:
  struct Built;  // a LeastSquares problem and which of its blocks is whose

  bool is_free_point() const { return config_.landmark == LandmarkType::kBearingInverseDepth; }
  FrameTiming timing_of(const WindowFrame& frame, const core::ImuBias& bias) const;
  core::Pose camera_pose(const WindowFrame& frame, double row_px) const;
  void make_inertial(std::size_t i);
  std::unique_ptr<const ceres::CostFunction> make_factor(const WindowPoint& point,
                                                         const WindowObservation& observation) const;
  bool make_factors(WindowPoint& point);
  bool can_evaluate(const WindowPoint& point, const WindowObservation& observation) const;
  std::optional<Eigen::Vector2d> residual_of(const WindowPoint& point, const WindowObservation& observation,
                                             const Eigen::Vector3d& landmark) const;
  bool tells_depth(const WindowPoint& point) const;
  const ceres::CostFunction* usual_depth() const;
  void add_calibration(Built& built);
  void add_point_terms(WindowPoint& point, Built& built, const WindowFrame* only_of = nullptr);
  void add_line_terms(WindowLine& line, Built& built);
  void add_inertial_term(std::size_t i, Built& built);
  Built build_all();
  std::array<int, kMostBlocks> point_blocks(const WindowPoint& point, const WindowObservation& observation,
                                            int landmark, const Built& built, int& count) const;
  void remove_frame(std::size_t i);

  const core::MeasurementLog& log_;
  const EstimatorConfig& config_;
  core::CalibrationSigmas calibration_sigma_;
  BelievedNoise noise_;
  PointModel point_model_;
  LineModel line_model_;
  std::vector<std::unique_ptr<WindowFrame>> frames_;  // by time
  std::map<std::int64_t, WindowPoint> points_;
  std::map<std::int64_t, WindowLine> lines_;
  PoseBlock extrinsics_;
  double td_s_;
  double readout_s_;
  core::Intrinsics intrinsics_;
  double timing_td_s_;
  // Before anything has left, then `prior_`.
  struct InitialTerm {
    std::unique_ptr<const ceres::CostFunction> factor;
    double* block;
  };
  std::vector<InitialTerm> initial_;
  std::unique_ptr<MarginalPrior> prior_;
  std::vector<double*> prior_values_;  // of its parts
  StateManifold state_manifold_;
  PoseManifold pose_manifold_;
  OrthonormalLineManifold line_manifold_;
  UsualDepthFactor<kLandmarkSize> usual_depth_;
  UsualDepthFactor<1> usual_depth_of_fixed_;
  std::unique_ptr<ceres::LossFunction> loss_;
  std::unique_ptr<ceres::LossFunction> doubtful_loss_;
};

}  // namespace plumbline::estimator
