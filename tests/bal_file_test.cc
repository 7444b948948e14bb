// BAL problem files: the format, exact round trips, and what must be refused.
#include "core/bal_file.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/bzip2.h"
#include "core/error.h"
#include "core/random.h"

namespace plumbline::core {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

// Two cameras, two points, three observations; every number is a different one.
const std::string kCounts = "2 2 3\n";
const std::string kObservations = "0 0 1.5 -2.5\n0 1 3 4\n1 1 5e1 -6\n";
const std::string kCameras =
    ".1\n.2\n.3\n4\n5\n6\n700\n-.08\n.009\n"
    "-.1\n-.2\n-.3\n-4\n-5\n-6\n701\n.18\n.019\n";
const std::string kPoints = "10\n11\n12\n13\n14\n15\n";
const std::string kProblem = kCounts + kObservations + kCameras + kPoints;

class Folder : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "plumbline-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path write(const std::string& name, std::string_view bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }

  fs::path folder_;
};
using BalFile = Folder;

std::string failure(const auto& action) {
  try {
    action();
  } catch (const DataError& error) {
    return error.what();
  }
  return "no error";
}

void expect_equal(const BalProblem& a, const BalProblem& b) {
  ASSERT_EQ(a.cameras.size(), b.cameras.size());
  ASSERT_EQ(a.observations.size(), b.observations.size());
  EXPECT_EQ(a.points, b.points);
  for (std::size_t i = 0; i < a.cameras.size(); ++i) {
    EXPECT_EQ(a.cameras[i].w, b.cameras[i].w);
    EXPECT_EQ(a.cameras[i].t, b.cameras[i].t);
    EXPECT_EQ(a.cameras[i].intrinsics.f_px, b.cameras[i].intrinsics.f_px);
    EXPECT_EQ(a.cameras[i].intrinsics.k1, b.cameras[i].intrinsics.k1);
    EXPECT_EQ(a.cameras[i].intrinsics.k2, b.cameras[i].intrinsics.k2);
  }
  for (std::size_t i = 0; i < a.observations.size(); ++i) {
    EXPECT_EQ(a.observations[i].camera, b.observations[i].camera);
    EXPECT_EQ(a.observations[i].point, b.observations[i].point);
    EXPECT_EQ(a.observations[i].pixel, b.observations[i].pixel);
  }
}

