#include "core/config.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <system_error>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "core/hash.h"

namespace plumbline::core {

namespace {

using Kind = ConfigTree::Kind;

std::string join_keys(std::string_view prefix, std::string_view key) {
  return prefix.empty() ? std::string(key) : fmt::format("{}.{}", prefix, key);
}

// A value as a message shows it: one short line.
std::string shown(const ConfigTree& node) {
  if (node.kind == Kind::kNull) return "nothing";
  if (node.kind == Kind::kSequence) return "a list";
  if (node.kind == Kind::kMap) return "a map";
  constexpr std::size_t kLongest = 60;
  std::string text = node.scalar.size() <= kLongest ? node.scalar : node.scalar.substr(0, kLongest) + "...";
  std::ranges::replace_if(text, [](char c) { return static_cast<unsigned char>(c) < 0x20; }, ' ');
  return node.quoted ? '"' + text + '"' : text;
}

class Reader final : public ConfigVisitor {
 public:
  Reader(const ConfigTree& tree, std::string prefix) { open(&tree, std::move(prefix)); }

  void value(std::string_view key, double& x, const Range& range, std::string_view /*doc*/) override {
    if (const ConfigTree* node = find(key)) x = number(*node, full(key), range, "a number");
  }

  void value(std::string_view key, int& x, const Range& range, std::string_view /*doc*/) override {
    if (const ConfigTree* node = find(key)) x = integer<int>(*node, full(key), range);
  }

  void value(std::string_view key, std::uint64_t& x, const Range& range, std::string_view /*doc*/) override {
    if (const ConfigTree* node = find(key)) x = integer<std::uint64_t>(*node, full(key), range);
  }

  void value(std::string_view key, bool& x, std::string_view /*doc*/) override {
    const ConfigTree* node = find(key);
    if (node == nullptr) return;
    const bool is_bool = !node->quoted && (node->scalar == "true" || node->scalar == "false");
    if (!is_bool) throw broken(*node, full(key), "true or false");
    x = node->scalar == "true";
  }

  void value(std::string_view key, std::string& x, std::string_view /*doc*/) override {
    if (const ConfigTree* node = find(key)) x = text(*node, full(key), "text");
  }

  void value(std::string_view key, std::optional<double>& x, const Range& range, std::string_view absent,
             std::string_view /*doc*/) override {
    const ConfigTree* node = find(key);
    if (node == nullptr) return;
    if (node->kind == Kind::kScalar && node->scalar == absent) {
      x.reset();
    } else {
      x = number(*node, full(key), range, fmt::format("a number or the word '{}'", absent));
    }
  }

  void numbers(std::string_view key, std::span<double> x, const Range& range, std::string_view /*doc*/) override {
    const ConfigTree* node = find(key);
    if (node == nullptr) return;
    const std::string rule = fmt::format("a list of {} numbers", x.size());
    if (node->kind != Kind::kSequence) throw broken(*node, full(key), rule);
    if (node->items.size() != x.size()) {
      throw config_error(node->origin, full(key), fmt::format("must be {}, got {}", rule, node->items.size()));
    }
    for (std::size_t i = 0; i < x.size(); ++i) {
      x[i] = number(node->items[i], fmt::format("{}[{}]", full(key), i), range, "a number");
    }
  }

  void value(std::string_view key, std::vector<double>& x, const Range& range, std::string_view /*doc*/) override {
    const ConfigTree* node = find(key);
    if (node == nullptr) return;
    if (node->kind != Kind::kSequence) throw broken(*node, full(key), "a list of numbers");
    x.clear();
    for (const ConfigTree& item : node->items) {
      x.push_back(number(item, fmt::format("{}[{}]", full(key), x.size()), range, "a number"));
    }
  }

  void path(std::string_view key, std::filesystem::path& x, std::string_view /*doc*/) override {
    const ConfigTree* node = find(key);
    if (node == nullptr) return;
    const std::filesystem::path named = text(*node, full(key), "a path");
    const bool in_file = node->origin.line > 0 && node->origin.label != nullptr;
    const std::filesystem::path folder =
        in_file ? std::filesystem::path(*node->origin.label).parent_path() : std::filesystem::path();
    x = named.empty() ? named : std::filesystem::absolute(folder / named).lexically_normal();
  }

