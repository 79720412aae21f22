#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "config/job_settings.h"
#include "config/json_reader.h"
#include "daemon/commands/exit_code.h"
#include "tests/daemon/commands/command_runs.h"

/// dry-run, plan, develop and calibrate against a child that follows a script instead of hilbrush-pipeline.
namespace hilbrush {
namespace {

using commands_test::CommandRun;
using commands_test::kKeepArguments;
using commands_test::run_command;
using Json = nlohmann::ordered_json;

class PipelineCommands : public commands_test::ScriptedChild {
 protected:
  std::string read(const std::string& name) const { return read_text_file(path(name), 1u << 20); }

  /// What the child was called with, one argument a line.
  std::vector<std::string> child_arguments() const {
    std::vector<std::string> arguments;
    std::istringstream in(read("arguments"));
    for (std::string line; std::getline(in, line);) arguments.push_back(line);
    return arguments;
  }
  std::string child_argument(const std::string& name) const {
    const std::vector<std::string> arguments = child_arguments();
    for (std::size_t i = 0; i + 1 < arguments.size(); ++i)
      if (arguments[i] == name) return arguments[i + 1];
    return "(none)";
  }

  const std::string model_ = folder_.write("cup.wrl", "#VRML V2.0 utf8\n");
};

constexpr const char* kResult =
    R"(echo '{"result":{"mesh":{"file":"cup.wrl"},"dots":{"placed":10,"exposed":9,"skipped":{"occluded":1}},"time_s":{"total":75}}}')";

TEST_F(PipelineCommands, DryRunShowsStagesWarningsReportAndFiles) {
  use_child(
      std::string(
          R"(echo '{"stage":"load","fraction":0.5}'; echo 'of a library'; echo '{"stage":"load","fraction":1}'
echo '{"warning":"texture a.png is missing"}'; echo '{"stage":"plan","fraction":0.25}'
mkdir -p "$folder/out/views"; echo '{}' > "$folder/out/report.json"; echo > "$folder/out/exposure.png"
)") + kResult);
  const CommandRun run = run_command({"dry-run", model_, "-o", path("out"), "--size-mm", "80"});
  EXPECT_EQ(run.exit_code, kExitOk) << run.err;
  EXPECT_EQ(run.err, "warning: texture a.png is missing\n");
  EXPECT_EQ(run.out,
            "stage: load\nstage: plan\n"
            "  model:         cup.wrl\n"
            "  dots:          10 placed, 9 exposed (90.00 %), 1 skipped (1 occluded)\n"
            "  painting time: 0:01:15\n"
            "  report:        " +
                path("out/report.json") +
                "\n"
                "  pictures:      " +
                path("out/exposure.png") +
                "\n"
                "  views:         " +
                path("out/views") + "\n");
}

TEST_F(PipelineCommands, ARunThatCanExposeNoDotIsSix) {
  const auto result_of = [](const std::string& dots) {
    return "echo '{\"result\":{\"dots\":" + dots + "}}'";
  };
  for (const char* json : {"", "--json"}) {
    std::vector<std::string> arguments{"plan", model_, "-o", path("out")};
    if (*json != '\0') arguments.emplace_back(json);
    use_child(result_of(R"({"placed":10,"exposed":0,"remaining":0,"in_doubt":0,"skipped":{"occluded":10}})"));
    EXPECT_EQ(run_command(arguments).exit_code, kExitJobFailed) << json;
    use_child(result_of(R"({"placed":10,"exposed":0,"remaining":1,"in_doubt":0,"skipped":{"occluded":9}})"));
    EXPECT_EQ(run_command(arguments).exit_code, kExitOk) << "planned, not yet painted " << json;
    use_child(result_of(R"({"placed":0,"exposed":0,"remaining":0,"in_doubt":0,"skipped":{}})"));
    EXPECT_EQ(run_command(arguments).exit_code, kExitOk) << "a white object, which is warned of " << json;
  }
}

TEST_F(PipelineCommands, ATerminalGetsABarWithTheStage) {
  use_child(std::string("echo '{\"stage\":\"plan\",\"fraction\":0.5}'\n") + kResult);
  const CommandRun run = run_command({"dry-run", model_, "-o", path("out")}, true);
  EXPECT_TRUE(run.out.starts_with("[############............] plan 50 % (stage 5 of 9)\r\033[K")) << run.out;
}

TEST_F(PipelineCommands, JsonIsTheResultAndNothingElse) {
  use_child(std::string("echo '{\"stage\":\"load\",\"fraction\":0.5}'\n") +
            R"(echo '{"result":{"b":1,"a":[2]}}')");
  const CommandRun run = run_command({"plan", model_, "-o", path("out"), "--json"});
  EXPECT_EQ(run.exit_code, kExitOk);
  EXPECT_EQ(run.out, "{\"b\":1,\"a\":[2]}\n");
  EXPECT_EQ(run.err, "");
}

TEST_F(PipelineCommands, TheChildGetsAbsolutePathsAndCanonicalSettings) {
  use_child(std::string(kKeepArguments) + kResult);
  const std::string settings =
      folder_.write("job.json", R"({"dpi":300,"units_mm":1,"seed":4,"sampler":"even"})");
  const CommandRun run = run_command({"plan",
                                      model_,
                                      "-o",
                                      path("a/../out"),
                                      "--settings",
                                      settings,
                                      "--dots",
                                      "5000",
                                      "--size-mm",
                                      "80",
                                      "--sampler",
                                      "jittered",
                                      "--up",
                                      "z",
                                      "--curve",
                                      "peano2",
                                      "--density",
                                      "mean_curvature",
                                      "--levels",
                                      "3",
                                      "--predictive-rounds",
                                      "2",
                                      "--fine-passes",
                                      "7",
                                      "--tone-curve",
                                      "linear"});
  ASSERT_EQ(run.exit_code, kExitOk) << run.err;
  EXPECT_EQ(child_arguments()[0], "plan");
  EXPECT_EQ(child_argument("--model"), model_);
  EXPECT_EQ(child_argument("--output"), path("out"));
  EXPECT_TRUE(child_argument("--cell").ends_with("/default.json"));
  JobSettings expected;  // flags over file; dots takes the place of the file's dpi, size_mm of its units_mm
  expected.dots = 5000;
  expected.size_mm = 80;
  expected.up = "z";
  expected.sampler = Sampler::kJittered;
  expected.seed = 4;
  expected.curve = CurveKind::kPeano2;
  expected.density = DensitySource::kMeanCurvature;
  expected.levels = 3;
  expected.predictive_rounds = 2;
  expected.fine_passes = 7;
  expected.tone_curve = ToneMapping::kLinear;
  EXPECT_EQ(child_argument("--settings-json"), job_settings_to_json(expected));
}

TEST_F(PipelineCommands, DevelopTakesTheSettingsBesideTheProgram) {
  use_child(std::string(kKeepArguments) + kResult);
  folder_.write("program.ply", "ply");
  folder_.write("emissions.ply", "ply");
  folder_.write("report.json", R"({"settings":{"dpi":200,"size_mm":60},"dots":{}})");
  const CommandRun run = run_command({"develop", model_, "-o", path("out"), "--program", path("program.ply"),
                                      "--emissions", path("emissions.ply")});
  ASSERT_EQ(run.exit_code, kExitOk) << run.err;
  EXPECT_EQ(child_argument("--program"), path("program.ply"));
  EXPECT_EQ(child_argument("--emissions"), path("emissions.ply"));
  EXPECT_EQ(child_argument("--settings-json"),
            job_settings_to_json(job_settings_from_json(R"({"dpi":200,"size_mm":60})")));
}

TEST_F(PipelineCommands, CalibrateNeedsNoModelAndPrintsTheCurve) {
  use_child(std::string(kKeepArguments) +
            R"(echo '{"result":{"sampler":"even","wanted":[0,1],"asked":[0,1.625]}}')");
  const CommandRun run = run_command({"calibrate", "-o", path("out"), "--sampler", "even"});
  ASSERT_EQ(run.exit_code, kExitOk) << run.err;
  EXPECT_EQ(child_argument("--model"), "(none)");
  EXPECT_EQ(run.out, "  sampler:       even\n  wanted  asked\n  0.00    0.0000\n  1.00    1.6250\n");
}

TEST_F(PipelineCommands, CalibrateTakesReadingsOrWritesAWedge) {
  use_child(std::string(kKeepArguments) + R"(echo '{"result":{"fields":16}}')");
  const std::string readings = folder_.write("wedge_steps.json", "{}");
  ASSERT_EQ(run_command({"calibrate", "-o", path("out"), "--measured", readings}).exit_code, kExitOk);
  EXPECT_EQ(child_argument("--measured"), readings);
  ASSERT_EQ(run_command({"calibrate", "-o", path("out"), "--wedge"}).exit_code, kExitOk);
  EXPECT_EQ(child_arguments().back(), "--wedge");
  EXPECT_EQ(run_command({"calibrate", "-o", path("out"), "--wedge", "--measured", readings}).exit_code,
            kExitUsage);
  EXPECT_EQ(run_command({"calibrate", "-o", path("out"), "--measured", path("none.json")}).exit_code,
            kExitBadInput);
}

TEST_F(PipelineCommands, BadInputIsRefusedBeforeTheChildStarts) {
  use_child(kKeepArguments);
  const auto error = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"-o", path("out")});
    const CommandRun run = run_command(arguments);
    EXPECT_EQ(run.exit_code, kExitBadInput) << run.err;
    return run.err;
  };
  EXPECT_EQ(error({"plan", path("none.wrl")}), "hilbrush: " + path("none.wrl") + ": no such model\n");
  EXPECT_EQ(error({"plan", folder_.path().string()}),
            "hilbrush: " + folder_.path().string() + ": is a folder, not a model\n");
  EXPECT_EQ(error({"plan", model_, "--dpi", "5"}),
            "hilbrush: --dpi: expected a number from 10 to 1200, found 5\n");
  EXPECT_EQ(error({"plan", model_, "--size-mm", "8", "--units-mm", "1"}),
            "hilbrush: --units-mm: contradicts size_mm: give size_mm or units_mm, not both\n");
  EXPECT_EQ(error({"plan", model_, "--levels", "5"}),
            "hilbrush: --levels: expected a whole number from 1 to 4, found 5\n");
  EXPECT_EQ(error({"plan", model_, "--tone-curve", "none"}),
            "hilbrush: --tone-curve: expected \"calibrated\" or \"linear\", found \"none\"\n");
  const std::string settings = folder_.write("job.json", R"({"dpi":5})");
  EXPECT_EQ(error({"plan", model_, "--settings", settings}),
            "hilbrush: " + settings + ": $.dpi: expected a number from 10 to 1200, found 5\n");
  const std::string empty = folder_.write("empty.json", "");
  EXPECT_TRUE(
      error({"plan", model_, "--settings", empty}).starts_with("hilbrush: " + empty + ":1: not JSON"));
  EXPECT_NE(error({"plan", model_, "--cell", "none"}).find("no cell is called \"none\""), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(path("arguments")));
}

