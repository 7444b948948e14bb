// Segments drawn on the faces of walls. A face's coordinates are (a, b) of sim/walls.h; its normal points to where it
// is seen from, and upright faces have v_W upwards.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "core/random.h"
#include "sim/segment.h"
#include "sim/walls.h"
#include "sim/world_config.h"

namespace plumbline::sim {

// Shares of the way from p to q.
struct Stretch {
  double from = 0.0;
  double to = 1.0;
};

// What of the straight way from p to q on the face is outside its openings, in order.
std::vector<Stretch> solid_stretches(const Wall& face, const Eigen::Vector2d& p, const Eigen::Vector2d& q);

// Those stretches, before the face.
void draw_line(const Wall& face, const Eigen::Vector2d& p, const Eigen::Vector2d& q, std::vector<Segment>& segments_W);

// The border of a face, this far within it.
void draw_outline(const Wall& face, double inset_m, std::vector<Segment>& segments_W);

// Posts and lintel of every opening.
void draw_door_frames(const Wall& face, std::vector<Segment>& segments_W);

// A row of rectangles, without those that do not fit or meet an opening.
void draw_windows(const Wall& face, const WindowsConfig& config, std::vector<Segment>& segments_W);

// Lines along u and v at multiples of the spacing.
void draw_grid(const Wall& face, double spacing_m, std::vector<Segment>& segments_W);

// Where upright faces meet one another, the floor and the ceiling: each edge of two walls once.
void draw_edges(const std::vector<Wall>& upright_faces, std::vector<Segment>& segments_W);

// Uniform over the area of the faces, the direction uniform in the face; where it leaves the face the segment ends.
// Throws core::RuleError where doors leave no place.
void scatter_lines_on(const std::vector<Wall>& faces, const WorldLinesConfig& config, const core::RandomStream& stream,
                      std::vector<Segment>& segments_W);

}  // namespace plumbline::sim
