#include "estimator/schur_system.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Cholesky>

#include "estimator/dense_cholesky.h"
#include "estimator/factors/orthonormal_line.h"
#include "estimator/factors/parameter_blocks.h"
#include "estimator/invariant_chart.h"

namespace plumbline::estimator {
namespace {

constexpr int kMaxRows = core::kStateDof;
constexpr int kMaxWidth = core::kStateDof;
constexpr int kMaxSpans = 4;  // of a term
constexpr int kMaxBlocks = 6;
constexpr int kCalibrationDof = 8;

template <int kRows, int kCols>
using RowMajor = Eigen::Matrix<double, kRows, kCols, kCols == 1 ? Eigen::ColMajor : Eigen::RowMajor>;

// H[a, b] += A^T B
template <int kRows, int kA, int kB>
void add_product(const double* A, const double* B, int rows, int a, int b, Eigen::MatrixXd& H) {
  const Eigen::Map<const RowMajor<kRows, kA>> J_a(A, rows, kA);
  const Eigen::Map<const RowMajor<kRows, kB>> J_b(B, rows, kB);
  H.block<kA, kB>(a, b).noalias() += J_a.transpose().lazyProduct(J_b);
}

template <int kRows, int kA>
void add_product_with(const double* A, const double* B, int rows, int a, int b, int width_b, Eigen::MatrixXd& H) {
  switch (width_b) {
    case kLandmarkSize:
      return add_product<kRows, kA, kLandmarkSize>(A, B, rows, a, b, H);
    case kCalibrationDof:
      return add_product<kRows, kA, kCalibrationDof>(A, B, rows, a, b, H);
    case core::kStateDof:
      return add_product<kRows, kA, core::kStateDof>(A, B, rows, a, b, H);
  }
  throw std::logic_error("SchurSystem: a span of unknown width");
}

template <int kRows>
void add_product_of(const double* A, const double* B, int rows, int a, int b, int width_a, int width_b,
                    Eigen::MatrixXd& H) {
  switch (width_a) {
    case kLandmarkSize:
      return add_product_with<kRows, kLandmarkSize>(A, B, rows, a, b, width_b, H);
    case kCalibrationDof:
      return add_product_with<kRows, kCalibrationDof>(A, B, rows, a, b, width_b, H);
    case core::kStateDof:
      return add_product_with<kRows, core::kStateDof>(A, B, rows, a, b, width_b, H);
  }
  throw std::logic_error("SchurSystem: a span of unknown width");
}

bool has_rotation(const ParameterBlock& block) { return block.size == kStateSize || block.size == kPoseSize; }

}  // namespace

struct SchurSystem::Rows {
  int rows = 0;
  Eigen::Matrix<double, kMaxRows, 1> r;
  int spans = 0;
  std::array<int, kMaxSpans> span = {};
  std::array<std::array<double, kMaxRows * kMaxWidth>, kMaxSpans> J;  // rows x width, row-major
  int eliminated = -1;                                                // block
  int dof = 0;                                                        // of it
  std::array<double, 2 * kLineDof> E;
  double cost = 0.0;

  // The derivatives with respect to a span, zero at first.
  double* of(int wanted, int width) {
    for (int i = 0; i < spans; ++i) {
      if (span[static_cast<std::size_t>(i)] == wanted) return J[static_cast<std::size_t>(i)].data();
    }
    const auto i = static_cast<std::size_t>(spans++);
    span[i] = wanted;
    std::fill_n(J[i].begin(), rows * width, 0.0);
    return J[i].data();
  }
};

struct SchurSystem::Landmark {
  int block = -1;
  int dof = 0;
  Eigen::Matrix4d V;
  Eigen::Vector4d h;
  std::vector<int> spans;
  std::vector<Eigen::Matrix<double, 4, kMaxWidth>> W;