  void choice_index(std::string_view key, int& index, std::span<const std::string_view> names,
                    std::string_view /*doc*/) override {
    const ConfigTree* node = find(key);
    if (node == nullptr) return;
    const auto name = std::ranges::find(names, std::string_view(node->scalar));
    if (node->kind != Kind::kScalar || name == names.end()) {
      const std::string rule = fmt::format("must be one of {}, got {}", fmt::join(names, ", "), shown(*node));
      throw config_error(node->origin, full(key), rule + suggestion(node->scalar, names));
    }
    index = static_cast<int>(name - names.begin());
  }

  // Once every key has been visited, what else the tree has is unknown.
  void close() {
    const Section section = std::move(sections_.back());
    sections_.pop_back();
    if (section.node == nullptr) return;
    for (const ConfigEntry& entry : section.node->entries) {
      if (std::ranges::find(section.known, entry.key) != section.known.end()) continue;
      throw config_error(entry.origin, join_keys(section.key, entry.key),
                         "unknown key" + suggestion(entry.key, section.known));
    }
  }

 private:
  struct Section {
    const ConfigTree* node;  // null if the configuration does not mention the section
    std::string key;
    std::vector<std::string_view> known;
  };

  void begin_section(std::string_view key, std::string_view /*doc*/) override {
    const ConfigTree* node = find(key);
    open(node, full(key));
  }

  void end_section() override { close(); }

  void open(const ConfigTree* node, std::string key) {
    if (node != nullptr && node->kind != Kind::kMap && node->kind != Kind::kNull) {
      throw broken(*node, key, "a section, a map of keys");
    }
    sections_.push_back({node, std::move(key), {}});
  }

  // The value of a key in the current section, null if the configuration does not give it.
  const ConfigTree* find(std::string_view key) {
    Section& section = sections_.back();
    section.known.push_back(key);
    if (section.node == nullptr) return nullptr;
    const auto entry = std::ranges::find(section.node->entries, key, &ConfigEntry::key);
    return entry == section.node->entries.end() ? nullptr : &entry->value;
  }

  std::string full(std::string_view key) const { return join_keys(sections_.back().key, key); }

  static std::string suggestion(std::string_view word, std::span<const std::string_view> candidates) {
    const std::string best = nearest(word, candidates);
    return best.empty() ? "" : fmt::format("; did you mean '{}'?", best);
  }

  static ConfigError broken(const ConfigTree& node, std::string_view key, std::string_view rule) {
    return config_error(node.origin, key, fmt::format("must be {}, got {}", rule, shown(node)));
  }

  static std::string text(const ConfigTree& node, std::string_view key, std::string_view rule) {
    if (node.kind != Kind::kScalar) throw broken(node, key, rule);
    return node.scalar;
  }

  // from_chars on the whole scalar: no locale, no blanks, no plus sign, no hexadecimal digits.
  template <class Number>
  static std::errc parse(const ConfigTree& node, Number& x) {
    if (node.kind != Kind::kScalar || node.quoted) return std::errc::invalid_argument;
    const char* end = node.scalar.data() + node.scalar.size();
    const auto result = std::from_chars(node.scalar.data(), end, x);
    return result.ptr == end ? result.ec : std::errc::invalid_argument;
  }

  static double number(const ConfigTree& node, std::string_view key, const Range& range, std::string_view rule) {
    double x = 0.0;
    const std::errc error = parse(node, x);
    if (error == std::errc::invalid_argument) throw broken(node, key, rule);
    if (error != std::errc() || !std::isfinite(x)) throw broken(node, key, "a finite number");
    if (!range.contains(x)) throw broken(node, key, range.text());
    return x;
  }

