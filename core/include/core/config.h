// One `visit` function a configuration struct describes each of its keys once; reading, resolving with defaults and
// documenting are visitors.
//
//   struct CameraConfig { double rate_hz = 20.0; RowReference td_reference_row = RowReference::kMiddle; };
//   void visit(ConfigVisitor& v, CameraConfig& c) {
//     v.value("rate_hz", c.rate_hz, positive(), "frames a second");
//     v.choice("td_reference_row", c.td_reference_row, kRowReferenceNames, "the row whose exposure td relates");
//   }
//
//   read_config(*find_value(tree, "scenario.camera"), "scenario.camera", config);
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>

#include "core/config_tree.h"

namespace plumbline::core {

// The numbers a key accepts; NaN and infinity are in no range.
struct Range {
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  bool lower_open = false;
  bool upper_open = false;

  bool contains(double x) const;
  std::string text() const;  // "> 0", ">= 0", "in [0, 1)"; empty for all numbers
};

inline Range any() { return {}; }
inline Range positive() { return {.lower = 0.0, .lower_open = true}; }
inline Range non_negative() { return {.lower = 0.0}; }
inline Range at_least(double x) { return {.lower = x}; }
inline Range between(double a, double b) { return {.lower = a, .upper = b}; }
inline Range probability() { return between(0.0, 1.0); }

// Keys, words and documentation are string literals.
class ConfigVisitor {
 public:
  ConfigVisitor() = default;
  ConfigVisitor(const ConfigVisitor&) = delete;
  ConfigVisitor& operator=(const ConfigVisitor&) = delete;
  virtual ~ConfigVisitor() = default;

  virtual void value(std::string_view key, double& x, const Range& range, std::string_view doc) = 0;
  virtual void value(std::string_view key, int& x, const Range& range, std::string_view doc) = 0;
  virtual void value(std::string_view key, std::uint64_t& x, const Range& range, std::string_view doc) = 0;
  virtual void value(std::string_view key, bool& x, std::string_view doc) = 0;
  virtual void value(std::string_view key, std::string& x, std::string_view doc) = 0;

  // A number or the word that stands for nullopt, such as "drawn" or "scenario".
  virtual void value(std::string_view key, std::optional<double>& x, const Range& range, std::string_view absent,
                     std::string_view doc) = 0;

  // A list of as many numbers as x has, each in the range.
  virtual void numbers(std::string_view key, std::span<double> x, const Range& range, std::string_view doc) = 0;

  // A list of any length, perhaps none.
  virtual void value(std::string_view key, std::vector<double>& x, const Range& range, std::string_view doc) = 0;

  template <int N>
  void value(std::string_view key, Eigen::Matrix<double, N, 1>& x, const Range& range, std::string_view doc) {
    static_assert(N > 0, "of fixed size");
    numbers(key, std::span<double>(x.data(), N), range, doc);
  }

  // Relative to the folder of the file that names it, or to the current directory on the command line; absolute once
  // read, unless empty.
  virtual void path(std::string_view key, std::filesystem::path& x, std::string_view doc) = 0;

  // names[i] is the word for the enumerator of value i.
  virtual void choice_index(std::string_view key, int& index, std::span<const std::string_view> names,
                            std::string_view doc) = 0;

  template <class Enum, std::size_t N>
  void choice(std::string_view key, Enum& x, const std::array<std::string_view, N>& names, std::string_view doc) {
    static_assert(std::is_enum_v<Enum>);
    int index = static_cast<int>(x);
    choice_index(key, index, names, doc);
    x = static_cast<Enum>(index);
  }

  // A struct inside the struct; its `visit` is found by its namespace.
  template <class Config>
  void section(std::string_view key, Config& c, std::string_view doc) {
    begin_section(key, doc);
    visit(*this, c);
    end_section();
  }

 private:
  virtual void begin_section(std::string_view key, std::string_view doc) = 0;
  virtual void end_section() = 0;
};

enum class PathForm {
  kPath,
  kContentHash,  // "xxh3:" and the hash of the file, so that where files lie does not change a configuration's hash
};

struct KeyDoc {
  std::string key;   // dotted
  std::string type;  // "section" for a struct's own row, which has neither default nor rule
  std::string default_value;
  std::string rule;  // empty if all values of the type will do
  std::string doc;
};

namespace detail {

using Visit = std::function<void(ConfigVisitor&)>;  // `visit` bound to a struct
void read(const ConfigTree& tree, std::string dotted_prefix, const Visit& visit_config);
nlohmann::ordered_json resolve(const Visit& visit_config, PathForm form);
std::vector<KeyDoc> document(const Visit& visit_config, std::string prefix);

}  // namespace detail

// Reads the keys that the tree has and leaves the others; ConfigError for an unknown key or a value that breaks its
// rule. The tree is the section of c, and the prefix is where it stands.
template <class Config>
void read_config(const ConfigTree& tree, std::string dotted_prefix, Config& c) {
  detail::read(tree, std::move(dotted_prefix), [&c](ConfigVisitor& v) { visit(v, c); });
}

// All keys with their values. The dump of the result is input for parse_config and reads back to the bit.
template <class Config>
nlohmann::ordered_json resolved_config(const Config& c, PathForm form = PathForm::kPath) {
  Config copy = c;
  return detail::resolve([&copy](ConfigVisitor& v) { visit(v, copy); }, form);
}

// All keys in the order of their visits.
template <class Config>
std::vector<KeyDoc> document_config(const Config& defaults, std::string prefix) {
  Config copy = defaults;
  return detail::document([&copy](ConfigVisitor& v) { visit(v, copy); }, std::move(prefix));
}

// The candidate that `word` was probably meant to be, empty if none is near.
std::string nearest(std::string_view word, std::span<const std::string_view> candidates);

}  // namespace plumbline::core