TEST_F(PipelineCommands, TheChildsErrorsKeepPlaceSentenceAndExitCode) {
  use_child(
      R"(echo 'a library says so' >&2; echo '{"error":{"at":"cup.wrl:12","message":"no geometry"}}'; exit 3)");
  const CommandRun run = run_command({"dry-run", model_, "-o", path("out"), "--json"});
  EXPECT_EQ(run.exit_code, kExitBadInput);
  EXPECT_EQ(run.err, "hilbrush: cup.wrl:12: no geometry\n  | a library says so\n");
  EXPECT_EQ(run.out, "{\"error\":{\"code\":3,\"message\":\"no geometry\",\"at\":\"cup.wrl:12\"}}\n");
}

TEST_F(PipelineCommands, AChildThatDiesIsReportedInASentence) {
  struct Case {
    const char *script, *error;
  };
  const Case cases[] = {
      {"kill -9 $$", "hilbrush-pipeline was killed (signal 9, Killed), probably because memory ran out"},
      {"kill -11 $$",
       "hilbrush-pipeline crashed (signal 11, Segmentation fault); this is a fault of the program"},
      {"kill -15 $$", "hilbrush-pipeline was ended from outside (signal 15, Terminated)"},
      {"kill -25 $$",
       "hilbrush-pipeline was ended by a resource limit of this session (signal 25, File size limit"},
      {"exit 1", "hilbrush-pipeline ended with code 1 and without a result"},
      {"exit 0", "hilbrush-pipeline ended with code 0 and without a result"},
      {"echo '{\"result\":{}}'; exit 1", "hilbrush-pipeline ended with code 1 after its result"},
  };
  for (const Case& c : cases) {
    use_child(c.script);
    const CommandRun run = run_command({"dry-run", model_, "-o", path("out")});
    EXPECT_EQ(run.exit_code, kExitInternal) << c.script;
    EXPECT_TRUE(run.err.starts_with("hilbrush: " + std::string(c.error))) << c.script << ": " << run.err;
    EXPECT_EQ(run.out, "");
  }
}

