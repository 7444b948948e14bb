// Folders that the commands write: recordings with their truth, estimates.
#pragma once

#include <filesystem>

#include "core/dataset.h"
#include "core/estimate.h"
#include "sim/simulate.h"

namespace plumbline::tools {

// A recording with its truth beside it.
void write_simulation(const std::filesystem::path& folder, const sim::Simulation& simulation,
                      const core::DatasetMeta& meta);

// estimate.tum and meta.yaml, as an external program would write them.
void write_estimate(const std::filesystem::path& folder, const core::EstimateLog& estimate);

// Throws core::DataError where the folder, which need not be there yet, holds something already, or is to lie below a
// file.
void refuse_existing(const std::filesystem::path& folder);

}  // namespace plumbline::tools
