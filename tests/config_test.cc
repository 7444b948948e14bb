// The configuration's syntax, limits and messages: every rule of core/config_tree.h and core/config.h.
#include "core/config.h"

#include <bit>
#include <cmath>
#include <fstream>
#include <string>
#include <tuple>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "core/config_tree.h"
#include "core/hash.h"

namespace plumbline::core {
namespace {

enum class Shutter { kGlobal, kRolling };
constexpr std::array<std::string_view, 2> kShutterNames = {"global", "rolling"};

struct LensConfig {
  double focal_px = 460.0;
  Eigen::Vector2d centre_px{319.5, 239.5};
};

struct RigConfig {
  double rate_hz = 20.0;
  double overlap = 0.1;
  double td_s = 0.0;
  int rows = 480;
  std::uint64_t seed = 1;
  bool estimate = true;
  std::string name = "rig";
  std::optional<double> td_mean_s;
  Eigen::Vector3d gravity_m_s2{0.0, 0.0, -9.81};
  std::filesystem::path poses;
  Shutter shutter = Shutter::kGlobal;
  LensConfig lens;
};

void visit(ConfigVisitor& v, LensConfig& c) {
  v.value("focal_px", c.focal_px, positive(), "focal length");
  v.value("centre_px", c.centre_px, non_negative(), "principal point");
}

void visit(ConfigVisitor& v, RigConfig& c) {
  v.value("rate_hz", c.rate_hz, positive(), "frames a second");
  v.value("overlap", c.overlap, probability(), "share of points seen twice");
  v.value("td_s", c.td_s, any(), "time offset");
  v.value("rows", c.rows, at_least(1), "rows of the image");
  v.value("seed", c.seed, any(), "of the draws");
  v.value("estimate", c.estimate, "whether td is estimated");
  v.value("name", c.name, "label");
  v.value("td_mean_s", c.td_mean_s, any(), "drawn", "prior mean");
  v.value("gravity_m_s2", c.gravity_m_s2, any(), "in W");
  v.path("poses", c.poses, "trajectory");
  v.choice("shutter", c.shutter, kShutterNames, "how rows are exposed");
  v.section("lens", c.lens, "projection");
}

auto fields(const RigConfig& c) {
  const auto bits = [](double x) { return std::bit_cast<std::uint64_t>(x); };
  return std::tuple(bits(c.rate_hz), bits(c.overlap), bits(c.td_s), c.rows, c.seed, c.estimate, c.name,
                    c.td_mean_s.has_value(), bits(c.td_mean_s.value_or(0.0)), bits(c.gravity_m_s2.x()),
                    bits(c.gravity_m_s2.y()), bits(c.gravity_m_s2.z()), c.poses, c.shutter, bits(c.lens.focal_px),
                    bits(c.lens.centre_px.x()), bits(c.lens.centre_px.y()));
}

RigConfig read(std::string_view text) {
  RigConfig c;
  read_config(parse_config(text, "a.yaml"), "", c);
  return c;
}

template <class Function>
std::string message_of(Function&& function) {
  try {
    function();
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "no error";
}

std::string parse_error(std::string_view text) {
  return message_of([&] { parse_config(text, "a.yaml"); });
}

std::string read_error(std::string_view text) {
  return message_of([&] { read(text); });
}

std::string override_error(std::string_view assignment) {
  return message_of([&] {
    ConfigTree root;
    ConfigOverride change = parse_override(assignment);
    set_value(root, change.key, std::move(change.value));
    RigConfig c;
    read_config(root, "", c);
  });
}

struct Refusal {
  std::string text;
  std::string message;
};

class TempFile {
 public:
  TempFile(const std::string& name, std::string_view content)
      : path_(std::filesystem::path(testing::TempDir()) / ("plumbline_config_" + name)) {
    std::ofstream(path_, std::ios::binary) << content;
  }
  TempFile(const TempFile&) = delete;
  TempFile& operator=(const TempFile&) = delete;
  ~TempFile() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

TEST(ConfigTree, KeepsOrderKindsQuotesAndLines) {
  const ConfigTree root = parse_config("b: 1\n\na:\n  - x\n  - 'y'\nempty:\nlast: {k: ~}\n", "a.yaml");
  ASSERT_EQ(root.kind, ConfigTree::Kind::kMap);
  ASSERT_EQ(root.entries.size(), 4u);
  EXPECT_EQ(root.entries[0].key, "b");
  EXPECT_EQ(root.entries[1].origin.line, 3);
  const ConfigTree& list = root.entries[1].value;
  ASSERT_EQ(list.items.size(), 2u);
  EXPECT_FALSE(list.items[0].quoted);
  EXPECT_TRUE(list.items[1].quoted);
  EXPECT_EQ(list.items[1].origin.line, 5);
  EXPECT_EQ(*list.items[1].origin.label, "a.yaml");
  EXPECT_EQ(root.entries[2].value.kind, ConfigTree::Kind::kNull);
  EXPECT_EQ(root.entries[2].value.origin.line, 6);
  EXPECT_EQ(find_value(root, "last.k")->kind, ConfigTree::Kind::kNull);
  EXPECT_EQ(find_value(root, "last.no"), nullptr);
  EXPECT_EQ(find_value(root, "b.no"), nullptr);
}

TEST(ConfigTree, AcceptsEmptyTextByteOrderMarkAndWindowsLineEnds) {
  EXPECT_EQ(parse_config("", "a.yaml").kind, ConfigTree::Kind::kNull);
  EXPECT_EQ(parse_config("# nothing\n", "a.yaml").kind, ConfigTree::Kind::kNull);
  const ConfigTree root = parse_config("\xEF\xBB\xBF---\r\na: 1\r\nname: \"\xC3\xA9\"\r\n", "a.yaml");
  EXPECT_EQ(find_value(root, "a")->scalar, "1");
  EXPECT_EQ(find_value(root, "name")->scalar, "\xC3\xA9");
  EXPECT_EQ(find_value(root, "name")->origin.line, 3);
}

TEST(ConfigTree, RefusesWhatIsNotPlainData) {
  const std::vector<Refusal> refusals = {
      {"a: 1\nb: &x 2\n", "a.yaml:2: anchors and aliases (& and *) are not allowed"},
      {"a: &x\n", "a.yaml:1: anchors and aliases (& and *) are not allowed"},
      {"a: &x {}\n", "a.yaml:1: anchors and aliases (& and *) are not allowed"},
      {"a: !!str 2\n", "a.yaml:1: tags (!) are not allowed"},
      {"a: ! 2\n", "a.yaml:1: tags (!) are not allowed"},
      {"a:\n - !x [1]\n", "a.yaml:2: tags (!) are not allowed"},
      {"a: !x {}\n", "a.yaml:1: tags (!) are not allowed"},
      {"a: 1\nb: 2\na: 3\n", "a.yaml:3: a: given twice; first on line 1"},
      {"s:\n  l: {x: 1, x: 2}\n", "a.yaml:2: s.l.x: given twice; first on line 2"},
      {"[1]: 2\n", "a.yaml:1: a key must be a word"},
      {"~: 2\n", "a.yaml:1: a key must be a word"},
      {"a: 1\n---\nb: 2\n", "a.yaml:2: a second document; a configuration is one"},
      {std::string("a: 1\nb: \0\n", 10), "a.yaml:2: byte 0x00 is not text; a configuration is UTF-8"},
      {"a: 1\nb: \x1b\n", "a.yaml:2: byte 0x1b is not text; a configuration is UTF-8"},
      {"a: \xff\n", "a.yaml:1: byte 0xff is not text; a configuration is UTF-8"},
      {"a: \xc0\xaf\n", "a.yaml:1: byte 0xc0 is not text; a configuration is UTF-8"},
      {"a: \xed\xa0\x80\n", "a.yaml:1: byte 0xed is not text; a configuration is UTF-8"},
      {"a: \xe2\x82", "a.yaml:1: byte 0xe2 is not text; a configuration is UTF-8"},
      {"a: \"\\0\"\n", "a.yaml:1: a NUL character"},
      {"a: 1\nb: [1\n", "a.yaml:3: YAML: end of sequence flow not found"},
  };
  for (const Refusal& r : refusals) EXPECT_EQ(parse_error(r.text), r.message) << r.text;
  EXPECT_TRUE(parse_error("a: *x\n").starts_with("a.yaml:1: ")) << parse_error("a: *x\n");
}

TEST(ConfigTree, LimitsDepthNodesAndBytes) {
  const auto nested = [](std::size_t depth) { return std::string(depth, '[') + std::string(depth, ']'); };
  EXPECT_EQ(parse_error(nested(kMaxConfigDepth)), "no error");
  EXPECT_EQ(parse_error(nested(kMaxConfigDepth + 1)), "a.yaml:1: nested deeper than 32");
  EXPECT_EQ(parse_error(std::string(1'000'000, '[')), "a.yaml:1: nested deeper than 32");

  std::string list;
  for (std::size_t i = 0; i < kMaxConfigNodes; ++i) list += "-\n";
  EXPECT_TRUE(parse_error(list).ends_with(": more than 1000000 values"));
  EXPECT_EQ(parse_error("[" + std::string(kMaxConfigMarks, ',')),
            "a.yaml:1: more than 2000000 brackets, commas, colons and quotes");

  const std::string full = "# " + std::string(kMaxConfigBytes - 2, 'x');
  EXPECT_EQ(parse_error(full), "no error");
  EXPECT_EQ(parse_error(full + "x"), "a.yaml:1: larger than 16 MiB");
  const TempFile file("large.yaml", full + "x");
  EXPECT_EQ(message_of([&] { load_config_file(file.path()); }), file.path().string() + ":1: larger than 16 MiB");
}

TEST(ConfigTree, LoadsFiles) {
  const TempFile file("file.yaml", "a: 1\nb: 2\n");
  const ConfigTree root = load_config_file(file.path());
  EXPECT_EQ(find_value(root, "b")->origin.line, 2);
  EXPECT_EQ(*root.origin.label, file.path().generic_string());
  EXPECT_EQ(message_of([] { load_config_file("/no/such.yaml"); }),
            "/no/such.yaml: cannot be opened: No such file or directory");
  EXPECT_EQ(message_of([] { load_config_file("/"); }), "/: is a directory");
}

TEST(ConfigTree, SetValueReplacesAndCreates) {
  ConfigTree root = parse_config("a: 1\ns:\n", "a.yaml");
  for (const std::string_view text : {"a=[1, 2]", "s.x.y=word", "n.m=", "s.x.z=k=v"}) {
    ConfigOverride change = parse_override(text);
    set_value(root, change.key, std::move(change.value));
  }
  EXPECT_EQ(find_value(root, "a")->items.size(), 2u);
  EXPECT_EQ(find_value(root, "s.x.y")->scalar, "word");
  EXPECT_EQ(find_value(root, "s.x.y")->origin.line, 0);
  EXPECT_EQ(find_value(root, "s.x.z")->scalar, "k=v");
  EXPECT_EQ(find_value(root, "n.m")->kind, ConfigTree::Kind::kNull);
  EXPECT_EQ(message_of([&] { set_value(root, "s.x.y.z", parse_override("s.x.y.z=1").value); }),
            "--set s.x.y.z=1: 's.x.y' is a value, not a section");
}

TEST(Override, Messages) {
  const std::vector<Refusal> refusals = {
      {"rate_hz=-3", "--set rate_hz=-3: must be > 0, got -3"},
      {"rate=3", "--set rate=3: unknown key; did you mean 'rate_hz'?"},
      {"lens.focal=3", "--set lens.focal=3: unknown key; did you mean 'focal_px'?"},
      {"lns.focal_px=3", "--set lns.focal_px=3: lns: unknown key; did you mean 'lens'?"},
      {"lens={focal_px: 0}", "--set lens={focal_px: 0}: lens.focal_px: must be > 0, got 0"},
      {"gravity_m_s2=[0, 0, x]", "--set gravity_m_s2=[0, 0, x]: gravity_m_s2[2]: must be a number, got x"},
      {"rate_hz=", "--set rate_hz=: must be a number, got nothing"},
      {"rate_hz", "--set rate_hz: expects key=value"},
      {"=3", "--set =3: expects a key, words joined by dots, before the '='"},
      {"a..b=3", "--set a..b=3: expects a key, words joined by dots, before the '='"},
      {"a.=3", "--set a.=3: expects a key, words joined by dots, before the '='"},
      {"a=1\nb", "--set a: the value must be one line"},
      {"a={x: 1, x: 2}", "--set a={x: 1, x: 2}: x: given twice"},
      {"a=*x", "--set a=*x: YAML: the referenced anchor is not defined"},
      {"a=[1", "--set a=[1: YAML: end of sequence flow not found"},
  };
  for (const Refusal& r : refusals) EXPECT_EQ(override_error(r.text), r.message);
}

TEST(ReadConfig, AbsentKeysKeepTheirDefaults) {
  for (const std::string_view text : {"", "{}", "lens:\n", "lens: {}\n"}) {
    EXPECT_EQ(fields(read(text)), fields(RigConfig{})) << text;
  }
  RigConfig c;
  c.rows = 7;
  c.lens.focal_px = 3.0;
  read_config(parse_config("lens: {centre_px: [1, 2]}", "a.yaml"), "", c);
  EXPECT_EQ(c.rows, 7);
  EXPECT_EQ(c.lens.focal_px, 3.0);
  EXPECT_EQ(c.lens.centre_px, Eigen::Vector2d(1.0, 2.0));
}

TEST(ReadConfig, ReadsEveryType) {
  const RigConfig c = read(
      "rate_hz: 1e-3\noverlap: 1\ntd_s: -0.5\nrows: 12\nseed: 18446744073709551615\nestimate: false\nname: 2024\n"
      "td_mean_s: 2e-3\ngravity_m_s2: [1, 2.5, -3]\nposes: /data/poses.txt\nshutter: rolling\nlens:\n  focal_px: 5\n");
  EXPECT_EQ(c.rate_hz, 1e-3);
  EXPECT_EQ(c.overlap, 1.0);
  EXPECT_EQ(c.td_s, -0.5);
  EXPECT_EQ(c.rows, 12);
  EXPECT_EQ(c.seed, std::numeric_limits<std::uint64_t>::max());
  EXPECT_FALSE(c.estimate);
  EXPECT_EQ(c.name, "2024");
  EXPECT_EQ(c.td_mean_s, 2e-3);
  EXPECT_EQ(c.gravity_m_s2, Eigen::Vector3d(1.0, 2.5, -3.0));
  EXPECT_EQ(c.poses, "/data/poses.txt");
  EXPECT_EQ(c.shutter, Shutter::kRolling);
  EXPECT_EQ(c.lens.focal_px, 5.0);
  EXPECT_EQ(read("td_mean_s: drawn").td_mean_s, std::nullopt);
}

TEST(ReadConfig, Messages) {
  const std::string kInt = "must be a whole number from -2147483648 to 2147483647, got ";
  const std::vector<Refusal> refusals = {
      {"\nrate_hz: -3", "a.yaml:2: rate_hz: must be > 0, got -3"},
      {"rate_hz: 0", "a.yaml:1: rate_hz: must be > 0, got 0"},
      {"rate_hz: fast", "a.yaml:1: rate_hz: must be a number, got fast"},
      {"rate_hz: \"20\"", "a.yaml:1: rate_hz: must be a number, got \"20\""},
      {"rate_hz: [20]", "a.yaml:1: rate_hz: must be a number, got a list"},
      {"rate_hz: {}", "a.yaml:1: rate_hz: must be a number, got a map"},
      {"rate_hz:\n\nrows: 1", "a.yaml:1: rate_hz: must be a number, got nothing"},
      {"rate_hz: 20 Hz", "a.yaml:1: rate_hz: must be a number, got 20 Hz"},
      {"rate_hz: +20", "a.yaml:1: rate_hz: must be a number, got +20"},
      {"rate_hz: 0x10", "a.yaml:1: rate_hz: must be a number, got 0x10"},
      {"rate_hz: .5e", "a.yaml:1: rate_hz: must be a number, got .5e"},
      {"rate_hz: ''", "a.yaml:1: rate_hz: must be a number, got \"\""},
      {"rate_hz: 1,5", "a.yaml:1: rate_hz: must be a number, got 1,5"},
      {"td_s: nan", "a.yaml:1: td_s: must be a finite number, got nan"},
      {"td_s: -inf", "a.yaml:1: td_s: must be a finite number, got -inf"},
      {"td_s: .nan", "a.yaml:1: td_s: must be a number, got .nan"},
      {"td_s: 1e999", "a.yaml:1: td_s: must be a finite number, got 1e999"},
      {"overlap: 1.5", "a.yaml:1: overlap: must be in [0, 1], got 1.5"},
      {"rows: 0", "a.yaml:1: rows: must be >= 1, got 0"},
      {"rows: 1.5", "a.yaml:1: rows: " + kInt + "1.5"},
      {"rows: 1e3", "a.yaml:1: rows: " + kInt + "1e3"},
      {"rows: '4'", "a.yaml:1: rows: " + kInt + "\"4\""},
      {"rows: 9999999999", "a.yaml:1: rows: " + kInt + "9999999999"},
      {"seed: -1", "a.yaml:1: seed: must be a whole number from 0 to 18446744073709551615, got -1"},
      {"estimate: yes", "a.yaml:1: estimate: must be true or false, got yes"},
      {"estimate: 'true'", "a.yaml:1: estimate: must be true or false, got \"true\""},
      {"estimate: [true]", "a.yaml:1: estimate: must be true or false, got a list"},
      {"name: [a]", "a.yaml:1: name: must be text, got a list"},
      {"poses: {}", "a.yaml:1: poses: must be a path, got a map"},
      {"td_mean_s: drwn", "a.yaml:1: td_mean_s: must be a number or the word 'drawn', got drwn"},
      {"gravity_m_s2: 9.81", "a.yaml:1: gravity_m_s2: must be a list of 3 numbers, got 9.81"},
      {"gravity_m_s2: [1, 2]", "a.yaml:1: gravity_m_s2: must be a list of 3 numbers, got 2"},
      {"lens:\n  centre_px:\n   - 1\n   - -2", "a.yaml:4: lens.centre_px[1]: must be >= 0, got -2"},
      {"shutter: roling", "a.yaml:1: shutter: must be one of global, rolling, got roling; did you mean 'rolling'?"},
      {"shutter: x", "a.yaml:1: shutter: must be one of global, rolling, got x"},
      {"shutter: [global]", "a.yaml:1: shutter: must be one of global, rolling, got a list"},
      {"lens: 3", "a.yaml:1: lens: must be a section, a map of keys, got 3"},
      {"lens: []", "a.yaml:1: lens: must be a section, a map of keys, got a list"},
      {"lens:\n  focal_xp: 3", "a.yaml:2: lens.focal_xp: unknown key; did you mean 'focal_px'?"},
      {"zzz: 3", "a.yaml:1: zzz: unknown key"},
  };
  for (const Refusal& r : refusals) EXPECT_EQ(read_error(r.text), r.message);

  EXPECT_EQ(read_error("rate_hz: |\n  1\n  2\n"), "a.yaml:1: rate_hz: must be a number, got \"1 2 \"");
  EXPECT_EQ(read_error("rate_hz: " + std::string(1000, 'x')),
            "a.yaml:1: rate_hz: must be a number, got " + std::string(60, 'x') + "...");
}

TEST(ReadConfig, PrefixLeadsTheKeys) {
  const ConfigTree root = parse_config("scenario:\n  camera:\n    rate_hz: -3\n", "a.yaml");
  RigConfig c;
  EXPECT_EQ(message_of([&] { read_config(*find_value(root, "scenario.camera"), "scenario.camera", c); }),
            "a.yaml:3: scenario.camera.rate_hz: must be > 0, got -3");
  EXPECT_EQ(message_of([&] { read_config(root.entries[0].value.entries[0].value.entries[0].value, "x", c); }),
            "a.yaml:3: x: must be a section, a map of keys, got -3");
}

TEST(ReadConfig, PathsAreRelativeToTheirFile) {
  RigConfig c;
  read_config(parse_config("poses: ../data/poses.txt", "/configs/scenarios/a.yaml"), "", c);
  EXPECT_EQ(c.poses, "/configs/data/poses.txt");
  ConfigTree root = parse_config("", "/configs/a.yaml");
  set_value(root, "poses", parse_override("poses=poses.txt").value);
  read_config(root, "", c);
  EXPECT_EQ(c.poses, std::filesystem::current_path() / "poses.txt");
  EXPECT_EQ(read("poses: ''").poses, "");
}

RigConfig uneven_config() {
  RigConfig c;
  c.rate_hz = 1.0 / 3.0;
  c.overlap = 5e-324;
  c.td_s = -0.0;
  c.rows = 17;
  c.seed = std::numeric_limits<std::uint64_t>::max();
  c.estimate = false;
  c.name = "a \"b\"\\\n\t\x01\xC3\xA9: # 'null'";
  c.td_mean_s = -1e-9;
  c.gravity_m_s2 = {0.1, 1e300, -9.80665};
  c.poses = "/data/p.txt";
  c.shutter = Shutter::kRolling;
  c.lens = {.focal_px = std::nextafter(460.0, 0.0), .centre_px = {2.0, 1e22}};
  return c;
}

TEST(ResolvedConfig, ReadsBackToTheBit) {
  for (const RigConfig& c : {RigConfig{}, uneven_config()}) {
    for (const int indent : {-1, 2}) {
      const std::string text = resolved_config(c).dump(indent);
      RigConfig back = uneven_config();
      back.td_mean_s = 7.0;
      read_config(parse_config(text, "a.json"), "", back);
      EXPECT_EQ(fields(back), fields(c)) << text;
    }
  }
}

TEST(ResolvedConfig, HoldsDefaultsInOrder) {
  EXPECT_EQ(resolved_config(RigConfig{}).dump(),
            R"({"rate_hz":20.0,"overlap":0.1,"td_s":0.0,"rows":480,"seed":1,"estimate":true,"name":"rig",)"
            R"("td_mean_s":"drawn","gravity_m_s2":[0.0,0.0,-9.81],"poses":"","shutter":"global",)"
            R"("lens":{"focal_px":460.0,"centre_px":[319.5,239.5]}})");
}

TEST(ResolvedConfig, HashesFilesByContent) {
  RigConfig c;
  EXPECT_EQ(resolved_config(c, PathForm::kContentHash)["poses"], "");
  const TempFile a("a.txt", "0 1 2");
  const TempFile b("b.txt", "0 1 2");
  c.poses = a.path();
  const auto of_a = resolved_config(c, PathForm::kContentHash);
  EXPECT_EQ(of_a["poses"], "xxh3:" + content_hash("0 1 2"));
  c.poses = b.path();
  EXPECT_EQ(resolved_config(c, PathForm::kContentHash), of_a);
  EXPECT_NE(resolved_config(c), of_a);
}

TEST(DocumentConfig, ListsEveryKey) {
  std::vector<std::string> lines;
  for (const KeyDoc& k : document_config(RigConfig{}, "rig")) {
    lines.push_back(fmt::format("{}|{}|{}|{}|{}", k.key, k.type, k.default_value, k.rule, k.doc));
  }
  EXPECT_EQ(lines, (std::vector<std::string>{
                       "rig.rate_hz|number|20|> 0|frames a second",
                       "rig.overlap|number|0.1|in [0, 1]|share of points seen twice",
                       "rig.td_s|number|0||time offset",
                       "rig.rows|integer|480|>= 1|rows of the image",
                       "rig.seed|integer|1||of the draws",
                       "rig.estimate|boolean|true||whether td is estimated",
                       "rig.name|text|rig||label",
                       "rig.td_mean_s|number or 'drawn'|drawn||prior mean",
                       "rig.gravity_m_s2|list of 3 numbers|[0, 0, -9.81]||in W",
                       "rig.poses|path|\"\"||trajectory",
                       "rig.shutter|choice|global|global | rolling|how rows are exposed",
                       "rig.lens|section|||projection",
                       "rig.lens.focal_px|number|460|> 0|focal length",
                       "rig.lens.centre_px|list of 2 numbers|[319.5, 239.5]|each >= 0|principal point",
                   }));
  EXPECT_EQ(document_config(LensConfig{}, "").front().key, "focal_px");
}

struct WaveConfig {
  std::vector<double> frequency_hz = {1.0, 2.5};
};
void visit(ConfigVisitor& v, WaveConfig& c) { v.value("frequency_hz", c.frequency_hz, positive(), "of its terms"); }

TEST(ListsOfAnyLength, AreReadResolvedAndDocumented) {
  const auto read_wave = [](std::string_view text) {
    WaveConfig c;
    read_config(parse_config(text, "a.yaml"), "", c);
    return c.frequency_hz;
  };
  EXPECT_EQ(read_wave(""), (std::vector<double>{1.0, 2.5}));
  EXPECT_EQ(read_wave("frequency_hz: []"), std::vector<double>{});
  EXPECT_EQ(read_wave("frequency_hz: [3, 0.5, 7]"), (std::vector<double>{3.0, 0.5, 7.0}));
  EXPECT_EQ(message_of([&] { read_wave("frequency_hz: 3"); }),
            "a.yaml:1: frequency_hz: must be a list of numbers, got 3");
  EXPECT_EQ(message_of([&] { read_wave("frequency_hz: [1, 0]"); }), "a.yaml:1: frequency_hz[1]: must be > 0, got 0");
  EXPECT_EQ(resolved_config(WaveConfig{}).dump(), R"({"frequency_hz":[1.0,2.5]})");
  const KeyDoc doc = document_config(WaveConfig{}, "").front();
  EXPECT_EQ(doc.type + "|" + doc.default_value + "|" + doc.rule, "list of numbers|[1, 2.5]|each > 0");
}

TEST(Range, ContainsAndText) {
  struct Case {
    Range range;
    double inside;
    double outside;
    std::string text;
  };
  const double inf = std::numeric_limits<double>::infinity();
  const std::vector<Case> cases = {
      {any(), -1e300, inf, ""},
      {positive(), 5e-324, 0.0, "> 0"},
      {non_negative(), 0.0, -5e-324, ">= 0"},
      {at_least(1.5), 1.5, 1.4, ">= 1.5"},
      {between(-1.0, 2.0), 2.0, 2.1, "in [-1, 2]"},
      {probability(), 0.0, 1.1, "in [0, 1]"},
      {{.lower = 0.0, .upper = 1.0, .lower_open = true}, 1.0, 0.0, "in (0, 1]"},
      {{.lower = 0.0, .upper = 1.0, .upper_open = true}, 0.0, 1.0, "in [0, 1)"},
      {{.upper = 3.0}, 3.0, 4.0, "<= 3"},
      {{.upper = 3.0, .upper_open = true}, 2.0, 3.0, "< 3"},
  };
  for (const Case& c : cases) {
    EXPECT_TRUE(c.range.contains(c.inside)) << c.text;
    EXPECT_FALSE(c.range.contains(c.outside)) << c.text;
    EXPECT_FALSE(c.range.contains(std::nan(""))) << c.text;
    EXPECT_FALSE(c.range.contains(-inf)) << c.text;
    EXPECT_EQ(c.range.text(), c.text);
  }
}

TEST(Nearest, SuggestsOnlyWhatIsNear) {
  constexpr std::array<std::string_view, 5> kWords = {"rate_hz", "td_s", "readout_s", "pixel_sigma_px", "middle"};
  const std::vector<std::pair<std::string, std::string>> cases = {{"rate_hs", "rate_hz"},
                                                                  {"rtae_hz", "rate_hz"},
                                                                  {"rate", "rate_hz"},
                                                                  {"td", "td_s"},
                                                                  {"readout_ms", "readout_s"},
                                                                  {"midle", "middle"},
                                                                  {"pixel_noise", ""},
                                                                  {"x", ""},
                                                                  {"", ""},
                                                                  {std::string(1000, 'm'), ""}};
  for (const auto& [word, expected] : cases) EXPECT_EQ(nearest(word, kWords), expected) << word;
  EXPECT_EQ(nearest("rate_hz", {}), "");
}

}  // namespace
}  // namespace plumbline::core
