#include "core/config_tree.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <unordered_set>
#include <utility>

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/parser.h>

namespace plumbline::core {

namespace {

using Kind = ConfigTree::Kind;

// Length of the UTF-8 sequence at the start of `text`, 0 if there is none (RFC 3629, table 3-7 of the Unicode
// standard).
std::size_t utf8_length(std::string_view text) {
  const auto byte = [&](std::size_t i) {
    return i < text.size() ? static_cast<unsigned>(static_cast<unsigned char>(text[i])) : 0U;
  };
  const unsigned first = byte(0);
  if (first < 0x80) return 1;
  if (first < 0xC2 || first > 0xF4) return 0;
  const std::size_t length = first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
  // The second byte excludes overlong forms, surrogates and code points beyond U+10FFFF.
  const unsigned low = first == 0xE0 ? 0xA0 : first == 0xF0 ? 0x90 : 0x80;
  const unsigned high = first == 0xED ? 0x9F : first == 0xF4 ? 0x8F : 0xBF;
  if (byte(1) < low || byte(1) > high) return 0;
  for (std::size_t i = 2; i < length; ++i) {
    if (byte(i) < 0x80 || byte(i) > 0xBF) return 0;
  }
  return length;
}

// yaml-cpp holds all tokens of the outermost [] or {} at once, before the tree's own limits see one of them.
void limit_marks(std::string_view text, const Origin& origin) {
  constexpr std::string_view kMarks = "[]{},:?\"'&*!";
  const auto is_mark = [&](char c) { return kMarks.find(c) != std::string_view::npos; };
  if (static_cast<std::size_t>(std::ranges::count_if(text, is_mark)) > kMaxConfigMarks) {
    throw config_error(origin, "", fmt::format("more than {} brackets, commas, colons and quotes", kMaxConfigMarks));
  }
}

// The text without byte order mark and carriage returns of line ends; an error if it is no text at all.
std::string clean_text(std::string_view text, Origin origin) {
  if (text.size() > kMaxConfigBytes) {
    throw config_error(origin, "", fmt::format("larger than {} MiB", kMaxConfigBytes >> 20U));
  }
  limit_marks(text, origin);
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  std::string clean;
  clean.reserve(text.size());
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    const bool control = static_cast<unsigned char>(text[0]) < 0x20 && text[0] != '\n' && text[0] != '\t';
    if (length == 0 || (control && !text.starts_with("\r\n"))) {
      const unsigned byte = static_cast<unsigned char>(text[0]);
      throw config_error(origin, "", fmt::format("byte 0x{:02x} is not text; a configuration is UTF-8", byte));
    }
    if (text[0] == '\n' && origin.line > 0) ++origin.line;
    if (!control) clean.append(text.substr(0, length));
    text.remove_prefix(length);
  }
  return clean;
}

class TreeBuilder final : public YAML::EventHandler {
 public:
  TreeBuilder(std::string_view text, Origin start) : text_(text), start_(std::move(start)) { root_.origin = start_; }

  ConfigTree take() { return std::move(root_); }

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (++documents_ > 1) throw error(mark, "a second document; a configuration is one");
  }
  void OnDocumentEnd() override {}

  void OnNull(const YAML::Mark& mark, YAML::anchor_t /*anchor*/) override { add(node(mark, Kind::kNull)); }

