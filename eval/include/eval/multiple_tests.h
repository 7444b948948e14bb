// Tests of counts, and of many hypotheses at once.
#pragma once

#include <vector>

namespace plumbline::eval {

// Two variants over the same trials: `only_a` failed with the first variant only, `only_b` with the second only. Under
// equal failure probabilities only_b is binomial(only_a + only_b, 1/2); two-sided and exact (McNemar 1947, with the
// binomial in place of chi-square). 1 where both are 0.
double mcnemar_p_value(int only_a, int only_b);

// Adjusted p values, in the order given: to reject those at most alpha keeps the probability of a single false
// rejection among all at most alpha, whatever their dependence (Holm 1979).
//   sorted p_(1) <= ... <= p_(m):  adjusted_(i) = max over j <= i of min(1, (m - j + 1) p_(j))
std::vector<double> holm(const std::vector<double>& p_values);

}  // namespace plumbline::eval