  void begin(int of_block, int of_dof) {
    block = of_block;
    dof = of_dof;
    V.setZero();
    h.setZero();
    spans.clear();
    W.clear();
  }

  template <int kDof, int kWidth>
  void add_coupling(std::size_t i, const double* E, const double* J) {
    const Eigen::Map<const RowMajor<2, kDof>> E_map(E);
    const Eigen::Map<const RowMajor<2, kWidth>> J_map(J);
    W[i].template topLeftCorner<kDof, kWidth>().noalias() += E_map.transpose().lazyProduct(J_map);
  }

  template <int kDof>
  void add(const Rows& rows, const std::vector<Span>& all) {
    const Eigen::Map<const RowMajor<2, kDof>> E(rows.E.data());
    V.topLeftCorner<kDof, kDof>().noalias() += E.transpose().lazyProduct(E);
    h.head<kDof>().noalias() += E.transpose() * rows.r.head<2>();
    for (int s = 0; s < rows.spans; ++s) {
      const int span = rows.span[static_cast<std::size_t>(s)];
      const double* J = rows.J[static_cast<std::size_t>(s)].data();
      auto i = static_cast<std::size_t>(std::find(spans.begin(), spans.end(), span) - spans.begin());
      if (i == spans.size()) {
        spans.push_back(span);
        W.emplace_back().setZero();
      }
      switch (all[static_cast<std::size_t>(span)].width) {
        case kLandmarkSize:
          add_coupling<kDof, kLandmarkSize>(i, rows.E.data(), J);
          break;
        case kCalibrationDof:
          add_coupling<kDof, kCalibrationDof>(i, rows.E.data(), J);
          break;
        default:
          add_coupling<kDof, core::kStateDof>(i, rows.E.data(), J);
      }
    }
  }
};

SchurSystem::SchurSystem(const LeastSquares& problem) : problem_(problem), layout_(problem.blocks.size()) {
  bool open = false;  // whether the last span is a calibration that may go on
  for (std::size_t i = 0; i < problem.blocks.size(); ++i) {
    const ParameterBlock& block = problem.blocks[i];
    if (block.eliminated) continue;
    Layout& layout = layout_[i];
    const bool joins = open && block.dof == 1;
    if (!joins) spans_.push_back({columns_, 0});
    layout.column = columns_;
    layout.span = static_cast<int>(spans_.size()) - 1;
    layout.offset = spans_.back().width;
    spans_.back().width += block.dof;
    columns_ += block.dof;
    open = block.size == kPoseSize || joins;
  }
  for (const Span& span : spans_) {
    if (span.width != kLandmarkSize && span.width != kCalibrationDof && span.width != core::kStateDof) {
      throw std::invalid_argument("SchurSystem: a span of unknown width");
    }
  }
}

bool SchurSystem::evaluate(const ResidualTerm& term, Rows& rows) const {
  rows.rows = term.factor->num_residuals();
  rows.spans = 0;
  rows.eliminated = -1;
  std::array<const double*, kMaxBlocks> parameters = {};
  std::array<double*, kMaxBlocks> jacobians = {};
  std::array<std::array<double, kMaxRows * kStateSize>, kMaxBlocks> ambient;
  for (int b = 0; b < term.count; ++b) {
    const auto i = static_cast<std::size_t>(b);
    const ParameterBlock& block = problem_.blocks[static_cast<std::size_t>(term.blocks[i])];
    parameters[i] = block.values;
    jacobians[i] = block.constant ? nullptr : ambient[i].data();
  }
  if (!term.factor->Evaluate(parameters.data(), rows.r.data(), jacobians.data())) return false;
  double scale = 1.0;
  const double squares = rows.r.head(rows.rows).squaredNorm();
  rows.cost = 0.5 * squares;
  if (term.loss != nullptr) {
    std::array<double, 3> rho;
    term.loss->Evaluate(squares, rho.data());
    rows.cost = 0.5 * rho[0];
    scale = std::sqrt(rho[1]);
    rows.r.head(rows.rows) *= scale;
  }
  const int m = rows.rows;
  for (int b = 0; b < term.count; ++b) {
    const auto i = static_cast<std::size_t>(b);
    const int index = term.blocks[i];
    const ParameterBlock& block = problem_.blocks[static_cast<std::size_t>(index)];
    const Layout& layout = layout_[static_cast<std::size_t>(index)];
    double* target;
    int width;
    if (block.eliminated) {
      rows.eliminated = index;
      rows.dof = block.dof;
      target = rows.E.data();
      width = block.dof;
    } else {
      width = spans_[static_cast<std::size_t>(layout.span)].width;
      target = rows.of(layout.span, width) + layout.offset;
    }
    if (block.constant) continue;
    for (int row = 0; row < m; ++row) {
      const double* in = ambient[i].data() + row * block.size;
      double* out = target + row * width;
      if (has_rotation(block)) {
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
  for (int s = 0; s < rows.spans; ++s) {
    const auto i = static_cast<std::size_t>(s);
    const Span& a = spans_[static_cast<std::size_t>(rows.span[i])];
    const double* J_a = rows.J[i].data();
    const Eigen::Map<const RowMajor<Eigen::Dynamic, Eigen::Dynamic>> J(J_a, rows.rows, a.width);
    g_.segment(a.column, a.width).noalias() += J.transpose() * rows.r.head(rows.rows);
    for (int t = 0; t < rows.spans; ++t) {
      const auto j = static_cast<std::size_t>(t);
      const Span& b = spans_[static_cast<std::size_t>(rows.span[j])];
      if (b.column > a.column) continue;
      const double* J_b = rows.J[j].data();
      if (rows.rows == 2) {
        add_product_of<2>(J_a, J_b, 2, a.column, b.column, a.width, b.width, H_);
      } else {
        add_product_of<Eigen::Dynamic>(J_a, J_b, rows.rows, a.column, b.column, a.width, b.width, H_);
      }
    }
  }
}

template <int kDof>
bool SchurSystem::eliminate_block(Landmark& landmark, double damping) {
  using Square = Eigen::Matrix<double, kDof, kDof>;
  Square V = landmark.V.topLeftCorner<kDof, kDof>();
  const ParameterBlock& block = problem_.blocks[static_cast<std::size_t>(landmark.block)];
  V.diagonal() *= 1.0 + damping + block.share_of_information;
  V(kDof - 1, kDof - 1) += block.last_information;
  const Eigen::LLT<Square> llt(V);
  if (llt.info() != Eigen::Success) return false;
  Eliminated done{.block = landmark.block,
                  .dof = kDof,
                  .first_coupling = couplings_.size(),
                  .couplings = landmark.spans.size(),
                  .V_inv_h = Eigen::Vector4d::Zero()};
  const Eigen::Matrix<double, kDof, 1> V_inv_h = llt.solve(landmark.h.head<kDof>());
  done.V_inv_h.head<kDof>() = V_inv_h;
  done.length2 = landmark.h.head<kDof>().dot(V_inv_h);
  const Square V_inv = llt.solve(Square::Identity());
  for (std::size_t i = 0; i < landmark.spans.size(); ++i) {
    Coupling& coupling = couplings_.emplace_back();
    coupling.span = landmark.spans[i];
    coupling.Y.template topRows<kDof>().noalias() = V_inv.lazyProduct(landmark.W[i].template topRows<kDof>());
  }
  const auto subtract = [&]<int kA, int kB>(std::size_t i, std::size_t j) {
    const Span& a = spans_[static_cast<std::size_t>(landmark.spans[i])];
    const Span& b = spans_[static_cast<std::size_t>(landmark.spans[j])];
    H_.block<kA, kB>(a.column, b.column).noalias() -=
        landmark.W[i].template topLeftCorner<kDof, kA>().transpose().lazyProduct(
            couplings_[done.first_coupling + j].Y.template topLeftCorner<kDof, kB>());
  };
  constexpr int kState = core::kStateDof;
  for (std::size_t i = 0; i < landmark.spans.size(); ++i) {
    const Span& a = spans_[static_cast<std::size_t>(landmark.spans[i])];
    g_.segment(a.column, a.width).noalias() -=
        landmark.W[i].template topRows<kDof>().leftCols(a.width).transpose() * V_inv_h;
    for (std::size_t j = 0; j < landmark.spans.size(); ++j) {
      const Span& b = spans_[static_cast<std::size_t>(landmark.spans[j])];
      if (b.column > a.column) continue;
      if (a.width == kState && b.width == kState) {
        subtract.template operator()<kState, kState>(i, j);
      } else if (a.width == kCalibrationDof && b.width == kState) {
        subtract.template operator()<kCalibrationDof, kState>(i, j);
      } else if (a.width == kCalibrationDof && b.width == kCalibrationDof) {
        subtract.template operator()<kCalibrationDof, kCalibrationDof>(i, j);
      } else if (a.width == kState && b.width == kCalibrationDof) {
        subtract.template operator()<kState, kCalibrationDof>(i, j);
      } else {
        throw std::logic_error("SchurSystem: a term with two landmarks");
      }
    }
  }
  eliminated_.push_back(done);
  return true;
}

bool SchurSystem::eliminate(Landmark& landmark, double damping) {
  switch (landmark.dof) {
    case 1:
      return eliminate_block<1>(landmark, damping);
    case kLandmarkSize:
      return eliminate_block<kLandmarkSize>(landmark, damping);
    case kLineDof:
      return eliminate_block<kLineDof>(landmark, damping);
  }
  throw std::logic_error("SchurSystem: a landmark of unknown size");
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
    const auto transform = [&]<int kDof>(const Eigen::Matrix<double, kDof, kDof>& J, int column) {
      information.middleCols<kDof>(column) = (information.middleCols<kDof>(column) * J).eval();
      information.middleRows<kDof>(column) = (J.transpose() * information.middleRows<kDof>(column)).eval();
      gradient.segment<kDof>(column) = (J.transpose() * gradient.segment<kDof>(column)).eval();
    };
    if (part.kind == MarginalPrior::Kind::kState) {
      const core::State x = unpack_state(parameters[i]);
      transform(invariant_difference_jacobian(x, xi.segment<core::kStateDof>(part.column)), part.column);
    } else if (part.kind == MarginalPrior::Kind::kPose) {
      transform(core::right_jacobian_inverse(xi.segment<3>(part.column + 3)), part.column + 3);
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
  H_.setZero(columns_, columns_);
  g_.setZero(columns_);
  cost_ = 0.0;
  eliminated_.clear();
  couplings_.clear();
  for (std::size_t i = 0; i < problem_.blocks.size(); ++i) {
    const ParameterBlock& block = problem_.blocks[i];
    if (has_rotation(block)) {
      layout_[i].plus = core::plus_jacobian(Eigen::Quaterniond(Eigen::Map<const Eigen::Quaterniond>(block.values + 3)));
    }
  }
  Rows rows;
  Landmark landmark;
  for (const ResidualTerm& term : problem_.terms) {
    if (!evaluate(term, rows)) return false;
    cost_ += rows.cost;
    if (rows.eliminated != landmark.block) {
      if (landmark.block >= 0 && !eliminate(landmark, damping)) return false;
      landmark.begin(rows.eliminated, rows.dof);
    }
    add_dense(rows);
    if (rows.eliminated < 0) continue;
    switch (rows.dof) {
      case 1:
        landmark.add<1>(rows, spans_);
        break;
      case kLandmarkSize:
        landmark.add<kLandmarkSize>(rows, spans_);
        break;
      default:
        landmark.add<kLineDof>(rows, spans_);
    }
  }
  if (landmark.block >= 0 && !eliminate(landmark, damping)) return false;
  if (problem_.prior != nullptr) add_prior();
  H_.diagonal() *= 1.0 + damping;
  for (std::size_t i = 0; i < problem_.blocks.size(); ++i) {
    const ParameterBlock& block = problem_.blocks[i];
    if (block.eliminated || !block.constant) continue;
    H_.diagonal().segment(layout_[i].column, block.dof).setOnes();
  }
  return true;
}

std::optional<double> SchurSystem::solve() {
  L_ = H_;
  if (!cholesky_in_place(L_)) return std::nullopt;
  step_ = -g_;
  L_.triangularView<Eigen::Lower>().solveInPlace(step_);
  double length2 = step_.squaredNorm();
  L_.triangularView<Eigen::Lower>().adjoint().solveInPlace(step_);
  for (const Eliminated& e : eliminated_) length2 += e.length2;
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
  for (const Eliminated& e : eliminated_) {
    Eigen::Vector4d delta = -e.V_inv_h;
    for (std::size_t c = e.first_coupling; c < e.first_coupling + e.couplings; ++c) {
      const Span& span = spans_[static_cast<std::size_t>(couplings_[c].span)];
      delta.head(e.dof).noalias() -=
          couplings_[c].Y.topLeftCorner(e.dof, span.width) * step_.segment(span.column, span.width);
    }
    move(problem_.blocks[static_cast<std::size_t>(e.block)], delta.data());
  }
  for (std::size_t i = 0; i < problem_.blocks.size(); ++i) {
    const ParameterBlock& block = problem_.blocks[i];
    if (block.eliminated || block.constant) continue;
    move(block, step_.data() + layout_[i].column);
  }
}

LeastSquaresResult solve_with_schur(const LeastSquares& problem, const LeastSquaresOptions& options,
                                    SchurSystem& system) {
  constexpr double kFirstDamping = 1e-6;
  constexpr double kLargestDamping = 1e8;
  constexpr double kRounding = 1e-12;  // of a cost
  constexpr double kUndamped = 1e-3;   // up to here a short step means that the minimum is near
  LeastSquaresResult result;
  result.status = core::SolveStatus::kIterationLimit;
  std::vector<double> before;
  const auto save = [&] {
    before.clear();
    for (const ParameterBlock& b : problem.blocks) before.insert(before.end(), b.values, b.values + b.size);
  };
  const auto restore = [&] {
    const double* from = before.data();
    for (const ParameterBlock& b : problem.blocks) {
      std::copy_n(from, b.size, b.values);
      from += b.size;
    }
  };
  double damping = 0.0;
  bool built = system.build(damping);
  if (!built) {
    result.status = core::SolveStatus::kDiverged;
    return result;
  }
  result.initial_cost = system.built_cost();
  result.final_cost = system.built_cost();
  save();
  while (result.iterations < options.max_iterations) {
    ++result.iterations;
    // Where the values are those that were saved.
    if (const std::optional<double> length2 = built ? system.solve() : std::nullopt) {
      system.apply_step();
      if (damping <= kUndamped && *length2 <= options.step_tolerance * options.step_tolerance) {
        result.final_cost -= 0.5 * *length2;
        result.status = core::SolveStatus::kConverged;
        return result;
      }
      const double next = damping > kFirstDamping ? 0.1 * damping : 0.0;
      if (system.build(next) && system.built_cost() <= result.final_cost + kRounding * std::abs(result.final_cost)) {
        damping = next;
        result.final_cost = system.built_cost();
        save();
        continue;
      }
      restore();
    }
    damping = std::max(kFirstDamping, 10.0 * damping);
    if (damping > kLargestDamping) {
      result.status = core::SolveStatus::kDiverged;
      return result;
    }
    built = system.build(damping);
  }
  return result;
}

}  // namespace plumbline::estimator