  template <class Integer>
  static Integer integer(const ConfigTree& node, std::string_view key, const Range& range) {
    using Limits = std::numeric_limits<Integer>;
    Integer x = 0;
    if (parse(node, x) != std::errc()) {
      throw broken(node, key, fmt::format("a whole number from {} to {}", Limits::min(), Limits::max()));
    }
    if (!range.contains(static_cast<double>(x))) throw broken(node, key, range.text());
    return x;
  }

  std::vector<Section> sections_;
};

class Resolver final : public ConfigVisitor {
 public:
  explicit Resolver(PathForm form) : form_(form) {}

  nlohmann::ordered_json take() { return std::move(open_.back().values); }

  void value(std::string_view key, double& x, const Range& /*range*/, std::string_view /*doc*/) override {
    put(key, x);
  }
  void value(std::string_view key, int& x, const Range& /*range*/, std::string_view /*doc*/) override { put(key, x); }
  void value(std::string_view key, std::uint64_t& x, const Range& /*range*/, std::string_view /*doc*/) override {
    put(key, x);
  }
  void value(std::string_view key, bool& x, std::string_view /*doc*/) override { put(key, x); }
  void value(std::string_view key, std::string& x, std::string_view /*doc*/) override { put(key, x); }

  void value(std::string_view key, std::optional<double>& x, const Range& /*range*/, std::string_view absent,
             std::string_view /*doc*/) override {
    x.has_value() ? put(key, *x) : put(key, absent);
  }

  void numbers(std::string_view key, std::span<double> x, const Range& /*range*/, std::string_view /*doc*/) override {
    put(key, std::vector<double>(x.begin(), x.end()));
  }

  void value(std::string_view key, std::vector<double>& x, const Range& /*range*/, std::string_view /*doc*/) override {
    put(key, x);
  }

  void path(std::string_view key, std::filesystem::path& x, std::string_view /*doc*/) override {
    const bool hashed = form_ == PathForm::kContentHash && !x.empty();
    put(key, hashed ? "xxh3:" + file_hash(x) : x.generic_string());
  }

  void choice_index(std::string_view key, int& index, std::span<const std::string_view> names,
                    std::string_view /*doc*/) override {
    put(key, names[static_cast<std::size_t>(index)]);
  }

 private:
  struct Section {
    std::string key;
    nlohmann::ordered_json values = nlohmann::ordered_json::object();
  };

  void begin_section(std::string_view key, std::string_view /*doc*/) override {
    open_.push_back({.key = std::string(key)});
  }

  void end_section() override {
    Section done = std::move(open_.back());
    open_.pop_back();
    put(done.key, std::move(done.values));
  }

  void put(std::string_view key, nlohmann::ordered_json json) {
    open_.back().values[std::string(key)] = std::move(json);
  }

  PathForm form_;
  std::vector<Section> open_ = std::vector<Section>(1);
};

class Documenter final : public ConfigVisitor {
 public:
  explicit Documenter(std::string prefix) : prefixes_{std::move(prefix)} {}

  std::vector<KeyDoc> take() { return std::move(rows_); }

  void value(std::string_view key, double& x, const Range& range, std::string_view doc) override {
    add(key, "number", fmt::format("{}", x), range.text(), doc);
  }
  void value(std::string_view key, int& x, const Range& range, std::string_view doc) override {
    add(key, "integer", fmt::format("{}", x), range.text(), doc);
  }
  void value(std::string_view key, std::uint64_t& x, const Range& range, std::string_view doc) override {
    add(key, "integer", fmt::format("{}", x), range.text(), doc);
  }
  void value(std::string_view key, bool& x, std::string_view doc) override {
    add(key, "boolean", x ? "true" : "false", "", doc);
  }
  void value(std::string_view key, std::string& x, std::string_view doc) override {
    add(key, "text", or_quotes(x), "", doc);
  }

  void value(std::string_view key, std::optional<double>& x, const Range& range, std::string_view absent,
             std::string_view doc) override {
    const std::string text = x.has_value() ? fmt::format("{}", *x) : std::string(absent);
    add(key, fmt::format("number or '{}'", absent), text, range.text(), doc);
  }

