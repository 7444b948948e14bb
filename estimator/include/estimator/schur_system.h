// Normal equations with the landmarks eliminated:
//   [ H  W^T ] [ x ]     [ g ]            (H - Z^T Z) x = -(g - Z^T y)      V = L L^T, Z = L^-1 W, y = L^-1 h
//   [ W  V   ] [ l ] = - [ h ]      =>    l = -L^-T (y + Z x)
// V in blocks of 1 (inverse depth), 3 (point) or 4 (line). What is left has zeros between states that no track and no
// preintegration joins, and its last blocks, the calibration, for a border. Damped as Levenberg-Marquardt: each
// diagonal entry d becomes d + damping d. (Triggs et al., "Bundle adjustment: a modern synthesis", 2000, section 6.1.)
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "estimator/bordered_band.h"
#include "estimator/least_squares.h"

namespace plumbline::estimator {

class SchurSystem {
 public:
  explicit SchurSystem(const LeastSquares& problem);

  // At the present values. False where a factor cannot be evaluated, or a landmark's block is not positive definite.
  bool build(double damping);

  int columns() const { return H_.size(); }
  int column(int block) const { return layout_[static_cast<std::size_t>(block)].column; }
  Eigen::MatrixXd H() const { return H_.dense(); }  // lower triangle, of what is left, until it is solved
  const Eigen::VectorXd& g() const { return g_; }
  double built_cost() const { return cost_; }

  // The step of all blocks, and its squared length in the damped information; once for each time it is built. Nothing
  // where that is not positive definite.
  std::optional<double> solve();
  void apply_step() const;
  bool solved_undamped() const { return solved_ && damping_ == 0.0; }

  // The last rows and columns of H = L L^T, once it is solved.
  Eigen::MatrixXd trailing_factor(int n) const { return H_.trailing(n); }

 private:
  struct Layout {
    int column = -1;                   // of what is left; -1 where eliminated
    Eigen::Matrix<double, 4, 3> plus;  // d Plus(q, d)/dd of the rotation in the block
    // Of a landmark: the columns before the border that it meets, and where its rows of couplings_ begin, each of
    // end - first and then the border's columns.
    int first = 0;
    int end = 0;
    std::size_t coupling = 0;
  };
  struct Rows;       // a term's residual and derivatives
  struct Landmark {  // with W and h as they are summed up; once eliminated, with Z and y in their place
    int block = -1;
    int dof = 0;
    double* coupling = nullptr;
    Eigen::Matrix4d V;
    Eigen::Vector4d h;
  };

  void lay_out();
  int width(const Landmark& landmark) const;
  bool evaluate(const ResidualTerm& term, Rows& rows) const;
  void add_dense(const Rows& rows);
  void begin_landmark(int block);
  void add_to_landmark(const Rows& rows);
  bool eliminate_landmark(double damping);
  void add_prior();

  const LeastSquares& problem_;
  std::vector<Layout> layout_;
  double cost_ = 0.0;
  double damping_ = 0.0;
  bool solved_ = false;
  BorderedBand H_;
  Eigen::VectorXd g_;
  Eigen::VectorXd step_;
  std::vector<Landmark> landmarks_;  // the last is the one being summed up
  std::vector<double> couplings_;
};

LeastSquaresResult solve_with_schur(const LeastSquares& problem, const LeastSquaresOptions& options,
                                    SchurSystem& system);

}  // namespace plumbline::estimator
