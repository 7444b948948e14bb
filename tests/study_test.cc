// What docs/results.md states, at full size. Label `study`: tools/test --studies runs it.
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/wait.h>

#include "eval/statistics.h"

namespace plumbline {
namespace {

nlohmann::json run(const std::string& experiment) {
  std::string out = (std::filesystem::temp_directory_path() / "plumbline-study-XXXXXX").string();
  EXPECT_NE(mkdtemp(out.data()), nullptr);
  const std::string command =
      std::string("'" PLUMBLINE_PROGRAM "' run '" PLUMBLINE_SOURCE_DIR "/configs/experiments/") + experiment +
      "' --json --out '" + out + "' >'" + out + "/summary.txt'";
  EXPECT_EQ(std::system(command.c_str()), 0);
  nlohmann::json summary = nlohmann::json::parse(std::ifstream(out + "/summary.txt"));
  std::filesystem::remove_all(out);
  return summary;
}

TEST(Study, HandheldRollingShutter) {
  const nlohmann::json cell = run("handheld_rs.yaml")["cells"][0];
  const auto& metrics = cell["metrics"];
  const int n = cell["n"];
  EXPECT_EQ(n, 50);
  EXPECT_EQ(cell["n_ok"], n);
  const double td_std = metrics["td_error_s"]["std"];
  EXPECT_LT(std::abs(metrics["td_error_s"]["mean"].get<double>()), 3.0 * td_std / std::sqrt(n));
  EXPECT_LT(metrics["td_error_s"]["rmse"], 60e-6);
  EXPECT_LT(metrics["ate_position_m"]["rmse"], 10e-3);
  for (const char* name : {"td_error_s", "extrinsic"}) {
    const auto band = eval::chi_square_mean_band(metrics[name]["nees_dof"], n, 0.999);
    EXPECT_TRUE(band.contains(metrics[name]["nees_mean"])) << name << " " << metrics[name]["nees_mean"];
  }
}

TEST(Study, NoiseFree) {
  const nlohmann::json cells = run("noise_free.yaml")["cells"];
  ASSERT_EQ(cells.size(), 4U);
  const auto rmse = [&](std::size_t cell, const char* name) -> double { return cells[cell]["metrics"][name]["rmse"]; };
  EXPECT_LT(rmse(0, "td_error_s"), 0.5e-6);
  EXPECT_LT(rmse(0, "ate_position_m"), 0.5e-3);
  for (std::size_t i = 1; i < cells.size(); ++i) {
    EXPECT_NEAR(rmse(i - 1, "td_error_s") / rmse(i, "td_error_s"), 4.0, 0.4);
    EXPECT_NEAR(rmse(i - 1, "ate_position_m") / rmse(i, "ate_position_m"), 4.0, 0.4);
  }
}

}  // namespace
}  // namespace plumbline
