#include <fmt/format.h>

#include "tools/commands.h"
#include "tools/experiment.h"

namespace plumbline::tools {

std::string key_table() {
  std::string table;
  for (const core::KeyDoc& key : core::document_config(Experiment{}, "")) {
    if (key.type == "section") {
      table += fmt::format("\n### `{}`: {}\n\n| key | type | default | rule | meaning |\n|---|---|---|---|---|\n", key.key,
                           key.doc);
      continue;
    }
    table += fmt::format("| `{}` | {} | {} | {} | {} |\n", key.key, key.type,
                         key.default_value.empty() ? "" : fmt::format("`{}`", key.default_value), key.rule, key.doc);
  }
  return table;
}

}  // namespace plumbline::tools