  void OnAlias(const YAML::Mark& mark, YAML::anchor_t /*anchor*/) override { refuse_anchor(mark); }
  void OnAnchor(const YAML::Mark& mark, const std::string& /*name*/) override { refuse_anchor(mark); }

  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t /*anchor*/,
                const std::string& value) override {
    refuse_tag(mark, tag);
    if (value.find('\0') != std::string::npos) throw error(mark, "a NUL character");
    ConfigTree scalar = node(mark, Kind::kScalar);
    scalar.scalar = value;
    scalar.quoted = tag == "!";
    add(std::move(scalar));
  }

  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t /*anchor*/,
                       YAML::EmitterStyle::value /*style*/) override {
    open(mark, tag, Kind::kSequence);
  }
  void OnSequenceEnd() override { close(); }

  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t /*anchor*/,
                  YAML::EmitterStyle::value /*style*/) override {
    open(mark, tag, Kind::kMap);
  }
  void OnMapEnd() override { close(); }

 private:
  // A list or map that is still open.
  struct Frame {
    ConfigTree node;
    bool awaits_value = false;  // a map whose last entry is a key so far
    std::unordered_set<std::string> keys;
  };

  Origin at(const YAML::Mark& mark) const {
    return {start_.label, start_.line > 0 && !mark.is_null() ? mark.line + 1 : start_.line};
  }

  ConfigError error(const YAML::Mark& mark, std::string_view rule) const { return config_error(at(mark), "", rule); }

  void refuse_anchor(const YAML::Mark& mark) const {
    throw error(mark, "anchors and aliases (& and *) are not allowed");
  }

  // yaml-cpp marks quoted scalars by the tag "!", just as if it had been written out; the text tells them apart.
  void refuse_tag(const YAML::Mark& mark, const std::string& tag) const {
    const auto position = static_cast<std::size_t>(mark.pos);
    const bool written = position < text_.size() && text_[position] == '!';
    if (written || (tag != "?" && tag != "!")) throw error(mark, "tags (!) are not allowed");
  }

  ConfigTree node(const YAML::Mark& mark, Kind kind) {
    if (++nodes_ > kMaxConfigNodes) throw error(mark, fmt::format("more than {} values", kMaxConfigNodes));
    ConfigTree result;
    result.kind = kind;
    result.origin = at(mark);
    return result;
  }

  void open(const YAML::Mark& mark, const std::string& tag, Kind kind) {
    refuse_tag(mark, tag);
    if (frames_.size() >= kMaxConfigDepth) throw error(mark, fmt::format("nested deeper than {}", kMaxConfigDepth));
    frames_.push_back({node(mark, kind), false, {}});
  }

  void close() {
    ConfigTree done = std::move(frames_.back().node);
    frames_.pop_back();
    add(std::move(done));
  }

  void add(ConfigTree child) {
    if (frames_.empty()) {
      root_ = std::move(child);
      return;
    }
    Frame& parent = frames_.back();
    if (parent.node.kind == Kind::kSequence) {
      parent.node.items.push_back(std::move(child));
    } else if (parent.awaits_value) {
      ConfigEntry& entry = parent.node.entries.back();
      // yaml-cpp places an absent value at whatever follows it.
      if (child.kind == Kind::kNull) child.origin = entry.origin;
      entry.value = std::move(child);
      parent.awaits_value = false;
    } else {
      add_key(parent, std::move(child));
    }
  }

  void add_key(Frame& parent, ConfigTree key) const {
    if (key.kind != Kind::kScalar) throw config_error(key.origin, "", "a key must be a word");
    if (!parent.keys.insert(key.scalar).second) {
      const auto& entries = parent.node.entries;
      const auto first = std::ranges::find(entries, key.scalar, &ConfigEntry::key);
      const std::string where = key.origin.line > 0 ? fmt::format("; first on line {}", first->origin.line) : "";
      throw config_error(key.origin, open_key() + key.scalar, "given twice" + where);
    }
    parent.node.entries.push_back({std::move(key.scalar), key.origin, {}});
    parent.awaits_value = true;
  }

  // The dotted keys that lead to the innermost open node, each followed by its dot.
  std::string open_key() const {
    std::string result;
    for (const Frame& frame : frames_) {
      if (frame.awaits_value) result += frame.node.entries.back().key + ".";
    }
    return result;
  }

  std::string_view text_;
  Origin start_;
  ConfigTree root_;
  std::vector<Frame> frames_;
  std::size_t nodes_ = 0;
  int documents_ = 0;
};

ConfigTree parse(std::string_view raw, const Origin& start) {
  const std::string text = clean_text(raw, start);
  TreeBuilder builder(text, start);
  try {
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    while (parser.HandleNextDocument(builder)) {
    }
  } catch (const YAML::Exception& e) {
    Origin where = start;
    if (where.line > 0 && !e.mark.is_null()) where.line = e.mark.line + 1;
    throw config_error(where, "", "YAML: " + e.msg);
  }
  return builder.take();
}

