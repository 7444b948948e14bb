// What a report shows, as one JSON text that the page (tools/report) and nothing else reads:
//   {"kind": "sweep", "name", "verdict": {"level", "headline", "findings"}, "runs", "runs_ok",
//    "metrics": [{"name", "label", "scale", "signed", "in_table"}], "cells": [CELL], "trials", "worst", "failures",
//    "provenance": [[name, text]], "config"}
//   CELL       the keys of summary.json's, and "td_s", "ecdf": {NAME: quantiles at 0, 0.01 ... 1},
//              "timing": {PART: {"q": [0, 0.05, 0.25, 0.5, 0.75, 0.95, 1], "sum_s"}},
//              of the first kDetailedCells "bands": {NAME: {"t_s", "q05", "median", "q95", "rms"}}, "nees_bands",
//              "paths"
//   trials     columns over all runs, at most kListedTrials
// Figures have six digits, which is more than a chart shows.
#pragma once

#include <filesystem>

#include <nlohmann/json.hpp>

#include "eval/summary.h"
#include "tools/experiment.h"

namespace plumbline::tools {

inline constexpr int kDetailedCells = 24;
inline constexpr int kListedTrials = 2000;
inline constexpr int kSeriesOfACell = 1000;

// Of a published sweep.
nlohmann::ordered_json report_data(const Plan& plan, const std::filesystem::path& out,
                                   const std::vector<eval::CellSummary>& cells);

}  // namespace plumbline::tools
