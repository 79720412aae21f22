#include <gtest/gtest.h>

#include <cstdlib>
#include <regex>

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

/// What the build compiles of `folder`: its sources, or the bundles of them that are compiled together.
std::string translation_units(const std::string& folder) {
  static const std::regex kFile(R"re("file": "([^"]+)")re");
  const std::string build = HILBRUSH_BUILD_DIR;
  const std::string commands = read_text(build + "/compile_commands.json");
  std::string units;
  for (std::sregex_iterator i(commands.begin(), commands.end(), kFile), end; i != end; ++i) {
    const std::string path = (*i)[1];
    if (path.starts_with(build + "/" + folder + "/") || path.starts_with((top_folder() / folder).string() + "/"))
      units += " " + testing_support::quoted(path);
  }
  return units;
}

/// The checks of .clang-tidy that find most for their time; the whole list, at three times the time, waits for
/// tests/run --long.
constexpr const char* kEverydayChecks =
    " --checks='-*,readability-identifier-naming,bugprone-use-after-move,bugprone-infinite-loop,"
    "bugprone-unused-return-value,performance-for-range-copy,performance-unnecessary-value-param'";

class Lint : public testing::TestWithParam<const char*> {};

TEST_P(Lint, FindsNothing) {
  const std::string linter = find_program("clang-tidy-14");
  if (linter.empty()) GTEST_SKIP() << "SKIPPED: clang-tidy-14 is not installed";
  const std::string units = translation_units(GetParam());
  ASSERT_FALSE(units.empty()) << "compile_commands.json names no source of " << GetParam();
  // The compiler has its say on shadows when it builds; clang sees more of them in a bundle.
  const CommandResult result =
      run_command(linter + (is_long() ? "" : kEverydayChecks) + " --extra-arg=-Wno-shadow --quiet -p " +
                  testing_support::quoted(HILBRUSH_BUILD_DIR) + units);
  EXPECT_EQ(result.exit_code, 0) << result.output;
}

INSTANTIATE_TEST_SUITE_P(Folders, Lint, testing::Values("sampling", "planner", "drivers", "sim", "config", "daemon"));

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
