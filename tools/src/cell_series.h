// The series of a cell's trials as a report shows them: bands over trials, and paths of two of them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace plumbline::tools {

// Six significant digits.
double rounded(double x);
nlohmann::ordered_json rounded(const std::vector<double>& values);

// {"bands": {NAME: {"t_s", "q05", "median", "q95", "rms"}}, "nees_bands": {BLOCK: {"t_s", "mean", "dof", "band95"}},
//  "series": how many} of the runs' series, NAME being td_ms, td_sigma_ms, position_x_mm, rotation_x_deg and so on, and
// bound_td_ms, bound_position_mm, bound_rotation_deg. Nothing of a quantity that no series has. Files that are missing
// are left out.
nlohmann::ordered_json series_bands(const std::filesystem::path& out, const std::vector<std::string>& run_ids);

// {"t_s", "truth": [x, y, z], "estimate": [x, y, z]} of a run, after alignment [m]; null without its file.
nlohmann::ordered_json path_of(const std::filesystem::path& out, const std::string& run_id);

}  // namespace plumbline::tools
