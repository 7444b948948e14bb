#include "eval/information_chain.h"

#include <algorithm>
#include <ranges>
#include <stdexcept>
#include <unordered_map>

namespace plumbline::eval {
namespace {

Eigen::LLT<Eigen::MatrixXd> factorised(const Eigen::MatrixXd& H) {
  Eigen::LLT<Eigen::MatrixXd> llt(H);
  if (llt.info() != Eigen::Success) throw std::domain_error("the information is singular");
  return llt;
}

// Plain loops, since Eigen's own selection and triangular solvers touch the first element of an empty matrix.
Eigen::MatrixXd select(const Eigen::MatrixXd& M, const std::vector<int>& rows, const std::vector<int>& columns) {
  Eigen::MatrixXd selected(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(columns.size()));
  for (std::size_t c = 0; c < columns.size(); ++c) {
    for (std::size_t r = 0; r < rows.size(); ++r) {
      selected(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)) = M(rows[r], columns[c]);
    }
  }
  return selected;
}

Eigen::MatrixXd select_rows(const Eigen::MatrixXd& M, const std::vector<int>& rows) {
  Eigen::MatrixXd selected(static_cast<Eigen::Index>(rows.size()), M.cols());
  for (std::size_t r = 0; r < rows.size(); ++r) selected.row(static_cast<Eigen::Index>(r)) = M.row(rows[r]);
  return selected;
}

void assign_rows(const Eigen::MatrixXd& values, const std::vector<int>& rows, Eigen::MatrixXd& M) {
  for (std::size_t r = 0; r < rows.size(); ++r) M.row(rows[r]) = values.row(static_cast<Eigen::Index>(r));
}

}  // namespace

InformationChain::Variable InformationChain::add(int dof) {
  const Variable v = size();
  dofs_.push_back(dof);
  offsets_.push_back(total_dof_);
  total_dof_ += dof;
  const auto n = H_.rows();
  active_.push_back(v);
  active_offsets_.push_back(static_cast<int>(n));
  H_.conservativeResizeLike(Eigen::MatrixXd::Zero(n + dof, n + dof));
  return v;
}

std::vector<int> InformationChain::columns_of(const std::vector<Variable>& variables) const {
  std::vector<int> columns;
  for (const Variable v : variables) {
    const int first = active_offsets_[static_cast<std::size_t>(v)];
    if (first < 0) throw std::invalid_argument("InformationChain: the variable was eliminated");
    for (int i = 0; i < dof(v); ++i) columns.push_back(first + i);
  }
  return columns;
}

std::vector<int> InformationChain::rows_of(const std::vector<Variable>& variables) const {
  std::vector<int> rows;
  for (const Variable v : variables) {
    for (int i = 0; i < dof(v); ++i) rows.push_back(offset(v) + i);
  }
  return rows;
}

void InformationChain::observe(const std::vector<Variable>& variables, const Eigen::MatrixXd& J) {
  const std::vector<int> columns = columns_of(variables);
  if (static_cast<Eigen::Index>(columns.size()) != J.cols()) {
    throw std::invalid_argument("InformationChain: columns and variables do not match");
  }
  const Eigen::MatrixXd JtJ = J.transpose() * J;
  for (Eigen::Index c = 0; c < JtJ.cols(); ++c) {
    for (Eigen::Index r = 0; r < JtJ.rows(); ++r) {
      H_(columns[static_cast<std::size_t>(r)], columns[static_cast<std::size_t>(c)]) += JtJ(r, c);
    }
  }
}

void InformationChain::reindex() {
  std::fill(active_offsets_.begin(), active_offsets_.end(), -1);
  int next = 0;
  for (const Variable v : active_) {
    active_offsets_[static_cast<std::size_t>(v)] = next;
    next += dof(v);
  }
}

