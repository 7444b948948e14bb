#include "canvas.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace plumbline::tools {
namespace {

constexpr int kLongestSidePx = 1100;
constexpr int kLeftPx = 80;
constexpr int kRightPx = 30;
constexpr int kTopPx = 84;
constexpr int kLegendPx = 62;
constexpr int kBottomPx = 64;
constexpr int kShift = 4;
constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
constexpr double kTextScale = 0.55;

const Colour kGrid{232, 230, 228};

cv::Size text_size(const std::string& text) {
  int baseline = 0;
  return cv::getTextSize(text, kFont, kTextScale, 1, &baseline);
}

// 1, 2 or 5 times a power of ten, so that about eight lines cross the span.
double tick_step(double span) {
  const double rough = span / 8.0;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (rough <= factor * power) return factor * power;
  }
  return 10.0 * power;
}

// The multiples of step within [lo, hi].
std::vector<double> multiples(double step, double lo, double hi) {
  std::vector<double> result;
  const auto last = static_cast<long>(std::floor(hi / step));
  for (auto n = static_cast<long>(std::ceil(lo / step)); n <= last; ++n) {
    result.push_back(static_cast<double>(n) * step);
  }
  return result;
}

}  // namespace

Colour along_the_scale(double share) {
  constexpr std::array<std::array<double, 3>, 4> kStops = {
      {{110, 40, 60}, {140, 110, 40}, {90, 170, 50}, {30, 190, 235}}};  // as viridis, its yellow darker
  const double at = std::clamp(share, 0.0, 1.0) * (kStops.size() - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(at), kStops.size() - 2);
  const double s = at - static_cast<double>(i);
  Colour colour;
  for (std::size_t c = 0; c < 3; ++c) {
    colour[static_cast<int>(c)] = (1.0 - s) * kStops[i][c] + s * kStops[i + 1][c];
  }
  return colour;
}

Canvas::Canvas(const Eigen::AlignedBox2d& view, const std::string& title, VerticalAxis vertical)
    : view_(view), vertical_(vertical), px_per_unit_(kLongestSidePx / view.sizes().maxCoeff()), legend_x_px_(kLeftPx) {
  const int width = static_cast<int>(std::ceil(px_per_unit_ * view.sizes().x()));
  const int height = static_cast<int>(std::ceil(px_per_unit_ * view.sizes().y()));
  image_ = cv::Mat(height + kTopPx + kBottomPx, width + kLeftPx + kRightPx, CV_8UC3, cv::Scalar::all(255));
  plot_ = image_(cv::Rect(kLeftPx, kTopPx, width, height));
  cv::putText(image_, title, {kLeftPx, 32}, kFont, 0.7, kInk, 1, cv::LINE_AA);
}

void Canvas::draw_axes(const std::string& x_label, const std::string& y_label) {
  const cv::Point right_bottom(kLeftPx + plot_.cols - 1, kTopPx + plot_.rows - 1);
  const double step = tick_step(view_.sizes().maxCoeff());
  const auto write = [&](const std::string& text, const cv::Point& corner) {
    cv::putText(image_, text, corner, kFont, kTextScale, kInk, 1, cv::LINE_AA);
  };
  const auto tick = [&](double value) { return fmt::format("{:g}", std::abs(value) < 1e-9 * step ? 0.0 : value); };
  for (const double x : multiples(step, view_.min().x(), view_.max().x())) {
    const int at = whole_pixel({x, view_.min().y()}).x;
    cv::line(plot_, {at, 0}, {at, plot_.rows}, kGrid, 1);
    write(tick(x), {kLeftPx + at - text_size(tick(x)).width / 2, right_bottom.y + 22});
  }
  for (const double y : multiples(step, view_.min().y(), view_.max().y())) {
    const int at = whole_pixel({view_.min().x(), y}).y;
    cv::line(plot_, {0, at}, {plot_.cols, at}, kGrid, 1);
    write(tick(y), {kLeftPx - 10 - text_size(tick(y)).width, kTopPx + at + 6});
  }
  cv::rectangle(image_, {kLeftPx - 1, kTopPx - 1}, right_bottom + cv::Point(1, 1), kGrey, 1);
  write(x_label, {kLeftPx + (plot_.cols - text_size(x_label).width) / 2, right_bottom.y + 50});
  write(y_label, {8, kLegendPx});
}

cv::Point Canvas::pixel(const Eigen::Vector2d& x) const {
  const double up = vertical_ == VerticalAxis::kUp ? view_.max().y() - x.y() : x.y() - view_.min().y();
  const double scale = 1 << kShift;
  return {static_cast<int>(std::lround(scale * px_per_unit_ * (x.x() - view_.min().x()))),
          static_cast<int>(std::lround(scale * px_per_unit_ * up))};
}

cv::Point Canvas::whole_pixel(const Eigen::Vector2d& x) const {
  const cv::Point p = pixel(x);
  return {p.x >> kShift, p.y >> kShift};
}

void Canvas::line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Colour& colour, int width_px) {
  cv::line(plot_, pixel(a), pixel(b), colour, width_px, cv::LINE_AA, kShift);
}

void Canvas::dot(const Eigen::Vector2d& centre, double radius_px, const Colour& colour) {
  cv::circle(plot_, pixel(centre), static_cast<int>(radius_px * (1 << kShift)), colour, cv::FILLED, cv::LINE_AA,
             kShift);
}

void Canvas::ring(const Eigen::Vector2d& centre, double radius_px, const Colour& colour) {
  dot(centre, radius_px + 2.0, Colour::all(255));
  cv::circle(plot_, pixel(centre), static_cast<int>(radius_px * (1 << kShift)), colour, 3, cv::LINE_AA, kShift);
}

void Canvas::label(const Eigen::Vector2d& place, const std::string& text, const Colour& colour) {
  const cv::Point corner = whole_pixel(place) + cv::Point(14, text_size(text).height / 2);
  cv::putText(plot_, text, corner, kFont, kTextScale, Colour::all(255), 5, cv::LINE_AA);
  cv::putText(plot_, text, corner, kFont, kTextScale, colour, 1, cv::LINE_AA);
}

void Canvas::legend(const std::string& text, const Colour& colour) {
  const cv::Point corner(legend_x_px_, kLegendPx);
  cv::circle(image_, corner + cv::Point(5, -5), 5, colour, cv::FILLED, cv::LINE_AA);
  cv::putText(image_, text, corner + cv::Point(18, 0), kFont, kTextScale, kInk, 1, cv::LINE_AA);
  legend_x_px_ += 18 + text_size(text).width + 28;
}

void Canvas::write(const std::string& file) const {
  if (!cv::imwrite(file, image_)) throw std::runtime_error(file + ": cannot be written");
}

}  // namespace plumbline::tools