  void numbers(std::string_view key, std::span<double> x, const Range& range, std::string_view doc) override {
    add(key, fmt::format("list of {} numbers", x.size()), fmt::format("[{}]", fmt::join(x, ", ")), each(range), doc);
  }

  void value(std::string_view key, std::vector<double>& x, const Range& range, std::string_view doc) override {
    add(key, "list of numbers", fmt::format("[{}]", fmt::join(x, ", ")), each(range), doc);
  }

  void path(std::string_view key, std::filesystem::path& x, std::string_view doc) override {
    add(key, "path", or_quotes(x.generic_string()), "", doc);
  }

  void choice_index(std::string_view key, int& index, std::span<const std::string_view> names,
                    std::string_view doc) override {
    add(key, "choice", std::string(names[static_cast<std::size_t>(index)]), fmt::format("{}", fmt::join(names, " | ")),
        doc);
  }

 private:
  void begin_section(std::string_view key, std::string_view doc) override {
    add(key, "section", "", "", doc);
    prefixes_.push_back(join_keys(prefixes_.back(), key));
  }

  void end_section() override { prefixes_.pop_back(); }

  static std::string each(const Range& range) { return range.text().empty() ? "" : "each " + range.text(); }

  static std::string or_quotes(const std::string& text) { return text.empty() ? "\"\"" : text; }

  void add(std::string_view key, std::string type, std::string default_value, std::string rule, std::string_view doc) {
    rows_.push_back({join_keys(prefixes_.back(), key), std::move(type), std::move(default_value), std::move(rule),
                     std::string(doc)});
  }

  std::vector<std::string> prefixes_;
  std::vector<KeyDoc> rows_;
};

// Edits between two words: insertion, deletion, substitution, exchange of neighbours (optimal string alignment).
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) d[i][0] = i;
  for (std::size_t j = 0; j <= b.size(); ++j) d[0][j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substituted = d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, substituted});
      const bool exchanged = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (exchanged) d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  }
  return d[a.size()][b.size()];
}

}  // namespace

bool Range::contains(double x) const {
  if (!std::isfinite(x)) return false;
  return (lower_open ? x > lower : x >= lower) && (upper_open ? x < upper : x <= upper);
}

std::string Range::text() const {
  const bool below = std::isfinite(lower);
  const bool above = std::isfinite(upper);
  if (below && above) {
    return fmt::format("in {}{}, {}{}", lower_open ? '(' : '[', lower, upper, upper_open ? ')' : ']');
  }
  if (below) return fmt::format("{} {}", lower_open ? ">" : ">=", lower);
  if (above) return fmt::format("{} {}", upper_open ? "<" : "<=", upper);
  return "";
}

namespace detail {

void read(const ConfigTree& tree, std::string dotted_prefix, const Visit& visit_config) {
  Reader reader(tree, std::move(dotted_prefix));
  visit_config(reader);
  reader.close();
}

nlohmann::ordered_json resolve(const Visit& visit_config, PathForm form) {
  Resolver resolver(form);
  visit_config(resolver);
  return resolver.take();
}

std::vector<KeyDoc> document(const Visit& visit_config, std::string prefix) {
  Documenter documenter(std::move(prefix));
  visit_config(documenter);
  return documenter.take();
}

}  // namespace detail

std::string nearest(std::string_view word, std::span<const std::string_view> candidates) {
  constexpr std::size_t kLongest = 64;
  if (word.empty() || word.size() > kLongest) return "";
  // A third of the letters may be wrong, but never all of them.
  std::size_t least = std::min(std::max<std::size_t>(1, word.size() / 3), word.size() - 1) + 1;
  std::string best;
  for (const std::string_view candidate : candidates) {
    // A forgotten unit or other ending (td for td_s) is the most common slip.
    const bool extends = word.size() > 1 && candidate.starts_with(word);
    const std::size_t distance = extends ? 1 : edit_distance(word, candidate);
    if (distance < least) {
      least = distance;
      best = candidate;
    }
  }
  return best;
}

}  // namespace plumbline::core
