#include "core/pose_covariance_file.h"

#include <algorithm>
#include <string>

#include <gtest/gtest.h>

#include "core/error.h"

namespace plumbline::core {
namespace {

const std::string kPose = "1.0 0 0 0 0 0 0 1";
const std::string kTriangle = " 11 12 13 14 15 16 22 23 24 25 26 33 34 35 36 44 45 46 55 56 66";

TEST(PoseCovarianceFile, TheUpperTriangleRowByRow) {
  const auto covariances = parse_tum_covariances("# a comment\n" + kPose + kTriangle + "\n\n" + kPose + kTriangle, "f");
  ASSERT_EQ(covariances.size(), 2U);
  for (int r = 0; r < 6; ++r) {
    for (int c = 0; c < 6; ++c) {
      EXPECT_EQ(covariances[1](r, c), 10 * (std::min(r, c) + 1) + std::max(r, c) + 1) << r << ' ' << c;
    }
  }
}

TEST(PoseCovarianceFile, OtherColumnsAreNoCovariances) {
  EXPECT_TRUE(parse_tum_covariances(kPose + "\n", "f").empty());
  EXPECT_TRUE(parse_tum_covariances(kPose + " 1 1 1 1 1 1\n", "f").empty());  // six variances, as of udel_gore
  EXPECT_TRUE(parse_tum_covariances("", "f").empty());
}

TEST(PoseCovarianceFile, RefusesHalfACovariance) {
  const auto message = [](const std::string& text) {
    try {
      parse_tum_covariances(text, "f");
    } catch (const DataError& error) {
      return std::string(error.what());
    }
    return std::string("none");
  };
  const std::string good = kPose + kTriangle + "\n";
  EXPECT_EQ(message(good + kPose + "\n"), "f:2: 8 columns after lines of 29");
  EXPECT_EQ(message(good + kPose + " x" + kTriangle.substr(3)), "f:2: 'x' is not a number");
  EXPECT_EQ(message(kPose + " nan" + kTriangle.substr(3)), "f:1: 'nan' is not finite");
  EXPECT_THROW(read_tum_covariances("no/such/file"), DataError);
}

}  // namespace
}  // namespace plumbline::core
