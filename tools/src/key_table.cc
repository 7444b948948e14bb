#include <map>
#include <vector>

#include <fmt/format.h>

#include "tools/commands.h"
#include "tools/experiment.h"

namespace plumbline::tools {
namespace {

// A bar would end the cell.
std::string cell(const std::string& text) {
  std::string escaped;
  for (const char c : text) escaped += c == '|' ? "\\|" : std::string(1, c);
  return escaped;
}

}  // namespace

std::string key_table() {
  // The keys of a section stay together, also those that come after a section inside it.
  std::vector<core::KeyDoc> sections;
  std::map<std::string, std::string> rows;
  for (const core::KeyDoc& key : core::document_config(Experiment{}, "")) {
    if (key.type == "section") {
      sections.push_back(key);
      continue;
    }
    rows[key.key.substr(0, key.key.rfind('.'))] += fmt::format(
        "| `{}` | {} | {} | {} | {} |\n", key.key, cell(key.type),
        key.default_value.empty() ? "" : fmt::format("`{}`", key.default_value), cell(key.rule), cell(key.doc));
  }
  std::string table;
  for (const core::KeyDoc& section : sections) {
    table += fmt::format("### `{}`: {}\n\n| key | type | default | rule | meaning |\n|---|---|---|---|---|\n{}\n",
                         section.key, section.doc, rows[section.key]);
  }
  return table;
}

}  // namespace plumbline::tools
