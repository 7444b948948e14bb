#include "cell_series.h"

#include <array>
#include <cstdlib>
#include <fstream>
#include <map>

#include <fmt/format.h>

#include "core/error.h"
#include "core/lie.h"
#include "eval/bands.h"
#include "eval/statistics.h"

namespace plumbline::tools {
namespace {

using nlohmann::ordered_json;

// Of a quantity: where it stands in a series, and what it is multiplied by.
struct Source {
  const char* name;
  const char* section;  // empty: the series itself
  const char* key;
  int component;  // -1: the key holds one array
  double scale;
};

constexpr double kMs = 1e3;
constexpr double kMm = 1e3;
constexpr double kDeg = core::kDegreesPerRadian;
constexpr std::array<Source, 17> kSources = {{{"td_ms", "td", "td_error_s", -1, kMs},
                                              {"td_sigma_ms", "td", "sigma_s", -1, kMs},
                                              {"position_x_mm", "", "position_error_m", 0, kMm},
                                              {"position_y_mm", "", "position_error_m", 1, kMm},
                                              {"position_z_mm", "", "position_error_m", 2, kMm},
                                              {"rotation_x_deg", "", "rotation_error_rad", 0, kDeg},
                                              {"rotation_y_deg", "", "rotation_error_rad", 1, kDeg},
                                              {"rotation_z_deg", "", "rotation_error_rad", 2, kDeg},
                                              {"position_sigma_x_mm", "sigma", "position_m", 0, kMm},
                                              {"position_sigma_y_mm", "sigma", "position_m", 1, kMm},
                                              {"position_sigma_z_mm", "sigma", "position_m", 2, kMm},
                                              {"rotation_sigma_x_deg", "sigma", "rotation_rad", 0, kDeg},
                                              {"rotation_sigma_y_deg", "sigma", "rotation_rad", 1, kDeg},
                                              {"rotation_sigma_z_deg", "sigma", "rotation_rad", 2, kDeg},
                                              {"bound_td_ms", "bound", "td_s", -1, kMs},
                                              {"bound_position_mm", "bound", "position_m", -1, kMm},
                                              {"bound_rotation_deg", "bound", "orientation_rad", -1, kDeg}}};

struct NeesBlock {
  const char* key;
  int dof;
};
constexpr std::array<NeesBlock, 3> kNeesBlocks = {{{"pose", 6}, {"velocity", 3}, {"bias", 6}}};

std::filesystem::path series_file(const std::filesystem::path& out, const std::string& run_id) {
  return out / "series" / (run_id + ".json");
}

// Null where the file is not there.
ordered_json read_series(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return nullptr;
  ordered_json series = ordered_json::parse(stream, nullptr, false);
  if (!series.is_object()) throw core::DataError(file.generic_string() + ": is no series");
  return series;
}

void add_scaled(eval::BandOverTrials& band, const ordered_json& t_s, std::vector<double> values, double scale) {
  for (double& x : values) x *= scale;
  band.add(t_s.get<std::vector<double>>(), values);
}

void add_series(const ordered_json& series, std::map<std::string, eval::BandOverTrials>& bands,
                std::map<std::string, eval::BandOverTrials>& nees) {
  for (const Source& source : kSources) {
    const bool whole = *source.section == '\0';
    if (!whole && !series.contains(source.section)) continue;
    const ordered_json& section = whole ? series : series.at(source.section);
    const ordered_json& values = section.at(source.key);
    add_scaled(bands[source.name], section.at("t_s"),
               source.component < 0 ? values : values.at(static_cast<std::size_t>(source.component)), source.scale);
  }
  if (!series.contains("nees")) return;
  for (const NeesBlock& block : kNeesBlocks) {
    add_scaled(nees[block.key], series.at("nees").at("t_s"), series.at("nees").at(block.key), 1.0);
  }
}

ordered_json to_json(const eval::Band& band) {
  return {{"t_s", rounded(band.t_s)},
          {"q05", rounded(band.q05)},
          {"median", rounded(band.median)},
          {"q95", rounded(band.q95)},
          {"rms", rounded(band.rms)}};
}

// The band is that of as many trials as the instant has.
ordered_json nees_json(const eval::Band& band, int dof) {
  ordered_json lo = ordered_json::array();
  ordered_json hi = ordered_json::array();
  for (const int n : band.n) {
    const eval::Interval band95 = eval::chi_square_mean_band(dof, n, eval::kConfidence);
    lo.push_back(rounded(band95.lo));
    hi.push_back(rounded(band95.hi));
  }
  return {{"t_s", rounded(band.t_s)}, {"mean", rounded(band.mean)}, {"dof", dof}, {"lo", lo}, {"hi", hi}};
}

}  // namespace

double rounded(double x) { return std::strtod(fmt::format("{:.6g}", x).c_str(), nullptr); }

ordered_json rounded(const std::vector<double>& values) {
  ordered_json json = ordered_json::array();
  for (const double x : values) json.push_back(rounded(x));
  return json;
}

ordered_json series_bands(const std::filesystem::path& out, const std::vector<std::string>& run_ids) {
  std::map<std::string, eval::BandOverTrials> bands;
  std::map<std::string, eval::BandOverTrials> nees;
  int count = 0;
  for (const std::string& run_id : run_ids) {
    const std::filesystem::path file = series_file(out, run_id);
    const ordered_json series = read_series(file);
    if (series.is_null()) continue;
    try {
      add_series(series, bands, nees);
    } catch (const nlohmann::json::exception& error) {
      throw core::DataError(fmt::format("{}: {}", file.generic_string(), error.what()));
    }
    ++count;
  }
  ordered_json json = {{"series", count}, {"bands", ordered_json::object()}, {"nees_bands", ordered_json::object()}};
  for (const Source& source : kSources) {
    if (bands.contains(source.name)) json["bands"][source.name] = to_json(bands[source.name].band());
  }
  for (const NeesBlock& block : kNeesBlocks) {
    if (nees.contains(block.key)) json["nees_bands"][block.key] = nees_json(nees[block.key].band(), block.dof);
  }
  return json;
}

ordered_json path_of(const std::filesystem::path& out, const std::string& run_id) {
  const ordered_json series = read_series(series_file(out, run_id));
  if (series.is_null()) return nullptr;
  const auto positions = [&](const char* key) {
    ordered_json xyz = ordered_json::array();
    for (std::size_t i = 0; i < 3; ++i) xyz.push_back(rounded(series.at(key).at(i).get<std::vector<double>>()));
    return xyz;
  };
  return {{"t_s", rounded(series.at("t_s").get<std::vector<double>>())},
          {"truth", positions("truth")},
          {"estimate", positions("estimate")}};
}

}  // namespace plumbline::tools