TEST(BalText, OrderOfNumbers) {
  const BalProblem p = parse_bal(kProblem, "p");
  ASSERT_EQ(p.observations.size(), 3U);
  EXPECT_EQ(p.observations[2].camera, 1);
  EXPECT_EQ(p.observations[1].point, 1);
  EXPECT_EQ(p.observations[0].pixel, Eigen::Vector2d(1.5, -2.5));
  EXPECT_EQ(p.observations[2].pixel, Eigen::Vector2d(50.0, -6.0));
  ASSERT_EQ(p.cameras.size(), 2U);
  EXPECT_EQ(p.cameras[0].w, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(p.cameras[0].t, Eigen::Vector3d(4.0, 5.0, 6.0));
  EXPECT_EQ(p.cameras[0].intrinsics.f_px, 700.0);
  EXPECT_EQ(p.cameras[0].intrinsics.k1, -0.08);
  EXPECT_EQ(p.cameras[1].intrinsics.k2, 0.019);
  ASSERT_EQ(p.points.size(), 2U);
  EXPECT_EQ(p.points[1], Eigen::Vector3d(13.0, 14.0, 15.0));
}

TEST(BalText, LineBreaksAndSignsDoNotMatter) {
  std::string text = kProblem;
  for (char& c : text) c = c == '\n' ? '\t' : c;
  expect_equal(parse_bal(text, "p"), parse_bal(kProblem, "p"));
  expect_equal(parse_bal("2 2 3\r\n" + kObservations + kCameras + "+10 11 12 13 14 15  \r\n\n", "p"),
               parse_bal(kProblem, "p"));
}

struct BadText {
  const char* name;
  std::string text;
  const char* message;
};

class BadBal : public ::testing::TestWithParam<BadText> {};

TEST_P(BadBal, IsRefusedInOneLine) {
  const std::string message = failure([] { parse_bal(GetParam().text, "bad.txt"); });
  EXPECT_THAT(message, ::testing::StartsWith("bad.txt:"));
  EXPECT_THAT(message, HasSubstr(GetParam().message));
  EXPECT_EQ(message.find('\n'), std::string::npos);
  for (const char c : message) EXPECT_TRUE(c >= ' ' && c <= '~');
}

std::string replaced(const std::string& from, const std::string& to) {
  std::string text = kProblem;
  return text.replace(text.find(from), from.size(), to);
}

// Counts of 10^12 would need terabytes: room made for them would end the test.
INSTANTIATE_TEST_SUITE_P(
    Texts, BadBal,
    ::testing::Values(
        BadText{"empty", "", ":1: an empty file"}, BadText{"blank", " \n\n", ":1: an empty file"},
        BadText{"one_count", "2", ":1: the file ends where the number of points is expected"},
        BadText{"zero_points", replaced("2 2 3", "2 0 3"), ":1: the number of points must be at least 1, not 0"},
        BadText{"negative", replaced("2 2 3", "-2 2 3"), ":1: the number of cameras must be at least 1, not -2"},
        BadText{"huge_observations", replaced("2 2 3", "2 2 1000000000000"),
                ":1: 2 cameras, 2 points and 1000000000000"},
        BadText{"huge_cameras", replaced("2 2 3", "1000000000000 2 3"), "cannot be in a file of"},
        BadText{"huge_points", replaced("2 2 3", "2 1000000000000 3"), "cannot be in a file of"},
        BadText{"overflow", replaced("2 2 3", "2 2 99999999999999999999"), "must be an integer"},
        BadText{"too_many", replaced("2 2 3", "2 2 40"), "cannot be in a file of"},
        BadText{"fraction", replaced("2 2 3", "2.5 2 3"), ":1: the number of cameras must be an integer, not '2.5'"},
        BadText{"camera_range", replaced("1 1 5e1", "2 1 5e1"), ":4: the camera of an observation must be from 0 to 1"},
        BadText{"point_range", replaced("0 1 3", "0 -1 3"), ":3: the point of an observation must be from 0 to 1"},
        BadText{"nan", replaced("5e1", "nan"), ":4: u of an observation must be finite, not 'nan'"},
        BadText{"infinite", replaced("700", "inf"), ":11: a camera's focal length must be finite"},
        BadText{"out_of_range", replaced("701", "1e999"), ":20: a camera's focal length is outside the range"},
        BadText{"word", replaced("-.08", "k1"), ":12: a camera's k1 must be a number, not 'k1'"},
        BadText{"comma", replaced("3 4", "3,4"), ":3: u of an observation must be a number, not '3,4'"},
        BadText{"truncated", kCounts + kObservations + kCameras, ":23: the file ends where a point is expected"},
        BadText{"cut_short", kProblem.substr(0, kProblem.size() - 3), "the file ends where a point is expected"},
        BadText{"trailing", kProblem + "16\n", ":29: '16' follows the last point"},
        BadText{"binary",
                std::string("\x7f"
                            "ELF\x02\x01\x01\0\0\0",
                            10),
                "must be an integer, not '\\x7fELF\\x02"},
        BadText{"zeros", kProblem + std::string(3, '\0'), "'\\x00\\x00\\x00' follows the last point"}),
    [](const auto& text) { return text.param.name; });

// Every prefix of a problem is refused, but those that end within the digits of the last number.
TEST(BalText, NoPrefixPasses) {
  for (std::size_t n = 0; n + 2 < kProblem.size(); ++n) {
    EXPECT_NE(failure([&] { parse_bal(std::string_view(kProblem).substr(0, n), "p"); }), "no error") << n;
  }
}

TEST_F(BalFile, RoundTripIsExactPlainAndCompressed) {
  const RandomStream random({3, 0}, "bal_file_test");
  BalProblem problem;
  for (std::uint64_t i = 0; i < 5; ++i) {
    problem.cameras.push_back(
        {random.normal3(i, 0), 1e-9 * random.normal3(i, 1), {500.0 + random.normal(i, 2), 1e-300, -0.0}});
    problem.points.push_back(1e12 * random.normal3(i, 3));
    problem.observations.push_back({static_cast<int>(i), static_cast<int>(4 - i), random.normal2(i, 4)});
  }
  for (const char* name : {"p.txt", "p.txt.bz2"}) {
    write_bal(folder_ / name, problem);
    expect_equal(read_bal(folder_ / name), problem);
  }
  EXPECT_LT(fs::file_size(folder_ / "p.txt.bz2"), fs::file_size(folder_ / "p.txt"));
}

TEST_F(BalFile, CompressionIsToldByTheBytesAndMayHaveManyStreams) {
  const std::string two = bzip2_compress(kCounts + kObservations) + bzip2_compress(kCameras + kPoints);
  expect_equal(read_bal(write("p.txt", two)), parse_bal(kProblem, "p"));
}

TEST_F(BalFile, DamagedCompressionIsRefused) {
  const std::string good = bzip2_compress(kProblem);
  std::string flipped = good;
  flipped[flipped.size() / 2] ^= 0x10;
  const auto message = [&](std::string_view bytes) {
    const fs::path path = write("p.bz2", bytes);
    return failure([&] { read_bal(path); });
  };
  EXPECT_THAT(message(flipped), HasSubstr("p.bz2:1: a damaged bzip2 stream"));
  EXPECT_THAT(message(std::string_view(good).substr(0, good.size() - 5)),
              HasSubstr("p.bz2:1: a truncated bzip2 stream"));
  EXPECT_THAT(message(bzip2_compress(kProblem + std::string(5'000'000, ' '))),
              HasSubstr("p.bz2:1: a bzip2 stream of implausible length"));
  EXPECT_THAT(message("BZh"), HasSubstr("p.bz2:1: a truncated bzip2 stream"));
  EXPECT_THAT(message("BZh9 no more"), HasSubstr("p.bz2:1: a damaged bzip2 stream"));
  EXPECT_THAT(message(good + "tail"), HasSubstr("p.bz2:1: bytes that belong to no bzip2 stream"));
  EXPECT_THAT(message(bzip2_compress("")), HasSubstr("p.bz2:1: an empty file"));
  EXPECT_THAT(message(bzip2_compress("2 2 x")), HasSubstr("p.bz2:1: the number of observations must be an integer"));
}

TEST(Bzip2, StopsAtTheLimit) {
  const std::string bomb = bzip2_compress(std::string(5'000'000, ' '));
  EXPECT_LT(bomb.size(), 1000U);
  EXPECT_EQ(bzip2_decompress(bomb, 5'000'000).size(), 5'000'000U);
  EXPECT_THROW(bzip2_decompress(bomb, 4'999'999), Bzip2Error);
}

TEST_F(BalFile, MissingAndFolder) {
  EXPECT_THAT(failure([&] { read_bal(folder_ / "none.txt"); }), HasSubstr("none.txt: no such file"));
  EXPECT_THAT(failure([&] { read_bal(folder_); }), HasSubstr("a folder, not a BAL problem"));
}

}  // namespace
}  // namespace plumbline::core
