#include <gtest/gtest.h>

#include <algorithm>
#include <regex>
#include <set>

#include "tests/tidy/source_tree.h"

/// What every file of the project must look like.
namespace hilbrush::tidy {
namespace fs = std::filesystem;

/// The faults that `check` finds in the lines of the files it is asked about, as "file:line: what".
template <class Applies, class Check>
std::string faults_in_lines(const Applies& applies, const Check& check) {
  std::string faults;
  for (const SourceFile& file : source_files()) {
    if (!applies(file)) continue;
    const std::vector<std::string> lines = file.lines();
    for (std::size_t i = 0; i < lines.size(); ++i) {
      const std::string fault = check(lines[i]);
      if (!fault.empty()) faults += file.path + ":" + std::to_string(i + 1) + ": " + fault + "\n";
    }
  }
  return faults;
}

const auto kAnyFile = [](const SourceFile&) { return true; };

TEST(Text, FilesAreFound) {
  // The other tests prove nothing about an empty list.
  EXPECT_GT(source_files().size(), 50u);
  EXPECT_TRUE(std::any_of(source_files().begin(), source_files().end(),
                          [](const SourceFile& f) { return f.path == "sampling/curve/stream_dots.h"; }));
}

TEST(Text, TopLevelIsAsFixed) {
  const std::set<std::string> wanted{
      "CMakeLists.txt", "README.md", "sampling", "planner",       "drivers",     "sim",       "config",
      "daemon",         "tests",     ".ci",      ".clang-format", ".clang-tidy", ".gitignore"};
  std::set<std::string> found;
  for (const fs::directory_entry& entry : fs::directory_iterator(top_folder())) {
    const std::string name = entry.path().filename();
    if (!is_ignored_name(name)) found.insert(name);
  }
  EXPECT_EQ(found, wanted);
}

TEST(Text, NoFileIsTooLong) {
  static constexpr std::size_t kLines = 600;
  static constexpr std::size_t kBytes = 1 << 20;
  for (const SourceFile& file : source_files())
    EXPECT_TRUE(file.lines().size() <= kLines || file.path == "tests/bench/RESULTS.md")
        << file.path << ": " << file.lines().size() << " lines; one subject a file, split it";
  for (const std::string& path : all_files())
    EXPECT_LE(fs::file_size(top_folder() / path), kBytes) << path << ": too large to be committed";
}

TEST(Text, FewLinesAreLong) {
  static constexpr std::size_t kColumns = 110;
  std::size_t long_count = 0;
  std::size_t count = 0;
  for (const SourceFile& file : source_files()) {
    if (!file.is_cpp()) continue;
    for (const std::string& line : file.lines()) {
      ++count;
      long_count += line.size() > kColumns ? 1 : 0;
    }
  }
  EXPECT_LT(static_cast<double>(long_count), .01 * static_cast<double>(count))
      << "lines of more than " << kColumns << " columns, of " << count;
}

/// Words that a reader from outside would stumble over, with what to write instead. In pieces, or this file
/// would find itself.
TEST(Text, PlainEnglish) {
  const std::vector<std::pair<std::string, std::string>> words{
      {"\\bk(Mo"
       "st|Lea"
       "st|Long"
       "est|Larg"
       "est|Small"
       "est)[A-Z]?",
       "kMax or kMin"},
      {"\\b(no"
       "body|some"
       "body|who"
       "ever)\\b",
       "a name for it, or \"none\", \"something\""},
      {"\\ban"
       "ew\\b",
       "again"},
      {"\\b(is|are) to"
       "ld\\b",
       "gets, receives"},
      {"\\bin its own wo"
       "rds\\b",
       "what it says"},
      {"\\bca"
       "n't\\b",
       "cannot"},
      {"\\b[Ss]o ma"
       "ny\\b",
       "this many"},
      {"\\btalks? non"
       "sense\\b",
       "invalid message"},
      {"\\b[a-z]*(col"
       "our|neigh"
       "bour|gr"
       "ey|behavi"
       "our|millim"
       "etre|microm"
       "etre)",
       "American spelling"},
      {"\\bcent"
       "red?\\b|\\bcent"
       "res\\b|\\bme"
       "tres?\\b",
       "American spelling"},
  };
  std::vector<std::regex> patterns;
  for (const auto& [word, instead] : words) patterns.emplace_back(word);
  EXPECT_EQ("", faults_in_lines(kAnyFile, [&](const std::string& line) -> std::string {
              for (std::size_t i = 0; i < words.size(); ++i) {
                std::smatch match;
                if (std::regex_search(line, match, patterns[i]))
                  return "says \"" + match.str() + "\"; write " + words[i].second;
              }
              return {};
            }));
}

TEST(Text, NoUnfinishedWork) {
  // In pieces, or this file would find itself.
  const std::regex words(
      "\\b(TO"
      "DO|FIX"
      "ME|XX"
      "X|HA"
      "CK)\\b|not impl"
      "emented|#if"
      " 0");
  EXPECT_EQ("", faults_in_lines(kAnyFile, [&](const std::string& line) -> std::string {
              std::smatch match;
              return std::regex_search(line, match, words) ? "says " + match.str() : "";
            }));
}

TEST(Text, NoPathsOfSomebodysMachine) {
  const std::vector<std::string> prefixes{
      "/ro"
      "ot/",
      "/wo"
      "rk/",
      "/ho"
      "me/"};
  EXPECT_EQ("", faults_in_lines(kAnyFile, [&](const std::string& line) -> std::string {
              for (const std::string& prefix : prefixes) {
                if (line.find(prefix) != std::string::npos) return "names a path below " + prefix;
              }
              return {};
            }));
}

TEST(Text, NoStrayWhitespace) {
  EXPECT_EQ("", faults_in_lines(kAnyFile, [](const std::string& line) -> std::string {
              if (line.empty()) return {};
              if (line.back() == '\r') return "ends with a carriage return";
              if (line.back() == ' ' || line.back() == '\t') return "trailing whitespace";
              if (line.find('\t') != std::string::npos) return "a tab";
              return {};
            }));
  for (const SourceFile& file : source_files()) {
    if (file.text.empty()) continue;
    EXPECT_TRUE(file.text.back() == '\n' && !file.text.ends_with("\n\n"))
        << file.path << ": must end with exactly one line end";
  }
}

TEST(Text, NoFileIsAPlaceholder) {
  for (const SourceFile& file : source_files()) {
    if (!file.is_cpp()) continue;
    EXPECT_GT(file.text.size(), 60u) << file.path << ": holds nothing";
  }
}

TEST(Text, HeadersAreGuardedOnce) {
  for (const SourceFile& file : source_files()) {
    if (!file.has_ending(".h")) continue;
    EXPECT_TRUE(file.text.starts_with("#pragma once\n")) << file.path << ":1: must begin with #pragma once";
  }
}

TEST(Text, ScriptsStopAtTheFirstFault) {
  const std::vector<std::string> scripts{".ci/run", "config/install-packages", "sim/demo", "tests/run"};
  for (const std::string& script : scripts) {
    const auto file = std::find_if(source_files().begin(), source_files().end(),
                                   [&](const SourceFile& f) { return f.path == script; });
    ASSERT_NE(file, source_files().end()) << script << " is missing";
    EXPECT_TRUE(file->text.starts_with("#!/usr/bin/env bash\n")) << script;
    EXPECT_NE(file->text.find("\nset -euo pipefail\n"), std::string::npos) << script;
    EXPECT_NE(fs::status(top_folder() / script).permissions() & fs::perms::owner_exec, fs::perms::none)
        << script << ": not executable";
  }
}

TEST(Text, PackagesHaveAReason) {
  const auto file = std::find_if(source_files().begin(), source_files().end(),
                                 [](const SourceFile& f) { return f.path == "config/packages.txt"; });
  ASSERT_NE(file, source_files().end());
  std::set<std::string> names;
  for (const std::string& line : file->lines()) {
    if (line.starts_with("#")) continue;
    const std::string name = line.substr(0, line.find(' '));
    EXPECT_NE(line.find("  # "), std::string::npos) << name << ": no reason given";
    EXPECT_TRUE(names.insert(name).second) << name << ": listed twice";
  }
  EXPECT_GT(names.size(), 10u);
}

}  // namespace hilbrush::tidy
