#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "tests/support/shell.h"
#include "tests/support/temporary_folder.h"

/// The shipped service file, as systemd reads it.
namespace hilbrush {
namespace {

using namespace testing_support;

TEST(ServiceFile, SystemdFindsNothingWrongWithIt) {
  if (find_program("systemd-analyze").empty()) GTEST_SKIP() << "systemd-analyze is not installed";
  std::ifstream in(std::string(HILBRUSH_SOURCE_DIR) + "/config/hilbrushd.service");
  std::string text{std::istreambuf_iterator<char>(in), {}};
  // The program is where it was built, not installed.
  const std::string installed = "/usr/local/bin/hilbrushd";
  const auto place = text.find(installed);
  ASSERT_NE(place, std::string::npos);
  text.replace(place, installed.size(), std::string(HILBRUSH_BUILD_DIR) + "/hilbrushd");
  const TemporaryFolder folder;
  const std::string file = folder.write("hilbrushd.service", text);
  const CommandResult good = run_command("systemd-analyze verify " + quoted(file));
  EXPECT_EQ(good.exit_code, 0) << good.output;
  EXPECT_EQ(good.output, "");
  const std::string wrong = folder.write("wrong.service", text + "\nNonsense=1\n[Service]\nUMask=x\n");
  EXPECT_NE(run_command("systemd-analyze verify " + quoted(wrong)).output, "");
}

}  // namespace
}  // namespace hilbrush