void InformationChain::eliminate(const std::vector<Variable>& variables) {
  if (variables.empty()) return;
  const std::vector<int> F = columns_of(variables);
  Conditional conditional;
  conditional.frontal = variables;
  for (const Variable v : active_) {
    if (std::find(variables.begin(), variables.end(), v) == variables.end()) conditional.separator.push_back(v);
  }
  const std::vector<int> S = columns_of(conditional.separator);
  conditional.H_FF = factorised(select(H_, F, F));
  const Eigen::MatrixXd H_FS = select(H_, F, S);
  Eigen::MatrixXd reduced = select(H_, S, S);
  if (S.empty()) {
    conditional.A = H_FS;
  } else {
    conditional.A = conditional.H_FF.solve(H_FS);
    // H_SF H_FF^-1 H_FS as a square, so that rounding leaves it symmetric.
    const Eigen::MatrixXd root = conditional.H_FF.matrixL().solve(H_FS);
    reduced.selfadjointView<Eigen::Lower>().rankUpdate(root.transpose(), -1.0);
    reduced.triangularView<Eigen::StrictlyUpper>() = reduced.transpose();
  }
  H_ = std::move(reduced);
  active_ = conditional.separator;
  reindex();
  conditionals_.push_back(std::move(conditional));
}

Eigen::MatrixXd InformationChain::causal_covariance(const std::vector<Variable>& variables,
                                                    const std::vector<Variable>& weak) const {
  const std::vector<int> columns = columns_of(variables);
  Eigen::MatrixXd H = H_;
  for (const int i : columns_of(weak)) H(i, i) += kWeak;
  const auto llt = factorised(H);
  Eigen::MatrixXd selected = Eigen::MatrixXd::Zero(H_.rows(), static_cast<Eigen::Index>(columns.size()));
  for (std::size_t i = 0; i < columns.size(); ++i) selected(columns[i], static_cast<Eigen::Index>(i)) = 1.0;
  // Sigma = L^-T L^-1: the square of half a substitution.
  llt.matrixL().solveInPlace(selected);
  return selected.transpose() * selected;
}

void InformationChain::finish() {
  const std::vector<Variable> rest = active_;
  eliminate(rest);
}

std::vector<Eigen::MatrixXd> InformationChain::marginals() const {
  if (!active_.empty()) throw std::logic_error("InformationChain: finish() first");
  std::vector<Eigen::MatrixXd> result(dofs_.size());
  std::unordered_map<Variable, int> place;  // of a variable in Sigma
  Eigen::MatrixXd Sigma;
  for (const Conditional& c : std::views::reverse(conditionals_)) {
    std::vector<int> S;
    for (const Variable v : c.separator) {
      for (int i = 0; i < dof(v); ++i) S.push_back(place.at(v) + i);
    }
    const Eigen::MatrixXd Sigma_SS = select(Sigma, S, S);
    const auto f = c.A.rows();
    const auto s = c.A.cols();
    Eigen::MatrixXd next(f + s, f + s);
    const Eigen::MatrixXd own = c.H_FF.matrixL().solve(Eigen::MatrixXd::Identity(f, f));
    next.topLeftCorner(f, f) = own.transpose() * own;
    if (s > 0) {
      const Eigen::MatrixXd ASigma = c.A * Sigma_SS;
      next.topLeftCorner(f, f) += ASigma * c.A.transpose();
      next.topRightCorner(f, s) = -ASigma;
      next.bottomLeftCorner(s, f) = -ASigma.transpose();
      next.bottomRightCorner(s, s) = Sigma_SS;
    }
    Sigma = std::move(next);

    place.clear();
    int at = 0;
    for (const Variable v : c.frontal) {
      result[static_cast<std::size_t>(v)] = Sigma.block(at, at, dof(v), dof(v));
      place[v] = at;
      at += dof(v);
    }
    for (const Variable v : c.separator) {
      place[v] = at;
      at += dof(v);
    }
  }
  return result;
}

Eigen::MatrixXd InformationChain::solve(const Eigen::MatrixXd& B) const {
  if (!active_.empty()) throw std::logic_error("InformationChain: finish() first");
  Eigen::MatrixXd x = B;
  for (const Conditional& c : conditionals_) {
    if (c.separator.empty()) continue;
    const std::vector<int> S = rows_of(c.separator);
    assign_rows(select_rows(x, S) - c.A.transpose() * select_rows(x, rows_of(c.frontal)), S, x);
  }
  for (const Conditional& c : std::views::reverse(conditionals_)) {
    const std::vector<int> F = rows_of(c.frontal);
    Eigen::MatrixXd x_F = c.H_FF.solve(select_rows(x, F));
    if (!c.separator.empty()) x_F -= c.A * select_rows(x, rows_of(c.separator));
    assign_rows(x_F, F, x);
  }
  return x;
}

}  // namespace plumbline::eval
