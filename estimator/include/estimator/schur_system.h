// Normal equations of a window with its landmarks eliminated:
//   [ H  W^T ] [ x ]     [ g ]            (H - W^T V^-1 W) x = -(g - W^T V^-1 h)
//   [ W  V   ] [ l ] = - [ h ]      =>    l = -V^-1 (h + W x)
// V in blocks of 1 (inverse depth), 3 (point) or 4 (line), W in blocks of a landmark and a state or the calibration,
// all of a size that is known when compiled. Damped as Levenberg-Marquardt: each diagonal entry d becomes d + damping
// d. (Triggs et al., "Bundle adjustment: a modern synthesis", 2000, section 6.1.)
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "estimator/least_squares.h"

namespace plumbline::estimator {

class SchurSystem {
 public:
  explicit SchurSystem(const LeastSquares& problem);

  // At the present values. False where a factor cannot be evaluated, or a landmark's block is not positive definite.
  bool build(double damping);

  int columns() const { return columns_; }
  int column(int block) const { return layout_[static_cast<std::size_t>(block)].column; }
  const Eigen::MatrixXd& H() const { return H_; }  // lower triangle, of what is left
  const Eigen::VectorXd& g() const { return g_; }
  double built_cost() const { return cost_; }

  // The step of all blocks, and its squared length in the damped information. Nothing where that is not positive
  // definite.
  std::optional<double> solve();
  void apply_step() const;

  // L of the last solve, lower.
  const Eigen::MatrixXd& factor() const { return L_; }

 private:
  // Dense blocks that follow each other and that terms meet together are one span of columns: a state, the calibration,
  // a landmark that is not eliminated.
  struct Span {
    int column = 0;
    int width = 0;
  };
  struct Layout {
    int column = -1;  // of what is left; -1 where eliminated
    int span = -1;
    int offset = 0;                    // in the span
    Eigen::Matrix<double, 4, 3> plus;  // d Plus(q, d)/dd of the rotation in the block
  };
  struct Rows;         // a term's residual and derivatives
  struct Eliminated {  // a landmark
    int block = 0;
    int dof = 0;
    std::size_t first_coupling = 0;
    std::size_t couplings = 0;
    Eigen::Vector4d V_inv_h;
    double length2 = 0.0;  // h^T V^-1 h
  };
  struct Coupling {  // V^-1 W of a landmark and a span, dof x width
    int span = 0;
    Eigen::Matrix<double, 4, 15> Y;
  };
  struct Landmark;  // the one being summed up

  bool evaluate(const ResidualTerm& term, Rows& rows) const;
  void add_dense(const Rows& rows);
  bool eliminate(Landmark& landmark, double damping);
  template <int kDof>
  bool eliminate_block(Landmark& landmark, double damping);
  void add_prior();

  const LeastSquares& problem_;
  std::vector<Layout> layout_;
  std::vector<Span> spans_;
  int columns_ = 0;
  double cost_ = 0.0;
  Eigen::MatrixXd H_;
  Eigen::VectorXd g_;
  Eigen::MatrixXd L_;
  Eigen::VectorXd step_;
  std::vector<Eliminated> eliminated_;
  std::vector<Coupling> couplings_;
};

LeastSquaresResult solve_with_schur(const LeastSquares& problem, const LeastSquaresOptions& options,
                                    SchurSystem& system);

}  // namespace plumbline::estimator