TEST_F(PipelineCommands, AProgramThatIsNotThereIsSaid) {
  setenv("HILBRUSH_PIPELINE", path("none").c_str(), 1);
  const CommandRun run = run_command({"dry-run", model_, "-o", path("out")});
  EXPECT_EQ(run.exit_code, kExitInternal);
  EXPECT_EQ(run.err, "hilbrush: hilbrush-pipeline cannot be started\n  | No such file or directory\n");
}

TEST_F(PipelineCommands, HalfLinesManyLinesAndMuchNoiseAreRead) {
  use_child(
      std::string(
          R"(printf '{"stage":"lo'; printf 'ad","fraction":0.5}\n{"stage":"disk"}\n\n[1]\n{"other":1}\n{"stage":5}\n'
i=0; while [ $i -lt 3000 ]; do echo "noise noise noise noise noise noise" >&2; i=$((i+1)); done
)") + kResult);
  const CommandRun run = run_command({"dry-run", model_, "-o", path("out")});
  EXPECT_EQ(run.exit_code, kExitOk) << run.err;
  EXPECT_TRUE(run.out.starts_with("stage: load\nstage: disk\n  model:")) << run.out;
}

TEST_F(PipelineCommands, TheChildHasNoStandardInputAndItsOwnProcessGroup) {
  use_child(
      std::string(
          "cat; [ \"$(ps -o pgid= -p $$ 2>/dev/null || cut -d' ' -f5 /proc/$$/stat)\" -eq $$ ] && touch "
          "\"$folder/own\"\n") +
      kResult);
  EXPECT_EQ(run_command({"dry-run", model_, "-o", path("out")}).exit_code, kExitOk);
  EXPECT_TRUE(std::filesystem::exists(path("own")));
}

TEST_F(PipelineCommands, InterruptEndsTheChildAndAllItStarted) {
  // A file is there before anything is written to it; under its own name only when all is.
  use_child(R"(sleep 100 & echo $! > "$folder/grandchild"; echo $$ > "$folder/written"
      mv "$folder/written" "$folder/pid"; echo '{"stage":"load","fraction":0.5}'; wait)");
  // Ctrl-C as soon as the child is there; blocked in this thread, so that it can never end the test itself.
  sigset_t set, before;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  pthread_sigmask(SIG_BLOCK, &set, &before);
  std::thread operator_thread([this] {
    while (!std::filesystem::exists(path("pid"))) std::this_thread::sleep_for(std::chrono::milliseconds(2));
    kill(getpid(), SIGINT);
  });
  const CommandRun run = run_command({"dry-run", model_, "-o", path("out")});
  operator_thread.join();
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  EXPECT_EQ(run.exit_code, kExitInterrupted);
  EXPECT_TRUE(run.err.starts_with("hilbrush: interrupted: hilbrush-pipeline was ended")) << run.err;
  EXPECT_NE(kill(std::stoi(read("pid")), 0), 0);  // gone, and reaped
  // Orphans are reaped by init at some later time: gone, or a zombie.
  const std::string orphan = "/proc/" + std::to_string(std::stoi(read("grandchild"))) + "/stat";
  const auto is_alive = [&] {
    std::ifstream status(orphan);
    std::string pid, name, state;
    return (status >> pid >> name >> state) && state != "Z";
  };
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (is_alive() && std::chrono::steady_clock::now() < deadline) std::this_thread::yield();
  EXPECT_FALSE(is_alive());
}

}  // namespace
}  // namespace hilbrush
