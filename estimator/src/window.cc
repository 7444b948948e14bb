#include "estimator/window.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <utility>

#include "estimator/batch_start.h"
#include "estimator/factors/anchored_point.h"
#include "estimator/factors/imu_factor.h"
#include "estimator/factors/prior_factors.h"
#include "estimator/line_triangulation.h"
#include "estimator/robust_loss.h"
#include "estimator/triangulation.h"

namespace plumbline::estimator {

Window::Window(const core::MeasurementLog& log, const EstimatorConfig& config, const core::InitialPrior& prior)
    : log_(log),
      config_(config),
      calibration_sigma_(prior.calibration_sigma),
      noise_(believed_noise(config, log.imu_noise, log.pixel_sigma_px, log.line_sigma_px)),
      extrinsics_(pack(prior.start_calibration.T_B_C)),
      td_s_(prior.start_calibration.td_s),
      readout_s_(prior.start_calibration.readout_s),
      intrinsics_(log.camera.intrinsics()),
      timing_td_s_(config.state_td_s.value_or(td_s_)),
      usual_depth_(config.window.usual_depth_m),
      usual_depth_of_fixed_(config.window.usual_depth_m),
      loss_(make_loss(config.loss, config.loss_scale)),
      doubtful_loss_(make_loss(RobustLoss::kCauchy, 3.0)) {
  const CameraModel camera{.camera = log.camera,
                           .pixel_sigma_px = noise_.pixel_sigma_px,
                           .gravity_m_s2 = log.gravity_m_s2,
                           .residual = config.residual};
  point_model_ = {.camera = camera, .timing = config.timing, .landmark = config.landmark};
  line_model_ = {.camera = camera, .timing = config.timing};
  line_model_.camera.pixel_sigma_px = noise_.line_sigma_px;

  auto first = std::make_unique<WindowFrame>();
  first->sample = nearest_sample(log.imu, 0.0, prior.t_ns);
  first->x = pack(prior.start);
  initial_.push_back({std::make_unique<StatePriorFactor>(prior.mean, prior.sigma), first->x.data()});
  frames_.push_back(std::move(first));
  const core::CalibrationSigmas& sigma = prior.calibration_sigma;
  const core::RigCalibration& mean = prior.calibration;
  if (config.estimate.extrinsics) {
    initial_.push_back(
        {std::make_unique<ExtrinsicsPriorFactor>(mean.T_B_C, sigma.extrinsic_position_m, sigma.extrinsic_rotation_rad),
         extrinsics_.data()});
  }
  if (config.estimate.td) initial_.push_back({std::make_unique<ScalarPriorFactor>(mean.td_s, sigma.td_s), &td_s_});
  if (config.estimate.readout) {
    initial_.push_back({std::make_unique<ScalarPriorFactor>(mean.readout_s, sigma.readout_s), &readout_s_});
  }
  if (config.estimate.intrinsics) {
    intrinsics_ = prior.start_calibration.intrinsics.value();
    initial_.push_back(
        {std::make_unique<IntrinsicsPriorFactor>(mean.intrinsics.value(), sigma.focal_px, sigma.principal_point_px),
         intrinsics_.data()});
  }
}

core::RigCalibration Window::calibration() const {
  core::RigCalibration calibration{.T_B_C = unpack_pose(extrinsics_.data()), .td_s = td_s_, .readout_s = readout_s_};
  if (config_.estimate.intrinsics) calibration.intrinsics = intrinsics_;
  return calibration;
}

std::vector<core::StampedState> Window::states() const {
  std::vector<core::StampedState> states;
  for (const auto& frame : frames_) {
    if (frame->frame) states.push_back({log_.imu[frame->sample].t_ns, unpack_state(frame->x.data())});
  }
  return states;
}

FrameTiming Window::timing_of(const WindowFrame& frame, const core::ImuBias& bias) const {
  const core::CalibrationSigmas& sigma = calibration_sigma_;
  const double sample_s = core::to_seconds(log_.imu[1].t_ns - log_.imu[0].t_ns);
  // How far observations may yet move from their states: as far as the prior lets td and readout, at first.
  constexpr double kSettledS = 5e-3;
  const double unsure_s = folded() ? kSettledS : kSettledS + 5.0 * (sigma.td_s + sigma.readout_s);
  const double offset_s = core::to_seconds(log_.frames[*frame.frame].t_cam_ns - log_.imu[frame.sample].t_ns);
  const double reach_s = 0.5 * std::abs(readout_s_) + sample_s + unsure_s + std::abs(offset_s + td_s_);
  return {std::make_shared<LocalMotion>(log_.imu, frame.sample, reach_s, bias), offset_s};
}

void Window::make_inertial(std::size_t i) {
  WindowFrame& frame = *frames_[i];
  const WindowFrame& before = *frames_[i - 1];
  frame.inertial_bias = unpack_state(before.x.data()).bias;
  const std::span<const core::ImuSample> imu(log_.imu);
  const Preintegration preintegration =
      preintegrate(imu.subspan(before.sample, frame.sample - before.sample + 1), frame.inertial_bias, noise_.imu);
  frame.inertial = std::make_unique<ImuFactor>(preintegration, log_.gravity_m_s2);
}

bool Window::add_frame(std::size_t index) {
  constexpr int kMostRejected = 2;
  const core::Frame& image = log_.frames[index];
  const WindowFrame& last = *frames_.back();
  const double placing_td_s = folded() && !config_.state_td_s ? td_s_ : timing_td_s_;
  const std::size_t sample = nearest_sample(log_.imu, placing_td_s, image.t_cam_ns);
  const double last_row_s =
      core::to_seconds(image.t_cam_ns - log_.imu.back().t_ns) + td_s_ + 0.5 * std::abs(readout_s_);
  if (sample <= last.sample || last_row_s > 0.0) return false;

  auto added = std::make_unique<WindowFrame>();
  added->frame = index;
  added->sample = sample;
  const core::State state = carry(unpack_state(last.x.data()), log_.imu, last.sample, sample, log_.gravity_m_s2);
  added->x = pack(state);
  added->timing = timing_of(*added, state.bias);
  WindowFrame* const frame = added.get();
  frames_.push_back(std::move(added));
  make_inertial(frames_.size() - 1);

  const bool velocities = config_.timing == TimingModel::kFeatureVelocity;
  if (uses_points(config_.use)) {
    for (const core::PointObservation& o : image.points) {
      if (!log_.camera.try_unproject(o.pixel) || (velocities && !o.velocity)) continue;
      WindowPoint& point = points_[o.track_id];
      // A track that has jumped: what the prior knows is of another point, and it is not looked at again.
      if (point.rejected >= kMostRejected) {
        if (point.in_prior) continue;
        point = {};
      }
      WindowObservation observation{.frame = frame, .pixel = o.pixel, .velocity = o.velocity, .factor = nullptr};
      if (point.has_value) {
        observation.factor = make_factor(point, observation);
        if (!can_evaluate(point, observation)) {
          ++point.rejected;
          continue;
        }
      }
      point.observations.push_back(std::move(observation));
    }
  }
  if (uses_lines(config_.use)) {
    for (const core::LineObservation& o : image.lines) {
      if (!log_.camera.try_unproject(o.ends_px[0]) || !log_.camera.try_unproject(o.ends_px[1])) continue;
      if (velocities && !o.velocities) continue;
      WindowLine& line = lines_[o.track_id];
      WindowLineObservation observation{
          .frame = frame, .ends_px = o.ends_px, .velocities = o.velocities, .factor = nullptr};
      if (line.value) {
        observation.factor =
            make_line_factor(line_model_, {frame->timing, o.ends_px, o.velocities}, line.value->origin_W);
      }
      line.observations.push_back(std::move(observation));
    }
  }
  return true;
}

// When the row was exposed. Constant rate over the few milliseconds from the state: good enough to start from.
core::Pose Window::camera_pose(const WindowFrame& frame, double row_px) const {
  const core::State state = unpack_state(frame.x.data());
  const double tau_s = frame.timing.offset_s + td_s_ + core::row_phase(row_px, log_.camera.height_px) * readout_s_;
  const Eigen::Vector3d rate = log_.imu[frame.sample].gyro_rad_s - state.bias.gyro_rad_s;
  const core::Pose T_W_B{state.T_W_B.q * core::exp_quaternion(rate * tau_s), state.T_W_B.p + tau_s * state.v_W};
  return T_W_B * unpack_pose(extrinsics_.data());
}

std::unique_ptr<const ceres::CostFunction> Window::make_factor(const WindowPoint& point,
                                                               const WindowObservation& o) const {
  const CameraModel& camera = point_model_.camera;
  if (!is_free_point()) {
    const WindowObservation& first = point.observations.front();
    return make_point_factor(point_model_, {point.anchor->timing, first.pixel, first.velocity},
                             {o.frame->timing, o.pixel, o.velocity});
  }
  const auto by = [&]<class Sight>(Sight sight) -> std::unique_ptr<const ceres::CostFunction> {
    if (o.frame == point.anchor) return std::make_unique<OwnAnchoredPoint<Sight>>(std::move(sight), point.T_B_A);
    return std::make_unique<AnchoredPoint<Sight>>(std::move(sight), point.T_B_A);
  };
  if (config_.estimate.intrinsics) return by(FreeCameraSight(camera, o.frame->timing, o.pixel));
  if (config_.timing == TimingModel::kPropagated) return by(PropagatedSight(camera, o.frame->timing, o.pixel));
  return by(VelocitySight(RayChart(camera.residual, camera.camera, camera.pixel_sigma_px, o.pixel),
                          MovingBearing(camera.camera, o.frame->timing.offset_s, o.pixel, *o.velocity)));
}

std::optional<Eigen::Vector2d> Window::residual_of(const WindowPoint& point, const WindowObservation& o,
                                                   const Eigen::Vector3d& landmark) const {
  std::array<const double*, kMostBlocks> parameters = {};
  std::size_t n = 0;
  parameters[n++] = point.anchor->x.data();
  if (!is_free_point() || o.frame != point.anchor) parameters[n++] = o.frame->x.data();
  for (const double* calibration : {extrinsics_.data(), &td_s_, &readout_s_}) parameters[n++] = calibration;
  parameters[n++] = is_free_point() ? landmark.data() : &landmark.z();
  parameters[n++] = intrinsics_.data();  // of factors that estimate them
  Eigen::Vector2d residual;
  if (!o.factor->Evaluate(parameters.data(), residual.data(), nullptr)) return std::nullopt;
  return residual;
}

const ceres::CostFunction* Window::usual_depth() const {
  if (is_free_point()) return &usual_depth_;
  return &usual_depth_of_fixed_;
}

bool Window::can_evaluate(const WindowPoint& point, const WindowObservation& o) const {
  return o.factor == nullptr || residual_of(point, o, point.landmark).has_value();
}

// A picture is nearly linear in the inverse depth: what it moves by from there to infinity, in sigmas, is lambda/sigma.
bool Window::tells_depth(const WindowPoint& point) const {
  if (!(point.landmark.z() > 0.0)) return false;
  const Eigen::Vector3d at_infinity(point.landmark.x(), point.landmark.y(), 0.0);
  double squares = 0.0;
  for (const WindowObservation& o : point.observations) {
    if (o.factor == nullptr) continue;
    const auto here = residual_of(point, o, point.landmark);
    const auto there = residual_of(point, o, at_infinity);
    if (here && there) squares += (*there - *here).squaredNorm();
  }
  const double limit = 1.0 / config_.window.largest_depth_sigma;
  return squares > limit * limit;
}

// False where one of them cannot be evaluated.
bool Window::make_factors(WindowPoint& point) {
  for (WindowObservation& o : point.observations) {
    const bool taken_as_exact = !is_free_point() && o.frame == point.anchor;
    o.factor = taken_as_exact ? nullptr : make_factor(point, o);
    if (!can_evaluate(point, o)) return false;
  }
  return true;
}

void Window::triangulate() {
  for (auto& [id, point] : points_) {
    if (point.has_value || point.observations.size() < 2) continue;
    std::vector<View> views;
    for (const WindowObservation& o : point.observations) {
      views.push_back({camera_pose(*o.frame, o.pixel.y()), o.pixel});
    }
    // Of so many at once some may be wrong, and would take the point out of reach of the rest.
    constexpr std::size_t kMany = 6;
    const auto agreed =
        views.size() < kMany
            ? std::nullopt
            : triangulate_agreeing(camera(), views, config_.window.outlier_sigma * noise_.pixel_sigma_px);
    point.landmark = agreed ? *agreed : estimator::triangulate(camera(), views);
    point.anchor = point.observations.front().frame;
    point.T_B_A = unpack_pose(extrinsics_.data());
    if (is_free_point()) {
      const auto moved =
          change_anchor(point.landmark, views.front().T_W_C, unpack_pose(point.anchor->x.data()) * point.T_B_A);
      if (!moved) continue;
      point.landmark = moved->landmark;
    }
    point.has_value = make_factors(point);
  }
  for (auto& [id, point] : points_) {
    if (point.has_value && !point.depth_is_known) point.depth_is_known = tells_depth(point);
  }
  const LineStartRules rules{.sigma_px = noise_.line_sigma_px,
                             .largest_depth_sigma = config_.lines.largest_depth_sigma};
  for (auto& [id, line] : lines_) {
    if (line.value || line.observations.size() < 3) continue;
    std::vector<SegmentView> views;
    for (const WindowLineObservation& o : line.observations) {
      views.push_back({View{camera_pose(*o.frame, o.ends_px[0].y()), o.ends_px[0]},
                       View{camera_pose(*o.frame, o.ends_px[1].y()), o.ends_px[1]}});
    }
    const TriangulatedLine start = triangulate_line(camera(), views, rules);
    if (!start.line) continue;
    line.value = LineValue{start.origin_W, *start.line};
    for (WindowLineObservation& o : line.observations) {
      o.factor = make_line_factor(line_model_, {o.frame->timing, o.ends_px, o.velocities}, start.origin_W);
    }
  }
}

void Window::remove_frame(std::size_t i) {
  const WindowFrame* frame = frames_[i].get();
  for (auto& [id, point] : points_) {
    std::erase_if(point.observations, [&](const WindowObservation& o) { return o.frame == frame; });
  }
  for (auto& [id, line] : lines_) {
    std::erase_if(line.observations, [&](const WindowLineObservation& o) { return o.frame == frame; });
  }
  std::erase_if(points_, [](const auto& entry) { return entry.second.observations.empty() && !entry.second.in_prior; });
  std::erase_if(lines_, [](const auto& entry) { return entry.second.observations.empty(); });
  frames_.erase(frames_.begin() + static_cast<std::ptrdiff_t>(i));
}

void Window::retime(double td_s) {
  if (folded()) return;
  timing_td_s_ = td_s;
  for (std::size_t i = 1; i < frames_.size();) {
    WindowFrame& frame = *frames_[i];
    const std::size_t sample = nearest_sample(log_.imu, td_s, log_.frames[*frame.frame].t_cam_ns);
    if (sample <= frames_[i - 1]->sample) {
      remove_frame(i);
      continue;
    }
    const core::State state = carry(unpack_state(frame.x.data()), log_.imu, frame.sample, sample, log_.gravity_m_s2);
    frame.sample = sample;
    frame.x = pack(state);
    frame.timing = timing_of(frame, state.bias);
    ++i;
  }
  for (std::size_t i = 1; i < frames_.size(); ++i) make_inertial(i);
  for (auto& [id, point] : points_) point.has_value = point.depth_is_known = false;
  for (auto& [id, line] : lines_) line.value.reset();
  triangulate();
}

std::optional<double> Window::parallax_of_newest_px() const {
  const WindowFrame* const newest = frames_.back().get();
  const WindowFrame* const before = frames_[frames_.size() - 2].get();
  const auto rotation = [&](const WindowFrame& frame, double row_px) {
    return Eigen::Quaterniond(camera_pose(frame, row_px).q);
  };
  const core::PinholeCamera model = camera();
  std::vector<double> moved;
  for (const auto& [id, point] : points_) {
    const std::size_t n = point.observations.size();
    if (n < 2 || point.observations[n - 1].frame != newest || point.observations[n - 2].frame != before) continue;
    const Eigen::Vector2d& from = point.observations[n - 2].pixel;
    const Eigen::Vector2d& to = point.observations[n - 1].pixel;
    const Eigen::Vector3d ray =
        rotation(*newest, to.y()).conjugate() * (rotation(*before, from.y()) * model.unproject(from));
    if (const auto turned = model.project(ray)) moved.push_back((to - *turned).squaredNorm());
  }
  if (moved.empty()) return std::nullopt;
  const auto middle = moved.begin() + static_cast<std::ptrdiff_t>(moved.size() / 2);
  std::nth_element(moved.begin(), middle, moved.end());
  // Of the noise of two pixels alone the median is 4 ln 2 sigma^2.
  const double noise2 = 4.0 * std::numbers::ln2 * noise_.pixel_sigma_px * noise_.pixel_sigma_px;
  return std::sqrt(std::max(0.0, *middle - noise2));
}

int Window::observations_of_newest() const {
  int n = 0;
  for (const auto& [id, point] : points_) {
    if (point.has_value && !point.observations.empty() && point.observations.back().frame == frames_.back().get()) ++n;
  }
  for (const auto& [id, line] : lines_) {
    if (line.value && !line.observations.empty() && line.observations.back().frame == frames_.back().get()) ++n;
  }
  return n;
}

}  // namespace plumbline::estimator
