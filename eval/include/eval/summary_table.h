// Cells as a table for a terminal of 100 columns, plain ASCII.
#pragma once

#include <string>
#include <vector>

#include "eval/summary.h"

namespace plumbline::eval {

// One block a cell: its axes and n_ok/n, then a line a metric. A mean NEES outside its band is marked with `!`.
std::string summary_table(const std::vector<CellSummary>& cells);

// The same for a pull request: a heading and a table of Markdown a cell.
std::string summary_markdown(const std::vector<CellSummary>& cells);

}  // namespace plumbline::eval
