// The command line in a folder of its own, in this process: what the tests of commands share.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "tools/program.h"

namespace plumbline {

struct ProgramResult {
  int code = -1;
  std::string out;
  std::string err;
};

// Words between blanks; '...' keeps blanks.
inline std::vector<std::string> split_arguments(std::string_view line) {
  std::vector<std::string> words;
  bool in_word = false;
  bool quoted = false;
  for (const char c : line) {
    if (c == ' ' && !quoted) {
      in_word = false;
      continue;
    }
    if (!in_word) words.emplace_back();
    in_word = true;
    if (c == '\'') {
      quoted = !quoted;
    } else {
      words.back() += c;
    }
  }
  return words;
}

class ProgramTest : public ::testing::Test {
 protected:
  void SetUp() override { folder_ = make_folder(); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  static std::filesystem::path make_folder() {
    std::string name = (std::filesystem::temp_directory_path() / "plumbline-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder " + name);
    return name;
  }

  static std::string read(const std::filesystem::path& path) {
    std::ostringstream text;
    text << std::ifstream(path, std::ios::binary).rdbuf();
    return text.str();
  }

  static void save(const std::filesystem::path& path, const std::string& text) {
    std::ofstream(path, std::ios::binary) << text;
  }

  // In the folder; returns where.
  std::filesystem::path write(const std::filesystem::path& name, const std::string& text) const {
    save(folder_ / name, text);
    return folder_ / name;
  }

  // The names of the files and folders below a folder, sorted.
  static std::vector<std::string> listing(const std::filesystem::path& folder) {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
      names.push_back(std::filesystem::relative(entry.path(), folder).generic_string());
    }
    std::sort(names.begin(), names.end());
    return names;
  }

  // `plumbline ARGUMENTS` in the folder.
  ProgramResult plumbline(const std::string& arguments) const { return plumbline_in(folder_, arguments); }

  static ProgramResult plumbline_in(const std::filesystem::path& folder, const std::string& arguments) {
    const std::vector<std::string> words = split_arguments("plumbline " + arguments);
    std::vector<const char*> argv;
    argv.reserve(words.size());
    for (const std::string& word : words) argv.push_back(word.c_str());
    const std::filesystem::path before = std::filesystem::current_path();
    std::filesystem::current_path(folder);
    ProgramResult result;
    ::testing::internal::CaptureStdout();
    ::testing::internal::CaptureStderr();
    result.code = tools::program(static_cast<int>(argv.size()), argv.data());
    result.out = ::testing::internal::GetCapturedStdout();
    result.err = ::testing::internal::GetCapturedStderr();
    std::filesystem::current_path(before);
    return result;
  }

  std::filesystem::path folder_;
};

}  // namespace plumbline
