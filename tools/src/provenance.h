// By what and where: pairs of a name and a text, for people to read.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace plumbline::tools {

using Provenance = std::vector<std::pair<std::string, std::string>>;

// Of this program and this machine.
Provenance provenance();

// For rows to be the same bytes, the processor's model and the packages must be.
std::string processor_model();

}  // namespace plumbline::tools
