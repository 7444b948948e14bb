// The report of a sweep: what stands in the file. How it looks and behaves: tests/report_page.
#include "tools/report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "program_test.h"

namespace plumbline {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;
using ::testing::HasSubstr;
using ::testing::Not;

class ReportTest : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("x.yaml",
          "experiment: {trials: 3, axes: {scenario.camera.td_s: [0, 0.02]}}\n"
          "scenario:\n  duration_s: 2\n  world: {landmarks: 1000}\n  points: {per_frame: 20}\n"
          "  imu: {gyro_noise_density_rad_s_sqrt_hz: 1.7e-4, gyro_bias_walk_rad_s2_sqrt_hz: 2.0e-5, "
          "accel_noise_density_m_s2_sqrt_hz: 2.0e-3, accel_bias_walk_m_s3_sqrt_hz: 3.0e-3}\n"
          "estimator: {type: sliding_window, keyframe_rate_hz: 10}\nset: {eval.crlb: true}\n");
    ASSERT_EQ(plumbline("run x.yaml --out x --jobs 1").code, 0);
  }

  // The data inside a page.
  static ordered_json data_of(const std::string& page) {
    const std::string begin = "<script type=\"application/json\" id=\"data\">";
    const std::size_t from = page.find(begin) + begin.size();
    return ordered_json::parse(page.substr(from, page.find("</script>", from) - from));
  }
};

TEST_F(ReportTest, HoldsTheSummaryAndTheSeriesOfTheRun) {
  const ordered_json data = data_of(read(folder_ / "x/report.html"));
  const ordered_json summary = ordered_json::parse(read(folder_ / "x/summary.json"));
  ASSERT_EQ(data["cells"].size(), 2U);
  for (std::size_t c = 0; c < 2; ++c) {
    const ordered_json& cell = data["cells"][c];
    EXPECT_EQ(cell["axes"], summary["cells"][c]["axes"]);
    EXPECT_EQ(cell["series"], 3);
    for (const char* name : {"td_ms", "td_sigma_ms", "bound_td_ms", "position_x_mm", "rotation_z_deg"}) {
      EXPECT_TRUE(cell["bands"].contains(name)) << name;
    }
    const double rmse = summary["cells"][c]["metrics"]["td_error_s"]["rmse"];
    EXPECT_NEAR(cell["metrics"]["td_error_s"]["rmse"].get<double>(), rmse, 1e-5 * rmse);
    // The last instant's error is the trial's.
    EXPECT_NEAR(cell["bands"]["td_ms"]["rms"].back().get<double>(), 1e3 * rmse, 1e-2 * rmse);
    EXPECT_EQ(cell["ecdf"]["ate_position_m"].size(), 101U);
    EXPECT_EQ(cell["paths"]["worst"]["truth"].size(), 3U);
  }
  EXPECT_EQ(data["trials"]["trial"].size(), 6U);
  EXPECT_EQ(data["worst"].size(), 15U);
  EXPECT_EQ(data["worst"][0]["replay"].get<std::string>().substr(0, 19), "plumbline replay x ");
  EXPECT_EQ(data["config"]["scenario"]["duration_s"], 2.0);
}

TEST_F(ReportTest, NeedsNothingButItself) {
  const std::string page = read(folder_ / "x/report.html");
  EXPECT_THAT(page, HasSubstr("default-src 'none'"));
  EXPECT_THAT(page, Not(HasSubstr("<link")));
  EXPECT_THAT(page, Not(HasSubstr("<script src")));
  EXPECT_LT(page.size(), 1'500'000U);
}

TEST_F(ReportTest, IsMadeAgainByCommand) {
  const std::string first = read(folder_ / "x/report.html");
  fs::remove(folder_ / "x/report.html");
  EXPECT_EQ(plumbline("report x").code, 0);
  EXPECT_EQ(read(folder_ / "x/report.html"), first);
  EXPECT_EQ(plumbline("report x --out y.html").code, 0);
  EXPECT_EQ(data_of(read(folder_ / "y.html"))["cells"], data_of(first)["cells"]);
}

TEST_F(ReportTest, SpeaksMarkdown) {
  const ProgramResult result = plumbline("report x --format md");
  EXPECT_EQ(result.code, 0);
  EXPECT_THAT(result.out, HasSubstr("# x\n\n**"));
  EXPECT_THAT(result.out, HasSubstr("- 6 of 6 trials gave an answer.\n"));
  EXPECT_THAT(result.out, HasSubstr("**scenario.camera.td_s = 0.02**, 3/3 ok\n\n| metric | mean | RMSE |"));
  EXPECT_THAT(result.out, HasSubstr("| td error [us] | "));
}

TEST_F(ReportTest, RefusesAFolderWithoutResults) {
  fs::create_directory(folder_ / "empty");
  EXPECT_EQ(plumbline("report empty").code, 2);
  ASSERT_EQ(plumbline("plan x.yaml --out planned").code, 0);
  const ProgramResult planned = plumbline("report planned");
  EXPECT_EQ(planned.code, 2);
  EXPECT_THAT(planned.err, HasSubstr("no results yet; to make them: plumbline run planned"));
}

TEST(ReportPage, DataCannotEndItsElement) {
  const std::string page = tools::report_page("a < b", {{"kind", "x"}, {"text", "</script><script>alert(1)"}});
  EXPECT_THAT(page, HasSubstr("<title>a &lt; b"));
  EXPECT_THAT(page, HasSubstr("\\u003c/script>\\u003cscript>alert(1)"));
}

}  // namespace
}  // namespace plumbline