std::vector<std::string_view> split_key(std::string_view dotted_key) {
  std::vector<std::string_view> parts;
  for (std::size_t start = 0; start <= dotted_key.size();) {
    const std::size_t dot = std::min(dotted_key.find('.', start), dotted_key.size());
    parts.push_back(dotted_key.substr(start, dot - start));
    start = dot + 1;
  }
  return parts;
}

// The dot-separated beginning of `dotted_key` that ends with `part`, a view into it.
std::string_view key_through(std::string_view dotted_key, std::string_view part) {
  return dotted_key.substr(0, static_cast<std::size_t>(part.data() + part.size() - dotted_key.data()));
}

}  // namespace

ConfigTree parse_config(std::string_view text, std::string label) {
  return parse(text, {std::make_shared<const std::string>(std::move(label)), 1});
}

ConfigTree load_config_file(const std::filesystem::path& file) {
  const std::string label = file.generic_string();
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) throw ConfigError(label + ": is a directory");
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw ConfigError(label + ": cannot be opened: " + std::strerror(errno));
  // Read rather than trust a file's stated size, which pipes and devices do not have; the parser refuses the excess.
  std::string text;
  std::array<char, 1 << 14> chunk;
  while (stream && text.size() <= kMaxConfigBytes) {
    stream.read(chunk.data(), chunk.size());
    text.append(chunk.data(), static_cast<std::size_t>(stream.gcount()));
  }
  if (stream.bad()) throw ConfigError(label + ": cannot be read");
  ConfigTree tree = parse_config(text, label);
  if (tree.kind == Kind::kNull) throw ConfigError(label + ": holds no keys");
  return tree;
}

ConfigOverride parse_override(std::string_view assignment, std::string_view option) {
  const Origin origin{std::make_shared<const std::string>(fmt::format("{} {}", option, assignment)), 0};
  const std::size_t equals = assignment.find('=');
  if (equals == std::string_view::npos) throw config_error(origin, "", "expects key=value");
  const std::string_view key = assignment.substr(0, equals);
  for (const std::string_view part : split_key(key)) {
    if (part.empty()) throw config_error(origin, "", "expects a key, words joined by dots, before the '='");
  }
  if (assignment.find('\n') != std::string_view::npos) {
    throw ConfigError(fmt::format("{} {}: the value must be one line", option, key));
  }
  return {std::string(key), parse(assignment.substr(equals + 1), origin)};
}

const ConfigTree* find_value(const ConfigTree& root, std::string_view dotted_key) {
  const ConfigTree* node = &root;
  for (const std::string_view part : split_key(dotted_key)) {
    const auto entry = std::ranges::find(node->entries, part, &ConfigEntry::key);
    if (entry == node->entries.end()) return nullptr;
    node = &entry->value;
  }
  return node;
}

void set_value(ConfigTree& root, std::string_view dotted_key, ConfigTree value) {
  const Origin origin = value.origin;
  ConfigTree* node = &root;
  std::string_view parent_key;
  for (const std::string_view part : split_key(dotted_key)) {
    if (node->kind == Kind::kNull) {
      node->kind = Kind::kMap;
      node->origin = origin;
    }
    if (node->kind != Kind::kMap) {
      throw config_error(origin, dotted_key, fmt::format("'{}' is a value, not a section", parent_key));
    }
    auto entry = std::ranges::find(node->entries, part, &ConfigEntry::key);
    if (entry == node->entries.end()) entry = node->entries.insert(entry, {std::string(part), origin, {}});
    node = &entry->value;
    parent_key = key_through(dotted_key, part);
    if (parent_key == dotted_key) entry->origin = origin;
  }
  *node = std::move(value);
}

ConfigError config_error(const Origin& origin, std::string_view dotted_key, std::string_view rule) {
  std::string where;
  bool key_is_named = dotted_key.empty();
  if (origin.label != nullptr) {
    where = *origin.label;
    if (origin.line > 0) where += fmt::format(":{}", origin.line);
    where += ": ";
    const std::string_view assignment = std::string_view(where).substr(where.find(' ') + 1);  // after the option
    key_is_named = key_is_named || (origin.line == 0 && assignment.starts_with(fmt::format("{}=", dotted_key)));
  }
  return ConfigError(key_is_named ? fmt::format("{}{}", where, rule)
                                  : fmt::format("{}{}: {}", where, dotted_key, rule));
}

}  // namespace plumbline::core
