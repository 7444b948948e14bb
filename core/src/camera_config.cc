#include "core/camera_config.h"

#include "core/physical_ranges.h"

namespace plumbline::core {

void visit(ConfigVisitor& v, PinholeCamera& c) {
  v.value("width_px", c.width_px, between(1, 100000), "columns");
  v.value("height_px", c.height_px, between(1, 100000), "rows");
  v.value("fx_px", c.fx_px, between(1e-3, 1e6), "focal length, horizontal");
  v.value("fy_px", c.fy_px, between(1e-3, 1e6), "focal length, vertical");
  v.value("cx_px", c.cx_px, within(kMostPixels), "principal point; (0, 0) is the centre of the upper left pixel");
  v.value("cy_px", c.cy_px, within(kMostPixels), "principal point");
  DistortionModel model = c.distortion.model();
  std::array<double, 4> k = c.distortion.coefficients();
  v.choice("distortion", model, kDistortionModelNames, "of the lens, as in OpenCV and Kalibr");
  v.numbers("distortion_coefficients", k, within(1e6), "k1, k2, p1, p2 of `radtan`; k1, k2, k3, k4 of `equidistant`");
  c.distortion = Distortion(model, k);
}

std::optional<RuleViolation> validate(const PinholeCamera& c) {
  if (c.distortion.model() == DistortionModel::kNone && c.distortion.coefficients() != std::array<double, 4>{}) {
    return RuleViolation{"distortion_coefficients", "must be 0 without a distortion"};
  }
  return std::nullopt;
}

}  // namespace plumbline::core
