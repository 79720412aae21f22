#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "config/json_reader.h"
#include "daemon/commands/exit_code.h"
#include "tests/daemon/commands/command_runs.h"

/// hilbrush quality against a child that follows a script instead of hilbrush-pipeline.
namespace hilbrush {
namespace {

using commands_test::CommandRun;
using commands_test::run_command;
using Json = nlohmann::ordered_json;

class QualityCommand : public commands_test::ScriptedChild {
 protected:
  /// A script that also keeps its arguments.
  void use_child(const std::string& script) {
    ScriptedChild::use_child(commands_test::kKeepArguments + script);
  }
  bool child_ran() const { return std::filesystem::exists(path("arguments")); }

  /// What the child was asked.
  Json request() const {
    std::istringstream in(read_text_file(path("arguments"), 1u << 20));
    std::string line;
    for (int i = 0; i < 3; ++i) std::getline(in, line);  // quality, --request-json, {...}
    return Json::parse(line);
  }
};

constexpr const char* kEmptyResult = R"(echo '{"result":{"sizes":[]}}')";

TEST_F(QualityCommand, ANamedSetGoesToTheChildAsItIs) {
  use_child(kEmptyResult);
  const CommandRun run =
      run_command({"quality", "plane", "-o", path("a/../out"), "--sampler", "jittered", "--curve", "peano2",
                   "--density", "u+v", "--count", "100,200,400", "--seed", "7"});
  ASSERT_EQ(run.exit_code, kExitOk) << run.err;
  EXPECT_EQ(request(), Json::parse(R"({"set":"plane","sampler":"jittered","curve":"peano2","density":"u+v",
                                       "count":[100,200,400],"seed":7})"));
  EXPECT_TRUE(read_text_file(path("arguments"), 1u << 20).ends_with("--output\n" + path("out") + "\n"));
}

TEST_F(QualityCommand, AModelIsNamedByItsWholePath) {
  use_child(kEmptyResult);
  const std::string model = folder_.write("cup.wrl", "#VRML V2.0 utf8\n");
  ASSERT_EQ(run_command({"quality", model, "-o", path("out")}).exit_code, kExitOk);
  EXPECT_EQ(request(), (Json{{"set", model}}));
}

TEST_F(QualityCommand, DotsTakeTheSettingsBesideThem) {
  use_child(kEmptyResult);
  const std::string model = folder_.write("cup.wrl", "#VRML V2.0 utf8\n");
  const std::string dots = folder_.write("dots.ply", "ply\n");
  CommandRun run = run_command({"quality", dots, "--model", model, "-o", path("out")});
  EXPECT_EQ(run.exit_code, kExitBadInput);
  EXPECT_EQ(run.err, "hilbrush: " + dots +
                         ": has no report.json beside it with the settings of its job: give --settings\n");
  EXPECT_FALSE(child_ran());

  folder_.write("report.json", R"({"settings":{"size_mm":60},"dots":{}})");
  run = run_command({"quality", dots, "--model", model, "-o", path("out")});
  ASSERT_EQ(run.exit_code, kExitOk) << run.err;
  EXPECT_EQ(request(), (Json{{"set", dots}, {"model", model}, {"settings", R"({"size_mm":60})"}}));

  const std::string settings = folder_.write("job.json", R"({"size_mm":80})");
  ASSERT_EQ(
      run_command({"quality", dots, "--model", model, "-o", path("out"), "--settings", settings}).exit_code,
      kExitOk);
  EXPECT_EQ(request()["settings"], R"({"size_mm":80})");

  folder_.write("report.json", "{}");
  run = run_command({"quality", dots, "--model", model, "-o", path("out")});
  EXPECT_EQ(run.err, "hilbrush: " + path("report.json") + ": has no settings: give --settings\n");
}

TEST_F(QualityCommand, FilesThatAreNotThereAreRefusedAtOnce) {
  use_child(kEmptyResult);
  const std::string dots = folder_.write("dots.ply", "ply\n");
  CommandRun run = run_command({"quality", dots, "--model", path("none.wrl"), "-o", path("out")});
  EXPECT_EQ(run.exit_code, kExitBadInput);
  EXPECT_EQ(run.err, "hilbrush: " + path("none.wrl") + ": no such model\n");
  run = run_command({"quality", folder_.path().string(), "-o", path("out")});
  EXPECT_EQ(run.err, "hilbrush: " + folder_.path().string() + ": is a folder, not a model\n");
  EXPECT_EQ(run_command({"quality", "plane"}).exit_code, kExitUsage);
  EXPECT_EQ(run_command({"quality", "plane", "-o", path("out"), "--count", "many"}).exit_code, kExitUsage);
  EXPECT_FALSE(child_ran());
}

TEST_F(QualityCommand, PathsInErrorsOfTheChildBecomeFlags) {
  use_child(R"(echo '{"error":{"at":"$.area","message":"expected \"triangle\", found \"x\""}}'; exit 3)");
  CommandRun run = run_command({"quality", "sphere", "-o", path("out"), "--area", "x"});
  EXPECT_EQ(run.exit_code, kExitBadInput);
  EXPECT_EQ(run.err, "hilbrush: --area: expected \"triangle\", found \"x\"\n");
  use_child(
      R"(echo '{"error":{"at":"$.count[1]","message":"expected a number from 1 to 9, found 0"}}'; exit 3)");
  run = run_command({"quality", "sphere", "-o", path("out"), "--count", "5", "--count", "0"});
  EXPECT_EQ(run.err, "hilbrush: --count: expected a number from 1 to 9, found 0\n");
  use_child(R"(echo '{"error":{"at":"$.set","message":"there is no file \"spere\""}}'; exit 3)");
  run = run_command({"quality", "spere", "-o", path("out")});
  EXPECT_EQ(run.err, "hilbrush: SET: there is no file \"spere\"\n");
}

