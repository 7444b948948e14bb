// A configuration as a tree that remembers where every value stands, so that an error can name file and line.
// The syntax is YAML without anchors, aliases, tags and repeated keys, as UTF-8, one document a file. Size, depth and
// number of nodes have limits: no file, however made, exhausts memory or stack.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/error.h"

namespace plumbline::core {

inline constexpr std::size_t kMaxConfigBytes = std::size_t{16} << 20U;
inline constexpr std::size_t kMaxConfigNodes = 1'000'000;  // keys count too
inline constexpr std::size_t kMaxConfigDepth = 32;         // lists and maps inside one another
inline constexpr std::size_t kMaxConfigMarks = 2'000'000;  // brackets, commas, colons, quotes and the like

// Where a value stands. The label is shared by all nodes of a file.
struct Origin {
  std::shared_ptr<const std::string> label;  // the file's path, or "--set key=value"
  int line = 0;                              // from 1; 0 on the command line
};

struct ConfigEntry;

struct ConfigTree {
  enum class Kind { kNull, kScalar, kSequence, kMap };

  Kind kind = Kind::kNull;
  Origin origin;
  std::string scalar;                // kScalar: the text, unquoted
  bool quoted = false;               // kScalar: a quoted one is never a number
  std::vector<ConfigTree> items;     // kSequence
  std::vector<ConfigEntry> entries;  // kMap, in the file's order
};

struct ConfigEntry {
  std::string key;
  Origin origin;  // of the key
  ConfigTree value;
};

// The label names the text in messages; paths in the text are relative to the label's folder.
ConfigTree parse_config(std::string_view text, std::string label);

// ConfigError for a file that cannot be read or holds nothing.
ConfigTree load_config_file(const std::filesystem::path& file);

struct ConfigOverride {
  std::string key;  // dotted
  ConfigTree value;
};

// "a.b=c", as in `--set a.b=c`; c is YAML, such as 3, word or [1, 2]. Messages name the option.
ConfigOverride parse_override(std::string_view assignment, std::string_view option = "--set");

// The value under a dotted key, or nullptr.
const ConfigTree* find_value(const ConfigTree& root, std::string_view dotted_key);

// Replaces the value under a dotted key, or adds it together with the maps around it.
void set_value(ConfigTree& root, std::string_view dotted_key, ConfigTree value);

// The error "file:line: key: rule"; on the command line "--set key=value: rule". A key may be empty.
ConfigError config_error(const Origin& origin, std::string_view dotted_key, std::string_view rule);

}  // namespace plumbline::core
