// The chain of eliminations against the dense inverse of the whole information.
#include "eval/information_chain.h"

#include <stdexcept>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "core/random.h"

namespace plumbline::eval {
namespace {

const core::RandomStream kRandom({21, 0}, "information_chain_test");

Eigen::MatrixXd random_matrix(int rows, int cols, std::uint64_t seed) {
  Eigen::MatrixXd m(rows, cols);
  std::uint64_t index = 0;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < cols; ++c) m(r, c) = kRandom.normal(seed, index++);
  }
  return m;
}

// A calibration that all see, states in a row, landmarks that three states in a row see.
class Problem : public ::testing::Test {
 protected:
  static constexpr int kStates = 6;

  void SetUp() override {
    calibration_ = chain_.add(2);
    observe({calibration_}, 3.0 * Eigen::MatrixXd::Identity(2, 2));
    std::uint64_t seed = 10;
    std::vector<int> alive;
    for (int k = 0; k < kStates; ++k) {
      states_.push_back(chain_.add(4));
      if (k == 0) observe({states_[0]}, Eigen::MatrixXd::Identity(4, 4));
      if (k > 0) observe({states_[k - 1], states_[k]}, random_matrix(4, 8, seed++));
      if (k + 3 <= kStates) alive.push_back(chain_.add(3));
      for (const int landmark : alive) observe({states_[k], calibration_, landmark}, random_matrix(2, 9, seed++));
      causal_.push_back(chain_.causal_covariance({calibration_}, alive));
      causal_dense_.push_back(information_);
      std::vector<int> done;
      if (k > 0) done.push_back(states_[k - 1]);
      if (k >= 2) {
        done.push_back(alive.front());
        alive.erase(alive.begin());
      }
      chain_.eliminate(done);
    }
    chain_.finish();
  }

  void observe(const std::vector<int>& variables, const Eigen::MatrixXd& J) {
    chain_.observe(variables, J);
    const int n = chain_.total_dof();
    information_.conservativeResizeLike(Eigen::MatrixXd::Zero(n, n));
    Eigen::MatrixXd wide = Eigen::MatrixXd::Zero(J.rows(), n);
    int column = 0;
    for (const int v : variables) {
      wide.middleCols(chain_.offset(v), chain_.dof(v)) = J.middleCols(column, chain_.dof(v));
      column += chain_.dof(v);
    }
    information_ += wide.transpose() * wide;
  }

  InformationChain chain_;
  Eigen::MatrixXd information_;
  int calibration_ = 0;
  std::vector<int> states_;
  std::vector<Eigen::MatrixXd> causal_;
  std::vector<Eigen::MatrixXd> causal_dense_;
};

TEST_F(Problem, MarginalsEqualTheDenseInverse) {
  const Eigen::MatrixXd Sigma = information_.inverse();
  const std::vector<Eigen::MatrixXd> marginals = chain_.marginals();
  ASSERT_EQ(marginals.size(), static_cast<std::size_t>(chain_.size()));
  for (int v = 0; v < chain_.size(); ++v) {
    const auto dense = Sigma.block(chain_.offset(v), chain_.offset(v), chain_.dof(v), chain_.dof(v));
    EXPECT_LT((marginals[static_cast<std::size_t>(v)] - dense).norm(), 1e-10 * dense.norm()) << v;
  }
}

TEST_F(Problem, SolveEqualsTheDenseInverse) {
  const Eigen::MatrixXd B = random_matrix(chain_.total_dof(), 3, 99);
  const Eigen::MatrixXd dense = information_.inverse() * B;
  EXPECT_LT((chain_.solve(B) - dense).norm(), 1e-10 * dense.norm());
}

TEST_F(Problem, CausalCovarianceKnowsThePastOnly) {
  for (std::size_t k = 0; k < causal_.size(); ++k) {
    // The landmark that was seen once is not determined; the pseudo-inverse knows of the others what there is to know.
    const Eigen::MatrixXd Sigma = causal_dense_[k].completeOrthogonalDecomposition().pseudoInverse();
    // kWeak leaks in, relative to information of order 1e-3 at the least.
    EXPECT_LT((causal_[k] - Sigma.topLeftCorner(2, 2)).norm(), 1e-6 * causal_[k].norm()) << k;
  }
  for (std::size_t k = 1; k < causal_.size(); ++k) EXPECT_LE(causal_[k].trace(), causal_[k - 1].trace() * (1 + 1e-12));
}

TEST(InformationChain, SaysWhatIsNotDetermined) {
  InformationChain chain;
  const int a = chain.add(2);
  chain.observe({a}, Eigen::MatrixXd::Identity(1, 2));
  EXPECT_THROW(chain.causal_covariance({a}, {}), std::domain_error);
  EXPECT_THROW(chain.eliminate({a}), std::domain_error);
}

TEST(InformationChain, RefusesWhatWasEliminated) {
  InformationChain chain;
  const int a = chain.add(1);
  const int b = chain.add(1);
  chain.observe({a, b}, Eigen::MatrixXd::Identity(2, 2));
  EXPECT_THROW(chain.marginals(), std::logic_error);
  chain.eliminate({a});
  EXPECT_THROW(chain.observe({a}, Eigen::MatrixXd::Identity(1, 1)), std::invalid_argument);
}

}  // namespace
}  // namespace plumbline::eval
