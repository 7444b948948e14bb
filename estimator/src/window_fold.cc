// The oldest state leaves the window, and with it the landmarks that are tied to it: all that was measured of them is
// linearised at the present values and becomes the prior of what stays, in the coordinates of invariant_chart.h.
#include <algorithm>
#include <stdexcept>

#include <Eigen/Cholesky>

#include "estimator/factors/anchored_point.h"
#include "estimator/invariant_chart.h"
#include "estimator/schur_system.h"
#include "estimator/window.h"
#include "window_built.h"

namespace plumbline::estimator {
namespace {

// What no measurement tells of a point that enters the prior must have some information all the same, so that it can
// leave again: so little that nothing depends on it, standard deviations of 100 in its bearing and of 10 1/m.
const Eigen::Vector3d kPointFloor(1e-4, 1e-4, 1e-2);

// H <- M^T H M, g <- M^T g for the columns of one point.
void change_columns(int column, const Eigen::Matrix3d& M, Eigen::MatrixXd& H, Eigen::VectorXd& g) {
  H.middleCols<3>(column) = (H.middleCols<3>(column) * M).eval();
  H.middleRows<3>(column) = (M.transpose() * H.middleRows<3>(column)).eval();
  g.segment<3>(column) = (M.transpose() * g.segment<3>(column)).eval();
}

// The block at `from` depends on that at `on` too: d_from = ... + J d_on.
void add_dependence(int from, int on, const Eigen::MatrixXd& J, Eigen::MatrixXd& H, Eigen::VectorXd& g) {
  H.middleCols(on, J.cols()) += H.middleCols(from, J.rows()) * J;
  H.middleRows(on, J.cols()) += J.transpose() * H.middleRows(from, J.rows());
  g.segment(on, J.cols()) += J.transpose() * g.segment(from, J.rows());
}

// The first m unknowns, by Schur complement.
void eliminate_first(int m, Eigen::MatrixXd& H, Eigen::VectorXd& g) {
  const Eigen::Index n = H.rows() - m;
  const Eigen::LLT<Eigen::MatrixXd> llt(H.topLeftCorner(m, m));
  if (llt.info() != Eigen::Success) throw std::domain_error("fold: what leaves is not determined");
  const Eigen::MatrixXd Y = llt.matrixL().solve(H.topRightCorner(m, n));  // H11 = L L^T, Y = L^-1 H12
  const Eigen::VectorXd y = llt.matrixL().solve(g.head(m));
  H.bottomRightCorner(n, n).selfadjointView<Eigen::Lower>().rankUpdate(Y.transpose(), -1.0);
  g.tail(n).noalias() -= Y.transpose() * y;
  H = H.bottomRightCorner(n, n).eval();
  g = g.tail(n).eval();
}

}  // namespace

void Window::fold_oldest() {
  WindowFrame* const leaving = frames_.front().get();
  WindowFrame* const newest = frames_.back().get();
  const core::Pose T_B_C = unpack_pose(extrinsics_.data());
  const core::Pose T_W_A_new = unpack_pose(newest->x.data()) * T_B_C;

  // What becomes of each point.
  struct Move {
    WindowPoint* point;
    AnchorChange change;
  };
  std::vector<Move> moves;                  // tied to the newest state from now on
  std::vector<WindowPoint*> leaving_prior;  // known to the prior
  std::vector<std::int64_t> leaving_ids;
  std::vector<WindowPoint*> consumed;
  int room = config_.window.kept_points;
  for (const auto& [id, point] : points_) room -= point.in_prior ? 1 : 0;
  struct Candidate {
    std::size_t seen;
    std::int64_t id;
    WindowPoint* point;
  };
  std::vector<Candidate> candidates;
  for (auto& [id, point] : points_) {
    if (!point.has_value || point.anchor != leaving) continue;
    const bool seen = !point.observations.empty() && point.observations.back().frame == newest;
    if (!point.depth_is_known && !tells_depth(point)) {
      leaving_ids.push_back(id);
      continue;
    }
    if (seen && is_free_point()) {
      const auto change = change_anchor(point.landmark, unpack_pose(leaving->x.data()) * point.T_B_A, T_W_A_new);
      if (change && point.in_prior) {
        moves.push_back({&point, *change});
        continue;
      }
      if (change) {
        candidates.push_back({point.observations.size(), id, &point});
        continue;
      }
    }
    if (point.in_prior) {
      leaving_prior.push_back(&point);
      ++room;
    } else {
      consumed.push_back(&point);
    }
    leaving_ids.push_back(id);
  }
  // Those that have been seen longest, since they will be seen longest.
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.seen > b.seen; });
  for (const Candidate& candidate : candidates) {
    WindowPoint& point = *candidate.point;
    if (room > 0) {
      --room;
      moves.push_back(
          {&point, *change_anchor(point.landmark, unpack_pose(leaving->x.data()) * point.T_B_A, T_W_A_new)});
    } else {
      consumed.push_back(&point);
      leaving_ids.push_back(candidate.id);
    }
  }

  // All that is said of what leaves. First the columns that leave, then those of points, states and calibration.
  Built built;
  built.add(leaving->x.data(), kStateSize, core::kStateDof, &state_manifold_);
  for (WindowPoint* point : leaving_prior) built.add(point->landmark.data(), kLandmarkSize, kLandmarkSize, nullptr);
  const auto is_leaving = [&](const WindowPoint* point) {
    return std::find(leaving_prior.begin(), leaving_prior.end(), point) != leaving_prior.end();
  };
  const auto is_moving = [&](const WindowPoint* point) {
    return std::any_of(moves.begin(), moves.end(), [&](const Move& move) { return move.point == point; });
  };
  for (auto& [id, point] : points_) {
    if ((point.in_prior && !is_leaving(&point)) || (!point.in_prior && is_moving(&point))) {
      built.add(point.landmark.data(), kLandmarkSize, kLandmarkSize, nullptr);
    }
  }
  for (std::size_t i = 1; i < frames_.size(); ++i) {
    built.add(frames_[i]->x.data(), kStateSize, core::kStateDof, &state_manifold_);
  }
  add_calibration(built);
  const std::size_t end = built.problem.blocks.size();
  for (WindowPoint* point : consumed) add_point_terms(*point, built);
  std::vector<WindowLine*> leaving_lines;
  for (auto& [id, line] : lines_) {
    if (line.observations.empty() || line.observations.front().frame != leaving) continue;
    leaving_lines.push_back(&line);
    add_line_terms(line, built);
  }
  for (WindowPoint* point : leaving_prior) add_point_terms(*point, built);
  for (auto& [id, point] : points_) {
    const bool stays = point.in_prior ? !is_leaving(&point) : is_moving(&point);
    if (stays) add_point_terms(point, built, leaving);
  }
  add_inertial_term(1, built);
  if (prior_ == nullptr) {
    for (const InitialTerm& initial : initial_) {
      ResidualTerm term{.factor = initial.factor.get(), .count = 1};
      term.blocks = {built.of(initial.block)};
      built.problem.terms.push_back(term);
    }
  }

  SchurSystem system(built.problem);
  if (!system.build(0.0)) throw std::domain_error("fold: a factor cannot be evaluated");
  const Eigen::MatrixXd lower = system.H();
  Eigen::MatrixXd H = lower.selfadjointView<Eigen::Lower>();
  Eigen::VectorXd g = system.g();
  const auto column_of = [&](const double* values) { return system.column(built.of(values)); };
  for (const auto& frame : frames_) {
    change_chart(column_of(frame->x.data()), from_invariant(unpack_state(frame->x.data())), H, g);
  }
  // Blocks that neither a term nor the prior speaks of stay out of the new prior.
  std::vector<bool> involved(end, false);
  for (const ResidualTerm& term : built.problem.terms) {
    for (int b = 0; b < term.count; ++b) {
      const auto block = static_cast<std::size_t>(term.blocks[static_cast<std::size_t>(b)]);
      if (block < end) involved[block] = true;
    }
  }
  if (!moves.empty()) involved[static_cast<std::size_t>(built.of(newest->x.data()))] = true;
  std::vector<bool> in_prior(end, false);
  if (prior_ != nullptr) {
    std::vector<const double*> parameters(prior_values_.begin(), prior_values_.end());
    const Eigen::VectorXd gradient = prior_->gradient_at(prior_->difference(parameters.data()));
    const Eigen::MatrixXd& information = prior_->information;
    for (std::size_t i = 0; i < prior_values_.size(); ++i) {
      const MarginalPrior::Part& a = prior_->parts[i];
      const int column_a = column_of(prior_values_[i]);
      in_prior[static_cast<std::size_t>(built.of(prior_values_[i]))] = true;
      g.segment(column_a, a.dof()) += gradient.segment(a.column, a.dof());
      for (std::size_t j = 0; j < prior_values_.size(); ++j) {
        const MarginalPrior::Part& b = prior_->parts[j];
        H.block(column_a, column_of(prior_values_[j]), a.dof(), b.dof()) +=
            information.block(a.column, b.column, a.dof(), b.dof());
      }
    }
  }
  for (std::size_t b = 0; b < end; ++b) {
    const ParameterBlock& block = built.problem.blocks[b];
    const int column = system.column(static_cast<int>(b));
    if (in_prior[b] || !involved[b] || b == 0) continue;
    if (block.size == kLandmarkSize) H.diagonal().segment<kLandmarkSize>(column) += kPointFloor;
  }
  for (const Move& move : moves) {
    const int column = column_of(move.point->landmark.data());
    // The pose's six columns come first in a state.
    add_dependence(column, column_of(newest->x.data()), move.change.J_relative, H, g);
    add_dependence(column, column_of(leaving->x.data()), -move.change.J_relative, H, g);
    change_columns(column, move.change.J_new, H, g);
  }
  const int leaving_columns = core::kStateDof + kLandmarkSize * static_cast<int>(leaving_prior.size());
  eliminate_first(leaving_columns, H, g);

  // The new values, so that the prior is about them.
  for (const Move& move : moves) {
    WindowPoint& point = *move.point;
    point.depth_is_known = true;
    point.landmark = move.change.landmark;
    point.anchor = newest;
    point.T_B_A = T_B_C;
    point.in_prior = true;
  }
  std::vector<MarginalPrior::Part> parts;
  std::vector<int> columns;  // of H that stay
  prior_values_.clear();
  for (std::size_t b = 1 + leaving_prior.size(); b < end; ++b) {
    const ParameterBlock& block = built.problem.blocks[b];
    if (block.constant || !(involved[b] || in_prior[b])) continue;
    MarginalPrior::Part part{.column = static_cast<int>(columns.size()),
                             .x0 = Eigen::Map<const Eigen::VectorXd>(block.values, block.size)};
    if (block.size == kStateSize) part.kind = MarginalPrior::Kind::kState;
    if (block.size == kPoseSize) part.kind = MarginalPrior::Kind::kPose;
    for (int c = 0; c < block.dof; ++c) {
      columns.push_back(system.column(static_cast<int>(b)) - leaving_columns + c);
    }
    parts.push_back(std::move(part));
    prior_values_.push_back(block.values);
  }
  if (static_cast<Eigen::Index>(columns.size()) < H.cols()) {
    H = H(columns, columns).eval();
    g = g(columns).eval();
  }
  // What rounding leaves of the directions that nothing is known of, in the gradient too, stays without weight.
  constexpr double kRounding = 1e-12;
  H.diagonal() *= 1.0 + kRounding;
  prior_ =
      std::make_unique<MarginalPrior>(MarginalPrior{std::move(parts), H.selfadjointView<Eigen::Lower>(), std::move(g)});
  initial_.clear();

  for (const std::int64_t id : leaving_ids) points_.erase(id);
  std::erase_if(lines_, [&](const auto& entry) {
    return std::find(leaving_lines.begin(), leaving_lines.end(), &entry.second) != leaving_lines.end() &&
           entry.second.value.has_value();
  });
  remove_frame(0);
  for (const Move& move : moves) make_factors(*move.point);
}

}  // namespace plumbline::estimator
