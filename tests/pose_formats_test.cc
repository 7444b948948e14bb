#include "core/pose_formats.h"

#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "core/error.h"

namespace plumbline::core {
namespace {

std::string refusal(const std::string& text, const PoseFormatOptions& options = {}) {
  try {
    parse_poses(text, "f", options);
  } catch (const DataError& error) {
    return error.what();
  }
  return "accepted";
}

constexpr const char* kKittiIdentity = "1 0 0 0 0 1 0 0 0 0 1 0\n";
constexpr const char* kEurocHeader =
    "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], v_RS_R_x [m "
    "s^-1]\n";

TEST(PoseFormats, AutoTellsByTheFirstLine) {
  const auto format = [](const std::string& text, const std::string& name) {
    return parse_poses(text, name, {.kitti_rate_hz = 10.0}).format;
  };
  EXPECT_EQ(format("# x,y\n1 0 0 0 0 0 0 1\n", "a.csv"), PoseFormat::kTum);
  EXPECT_EQ(format("1,0,0,0,1,0,0,0\n", "a.txt"), PoseFormat::kEuroc);
  EXPECT_EQ(format(kKittiIdentity, "00.txt"), PoseFormat::kKitti);
  EXPECT_EQ(format("1 0 0 0 0 0 0 1 9 9 9 9\n", "a.tum"), PoseFormat::kTum);
  EXPECT_EQ(format("1 0 0 0 0 0 0 1 9 9 9 9 9 9\n", "a.txt"), PoseFormat::kTum);
  EXPECT_EQ(refusal("# nothing\n"), "f: no poses");
}

TEST(PoseFormats, EurocHasIntegerStampsAndWFirst) {
  const auto poses =
      parse_poses(std::string(kEurocHeader) + "1403636580863555584,1,2,3, 0.5,-0.5,0.5,0.5,7,7\r\n", "data.csv").poses;
  ASSERT_EQ(poses.size(), 1U);
  EXPECT_EQ(poses[0].t_ns, 1403636580863555584);
  EXPECT_EQ(poses[0].T_W_B.p, Eigen::Vector3d(1.0, 2.0, 3.0));
  EXPECT_EQ(poses[0].T_W_B.q.w(), 0.5);
  EXPECT_EQ(poses[0].T_W_B.q.vec(), Eigen::Vector3d(-0.5, 0.5, 0.5));
}

TEST(PoseFormats, EurocTakesVinsTrailingCommaAndFilesWithPosesOnly) {
  const std::string bare = "1,1,2,3,1,0,0,0";
  for (const std::string& line : {bare, bare + ",", bare + ", \r", bare + ",0.1,0.2,0.3,"}) {
    const auto file = parse_poses(line + "\n", "f");
    ASSERT_EQ(file.poses.size(), 1U) << line;
    EXPECT_EQ(file.poses[0].T_W_B.p.z(), 3.0) << line;
  }
  EXPECT_EQ(refusal("1,1,2,3,1,0,0,\n"), "f:1: a pose needs 8 columns (t_ns,px,py,pz,qw,qx,qy,qz), not 7");
  EXPECT_EQ(refusal("1,1,2,,1,0,0,0\n"), "f:1: '' is not a number");
}

TEST(PoseFormats, EurocRefusesByFileLineAndRule) {
  EXPECT_EQ(refusal("1.5,0,0,0,1,0,0,0\n"), "f:1: the stamp '1.5' is not integer nanoseconds");
  EXPECT_EQ(refusal("1,0,0,nan,1,0,0,0\n"), "f:1: 'nan' is not finite");
  EXPECT_EQ(refusal("#\n1,0,0,0,1,1,0,0\n"), "f:2: the quaternion's norm is 1.41421, not 1 (to 0.001)");
  EXPECT_EQ(refusal("2,0,0,0,1,0,0,0\n1,0,0,0,1,0,0,0\n"),
            "f:2: stamps must increase: this one is unsorted, earlier than the one before");
  EXPECT_EQ(refusal("2,0,0,0,1,0,0,0\n2,0,0,0,1,0,0,0\n"),
            "f:2: stamps must increase: this one is a duplicate of the one before");
}

// KITTI's camera moves along its own z axis and turns about its own y axis, which points down: in our axes it moves
// along x, and turns to the right, which is negative about z.
TEST(PoseFormats, KittiTurnsToAxesWithZUp) {
  const double c = std::cos(0.1);
  const double s = std::sin(0.1);
  const std::string turned = std::to_string(c) + " 0 " + std::to_string(s) + " 0.5 0 1 0 -0.25 " + std::to_string(-s) +
                             " 0 " + std::to_string(c) + " 2\n";
  const auto poses = parse_poses(kKittiIdentity + turned, "00.txt", {.kitti_rate_hz = 10.0}).poses;
  ASSERT_EQ(poses.size(), 2U);
  EXPECT_EQ(poses[0].t_ns, 0);
  EXPECT_EQ(poses[1].t_ns, 100'000'000);
  EXPECT_LT(rotation_angle(poses[0].T_W_B.q), 1e-15);
  EXPECT_LT((poses[1].T_W_B.p - Eigen::Vector3d(2.0, -0.5, 0.25)).norm(), 1e-15);
  // Six decimals of sine and cosine.
  EXPECT_LT((log_so3(poses[1].T_W_B.q) - Eigen::Vector3d(0.0, 0.0, -0.1)).norm(), 1e-6);
}

TEST(PoseFormats, KittiRefusesByFileLineAndRule) {
  const PoseFormatOptions kitti{.format = PoseFormat::kKitti, .kitti_rate_hz = 10.0};
  EXPECT_EQ(refusal("1 0 0 0 0 1 0 0 0 0 1\n", kitti), "f:1: a KITTI pose has 12 numbers, the rows of [R t], not 11");
  EXPECT_EQ(refusal(std::string(kKittiIdentity) + "-1 0 0 0 0 1 0 0 0 0 1 0\n", kitti),
            "f:2: its left 3 columns are not a rotation: R R^T is off the identity by 0, its determinant -1");
  EXPECT_EQ(refusal("1 0 0 0 0 1 0 0 0 0 1.01 0\n", kitti),
            "f:1: its left 3 columns are not a rotation: R R^T is off the identity by 0.0201, its determinant 1.01");
  EXPECT_EQ(refusal("1 0 0 inf 0 1 0 0 0 0 1 0\n", kitti), "f:1: 'inf' is not finite");
  EXPECT_EQ(refusal(kKittiIdentity),
            "f: a KITTI file has no stamps; scenario.trajectory.pose_rate_hz must give their rate");
}

TEST(PoseFormats, AGivenFormatIsTakenAtItsWord) {
  EXPECT_EQ(refusal("1,0,0,0,1,0,0,0\n", {.format = PoseFormat::kTum}),
            "f:1: a pose needs 8 columns (t tx ty tz qx qy qz qw), not 1");
  EXPECT_EQ(parse_poses("1 0 0 0 0 0 0 1 9 9 9 9\n", "f", {.format = PoseFormat::kTum}).format, PoseFormat::kTum);
}

}  // namespace
}  // namespace plumbline::core
