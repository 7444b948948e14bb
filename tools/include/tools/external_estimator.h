// `estimator.type: external`, a program that knows nothing of us:
//   COMMAND ARGUMENTS --dataset DIR --out DIR
// DIR holds the measurements (core/dataset.h) without the truth and without what would draw it again; the folder of
// --out it fills as tools/stated_estimate.h says. It starts in that folder, where its output is kept, too.
#pragma once

#include <filesystem>
#include <string>

#include "core/measurements.h"
#include "estimator/config.h"
#include "tools/stated_estimate.h"

namespace plumbline::tools {

struct ExternalEstimate {
  StatedEstimate stated;
  std::string failure;  // one line; where there is one, nothing is stated
  double cpu_s = 0.0;   // of the program
};

// Throws core::RuleError where the command is no program.
void require_runnable(const estimator::ExternalConfig& config);

// `out` is the program's, and is made where it is not there. Throws eval::MachineFault where the machine ended it.
ExternalEstimate estimate_externally(const core::MeasurementLog& log, const estimator::ExternalConfig& config,
                                     const std::filesystem::path& out);

// A folder for what is not to stay.
class ScratchFolder {
 public:
  ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  ~ScratchFolder();

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace plumbline::tools
