// Motion as of a handheld device: each freedom an independent sum of five sinusoids, drawn from the shared stream of
// the experiment, with the rms speed and rate as configured; and the same with some freedoms taken away, which makes
// parts of the calibration unobservable.
#pragma once

#include "sim/harmonic_trajectory.h"

namespace plumbline::sim {

// All six freedoms.
HarmonicTrajectory::Shape handheld_shape(const HandheldConfig& config, core::TrialId id);

// x, y and yaw: a vehicle on a floor.
HarmonicTrajectory::Shape planar_shape(const HandheldConfig& config, core::TrialId id);

// Three translations, and the whole rate about one axis of the body.
HarmonicTrajectory::Shape one_axis_shape(const HandheldConfig& config, BodyAxis axis, core::TrialId id);

HarmonicTrajectory::Shape pure_translation_shape(const HandheldConfig& config, core::TrialId id);
HarmonicTrajectory::Shape pure_rotation_shape(const HandheldConfig& config, core::TrialId id);

}  // namespace plumbline::sim