TEST_F(QualityCommand, FiguresAreATableAndFilesAreNamed) {
  use_child(R"(echo '{"stage":"measure","fraction":0.5}'; echo '{"warning":"on triangles"}'
echo '{"result":{"sizes":[
{"count":1000,"discrepancy":{"quarter_circles":{"rms":0.00213,"largest":0.0051}},"path_constant":1.08,"spectrum":null},
{"count":20000,"discrepancy":{"quarter_circles":{"rms":0.0000312,"largest":0.0009}},"path_constant":0.94,
"spectrum":{"below_half":0.05,"anisotropy":null}}],
"slopes":{"quarter_circles":{"rms":-0.741,"largest":-0.7}},"files":["quality.json","dots.svg"]}}' | tr -d '\n'; echo)");
  const CommandRun run = run_command({"quality", "plane", "-o", path("out"), "--count", "1000,20000"});
  ASSERT_EQ(run.exit_code, kExitOk) << run.err;
  EXPECT_EQ(run.err, "note: on triangles\n");
  EXPECT_EQ(run.out,
            "stage: measure\n"
            "  dots                                        1,000     20,000      slope\n"
            "  discrepancy, quarter circles, rms         0.00213   3.12e-05     -0.741\n"
            "      largest                                0.0051   9.00e-04       -0.7\n"
            "  path constant                                1.08       0.94\n"
            "  power below half the frequency                  -       0.05\n"
            "  " +
                path("out/quality.json") + "\n  " + path("out/dots.svg") + "\n");
}

TEST_F(QualityCommand, JsonIsTheResultAndNothingElse) {
  use_child(R"(echo '{"stage":"load","fraction":0}'; echo '{"result":{"b":1,"a":[2]}}')");
  const CommandRun run = run_command({"quality", "plane", "-o", path("out"), "--json"});
  EXPECT_EQ(run.exit_code, kExitOk);
  EXPECT_EQ(run.out, "{\"b\":1,\"a\":[2]}\n");
}

TEST_F(QualityCommand, AStrangeResultIsNoFailure) {
  for (const char* result :
       {"{}", R"({"sizes":5})", R"({"sizes":[]})", R"({"sizes":[{"count":"x","discrepancy":[1]}]})",
        R"({"sizes":[7],"coherence":{"z":3},"files":[1]})"}) {
    use_child(std::string("echo '{\"result\":") + result + "}'");
    EXPECT_EQ(run_command({"quality", "plane", "-o", path("out")}).exit_code, kExitOk) << result;
  }
}

TEST_F(QualityCommand, HelpNamesTheSetsAndFlags) {
  const CommandRun run = run_command({"quality", "--help"});
  EXPECT_EQ(run.exit_code, kExitOk);
  for (const char* word : {"monkey_saddle", "dots.ply", "--model", "--sampler", "--curve", "--area",
                           "--density", "--points", "--count", "--seed", "--shapes", "--json"})
    EXPECT_NE(run.out.find(word), std::string::npos) << word;
}

}  // namespace
}  // namespace hilbrush
