#include "core/pose_file.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <system_error>

#include <gtest/gtest.h>

#include "core/atomic_file.h"
#include "core/error.h"

namespace plumbline::core {
namespace {

namespace fs = std::filesystem;

fs::path scratch(const std::string& name) {
  const fs::path folder = fs::path(testing::TempDir()) / "plumbline_pose_file" /
                          testing::UnitTest::GetInstance()->current_test_info()->name();
  fs::create_directories(folder);
  fs::remove_all(folder / name);  // of an earlier run
  return folder / name;
}

std::string contents(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

TimeNs stamp(const std::string& text) { return parse_tum(text + " 0 0 0 0 0 0 1", "f").front().t_ns; }

std::string refusal(const std::string& text, const PoseFileOptions& options = {}) {
  try {
    parse_tum(text, "f", options);
  } catch (const DataError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(PoseFile, StampsAreExact) {
  EXPECT_EQ(stamp("1403636580.863555527"), 1403636580863555527);  // as a double: ...555574
  EXPECT_EQ(stamp("1.403636580863555527e+09"), 1403636580863555527);
  EXPECT_EQ(stamp("14036365808635555.27e-7"), 1403636580863555527);
  EXPECT_EQ(stamp("100.050000000000"), 100050000000);
  EXPECT_EQ(stamp("7"), 7 * kNsPerSecond);
  EXPECT_EQ(stamp(".5"), 500'000'000);
  EXPECT_EQ(stamp("0.0000000015"), 2);
  EXPECT_EQ(stamp("0.00000000149"), 1);
  EXPECT_EQ(stamp("0.00000000049"), 0);
  EXPECT_EQ(stamp("-0.000000001"), -1);
  EXPECT_EQ(stamp("9223372036.854775807"), std::numeric_limits<TimeNs>::max());
}

TEST(PoseFile, StampsThatDoNotFitAreRefused) {
  const std::string pose = " 0 0 0 0 0 0 1";
  EXPECT_EQ(refusal("9223372036.854775808" + pose),
            "f:1: the stamp '9223372036.854775808' is too large for integer nanoseconds");
  EXPECT_NE(refusal("9223372036.8547758075" + pose).find("too large"), std::string::npos);
  EXPECT_NE(refusal("1403636580863555527" + pose).find("too large"), std::string::npos);
  EXPECT_NE(refusal("1e300" + pose).find("too large"), std::string::npos);
  for (const char* word : {"nan", "inf", "1.2.3", "1e", "--1", "0x10", ".", "1,5"}) {
    EXPECT_NE(refusal(word + pose).find("is not a number"), std::string::npos) << word;
    EXPECT_NE(refusal(word + pose, {.allow_unusable = true}).find("is not a number"), std::string::npos) << word;
  }
}

TEST(PoseFile, ReadsColumnsInTheirOrder) {
  const auto poses =
      parse_tum("# t x y z qx qy qz qw\r\n\r\n  1 2\t3 -4e0 0.5 -0.5 +0.5 -0.5 99 variance\r\n2 0 0 0 0 0 0 1", "f");
  ASSERT_EQ(poses.size(), 2U);
  EXPECT_EQ(poses[0].T_W_B.p, Eigen::Vector3d(2.0, 3.0, -4.0));
  EXPECT_EQ(poses[0].T_W_B.q.coeffs(), Eigen::Vector4d(0.5, -0.5, 0.5, -0.5));
}

TEST(PoseFile, NormalisesWhatIsNearlyUnit) {
  const auto poses = parse_tum("1 0 0 0 0 0 0.6 0.8005", "f");
  EXPECT_NEAR(poses[0].T_W_B.q.norm(), 1.0, 1e-15);
  EXPECT_EQ(refusal("1 0 0 0 0 0 0.6 0.802"), "f:1: the quaternion's norm is 1.0016, not 1 (to 0.001)");
  EXPECT_EQ(refusal("1 0 0 0 0 0 0 0"), "f:1: the quaternion's norm is 0, not 1 (to 0.001)");
}

TEST(PoseFile, RefusesByFileLineAndRule) {
  EXPECT_EQ(refusal("# c\n1 0 0 0 0 0 1\n"), "f:2: a pose needs 8 columns (t tx ty tz qx qy qz qw), not 7");
  EXPECT_EQ(refusal("1 0 0 0 0 0 0 1\n2 0 x 0 0 0 0 1\n"), "f:2: 'x' is not a number");
  EXPECT_EQ(refusal("1 0 1e999 0 0 0 0 1\n"), "f:1: '1e999' is outside the range of a double");
  EXPECT_EQ(refusal("1 0 nan 0 0 0 0 1\n"), "f:1: 'nan' is not finite");
  EXPECT_EQ(refusal("1 0 0 -inf 0 0 0 1\n"), "f:1: '-inf' is not finite");
  EXPECT_EQ(refusal("2 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n"),
            "f:2: stamps must increase: this one is unsorted, earlier than the one before");
  EXPECT_EQ(refusal("2 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n"),
            "f:2: stamps must increase: this one is a duplicate of the one before");
  EXPECT_EQ(refusal(""), "f: no poses");
  EXPECT_EQ(refusal("# only a comment\n"), "f: no poses");
  EXPECT_EQ(refusal(std::string("1 0\0 0", 6)), "f: a binary file, not a list of poses");
  EXPECT_THROW(read_tum(scratch("missing.tum")), DataError);
  EXPECT_THROW(read_tum(scratch("missing.tum").parent_path()), DataError);
}

TEST(PoseFile, HandsOnWhatIsReadableButUnusable) {
  const PoseFileOptions options{.allow_unusable = true};
  const auto poses = parse_tum("2 nan 0 0 0 0 0 1\n2 0 inf 0 0 0 0 1\n1 0 0 0 nan nan nan nan\n", "f", options);
  ASSERT_EQ(poses.size(), 3U);
  EXPECT_TRUE(std::isnan(poses[0].T_W_B.p.x()));
  EXPECT_TRUE(std::isinf(poses[1].T_W_B.p.y()));
  EXPECT_TRUE(std::isnan(poses[2].T_W_B.q.w()));
  EXPECT_EQ(poses[1].t_ns, poses[0].t_ns);
  EXPECT_LT(poses[2].t_ns, poses[1].t_ns);
  EXPECT_NE(refusal("1 0 0", options), "accepted");
}

TEST(PoseFile, RoundTripsToTheLastBit) {
  const Pose a{Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5), {0.1, -1.0 / 3.0, 1e-17}};
  const Pose b{Eigen::Quaterniond::Identity(), {1e300, 4.9e-324, -0.0}};
  const fs::path path = scratch("poses.tum");
  write_tum(path, {{-1'500'000'001, a}, {-1, a}, {0, b}, {1403636580863555527, b}});
  EXPECT_TRUE(contents(path).starts_with("-1.500000001 0.1 -0.3333333333333333 1e-17 0.5 -0.5 0.5 0.5\n-0.000000001 "));
  const auto read = read_tum(path);
  ASSERT_EQ(read.size(), 4U);
  EXPECT_EQ(read[0].t_ns, -1'500'000'001);
  EXPECT_EQ(read[3].t_ns, 1403636580863555527);
  EXPECT_EQ(read[0].T_W_B.p, a.p);
  EXPECT_EQ(read[3].T_W_B.p, b.p);
  EXPECT_EQ(read[0].T_W_B.q.coeffs(), a.q.coeffs());
}

TEST(AtomicFile, ReplacesAndLeavesNothingBehind) {
  const fs::path path = scratch("file.txt");
  write_file_atomically(path, "old");
  write_file_atomically(path, "new");
  EXPECT_EQ(contents(path), "new");
  EXPECT_EQ(std::distance(fs::directory_iterator(path.parent_path()), {}), 1);
}

TEST(AtomicFile, FailsWithThePathAndLeavesNothingBehind) {
  const fs::path folder = scratch("folder_in_the_way");
  fs::create_directories(folder / "child");
  EXPECT_THROW(write_file_atomically(folder, "text"), std::system_error);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.parent_path()), {}), 1);
  try {
    write_file_atomically(folder / "no_such_folder" / "file", "text");
    FAIL() << "wrote into a folder that does not exist";
  } catch (const std::system_error& error) {
    EXPECT_NE(std::string(error.what()).find("no_such_folder/file"), std::string::npos);
  }
}

TEST(AtomicFile, DoesNotReplaceADevice) {
  write_file_atomically("/dev/null", "text");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

}  // namespace
}  // namespace plumbline::core
