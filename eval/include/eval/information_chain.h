// Gaussian information of variables that come and go along a recording: states, landmarks, and a calibration that
// stays. With whitened Jacobians J of the measurements, the information is
//   H = sum_i J_i^T J_i          Sigma = H^-1
// Variables are eliminated as soon as no further measurement speaks of them, so that the matrix at hand holds the
// active ones only; each elimination leaves the conditional of what it took out, x_F given the others x_S,
//   x_F = -A x_S + n,   A = H_FF^-1 H_FS,   n ~ N(0, H_FF^-1),      H_SS <- H_SS - H_SF A
// whose chain is the sparse Cholesky factor of H. Exact; the cost is linear in the length of the recording.
//
// Marginals by the backward recursion (Takahashi, Fagan, Chen, 1973; in blocks, Kaess, Dellaert, "Covariance recovery
// from a square root information matrix", RAS 2009):
//   Sigma_FS = -A Sigma_SS         Sigma_FF = H_FF^-1 + A Sigma_SS A^T
#pragma once

#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace plumbline::eval {

class InformationChain {
 public:
  using Variable = int;

  Variable add(int dof);

  // Adds J^T J. The columns of J are those of the variables, in their order; all must be active.
  void observe(const std::vector<Variable>& variables, const Eigen::MatrixXd& J);

  // Marginalises the variables out; no further measurement may speak of them. Throws std::domain_error where they are
  // not determined given the others.
  void eliminate(const std::vector<Variable>& variables);

  // Joint covariance of active variables from the measurements so far. A variable that is `weak` need not be determined
  // yet, as a landmark that was seen once: its directions get the information `kWeak`, which must be far below what the
  // later measurements bring. Throws std::domain_error where the information is singular.
  static constexpr double kWeak = 1e-9;
  Eigen::MatrixXd causal_covariance(const std::vector<Variable>& variables, const std::vector<Variable>& weak) const;

  // Eliminates what is left. The following need it.
  void finish();

  // Of each variable, from all measurements.
  std::vector<Eigen::MatrixXd> marginals() const;

  // Sigma B. Rows of B and of the answer: see offset().
  Eigen::MatrixXd solve(const Eigen::MatrixXd& B) const;

  int size() const { return static_cast<int>(dofs_.size()); }
  int total_dof() const { return total_dof_; }
  int dof(Variable v) const { return dofs_[static_cast<std::size_t>(v)]; }
  int offset(Variable v) const { return offsets_[static_cast<std::size_t>(v)]; }  // of its rows among all variables

 private:
  struct Conditional {
    std::vector<Variable> frontal;
    std::vector<Variable> separator;
    Eigen::LLT<Eigen::MatrixXd> H_FF;
    Eigen::MatrixXd A;
  };

  std::vector<int> columns_of(const std::vector<Variable>& variables) const;  // in H_, of active variables
  std::vector<int> rows_of(const std::vector<Variable>& variables) const;     // among all variables
  void reindex();

  std::vector<int> dofs_;
  std::vector<int> offsets_;
  int total_dof_ = 0;
  std::vector<Variable> active_;
  std::vector<int> active_offsets_;  // of every variable in H_; -1 where it is not active
  Eigen::MatrixXd H_;
  std::vector<Conditional> conditionals_;
};

}  // namespace plumbline::eval
