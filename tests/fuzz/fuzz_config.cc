// YAML text as a scenario, or as the value of an override.
#include <string>

#include <nlohmann/json.hpp>

#include "core/config.h"
#include "core/config_tree.h"
#include "core/error.h"
#include "sim/scenario.h"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  using namespace plumbline;
  const std::string text(data, data + size);
  try {
    const core::ConfigTree tree = core::parse_config(text, "fuzz.yaml");
    sim::ScenarioConfig scenario;
    core::read_config(tree, "scenario", scenario);
    sim::validate(scenario);
    // What was accepted must survive being written and read again.
    const std::string resolved = core::resolved_config(scenario).dump();
    sim::ScenarioConfig again;
    core::read_config(core::parse_config(resolved, "resolved"), "scenario", again);
    if (core::resolved_config(again).dump() != resolved) __builtin_trap();
  } catch (const core::InputError&) {
  }
  try {
    core::parse_override(text);
  } catch (const core::InputError&) {
  }
  return 0;
}
