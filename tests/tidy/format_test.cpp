#include <gtest/gtest.h>

#include <cstdlib>
#include <optional>
#include <regex>
#include <set>
#include <sstream>

#include "tests/support/shell.h"
#include "tests/tidy/source_tree.h"

/// Layout by clang-format, lint by clang-tidy, and generated data against its generator.
namespace hilbrush::tidy {

using testing_support::CommandResult;
using testing_support::find_program;
using testing_support::run_command;

std::string quoted(const std::string& path) {
  return testing_support::quoted((top_folder() / path).string());
}

TEST(Format, EveryFileIsAsClangFormatLeavesIt) {
  const std::string formatter = find_program("clang-format-14");
  if (formatter.empty()) GTEST_SKIP() << "SKIPPED: clang-format-14 is not installed";
  std::string files;
  for (const SourceFile& file : source_files()) {
    if (file.is_cpp()) files += " " + quoted(file.path);
  }
  const CommandResult result = run_command(formatter + " --dry-run --Werror --ferror-limit=1" + files);
  EXPECT_EQ(result.exit_code, 0) << result.output;
}

bool is_long() {
  return std::getenv("HILBRUSH_LONG") != nullptr;
}

/// The first line of what a git command answers; empty if it fails.
std::string git_line(const std::string& arguments) {
  const CommandResult result = run_command("git -C " + quoted(".") + " " + arguments + " 2>/dev/null");
  return result.exit_code == 0 ? result.output.substr(0, result.output.find('\n')) : "";
}

/// The files that differ from the base that HILBRUSH_LINT_BASE names (default: where this branch left its
/// upstream, or the last commit); nothing if it says "all" or this is not a checkout: then every file counts.
std::optional<std::set<std::string>> changed_files() {
  const char* named = std::getenv("HILBRUSH_LINT_BASE");
  if (named != nullptr && std::string(named) == "all") return std::nullopt;
  std::string base = named != nullptr ? named : git_line("merge-base HEAD @{upstream}");
  if (base.empty()) base = git_line("rev-parse HEAD");
  if (base.empty()) return std::nullopt;
  const CommandResult changed =
      run_command("cd " + quoted(".") + " && git diff --name-only " + testing_support::quoted(base) +
                  " && git ls-files --others --exclude-standard");
  EXPECT_EQ(changed.exit_code, 0) << "HILBRUSH_LINT_BASE is not a commit: " << base << "\n" << changed.output;
  std::set<std::string> files;
  std::istringstream lines(changed.output);
  for (std::string line; std::getline(lines, line);) files.insert(line);
  return files;
}

/// What the build compiles of `folder`: its sources, or the bundles of them that are compiled together.
std::string translation_units(const std::string& folder) {
  static const std::regex kFile(R"re("file": "([^"]+)")re");
  const std::string build = HILBRUSH_BUILD_DIR;
  const std::string commands = read_text(build + "/compile_commands.json");
  std::string units;
  for (std::sregex_iterator i(commands.begin(), commands.end(), kFile), end; i != end; ++i) {
    const std::string path = (*i)[1];
    if (path.starts_with(build + "/" + folder + "/") ||
        path.starts_with((top_folder() / folder).string() + "/"))
      units += " " + testing_support::quoted(path);
  }
  return units;
}

/// The sources of `folder` that changed, or whose header did.
std::string changed_units(const std::string& folder, const std::set<std::string>& changed) {
  std::string units;
  for (const SourceFile& file : source_files()) {
    if (!file.has_ending(".cpp") || !file.is_below(folder)) continue;
    const std::string header = file.path.substr(0, file.path.size() - 4) + ".h";
    if (changed.contains(file.path) || changed.contains(header)) units += " " + quoted(file.path);
  }
  return units;
}

/// The checks of .clang-tidy that find most for their time; the whole list, at three times the time, waits
/// for tests/run --long.
constexpr const char* kEverydayChecks =
    " --checks='-*,readability-identifier-naming,bugprone-use-after-move,bugprone-infinite-loop,"
    "bugprone-unused-return-value,performance-for-range-copy,performance-unnecessary-value-param'";

class Lint : public testing::TestWithParam<const char*> {};

TEST_P(Lint, FindsNothing) {
  const std::string linter = find_program("clang-tidy-14");
  if (linter.empty()) GTEST_SKIP() << "SKIPPED: clang-tidy-14 is not installed";
  const std::optional<std::set<std::string>> changed = changed_files();
  const std::string units = changed ? changed_units(GetParam(), *changed) : translation_units(GetParam());
  if (changed && units.empty()) return;  // nothing of this folder differs from the base
  ASSERT_FALSE(units.empty()) << "compile_commands.json names no source of " << GetParam();
  // The compiler has its say on shadows and conversions when it builds; clang sees more of them.
  const CommandResult result =
      run_command(linter + (is_long() ? "" : kEverydayChecks) +
                  " --extra-arg=-Wno-shadow --extra-arg=-Wno-conversion --quiet -p " +
                  testing_support::quoted(HILBRUSH_BUILD_DIR) + units);
  EXPECT_EQ(result.exit_code, 0) << result.output;
}

INSTANTIATE_TEST_SUITE_P(Folders, Lint,
                         testing::Values("sampling", "planner", "drivers", "sim", "config", "daemon"));

TEST(Data, ModelsAreWhatTheirProgramsMake) {
  const std::string python = find_program("python3");
  if (python.empty()) GTEST_SKIP() << "SKIPPED: python3 is not installed; building and running need none";
  for (const char* script : {"tests/data/make_eggcup.py", "tests/data/make_cubes.py"}) {
    const CommandResult result = run_command(python + " " + quoted(script) + " --check");
    EXPECT_EQ(result.exit_code, 0) << result.output;
  }
}

TEST(Data, BuildingNeedsNoPython) {
  const std::string word = std::string("py") + "thon";
  for (const SourceFile& file : source_files()) {
    const bool is_build_file = file.has_ending("CMakeLists.txt") || file.has_ending(".cmake") ||
                               file.path == "config/packages.txt" || file.path == "config/install-packages" ||
                               file.path == "tests/run" || file.path == "sim/demo";
    if (!is_build_file) continue;
    EXPECT_EQ(file.text.find(word), std::string::npos) << file.path << ": needs " << word;
  }
}

}  // namespace hilbrush::tidy
