// The page of a sweep: one file that needs no other and no network. What it shows: docs/reports.md.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "eval/summary.h"
#include "tools/experiment.h"

namespace plumbline::tools {

inline constexpr std::string_view kReportFile = "report.html";

// Of a published sweep.
void write_report(const Plan& plan, const std::filesystem::path& out, const std::vector<eval::CellSummary>& cells,
                  const std::filesystem::path& file);

// The page (tools/report) with data that it knows how to show.
std::string report_page(std::string_view title, const nlohmann::ordered_json& data);

}  // namespace plumbline::tools
