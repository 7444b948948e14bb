// What a report says first, of all cells of a sweep.
//   failed      more than the allowed share of trials failed
//   attention   trials failed, or a mean NEES lies outside its chi-square band. The bands are widened for their
//               number m (Bonferroni): each at confidence 1 - 0.01 / m, so that not one consistent sweep in a hundred
//               gets attention for them, while some of many 95 % bands are always missed
//   ok          neither
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "eval/summary.h"

namespace plumbline::eval {

enum class VerdictLevel { kOk, kAttention, kFailed };
inline constexpr std::array<std::string_view, 3> kVerdictLevelNames = {"ok", "attention", "failed"};

struct Verdict {
  VerdictLevel level = VerdictLevel::kOk;
  std::string headline;
  std::vector<std::string> findings;  // sentences
};

Verdict judge(const std::vector<CellSummary>& cells, double max_failed_share);

}  // namespace plumbline::eval
