#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/pipeline/painting.h"
#include "tests/pipeline/report_expectations.h"
#include "tests/support/shell.h"
#include "tests/support/temporary_folder.h"

/// The programs as a person or a script runs them: exit codes, sentences, files.
namespace hilbrush::testing_pipeline {
namespace {

namespace fs = std::filesystem;
using testing_support::CommandResult;
using testing_support::quoted;
using testing_support::run_command;
using testing_support::TemporaryFolder;

CommandResult hilbrush(const std::string& arguments) {
  return run_command(quoted(std::string(HILBRUSH_BUILD_DIR) + "/hilbrush") + " " + arguments + " </dev/null");
}

std::string cube() {
  return quoted(test_data("letter_cube.wrl").string());
}

TEST(Command, DryRunMakesTheReportAndThePictures) {
  const TemporaryFolder folder;
  const fs::path out = folder.path() / "made/by/the command";
  const CommandResult result =
      hilbrush("dry-run " + cube() + " --size-mm 20 --dpi 50 -o " + quoted(out.string()));
  ASSERT_EQ(result.exit_code, 0) << result.output;
  EXPECT_NE(result.output.find("exposure.png"), std::string::npos) << "it says where the pictures are:\n"
                                                                   << result.output;
  std::ifstream stream(out / "report.json");
  expect_sound_dry_run({std::istreambuf_iterator<char>(stream), {}}, out);
}

TEST(Command, JsonOutputIsTheReportAndNothingElse) {
  const TemporaryFolder folder;
  const CommandResult result =
      run_command(quoted(std::string(HILBRUSH_BUILD_DIR) + "/hilbrush") + " plan " + cube() +
                  " --size-mm 20 --dpi 50 --json -o " + quoted(folder.path().string()) + " 2>/dev/null");
  ASSERT_EQ(result.exit_code, 0) << result.output;
  const auto report = nlohmann::json::parse(result.output, nullptr, false);
  ASSERT_FALSE(report.is_discarded()) << result.output;
  EXPECT_GT(report.at("dots").at("placed"), 0);
}

TEST(Command, AMissingTextureIsAWarningThatNamesIt) {
  const TemporaryFolder folder;
  fs::copy_file(test_data("letter_cube.obj"), folder.path() / "letter_cube.obj");
  fs::copy_file(test_data("letter_cube.mtl"), folder.path() / "letter_cube.mtl");
  const CommandResult result =
      hilbrush("plan " + quoted((folder.path() / "letter_cube.obj").string()) +
               " --size-mm 20 --dpi 50 --untextured material -o " + quoted((folder.path() / "out").string()));
  // The material is white: without its picture nothing is left to paint, which is refused as bad input; with
  // it named either way.
  EXPECT_TRUE(result.exit_code == 0 || result.exit_code == 3) << result.exit_code << "\n" << result.output;
  EXPECT_NE(result.output.find("letter_cube.png"), std::string::npos) << result.output;
}

TEST(Command, WrongUseIsTwo) {
  const TemporaryFolder folder;
  const std::string out = " -o " + quoted(folder.path().string());
  for (const std::string& arguments :
       {std::string("dry-run " + cube() + " --no-such-flag" + out), std::string("dry-run " + cube()),
        std::string("no-such-command"), std::string("dry-run --size-mm 20" + out), std::string(),
        std::string("dry-run " + cube() + " --dpi many" + out)}) {
    const CommandResult result = hilbrush(arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments << "\n" << result.output;
    EXPECT_FALSE(result.output.empty()) << arguments;
  }
}

TEST(Command, BadInputIsThreeAndSaysWhere) {
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "broken.wrl")
      << "#VRML V2.0 utf8\nShape {\n  geometry IndexedFaceSet { coord Coordinate { point [ 0 0\n";
  std::ofstream(folder.path() / "empty.obj");
  std::ofstream(folder.path() / "a_file") << "no folder";
  const std::string out = " -o " + quoted((folder.path() / "out").string());
  const std::string broken = (folder.path() / "broken.wrl").string();
  const std::string empty = (folder.path() / "empty.obj").string();
  struct Case {
    std::string arguments, named;
  };
  const std::vector<Case> cases{
      {"dry-run /no/such/model.wrl --size-mm 20" + out, "/no/such/model.wrl"},
      {"dry-run " + quoted(broken) + " --size-mm 20" + out, "broken.wrl:"},
      {"dry-run " + quoted(empty) + " --size-mm 20" + out, "empty.obj"},
      {"dry-run " + quoted(folder.path().string()) + " --size-mm 20" + out,
       folder.path().filename().string()},
      {"dry-run " + quoted(test_data("letter_cube.obj").string()) + out, "size"},
      {"dry-run " + cube() + " --size-mm -5" + out, "size"},
      {"dry-run " + cube() + " --size-mm 20 --cell no_such_cell" + out, "no_such_cell"},
      {"dry-run " + cube() + " --size-mm 20 --sampler neat" + out, "sampler"},
      {"dry-run " + cube() + " --size-mm 20 --dpi 50 -o " + quoted((folder.path() / "a_file/below").string()),
       "a_file"},
      {"develop " + cube() + " --program /no/program.ply --emissions /no/emissions.ply" + out,
       "/no/program.ply"}};
  for (const Case& each : cases) {
    const CommandResult result = hilbrush(each.arguments);
    EXPECT_EQ(result.exit_code, 3) << each.arguments << "\n" << result.output;
    EXPECT_NE(result.output.find(each.named), std::string::npos)
        << each.arguments << " should name " << each.named << ":\n"
        << result.output;
  }
}

TEST(Command, ADamagedProgramOrRecordIsBadInputAndNamedOnce) {
  const TemporaryFolder folder;
  const std::string plan = (folder.path() / "plan").string();
  ASSERT_EQ(hilbrush("plan " + cube() + " --size-mm 20 --dpi 30 -o " + quoted(plan)).exit_code, 0);
  const std::string record = (folder.path() / "emissions.ply").string();
  std::ofstream(record) << "not a record";
  const std::string rest = " -o " + quoted((folder.path() / "out").string());
  const auto expect_refused = [&](const std::string& program, const std::string& named) {
    const CommandResult result = hilbrush("develop " + cube() + " --size-mm 20 --dpi 30 --program " +
                                          quoted(program) + " --emissions " + quoted(record) + rest);
    EXPECT_EQ(result.exit_code, 3) << result.output;
    const auto first = result.output.find(named);
    EXPECT_NE(first, std::string::npos) << result.output;
    EXPECT_EQ(result.output.find(named, first + 1), std::string::npos) << "named twice:\n" << result.output;
  };
  expect_refused(plan + "/program.ply", record);
  std::ofstream(plan + "/program.ply", std::ios::app) << "more";
  expect_refused(plan + "/program.ply", plan + "/program.ply");
}

/// A dark box inside a white one: all dots are out of sight.
TEST(Command, APictureOfWhichNoDotCanBeExposedIsSixAndSaysWhy) {
  const TemporaryFolder folder;
  const auto box = [](double size, double gray) {
    const std::string g = std::to_string(gray);
    const std::string s = std::to_string(size);
    return "Shape { appearance Appearance { material Material { diffuseColor " + g + " " + g + " " + g +
           " } } geometry Box { size " + s + " " + s + " " + s + " } }\n";
  };
  std::ofstream(folder.path() / "hidden.wrl") << "#VRML V2.0 utf8\n" << box(.02, 1) << box(.005, 0);
  const CommandResult result =
      hilbrush("plan " + quoted((folder.path() / "hidden.wrl").string()) +
               " --size-mm 20 --dpi 30 --untextured material -o " + quoted((folder.path() / "out").string()));
  EXPECT_EQ(result.exit_code, 6) << result.output;
  EXPECT_NE(result.output.find("warning: none of the "), std::string::npos) << result.output;
}

TEST(Command, AnUnwritableFolderIsRefused) {
  const TemporaryFolder folder;
  fs::permissions(folder.path(), fs::perms::owner_read | fs::perms::owner_exec);
  if (run_command("test -w " + quoted(folder.path().string())).exit_code == 0)
    GTEST_SKIP() << "SKIPPED: root may write everywhere";
  const CommandResult result =
      hilbrush("dry-run " + cube() + " --size-mm 20 --dpi 50 -o " + quoted((folder.path() / "out").string()));
  fs::permissions(folder.path(), fs::perms::owner_all);
  EXPECT_EQ(result.exit_code, 3) << result.output;
}

TEST(Command, WithoutADaemonItSaysSo) {
  const TemporaryFolder folder;
  const std::string socket = (folder.path() / "none.sock").string();
  for (const char* command : {"list", "status", "stop", "get 1"}) {
    const CommandResult result = hilbrush(std::string(command) + " --socket " + quoted(socket));
    EXPECT_EQ(result.exit_code, 4) << command << "\n" << result.output;
    EXPECT_NE(result.output.find(socket), std::string::npos) << result.output;
    EXPECT_NE(result.output.find("is hilbrushd running?"), std::string::npos) << result.output;
  }
}

TEST(Programs, AnswerHelpAndVersion) {
  for (const char* program : {"hilbrush", "hilbrushd", "hilbrush-pipeline"}) {
    for (const char* flag : {"--help", "--version"}) {
      const CommandResult result =
          run_command(quoted(std::string(HILBRUSH_BUILD_DIR) + "/" + program) + " " + flag);
      EXPECT_EQ(result.exit_code, 0) << program << " " << flag << "\n" << result.output;
      EXPECT_FALSE(result.output.empty()) << program << " " << flag;
    }
  }
  for (const char* command :
       {"dry-run", "plan", "develop", "calibrate", "submit", "watch", "list", "get", "start", "pause",
        "resume", "cancel", "status", "stop", "clear", "arm", "home", "check-config"}) {
    for (const char* flag : {"--help", "--version"}) {
      const CommandResult result = hilbrush(std::string(command) + " " + flag);
      EXPECT_EQ(result.exit_code, 0) << command << " " << flag << "\n" << result.output;
      EXPECT_FALSE(result.output.empty()) << command << " " << flag;
    }
  }
}

}  // namespace
}  // namespace hilbrush::testing_pipeline
