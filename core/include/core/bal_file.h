// Problem files of "Bundle adjustment in the large" (grail.cs.washington.edu/projects/bal), plain text or bzip2:
//   CAMERAS POINTS OBSERVATIONS
//   CAMERA POINT U V          once for each observation; indices from 0, pixels from the centre of the picture
//   NUMBER                    9 a camera: rotation vector, translation, f, k1, k2; then 3 a point
// Numbers are separated by white space; line breaks have no meaning. The cameras look down their -z axis.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "core/bal_camera.h"

namespace plumbline::core {

struct BalObservation {
  int camera = 0;
  int point = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
};

struct BalProblem {
  std::vector<BalCamera> cameras;
  std::vector<Eigen::Vector3d> points;
  std::vector<BalObservation> observations;
};

// Throw DataError `file:line: rule` for what is not a whole and finite problem. Room is made only for what the length
// of the text can hold, whatever the counts say. A point seen twice by one camera is accepted: the format allows it.
BalProblem parse_bal(std::string_view text, const std::string& name);
BalProblem read_bal(const std::filesystem::path& path);  // bzip2 is told by its first bytes, not by the name

// Numbers with as many digits as give the same double again; compressed where the name ends in .bz2.
void write_bal(const std::filesystem::path& path, const BalProblem& problem);

}  // namespace plumbline::core
