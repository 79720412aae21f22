#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/tidy/source_tree.h"

/// Layout by clang-format, lint by clang-tidy, and generated data against its generator.
namespace hilbrush::tidy {

std::string quoted(const std::string& path) {
  return "'" + (top_folder() / path).string() + "'";
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
