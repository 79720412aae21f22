#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/shell.h"
#include "tests/support/temporary_folder.h"

/// The guides tell the truth: what they name exists, and what they tell to run runs.
///
/// A block that begins with ```sh is run, in the order of its guide, from a folder that looks like a built
/// checkout. One that begins with ```sh by-hand is not: it needs hardware, root, or too much time.
namespace hilbrush::guides {
namespace fs = std::filesystem;
using namespace testing_support;

const fs::path kTop = HILBRUSH_SOURCE_DIR;
const fs::path kBuild = HILBRUSH_BUILD_DIR;

const std::vector<std::string>& all_guides() {
  static const std::vector<std::string> guides{"README.md",         "config/README.md",  "daemon/README.md",
                                               "drivers/README.md", "planner/README.md", "sampling/README.md",
                                               "sim/README.md",     "tests/README.md"};
  return guides;
}

std::vector<std::string> lines_of(const std::string& guide) {
  std::ifstream in(kTop / guide);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

/// The commands of a guide's runnable blocks, line by line.
std::vector<std::string> commands_of(const std::string& guide) {
  std::vector<std::string> commands;
  bool is_inside = false;
  for (const std::string& line : lines_of(guide)) {
    if (line.starts_with("```")) {
      is_inside = !is_inside && line == "```sh";
    } else if (is_inside) {
      commands.push_back(line);
    }
  }
  return commands;
}

/// What a command that goes to the background has to have done before the next one may count on it.
std::string wait_for(const std::string& command) {
  static const std::regex kCellFile("--write-cell +([^ ]+)");
  std::smatch file;
  if (std::regex_search(command, file, kCellFile)) return "wait_until test -s " + file[1].str() + "\n";
  return command.starts_with("hilbrushd ") ? "wait_until hilbrush info\n" : "";
}

std::string script_of(const std::vector<std::string>& commands) {
  std::string script =
      "set -euo pipefail\n"
      "end() { code=$?; trap - EXIT; kill $(jobs -p) 2>/dev/null || true; wait; exit $code; }\n"
      "trap end EXIT\n"
      "wait_until() { for i in $(seq 300); do \"$@\" >/dev/null 2>&1 && return; sleep 0.1; done; return 1; "
      "}\n"
      "set -x\n";
  for (const std::string& command : commands) {
    script += command + "\n";
    if (std::regex_search(command, std::regex("&( *#.*)?$"))) script += wait_for(command);
  }
  return script;
}

/// A folder that looks like the checkout after a build, and takes what the commands write.
void lay_out_checkout(const fs::path& folder) {
  for (const char* name : {"config", "sim", "tests"})
    fs::create_directory_symlink(kTop / name, folder / name);
  fs::create_directory(folder / "build");
  for (const char* program :
       {"hilbrush", "hilbrushd", "hilbrush-pipeline", "hilbrush-laserguard", "hilbrush-simcell"})
    fs::create_symlink(kBuild / program, folder / "build" / program);
}

/// Of a character in UTF-8.
bool is_first_byte(char byte) {
  return (static_cast<unsigned char>(byte) & 0xC0U) != 0x80U;
}

class Guide : public testing::TestWithParam<std::string> {};

TEST_P(Guide, NamesOnlyPathsThatExist) {
  static const std::regex kPath(
      "(^|[^A-Za-z0-9_/.-])((sampling|planner|drivers|sim|config|daemon|tests)/[A-Za-z0-9_./-]*)");
  std::size_t count = 0;
  const std::vector<std::string> lines = lines_of(GetParam());
  for (std::size_t i = 0; i < lines.size(); ++i) {
    for (std::sregex_iterator it(lines[i].begin(), lines[i].end(), kPath), end; it != end; ++it) {
      std::string path = (*it)[2];
      while (path.ends_with('.')) path.pop_back();
      ++count;
      EXPECT_TRUE(fs::exists(kTop / path)) << GetParam() << ":" << i + 1 << ": no such path: " << path;
    }
  }
  EXPECT_GT(count, 0u);
}

TEST_P(Guide, CommandsRun) {
  const std::vector<std::string> commands = commands_of(GetParam());
  if (commands.empty()) return;  // a guide without commands of that kind
  const TemporaryFolder folder;
  lay_out_checkout(folder.path());
  const std::string script = folder.write("guide.sh", script_of(commands));
  const CommandResult result = run_command("cd " + quoted(folder.path().string()) + " && timeout 300 bash " +
                                           quoted(script) + " 2>&1");
  EXPECT_EQ(result.exit_code, 0) << GetParam() << "\n" << result.output;
}

TEST_P(Guide, IsWrapped) {
  const std::vector<std::string> lines = lines_of(GetParam());
  bool is_block = false;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (lines[i].starts_with("```")) is_block = !is_block;
    if (is_block || lines[i].starts_with("|")) continue;  // what is shown as it is, and rows of tables
    const auto columns = std::count_if(lines[i].begin(), lines[i].end(), is_first_byte);
    EXPECT_LE(columns, 120) << GetParam() << ":" << i + 1;
  }
}

INSTANTIATE_TEST_SUITE_P(All, Guide, testing::ValuesIn(all_guides()), [](const auto& guide) {
  std::string name = guide.param.substr(0, guide.param.size() - std::string("/README.md").size());
  return guide.param == "README.md" ? std::string("front_page") : name;
});

TEST(FrontPage, FitsAFewScreens) {
  EXPECT_LE(lines_of("README.md").size(), 120u);
}

TEST(FrontPage, EveryFolderHasAGuide) {
  for (const std::string& guide : all_guides()) EXPECT_TRUE(fs::exists(kTop / guide)) << guide;
}

}  // namespace hilbrush::guides
