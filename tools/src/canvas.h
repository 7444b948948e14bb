// A chart of OpenCV's: a white picture with axes of equal scale, in the units of the data.
#pragma once

#include <string>

#include <Eigen/Geometry>
#include <opencv2/core.hpp>

namespace plumbline::tools {

using Colour = cv::Scalar;  // blue, green, red
inline const Colour kInk{60, 50, 45};
inline const Colour kGrey{150, 145, 140};

// Dark blue over green to yellow, share in [0, 1].
Colour along_the_scale(double share);

class Canvas {
 public:
  enum class VerticalAxis { kUp, kDown };

  // `view` is what is shown of the data, with room for the title above and labels about it.
  Canvas(const Eigen::AlignedBox2d& view, const std::string& title, VerticalAxis vertical);

  // Lines of the grid and their labels.
  void draw_axes(const std::string& x_label, const std::string& y_label);

  void line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Colour& colour, int width_px = 1);
  void dot(const Eigen::Vector2d& centre, double radius_px, const Colour& colour);
  void ring(const Eigen::Vector2d& centre, double radius_px, const Colour& colour);
  // The text begins right of the place, with a white edge.
  void label(const Eigen::Vector2d& place, const std::string& text, const Colour& colour);
  // Beside the title, from the left.
  void legend(const std::string& text, const Colour& colour);

  void write(const std::string& file) const;

 private:
  cv::Point pixel(const Eigen::Vector2d& x) const;  // of plot_, in sixteenths, as OpenCV takes them with kShift
  cv::Point whole_pixel(const Eigen::Vector2d& x) const;

  Eigen::AlignedBox2d view_;
  VerticalAxis vertical_;
  double px_per_unit_;
  int legend_x_px_;
  cv::Mat image_;
  cv::Mat plot_;  // the part of image_ within the axes, which clips what is drawn
};

}  // namespace plumbline::tools
