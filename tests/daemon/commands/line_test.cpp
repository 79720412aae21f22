#include <gtest/gtest.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "config/cell_file.h"
#include "daemon/commands/exit_code.h"
#include "tests/daemon/commands/command_runs.h"

/// Parsing, help, exit codes and check-config: everything of the command that needs neither daemon nor
/// pipeline.
namespace hilbrush {
namespace {

using commands_test::CommandRun;
using commands_test::run_command;
using commands_test::TemporaryFolder;
using Json = nlohmann::ordered_json;

const char* const kCommands[] = {"dry-run", "plan",  "develop", "calibrate", "submit",      "watch",  "list",
                                 "get",     "start", "pause",   "resume",    "cancel",      "status", "stop",
                                 "clear",   "arm",   "home",    "info",      "check-config"};

TEST(CommandLine, HelpAndVersionAreEverywhere) {
  const CommandRun help = run_command({"--help"});
  EXPECT_EQ(help.exit_code, kExitOk);
  for (const char* command : kCommands) {
    EXPECT_NE(help.out.find(std::string("\n  ") + command + " "), std::string::npos) << command;
    const CommandRun own = run_command({command, "--help"});
    EXPECT_EQ(own.exit_code, kExitOk) << command;
    EXPECT_NE(own.out.find(std::string("Usage: hilbrush ") + command), std::string::npos) << own.out;
    EXPECT_NE(own.out.find("--json"), std::string::npos) << command;
    EXPECT_NE(own.out.find("Exit codes:"), std::string::npos) << command;
    EXPECT_EQ(own.err, "");
    const CommandRun version = run_command({command, "--version"});
    EXPECT_EQ(version.exit_code, kExitOk) << command;
    EXPECT_EQ(version.out, "hilbrush " HILBRUSH_VERSION "\n");
  }
  EXPECT_EQ(run_command({"--version"}).out, "hilbrush " HILBRUSH_VERSION "\n");
}

TEST(CommandLine, WrongUsageIsTwo) {
  const std::vector<std::vector<std::string>> wrong{{},
                                                    {"paint"},
                                                    {"--nonsense"},
                                                    {"status", "--nonsense"},
                                                    {"status", "extra"},
                                                    {"dry-run"},
                                                    {"dry-run", "m.obj"},  // no -o
                                                    {"dry-run", "m.obj", "-o"},
                                                    {"dry-run", "m.obj", "-o", "d", "--dpi", "many"},
                                                    {"dry-run", "m.obj", "-o", "d", "--dots", "1.5"},
                                                    {"develop", "m.obj", "-o", "d", "--program", "p"},
                                                    {"get"},
                                                    {"watch", "1", "--until", "tomorrow"},
                                                    {"resume", "1", "--in-doubt", "maybe"},
                                                    {"check-config", "a.json", "--cell", "default"}};
  for (const auto& arguments : wrong) {
    const CommandRun run = run_command(arguments);
    EXPECT_EQ(run.exit_code, kExitUsage) << testing::PrintToString(arguments);
    EXPECT_TRUE(run.err.starts_with("hilbrush: ")) << run.err;
    EXPECT_EQ(run.out, "");
  }
}

TEST(CommandLine, TheNearestCommandOrFlagIsNamed) {
  struct Case {
    std::vector<std::string> arguments;
    const char* error;
  };
  const Case cases[] = {
      {{"foo"}, "no command is called foo\nTry hilbrush --help.\n"},
      {{"submitt"}, "no command is called submitt; did you mean submit?\nTry hilbrush --help.\n"},
      {{"dryrun", "m.obj"}, "no command is called dryrun; did you mean dry-run?\nTry hilbrush --help.\n"},
      {{"plan", "m.obj", "-o", "d", "--size", "60"},
       "there is no flag --size; did you mean --size-mm?\nTry hilbrush plan --help.\n"},
      {{"plan", "m.obj", "-o", "d", "--smapler=even"},
       "there is no flag --smapler; did you mean --sampler?\nTry hilbrush plan --help.\n"},
      {{"--verion"}, "there is no flag --verion; did you mean --version?\nTry hilbrush --help.\n"},
  };
  for (const Case& c : cases) {
    const CommandRun run = run_command(c.arguments);
    EXPECT_EQ(run.exit_code, kExitUsage);
    EXPECT_EQ(run.err, std::string("hilbrush: ") + c.error);
  }
}

TEST(CommandLine, HelpIsACommandToo) {
  EXPECT_EQ(run_command({"help"}).out, run_command({"--help"}).out);
  EXPECT_EQ(run_command({"help", "plan"}).out, run_command({"plan", "--help"}).out);
  EXPECT_EQ(run_command({"help"}).exit_code, kExitOk);
}

TEST(CommandLine, NegativeAndEndlessNumbersAreRefused) {
  const auto error = [](std::vector<std::string> flags) {
    flags.insert(flags.begin(), {"plan", "/none.obj", "-o", "d"});
    return run_command(flags);
  };
  for (const char* value : {"nan", "inf", "-inf"}) {
    for (const char* flag : {"--size-mm", "--dpi", "--max-incidence-deg", "--post-height-mm", "--turn-deg"}) {
      const CommandRun run = error({std::string(flag) + "=" + value});
      EXPECT_EQ(run.exit_code, kExitBadInput) << flag;
      EXPECT_EQ(run.err, std::string("hilbrush: ") + flag + ": expected a number, found " + value + "\n");
    }
    EXPECT_EQ(error({std::string("--offset-mm=0,0,") + value}).exit_code, kExitBadInput);
  }
  const CommandRun run = error({"--dots", "-4"});
  EXPECT_EQ(run.exit_code, kExitUsage);
  EXPECT_NE(run.err.find("--dots: expected a whole number of at least 0, found -4"), std::string::npos)
      << run.err;
  EXPECT_EQ(run_command({"move", "3", "0"}).exit_code, kExitUsage);
  EXPECT_LT(run_command({"move", "3", "0"}).err.size(), 120u);
}

TEST(CommandLine, OutputThatCannotBeWrittenIsAFailure) {
  std::ostringstream out, err;
  std::istringstream in;
  out.setstate(std::ios::badbit);
  Terminal terminal{out, err, in};
  EXPECT_EQ(run_hilbrush({"check-config"}, terminal), kExitInternal);
  EXPECT_EQ(err.str(), "hilbrush: standard output cannot be written\n");
  EXPECT_EQ(run_hilbrush({"--help"}, terminal), kExitInternal);
}

TEST(CommandLine, NoDaemonIsFour) {
  const TemporaryFolder folder;
  const std::string socket = (folder.path() / "none").string();
  for (const char* command : {"list", "status", "stop", "clear", "arm", "home", "info"}) {
    const CommandRun run = run_command({command, "--socket", socket});
    EXPECT_EQ(run.exit_code, kExitNoDaemon) << command;
    EXPECT_EQ(run.err, "hilbrush: no daemon answers on " + socket + ": is hilbrushd running?\n");
    EXPECT_EQ(run.out, "");
  }
  const CommandRun as_json = run_command({"stop", "--json", "--socket", socket});
  EXPECT_EQ(Json::parse(as_json.out)["error"]["code"], kExitNoDaemon);
}

TEST(CommandLine, TheSocketMayComeFromTheEnvironment) {
  const TemporaryFolder folder;
  const std::string socket = (folder.path() / "from-environment").string();
  setenv("HILBRUSH_SOCKET", socket.c_str(), 1);
  const CommandRun run = run_command({"status"});
  unsetenv("HILBRUSH_SOCKET");
  EXPECT_NE(run.err.find(socket), std::string::npos) << run.err;
  EXPECT_NE(run_command({"status", "--socket", "/none/flag"}).err.find("/none/flag"), std::string::npos);
}

TEST(CheckConfig, TheShippedCellIsValid) {
  const CommandRun run = run_command({"check-config"});
  EXPECT_EQ(run.exit_code, kExitOk) << run.err;
  EXPECT_NE(run.out.find("cell \"default\", valid"), std::string::npos) << run.out;
  const CommandRun as_json = run_command({"check-config", "--json", "--cell", "default"});
  EXPECT_EQ(Json::parse(as_json.out)["cell"], "default");
  EXPECT_EQ(run_command({"check-config", "default"}).out, run.out) << "by its name, as check-cell takes it";
  EXPECT_EQ(Json::parse(as_json.out)["sha256"], load_cell(find_cell("default")).sha256);
}

TEST(CheckConfig, ABadCellIsThreeAndNamesThePath) {
  const TemporaryFolder folder;
  const std::string file = folder.write("cell.json", R"({"name":"mine","axis":{}})");
  const CommandRun run = run_command({"check-config", file});
  EXPECT_EQ(run.exit_code, kExitBadInput);
  EXPECT_EQ(run.err,
            "hilbrush: " + file + ": $.axes: missing: expected an object, found the key \"axis\" instead\n");
  EXPECT_EQ(run_command({"check-config", "/none.json"}).exit_code, kExitBadInput);
  EXPECT_EQ(run_command({"check-config", "--cell", "none"}).exit_code, kExitBadInput);
  const CommandRun unknown = run_command({"check-config", "none"});
  EXPECT_EQ(unknown.exit_code, kExitBadInput);
  EXPECT_NE(unknown.err.find("no cell is called \"none\""), std::string::npos) << unknown.err;
}

TEST(CheckConfig, JobSettingsCanBeCheckedToo) {
  const TemporaryFolder folder;
  EXPECT_EQ(run_command({"check-config", "--settings", folder.write("job.json", R"({"dpi":300})")}).exit_code,
            kExitOk);
  const std::string bad = folder.write("bad.json", R"({"dip":300})");
  const CommandRun run = run_command({"check-config", "--settings", bad});
  EXPECT_EQ(run.exit_code, kExitBadInput);
  EXPECT_TRUE(run.err.starts_with("hilbrush: " + bad + ": $.dip: unknown key")) << run.err;
}

}  // namespace
}  // namespace hilbrush
