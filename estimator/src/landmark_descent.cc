#include "estimator/landmark_descent.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>

#include <Eigen/Cholesky>

#include "estimator/factors/orthonormal_line.h"

namespace plumbline::estimator {
namespace {

constexpr int kMostSize = kLineSize;
constexpr int kMostIterations = 10;
constexpr double kShortStep2 = 1e-2;  // in variances
constexpr double kFirstDamping = 1e-4;
constexpr double kLargestDamping = 1e4;

using Values = std::array<double, kMostSize>;
using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kLineDof, kLineDof>;
using Column = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kLineDof, 1>;

class Descent {
 public:
  Descent(const LeastSquares& problem, int landmark, std::span<const ResidualTerm> terms)
      : problem_(problem),
        block_(problem.blocks[static_cast<std::size_t>(landmark)]),
        landmark_(landmark),
        terms_(terms) {}

  void run(const double* before) {
    std::optional<double> cost = sum();
    if (!cost) {
      const Values present = values();
      set(before);
      cost = sum();
      if (!cost) {
        set(present.data());
        return;
      }
    }
    double damping = 0.0;
    for (int i = 0; i < kMostIterations; ++i) {
      const Values from = values();
      const Square V = V_;
      const Column h = h_;
      bool moved = false;
      while (!moved && damping <= kLargestDamping) {
        const std::optional<double> length2 = step(from, V, h, damping);
        if (damping == 0.0 && length2 && *length2 < kShortStep2) {
          set(from.data());
          return;
        }
        const std::optional<double> next = length2 ? sum() : std::nullopt;
        moved = next && *next <= *cost;
        if (moved) {
          cost = next;
          damping = damping > kFirstDamping ? 0.1 * damping : 0.0;
        } else {
          set(from.data());
          damping = std::max(kFirstDamping, 10.0 * damping);
        }
      }
      if (!moved) return;
    }
  }

 private:
  Values values() const {
    Values x = {};
    std::copy_n(block_.values, block_.size, x.begin());
    return x;
  }
  void set(const double* x) const { std::copy_n(x, block_.size, block_.values); }

  // The landmark's share of the cost, and its normal equations.
  std::optional<double> sum() {
    double cost = 0.0;
    V_.setZero(block_.dof, block_.dof);
    h_.setZero(block_.dof);
    for (const ResidualTerm& term : terms_) {
      std::array<const double*, kMostBlocks> parameters = {};
      std::array<double*, kMostBlocks> jacobians = {};
      std::array<double, 2 * kMostSize> ambient;
      for (int b = 0; b < term.count; ++b) {
        const auto i = static_cast<std::size_t>(b);
        parameters[i] = problem_.blocks[static_cast<std::size_t>(term.blocks[i])].values;
        if (term.blocks[i] == landmark_) jacobians[i] = ambient.data();
      }
      Eigen::Vector2d r;
      if (!term.factor->Evaluate(parameters.data(), r.data(), jacobians.data())) return std::nullopt;
      std::array<double, 3> rho = {r.squaredNorm(), 1.0, 0.0};
      if (term.loss != nullptr) term.loss->Evaluate(r.squaredNorm(), rho.data());
      cost += 0.5 * rho[0];
      Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::RowMajor, 2, kMostSize> E(2, block_.dof);
      if (block_.manifold == nullptr) {
        E = Eigen::Map<const Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::RowMajor>>(ambient.data(), 2, block_.dof);
      } else {
        block_.manifold->RightMultiplyByPlusJacobian(block_.values, 2, ambient.data(), E.data());
      }
      V_.noalias() += rho[1] * E.transpose() * E;
      h_.noalias() += rho[1] * E.transpose() * r;
    }
    return cost;
  }

  // A damped step from `from`; its squared length in the damped information.
  std::optional<double> step(const Values& from, Square V, const Column& h, double damping) const {
    V.diagonal() *= 1.0 + damping;
    const Eigen::LLT<Square> llt(V);
    if (llt.info() != Eigen::Success) return std::nullopt;
    const Column delta = -llt.solve(h);
    if (block_.manifold == nullptr) {
      for (int i = 0; i < block_.size; ++i) block_.values[i] = from[static_cast<std::size_t>(i)] + delta[i];
    } else {
      block_.manifold->Plus(from.data(), delta.data(), block_.values);
    }
    return -h.dot(delta);
  }

  const LeastSquares& problem_;
  const ParameterBlock& block_;
  int landmark_;
  std::span<const ResidualTerm> terms_;
  Square V_;
  Column h_;
};

}  // namespace

void settle_landmarks(const LeastSquares& problem, const std::vector<double>& before) {
  std::vector<std::size_t> first(problem.blocks.size());
  for (std::size_t b = 0, at = 0; b < first.size(); ++b) {
    first[b] = at;
    at += static_cast<std::size_t>(problem.blocks[b].size);
  }
  const std::span<const ResidualTerm> terms(problem.terms);
  for (std::size_t begin = 0; begin < terms.size();) {
    const int landmark = eliminated_block(problem, terms[begin]);
    std::size_t end = begin + 1;
    while (end < terms.size() && landmark >= 0 && eliminated_block(problem, terms[end]) == landmark) ++end;
    if (landmark >= 0) {
      Descent(problem, landmark, terms.subspan(begin, end - begin))
          .run(before.data() + first[static_cast<std::size_t>(landmark)]);
    }
    begin = end;
  }
}

}  // namespace plumbline::estimator
