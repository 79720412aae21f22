#include <gtest/gtest.h>

#include <algorithm>
#include <regex>
#include <set>

#include "tests/support/shell.h"

/// What the light programs load when they start: the operator's command and the daemon must answer in
/// milliseconds, so nothing heavy is linked.
namespace hilbrush::tidy {

using testing_support::CommandResult;
using testing_support::find_program;
using testing_support::run_command;

std::string program(const std::string& name) {
  return std::string(HILBRUSH_BUILD_DIR) + "/" + name;
}

/// Libraries named in the program's dynamic section.
std::set<std::string> needed_libraries(const std::string& file) {
  const CommandResult result = run_command("readelf --dynamic --wide " + testing_support::quoted(file));
  EXPECT_EQ(result.exit_code, 0) << result.output;
  static const std::regex kNeeded(R"(\(NEEDED\)[^\[]*\[([^\]]+)\])");
  std::set<std::string> names;
  for (std::sregex_iterator it(result.output.begin(), result.output.end(), kNeeded), end; it != end; ++it)
    names.insert((*it)[1]);
  return names;
}

/// Everything the program would load, libraries of libraries included.
std::set<std::string> loaded_libraries(const std::string& file) {
  const CommandResult result = run_command("ldd " + testing_support::quoted(file));
  EXPECT_EQ(result.exit_code, 0) << result.output;
  static const std::regex kLibrary(R"(\s(lib[^\s]+)\s+=>)");
  std::set<std::string> names;
  for (std::sregex_iterator it(result.output.begin(), result.output.end(), kLibrary), end; it != end; ++it)
    names.insert((*it)[1]);
  return names;
}

bool is_heavy(const std::string& library) {
  static const std::regex kHeavy(
      "lib(OpenImageIO|OpenMesh|embree|tbb|metis|opencv|OpenEXR|Imath|boost_filesystem).*",
      std::regex::icase);
  return std::regex_match(library, kHeavy);
}

class LightProgram : public testing::TestWithParam<const char*> {};

TEST_P(LightProgram, LinksNothingHeavy) {
  if (find_program("readelf").empty()) GTEST_SKIP() << "SKIPPED: readelf (package binutils) is not installed";
  const std::set<std::string> needed = needed_libraries(program(GetParam()));
  EXPECT_FALSE(needed.empty());
  for (const std::string& library : needed)
    EXPECT_FALSE(is_heavy(library)) << GetParam() << " links " << library;
  const std::set<std::string> loaded = loaded_libraries(program(GetParam()));
  for (const std::string& library : loaded)
    EXPECT_FALSE(is_heavy(library)) << GetParam() << " loads " << library;
  EXPECT_LE(loaded.size(), 30u) << GetParam() << ": hundreds of libraries take a second to load";
}

INSTANTIATE_TEST_SUITE_P(Programs, LightProgram,
                         testing::Values("hilbrush", "hilbrushd", "hilbrush-laserguard", "hilbrush-simcell"));

TEST(HeavyProgram, IsRecognized) {
  // The same reading finds the image library where it is linked: the test above can fail.
  if (find_program("readelf").empty()) GTEST_SKIP() << "SKIPPED: readelf (package binutils) is not installed";
  const std::set<std::string> needed = needed_libraries(program("hilbrush-pipeline"));
  EXPECT_TRUE(std::any_of(needed.begin(), needed.end(), is_heavy))
      << "hilbrush-pipeline links no image, mesh or ray library";
}

}  // namespace hilbrush::tidy
