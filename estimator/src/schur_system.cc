#include "estimator/schur_system.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "estimator/factors/orthonormal_line.h"
#include "estimator/factors/parameter_blocks.h"
#include "estimator/invariant_chart.h"
#include "estimator/outer_products.h"

namespace plumbline::estimator {
namespace {

constexpr int kMaxRows = core::kStateDof;
constexpr int kMaxWidth = 2 * 6 * kMostControls + 12;  // the controls of two segments and the calibration

bool has_rotation(const ParameterBlock& block) { return block.size == kStateSize || block.size == kPoseSize; }

}  // namespace

struct SchurSystem::Rows {
  // Columns that follow each other.
  struct Run {
    int column;
    int width;
    int offset;  // in J
  };
  int rows = 0;
  Eigen::Matrix<double, kMaxRows, 1> r;
  int runs = 0;
  std::array<Run, kMostBlocks> run;
  int width = 0;
  std::array<double, kMaxRows * kMaxWidth> J;  // rows x kMaxWidth, row-major
  int landmark = -1;                           // block
  std::array<double, 2 * kLineDof> E;          // 2 x its dof, row-major
  double cost = 0.0;

  RowBlock of(const Run& part) const { return {J.data() + part.offset, rows, kMaxWidth, part.width}; }
};

SchurSystem::SchurSystem(const LeastSquares& problem) : problem_(problem), layout_(problem.blocks.size()) { lay_out(); }

// What is shared is the border; every other block reaches down to the last that a landmark, a term or the prior joins
// it with.
void SchurSystem::lay_out() {
  int columns = 0;
  int banded = 0;
  for (std::size_t i = 0; i < problem_.blocks.size(); ++i) {
    const ParameterBlock& block = problem_.blocks[i];
    if (block.eliminated) continue;
    layout_[i].column = columns;
    columns += block.dof;
    if (static_cast<int>(i) < problem_.first_shared) banded = columns;
  }
  std::vector<int> reach(static_cast<std::size_t>(banded));
  std::vector<int> group;  // blocks
  const auto join = [&](int landmark) {
    int first = banded;
    int end = 0;
    for (const int b : group) {
      const int column = layout_[static_cast<std::size_t>(b)].column;
      if (column < 0 || column >= banded) continue;
      first = std::min(first, column);
      end = std::max(end, column + problem_.blocks[static_cast<std::size_t>(b)].dof);
    }
    group.clear();
    if (first >= end) return;
    reach[static_cast<std::size_t>(first)] = std::max(reach[static_cast<std::size_t>(first)], end);
    if (landmark < 0) return;
    layout_[static_cast<std::size_t>(landmark)].first = first;
    layout_[static_cast<std::size_t>(landmark)].end = end;
  };
  int landmark = -1;
  for (const ResidualTerm& term : problem_.terms) {
    const int of = eliminated_block(problem_, term);
    if (of < 0 || of != landmark) join(landmark);
    landmark = of;
    group.insert(group.end(), term.blocks.begin(), term.blocks.begin() + term.count);
  }
  join(landmark);
  group = problem_.prior_blocks;
  join(-1);
  H_ = BorderedBand(std::move(reach), columns - banded);
  std::size_t couplings = 0;
  for (std::size_t i = 0; i < problem_.blocks.size(); ++i) {
    if (!problem_.blocks[i].eliminated) continue;
    Layout& layout = layout_[i];
    layout.coupling = couplings;
    couplings += static_cast<std::size_t>(problem_.blocks[i].dof * (layout.end - layout.first + H_.border()));
  }
  couplings_.resize(couplings);
}

bool SchurSystem::evaluate(const ResidualTerm& term, Rows& rows) const {
  const int m = rows.rows = term.factor->num_residuals();
  rows.landmark = -1;
  rows.runs = rows.width = 0;
  std::array<const double*, kMostBlocks> parameters = {};
  std::array<double*, kMostBlocks> jacobians = {};
  std::array<std::array<double, kMaxRows * kStateSize>, kMostBlocks> ambient;
  for (int b = 0; b < term.count; ++b) {
    const auto i = static_cast<std::size_t>(b);
    const ParameterBlock& block = problem_.blocks[static_cast<std::size_t>(term.blocks[i])];
    parameters[i] = block.values;
    jacobians[i] = block.constant ? nullptr : ambient[i].data();
  }
  if (!term.factor->Evaluate(parameters.data(), rows.r.data(), jacobians.data())) return false;
  double scale = 1.0;
  const double squares = rows.r.head(m).squaredNorm();
  rows.cost = 0.5 * squares;
  if (term.loss != nullptr) {
    std::array<double, 3> rho;
    term.loss->Evaluate(squares, rho.data());
    rows.cost = 0.5 * rho[0];
    scale = std::sqrt(rho[1]);
    rows.r.head(m) *= scale;
  }
  for (int b = 0; b < term.count; ++b) {
    const auto i = static_cast<std::size_t>(b);
    const ParameterBlock& block = problem_.blocks[static_cast<std::size_t>(term.blocks[i])];
    const Layout& layout = layout_[static_cast<std::size_t>(term.blocks[i])];
    double* target = rows.E.data();
    int stride = block.dof;
    if (block.eliminated) {
      rows.landmark = term.blocks[i];
    } else {
      target = rows.J.data() + rows.width;
      stride = kMaxWidth;
      Rows::Run* const last = rows.runs > 0 ? &rows.run[static_cast<std::size_t>(rows.runs - 1)] : nullptr;
      if (last != nullptr && last->column + last->width == layout.column && layout.column != H_.banded()) {
        last->width += block.dof;
      } else {
        rows.run[static_cast<std::size_t>(rows.runs++)] = {layout.column, block.dof, rows.width};
      }
      rows.width += block.dof;
    }
    for (int row = 0; row < m; ++row) {
      const double* in = ambient[i].data() + row * block.size;
      double* out = target + row * stride;
      if (block.constant) {
        std::fill_n(out, block.dof, 0.0);
      } else if (has_rotation(block)) {
        for (int c = 0; c < 3; ++c) out[c] = scale * in[c];
        for (int c = 0; c < 3; ++c) {
          out[3 + c] = scale * (in[3] * layout.plus(0, c) + in[4] * layout.plus(1, c) + in[5] * layout.plus(2, c) +
                                in[6] * layout.plus(3, c));
        }
        for (int c = 7; c < block.size; ++c) out[c - 1] = scale * in[c];
      } else if (block.manifold == nullptr) {
        for (int c = 0; c < block.size; ++c) out[c] = scale * in[c];
      } else {
        block.manifold->RightMultiplyByPlusJacobian(block.values, 1, in, out);
        for (int c = 0; c < block.dof; ++c) out[c] *= scale;
      }
    }
  }
  return true;
}

void SchurSystem::add_dense(const Rows& rows) {
  for (int s = 0; s < rows.runs; ++s) {
    const Rows::Run& a = rows.run[static_cast<std::size_t>(s)];
    const RowBlock J_a = rows.of(a);
    for (int k = 0; k < rows.rows; ++k) {
      const double r = rows.r[k];
      for (int c = 0; c < a.width; ++c) g_[a.column + c] += J_a.data[k * kMaxWidth + c] * r;
    }
    for (int t = 0; t < rows.runs; ++t) {
      const Rows::Run& b = rows.run[static_cast<std::size_t>(t)];
      if (b.column > a.column) continue;
      add_outer_products(J_a, rows.of(b), 1.0, H_.at(a.column, b.column), H_.stride(a.column), s == t);
    }
  }
}

int SchurSystem::width(const Landmark& landmark) const {
  const Layout& layout = layout_[static_cast<std::size_t>(landmark.block)];
  return layout.end - layout.first + H_.border();
}

void SchurSystem::begin_landmark(int block) {
  Landmark& landmark = landmarks_.emplace_back();
  landmark.block = block;
  landmark.dof = problem_.blocks[static_cast<std::size_t>(block)].dof;
  landmark.coupling = couplings_.data() + layout_[static_cast<std::size_t>(block)].coupling;
  landmark.V.setZero();
  landmark.h.setZero();
  std::fill_n(landmark.coupling, landmark.dof * width(landmark), 0.0);
}

void SchurSystem::add_to_landmark(const Rows& rows) {
  Landmark& landmark = landmarks_.back();
  const Layout& layout = layout_[static_cast<std::size_t>(landmark.block)];
  const RowBlock E{rows.E.data(), 2, landmark.dof, landmark.dof};
  add_outer_products(E, E, 1.0, landmark.V.data(), 4, true);
  for (int d = 0; d < landmark.dof; ++d) {
    landmark.h[d] += E.data[d] * rows.r[0] + E.data[landmark.dof + d] * rows.r[1];
  }
  for (int s = 0; s < rows.runs; ++s) {
    const Rows::Run& run = rows.run[static_cast<std::size_t>(s)];
    const int at =
        run.column < H_.banded() ? run.column - layout.first : layout.end - layout.first + run.column - H_.banded();
    add_outer_products(rows.of(run), E, 1.0, landmark.coupling + at, width(landmark));
  }
}

bool SchurSystem::eliminate_landmark(double damping) {
  Landmark& landmark = landmarks_.back();
  const ParameterBlock& block = problem_.blocks[static_cast<std::size_t>(landmark.block)];
  const int dof = landmark.dof;
  Eigen::Matrix4d& L = landmark.V;
  L.diagonal().head(dof) *= 1.0 + damping + block.share_of_information;
  L(dof - 1, dof - 1) += block.last_information;
  const int n = width(landmark);
  double* const Z = landmark.coupling;
  Eigen::Vector4d& y = landmark.h;
  // Cholesky, with both substitutions on the way.
  for (int k = 0; k < dof; ++k) {
    double d = L(k, k);
    for (int j = 0; j < k; ++j) d -= L(k, j) * L(k, j);
    if (!(d > 0.0)) return false;
    L(k, k) = std::sqrt(d);
    const double inverse = 1.0 / L(k, k);
    for (int i = k + 1; i < dof; ++i) {
      double e = L(i, k);
      for (int j = 0; j < k; ++j) e -= L(i, j) * L(k, j);
      L(i, k) = e * inverse;
    }
    Eigen::Map<Eigen::VectorXd> z(Z + k * n, n);
    for (int j = 0; j < k; ++j) {
      z -= L(k, j) * Eigen::Map<const Eigen::VectorXd>(Z + j * n, n);
      y[k] -= L(k, j) * y[j];
    }
    z *= inverse;
    y[k] *= inverse;
  }
  const Layout& layout = layout_[static_cast<std::size_t>(landmark.block)];
  const int length = layout.end - layout.first;
  const RowBlock band{Z, dof, n, length};
  const RowBlock border{Z + length, dof, n, H_.border()};
  const int first = layout.first;
  if (length > 0) {
    add_outer_products(band, band, -1.0, H_.at(first, first), H_.stride(first), true);
    add_outer_products(border, band, -1.0, H_.at(H_.banded(), first), H_.stride(H_.banded()));
  }
  add_outer_products(border, border, -1.0, H_.at(H_.banded(), H_.banded()), H_.stride(H_.banded()), true);
  for (int k = 0; k < dof; ++k) {
    const Eigen::Map<const Eigen::VectorXd> z(Z + k * n, n);
    g_.segment(first, length) -= y[k] * z.head(length);
    g_.tail(H_.border()) -= y[k] * z.tail(H_.border());
  }
  return true;
}

void SchurSystem::add_prior() {
  const MarginalPrior& prior = *problem_.prior;
  std::vector<const double*> parameters;
  for (const int b : problem_.prior_blocks) parameters.push_back(problem_.blocks[static_cast<std::size_t>(b)].values);
  const Eigen::VectorXd xi = prior.difference(parameters.data());
  cost_ += prior.cost(xi);
  Eigen::VectorXd gradient = prior.gradient_at(xi);
  Eigen::MatrixXd information = prior.information;
  for (std::size_t i = 0; i < prior.parts.size(); ++i) {
    const MarginalPrior::Part& part = prior.parts[i];
    if (part.kind == MarginalPrior::Kind::kState) {
      const core::StateTangent of_state = xi.segment<core::kStateDof>(part.column);
      change_chart(part.column, invariant_difference_jacobian(unpack_state(parameters[i]), of_state), information,
                   gradient);
    } else if (part.kind == MarginalPrior::Kind::kPose) {
      const int rotation = part.column + 3;
      const Eigen::Matrix3d J = core::right_jacobian_inverse(xi.segment<3>(rotation));
      information.middleCols<3>(rotation) = (information.middleCols<3>(rotation) * J).eval();
      information.middleRows<3>(rotation) = (J.transpose() * information.middleRows<3>(rotation)).eval();
      gradient.segment<3>(rotation) = (J.transpose() * gradient.segment<3>(rotation)).eval();
    }
  }
  for (std::size_t i = 0; i < prior.parts.size(); ++i) {
    const MarginalPrior::Part& a = prior.parts[i];
    const int block_a = problem_.prior_blocks[i];
    if (problem_.blocks[static_cast<std::size_t>(block_a)].constant) continue;
    const int column_a = column(block_a);
    g_.segment(column_a, a.dof()) += gradient.segment(a.column, a.dof());
    for (std::size_t j = 0; j < prior.parts.size(); ++j) {
      const MarginalPrior::Part& b = prior.parts[j];
      const int block_b = problem_.prior_blocks[j];
      const int column_b = column(block_b);
      if (column_b > column_a || problem_.blocks[static_cast<std::size_t>(block_b)].constant) continue;
      H_.block(column_a, column_b, a.dof(), b.dof()) += information.block(a.column, b.column, a.dof(), b.dof());
    }
  }
}

bool SchurSystem::build(double damping) {
  H_.set_zero();
  g_.setZero(columns());
  cost_ = 0.0;
  damping_ = damping;
  solved_ = false;
  landmarks_.clear();
  for (std::size_t i = 0; i < problem_.blocks.size(); ++i) {
    const ParameterBlock& block = problem_.blocks[i];
    if (has_rotation(block)) {
      layout_[i].plus = core::plus_jacobian(Eigen::Quaterniond(Eigen::Map<const Eigen::Quaterniond>(block.values + 3)));
    }
  }
  Rows rows;
  int landmark = -1;
  for (const ResidualTerm& term : problem_.terms) {
    if (!evaluate(term, rows)) return false;
    cost_ += rows.cost;
    if (rows.landmark != landmark) {
      if (landmark >= 0 && !eliminate_landmark(damping)) return false;
      landmark = rows.landmark;
      if (landmark >= 0) begin_landmark(landmark);
    }
    add_dense(rows);
    if (landmark >= 0) add_to_landmark(rows);
  }
  if (landmark >= 0 && !eliminate_landmark(damping)) return false;
  if (problem_.prior != nullptr) add_prior();
  for (int i = 0; i < columns(); ++i) *H_.at(i, i) *= 1.0 + damping;
  for (std::size_t i = 0; i < problem_.blocks.size(); ++i) {
    const ParameterBlock& block = problem_.blocks[i];
    if (block.eliminated || !block.constant) continue;
    for (int c = 0; c < block.dof; ++c) *H_.at(layout_[i].column + c, layout_[i].column + c) = 1.0;
  }
  return std::isfinite(cost_);
}

std::optional<double> SchurSystem::solve() {
  if (!H_.factor()) return std::nullopt;
  solved_ = true;
  step_ = -g_;
  H_.solve_lower(step_);
  double length2 = step_.squaredNorm();
  H_.solve_upper(step_);
  for (const Landmark& landmark : landmarks_) length2 += landmark.h.head(landmark.dof).squaredNorm();
  return length2;
}

void SchurSystem::apply_step() const {
  const auto move = [](const ParameterBlock& block, const double* delta) {
    if (block.manifold == nullptr) {
      for (int i = 0; i < block.size; ++i) block.values[i] += delta[i];
      return;
    }
    std::array<double, kStateSize> moved;
    block.manifold->Plus(block.values, delta, moved.data());
    std::copy_n(moved.begin(), block.size, block.values);
  };
  for (const Landmark& landmark : landmarks_) {
    const Layout& layout = layout_[static_cast<std::size_t>(landmark.block)];
    const int length = layout.end - layout.first;
    const int n = width(landmark);
    Eigen::Vector4d delta = -landmark.h;
    for (int k = 0; k < landmark.dof; ++k) {
      const Eigen::Map<const Eigen::VectorXd> z(landmark.coupling + k * n, n);
      delta[k] -=
          z.head(length).dot(step_.segment(layout.first, length)) + z.tail(H_.border()).dot(step_.tail(H_.border()));
    }
    for (int k = landmark.dof - 1; k >= 0; --k) {
      for (int j = k + 1; j < landmark.dof; ++j) delta[k] -= landmark.V(j, k) * delta[j];
      delta[k] /= landmark.V(k, k);
    }
    move(problem_.blocks[static_cast<std::size_t>(landmark.block)], delta.data());
  }
  for (std::size_t i = 0; i < problem_.blocks.size(); ++i) {
    const ParameterBlock& block = problem_.blocks[i];
    if (block.eliminated || block.constant) continue;
    move(block, step_.data() + layout_[i].column);
  }
}

}  // namespace plumbline::estimator
