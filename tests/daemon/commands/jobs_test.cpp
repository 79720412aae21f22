#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "daemon/commands/exit_code.h"
#include "tests/daemon/commands/command_runs.h"

/// Job and cell commands against a daemon that follows a script.
namespace hilbrush {
namespace {

using commands_test::AnsweringDaemon;
using commands_test::CommandRun;
using commands_test::FakeDaemon;
using commands_test::Peer;
using commands_test::run_command;
using commands_test::TemporaryFolder;
using Json = nlohmann::ordered_json;

constexpr const char* kJob =
    R"("result":{"job":{"id":"7","state":"painting","model":"/m.wrl","dry_run":false,"dots":{"placed":2000,"exposed":500,"skipped":0},"progress":0.25,"eta_s":65,"error":null}})";

/// kJob in another state.
std::string job_in(const std::string& state) {
  std::string text = kJob;
  const std::string now = "painting";
  return text.replace(text.find(now), now.size(), state);
}

CommandRun run_with(AnsweringDaemon& daemon, std::vector<std::string> arguments,
                    const char* input = nullptr) {
  arguments.insert(arguments.end(), {"--socket", daemon.socket_path()});
  return run_command(arguments, false, input);
}

TEST(JobCommands, EachSendsItsMethodAndParameters) {
  struct Case {
    std::vector<std::string> arguments;
    const char* request;
  };
  const Case cases[] = {
      {{"get", "7"}, R"(job.get {"id":"7"})"},
      {{"start", "7", "--part-in-place"}, R"(job.start {"id":"7","part_in_place":true})"},
      {{"pause", "7"}, R"(job.pause {"id":"7"})"},
      {{"resume", "7"}, R"(job.resume {"id":"7"})"},
      {{"resume", "7", "--in-doubt", "expose"}, R"(job.resume {"id":"7","in_doubt":"expose"})"},
      {{"cancel", "7"}, R"(job.cancel {"id":"7"})"},
      {{"move", "7", "2"}, R"(job.move {"id":"7","position":2})"},
      {{"list", "--queue"}, R"(job.list {"order":"queue"})"},
      {{"list"}, "job.list -"},
      {{"status"}, "cell.status -"},
      {{"stop"}, "cell.stop -"},
      {{"clear"}, "cell.clear -"},
      {{"arm"}, "cell.arm -"},
      {{"home"}, "cell.home -"},
      {{"info"}, "system.info -"},
  };
  for (const Case& c : cases) {
    const bool ends_painting = c.arguments[0] == "pause" || c.arguments[0] == "cancel";
    AnsweringDaemon daemon(ends_painting ? job_in("paused") : kJob);
    const CommandRun run = run_with(daemon, c.arguments);
    EXPECT_EQ(run.exit_code, kExitOk) << run.err;
    const auto requests = daemon.requests();
    ASSERT_FALSE(requests.empty());
    EXPECT_EQ(requests.back(), c.request);
    const bool asks_first = c.arguments[0] == "resume" || c.arguments[0] == "start";
    EXPECT_EQ(requests.size(), asks_first ? 2u : 1u) << "whether it must ask the operator";
  }
}

TEST(JobCommands, ResumeAsksAfterThePartOnlyWhenItMust) {
  std::string moved = kJob;
  const auto brace = moved.find("\"state\"");
  ASSERT_NE(brace, std::string::npos);
  moved.insert(brace, "\"needs_part_in_place\":true,");
  {
    AnsweringDaemon daemon(moved);
    const CommandRun run = run_with(daemon, {"resume", "7"});
    EXPECT_EQ(run.exit_code, kExitRefused);
    EXPECT_EQ(daemon.requests(), std::vector<std::string>{R"(job.get {"id":"7"})"});
  }
  AnsweringDaemon daemon(moved);
  EXPECT_EQ(run_with(daemon, {"resume", "7", "--part-in-place"}).exit_code, kExitOk);
  EXPECT_EQ(daemon.requests().back(), R"(job.resume {"id":"7","part_in_place":true})");
}

TEST(JobCommands, JsonIsTheDaemonsResult) {
  for (const char* command : {"list", "status", "info"}) {
    AnsweringDaemon daemon(R"("result":{"z":[1],"a":{"b":null}})");
    EXPECT_EQ(run_with(daemon, {command, "--json"}).out, "{\"z\":[1],\"a\":{\"b\":null}}\n");
  }
  AnsweringDaemon daemon(kJob);
  EXPECT_EQ("\"result\":" + run_with(daemon, {"get", "7", "--json"}).out, std::string(kJob) + "\n");
}

TEST(JobCommands, SubmitResolvesPathsAndSendsOnlyWhatWasGiven) {
  const TemporaryFolder folder;
  folder.write("cup.wrl", "#VRML V2.0 utf8");
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(folder.path());
  AnsweringDaemon daemon(kJob);
  const CommandRun run = run_with(daemon, {"submit", "cup.wrl", "--dry-run", "--key", "order-17", "--size-mm",
                                           "80", "--cell", "./c.json"});
  std::filesystem::current_path(before);
  EXPECT_EQ(run.exit_code, kExitOk) << run.err;
  const std::string absolute = std::filesystem::canonical(folder.path()).string();
  EXPECT_EQ(daemon.requests(),
            std::vector<std::string>{R"(job.submit {"model":")" + absolute +
                                     R"(/cup.wrl","settings":{"size_mm":80.0,"cell":")" + absolute +
                                     R"(/c.json"},"dry_run":true,"key":"order-17"})"});
  EXPECT_EQ(run.out, "job 7: painting, 500 of 2,000 dots exposed, 25 %, about 0:01:05 left\n");
}

TEST(JobCommands, SubmitRefusesBadInputWithoutTheDaemon) {
  EXPECT_EQ(run_command({"submit", "/none.wrl"}).exit_code, kExitBadInput);
  EXPECT_EQ(run_command({"submit", "/dev/null", "--dpi", "1"}).exit_code, kExitBadInput);
}

TEST(JobCommands, StartAsksOnATerminalAndRefusesInAPipe) {
  {
    AnsweringDaemon daemon(kJob);
    const CommandRun run = run_with(daemon, {"start", "7"});
    EXPECT_EQ(run.exit_code, kExitRefused);
    EXPECT_EQ(run.err, "hilbrush: not started: give --part-in-place when the part is on the table\n");
    EXPECT_EQ(daemon.requests(), std::vector<std::string>{R"(job.get {"id":"7"})"});
  }
  for (const char* no : {"n\n", "\n", "", "yeah\n"}) {
    AnsweringDaemon daemon(kJob);
    EXPECT_EQ(run_with(daemon, {"start", "7"}, no).exit_code, kExitRefused) << no;
    EXPECT_EQ(daemon.requests(), std::vector<std::string>{R"(job.get {"id":"7"})"});
  }
  AnsweringDaemon daemon(kJob);
  const CommandRun run = run_with(daemon, {"start", "7"}, "y\n");
  EXPECT_EQ(run.exit_code, kExitOk);
  EXPECT_EQ(run.err, "Is the part of job 7 in place? [y/N] ");
  EXPECT_EQ(daemon.requests().back(), R"(job.start {"id":"7","part_in_place":true})");
}

constexpr const char* kPlannedJob =
    R"("result":{"job":{"id":"7","state":"ready","dots":{"placed":2000,"skipped":3},"warnings":["texture a.png is missing"],"plan":{"size_mm":[20,20,60],"min_mm":[-10,-10,0],"max_mm":[10,10,60],"skipped":[{"count":3,"text":"beam blocked"}],"suggestion":"a post of 90 mm would reach more"}}})";
constexpr const char* kPlanText =
    "  size:          20.00 x 20.00 x 60.00 mm\n"
    "  place:         x -10.00 to 10.00, y -10.00 to 10.00, z 0.00 to 60.00 mm from the top of the post\n"
    "  skipped:       3 x beam blocked\n"
    "  suggestion:    a post of 90 mm would reach more\n";

TEST(JobCommands, AJobWithWarningsIsStartedOnlyIfTheyAreAccepted) {
  const std::string seen = std::string("warning: texture a.png is missing\n") + kPlanText;
  {
    AnsweringDaemon daemon(kPlannedJob);
    const CommandRun run = run_with(daemon, {"start", "7", "--part-in-place"});
    EXPECT_EQ(run.exit_code, kExitRefused);
    EXPECT_EQ(run.err, seen +
                           "hilbrush: not started: give --accept-warnings to paint the job in spite of its "
                           "warnings\n");
    EXPECT_EQ(daemon.requests().size(), 1u);
  }
  {
    AnsweringDaemon daemon(kPlannedJob);
    const CommandRun run = run_with(daemon, {"start", "7", "--part-in-place"}, "n\n");
    EXPECT_EQ(run.exit_code, kExitRefused);
    EXPECT_TRUE(run.err.starts_with(seen + "Paint job 7 in spite of its warnings? [y/N] ")) << run.err;
    EXPECT_EQ(daemon.requests().size(), 1u);
  }
  AnsweringDaemon asked(kPlannedJob);
  EXPECT_EQ(run_with(asked, {"start", "7"}, "y\ny\n").exit_code, kExitOk) << "the warnings, then the part";
  EXPECT_EQ(asked.requests().back(), R"(job.start {"id":"7","part_in_place":true})");
  AnsweringDaemon accepted(kPlannedJob);
  EXPECT_EQ(run_with(accepted, {"start", "7", "--part-in-place", "--accept-warnings"}).exit_code, kExitOk);
  EXPECT_EQ(accepted.requests().back(), R"(job.start {"id":"7","part_in_place":true})");
}

TEST(JobCommands, GetAndSubmitShowThePlan) {
  AnsweringDaemon got(kPlannedJob);
  EXPECT_NE(run_with(got, {"get", "7"}).out.find(kPlanText), std::string::npos);
  const TemporaryFolder folder;
  const std::string model = folder.write("cup.wrl", "#VRML V2.0 utf8");
  AnsweringDaemon known(kPlannedJob);
  const CommandRun run = run_with(known, {"submit", model, "--key", "k"});
  EXPECT_TRUE(run.out.starts_with(kPlanText)) << run.out;
  EXPECT_EQ(run.err, "warning: texture a.png is missing\n");
  AnsweringDaemon queued(R"("result":{"job":{"id":"7","state":"queued"}})");
  EXPECT_EQ(run_with(queued, {"submit", model}).out,
            "job 7: queued\n`hilbrush watch 7 --until ready` shows what is planned and its warnings\n");
}

/// A daemon that answers the requests with these jobs, the last one again and again, and keeps what was
/// asked.
std::function<void(Peer&)> answering_in_turn(std::vector<std::string> states,
                                             std::vector<std::string>& methods) {
  return [states = std::move(states), &methods](Peer& peer) {
    for (std::string line = peer.read_line(); !line.empty(); line = peer.read_line()) {
      const Json request = Json::parse(line);
      const std::size_t turn = std::min(methods.size(), states.size() - 1);
      methods.push_back(request["method"].get<std::string>());
      peer.write_line(R"({"jsonrpc":"2.0","id":)" + request["id"].dump() + "," + job_in(states[turn]) + "}");
    }
  };
}

TEST(JobCommands, PauseAndCancelAnswerWithTheNewState) {
  for (const auto& [command, state] : {std::pair("pause", "paused"), std::pair("cancel", "cancelled")}) {
    std::vector<std::string> methods;
    FakeDaemon daemon(answering_in_turn({"painting", "painting", state}, methods));
    const CommandRun run = run_command({command, "7", "--socket", daemon.socket_path()});
    daemon.finish();
    EXPECT_EQ(run.exit_code, kExitOk) << run.err;
    EXPECT_TRUE(run.out.starts_with(std::string("job 7: ") + state + ", 500 of 2,000 dots exposed"))
        << run.out;
    EXPECT_EQ(methods, (std::vector<std::string>{std::string("job.") + command, "job.get", "job.get"}));
  }
}

TEST(JobCommands, CancelOfAJobThatIsPaintedAsksOnATerminal) {
  for (const char* state : {"painting", "paused"}) {
    AnsweringDaemon daemon(job_in(state));
    const CommandRun run = run_with(daemon, {"cancel", "7"}, "n\n");
    EXPECT_EQ(run.exit_code, kExitRefused);
    EXPECT_NE(run.err.find("Cancelling is final"), std::string::npos) << run.err;
    EXPECT_EQ(daemon.requests(), std::vector<std::string>{R"(job.get {"id":"7"})"});
  }
  AnsweringDaemon agreed(job_in("paused"));
  EXPECT_EQ(run_with(agreed, {"cancel", "7"}, "y\n").exit_code, kExitOk);
  EXPECT_EQ(agreed.requests().back(), R"(job.cancel {"id":"7"})");
  AnsweringDaemon ready(job_in("ready"));
  EXPECT_EQ(run_with(ready, {"cancel", "7"}, "").err, "") << "nothing is lost that cannot be planned again";
  AnsweringDaemon forced(job_in("paused"));
  EXPECT_EQ(run_with(forced, {"cancel", "7", "--yes"}, "").exit_code, kExitOk);
}

TEST(JobCommands, RefusalsBecomeExitCodes) {
  const std::pair<int, int> codes[] = {
      {-32700, kExitInternal}, {-32600, kExitInternal}, {-32601, kExitInternal}, {-32602, kExitBadInput},
      {-32000, kExitInternal}, {-32001, kExitBadInput}, {-32002, kExitRefused},  {-32003, kExitBadInput},
      {-32004, kExitRefused},  {-32005, kExitRefused}};
  for (const auto& [code, exit_code] : codes) {
    AnsweringDaemon daemon(R"("error":{"code":)" + std::to_string(code) +
                           R"(,"message":"a sentence","data":{"at":"$.id"}})");
    const CommandRun run = run_with(daemon, {"pause", "7"});
    EXPECT_EQ(run.exit_code, exit_code) << code;
    EXPECT_EQ(run.err, "hilbrush: $.id: a sentence\n");
  }
}

TEST(CellCommands, StatusIsTextActsAreALine) {
  const std::string cell =
      R"("result":{"cell":{"state":"stopped","laser":"off","devices":{"robot":{"state":"ready","fault":null}},"joints":null,"job":null,"reason":"stopped by user 0"}})";
  AnsweringDaemon daemon(cell);
  EXPECT_EQ(
      run_with(daemon, {"status"}).out,
      "  cell:          stopped\n  reason:        stopped by user 0\n  laser:         off\n  devices:       "
      "robot ready\n");
  AnsweringDaemon stopped(cell);
  EXPECT_EQ(run_with(stopped, {"stop"}).out, "cell: stopped, laser off, stopped by user 0\n");
  AnsweringDaemon info(R"("result":{"system":{"version":"0.1.0","cell":{"name":"default"}}})");
  EXPECT_EQ(run_with(info, {"info"}).out, "version: 0.1.0\ncell.name: default\n");
}

std::string job(const std::string& state, double progress, const std::string& more = {}) {
  return R"({"id":"7","state":")" + state + R"(","dots":{"placed":100,"exposed":)" +
         std::to_string(static_cast<int>(100 * progress)) + R"(},"progress":)" + std::to_string(progress) +
         more + "}";
}

/// A daemon that answers job.watch with the first of these jobs and notifies of the others, then closes or
/// waits.
std::function<void(Peer&)> telling(std::vector<std::string> jobs, bool closes = false) {
  return [jobs = std::move(jobs), closes](Peer& peer) {
    peer.read_line();
    peer.write_line(R"({"jsonrpc":"2.0","id":1,"result":{"seq":1,"job":)" + jobs[0] + "}}");
    for (std::size_t i = 1; i < jobs.size(); ++i)
      peer.write_line(R"({"jsonrpc":"2.0","method":"job.update","params":{"seq":)" + std::to_string(i + 1) +
                      R"(,"job":)" + jobs[i] + "}}");
    if (!closes) peer.wait_for_close();
  };
}

CommandRun watch(const std::function<void(Peer&)>& script, std::vector<std::string> more = {},
                 bool is_terminal = false) {
  FakeDaemon daemon(script);
  more.insert(more.begin(), {"watch", "7", "--socket", daemon.socket_path()});
  return run_command(more, is_terminal);
}

TEST(Watch, APipeGetsLinesUntilTheJobIsDone) {
  const CommandRun run = watch(telling({job("queued", 0), job("planning", .5, R"(,"stage":"load")"),
                                        job("planning", .6, R"(,"stage":"load")"), job("painting", 0),
                                        job("painting", .05), job("painting", .11, R"(,"eta_s":9)"),
                                        job("painting", .15), job("done", 1, R"(,"output":"/jobs/7")")}));
  EXPECT_EQ(run.exit_code, kExitOk) << run.err;
  EXPECT_EQ(run.out,
            "job 7: queued, 0 of 100 dots exposed\n"
            "job 7: planning, load\n"
            "job 7: painting, 0 of 100 dots exposed, 0 %\n"
            "job 7: painting, 11 of 100 dots exposed, 11 %, about 0:00:09 left\n"
            "job 7: done, 100 of 100 dots exposed\n"
            "results are in /jobs/7\n");
}

TEST(Watch, ShowsThePlanAndItsWarningsOnceWhenItIsMade) {
  const std::string planned =
      R"(,"warnings":["w"],"plan":{"size_mm":[1,2,3],"skipped":[],"suggestion":null})";
  const std::string early = R"(,"stage":"load","warnings":["w"],"plan":null)";
  const CommandRun run = watch(telling({job("planning", .5, early), job("ready", 0, planned),
                                        job("painting", 0, planned), job("done", 1, planned)}));
  EXPECT_EQ(run.err, "warning: w\n");
  EXPECT_EQ(run.out,
            "job 7: planning, load\n"
            "  size:          1.00 x 2.00 x 3.00 mm\n"
            "job 7: ready, 0 of 100 dots exposed\n"
            "job 7 waits for `hilbrush start 7`; the cell must be armed (`hilbrush clear`, `hilbrush arm`)\n"
            "job 7: painting, 0 of 100 dots exposed, 0 %\n"
            "job 7: done, 100 of 100 dots exposed\n");
}

TEST(Watch, ATerminalGetsABar) {
  const CommandRun run = watch(telling({job("painting", .5), job("done", 1)}), {}, true);
  EXPECT_TRUE(run.out.starts_with("[############............] job 7: painting, 50 %, 50 of 100 dots\r\033[K"))
      << run.out;
  EXPECT_TRUE(run.out.ends_with("\r\033[Kjob 7: done, 100 of 100 dots exposed\n")) << run.out;
}

TEST(Watch, JsonIsEveryUpdate) {
  const CommandRun run = watch(telling({job("painting", .5), job("done", 1)}), {"--json"});
  std::istringstream lines(run.out);
  std::vector<int> numbers;
  for (std::string line; std::getline(lines, line);) numbers.push_back(Json::parse(line)["seq"]);
  EXPECT_EQ(numbers, (std::vector<int>{1, 2}));
}

TEST(Watch, AFailedOrCancelledJobIsSix) {
  const CommandRun failed = watch(telling(
      {job("painting", .5), job("failed", .5, R"(,"error":{"at":"laser","message":"interlock open"})")}));
  EXPECT_EQ(failed.exit_code, kExitJobFailed);
  EXPECT_EQ(failed.err, "hilbrush: job 7: laser: interlock open\n");
  EXPECT_EQ(watch(telling({job("cancelled", 0)})).exit_code, kExitJobFailed);
}

TEST(Watch, UntilEndsAtTheStateOrPastIt) {
  EXPECT_EQ(
      watch(telling({job("queued", 0), job("planning", 0), job("ready", 0)}), {"--until", "ready"}).exit_code,
      kExitOk);
  EXPECT_EQ(watch(telling({job("painting", 0)}), {"--until", "ready"}).exit_code, kExitOk);
  EXPECT_EQ(watch(telling({job("painting", 0), job("paused", .5)}), {"--until", "paused"}).exit_code,
            kExitOk);
  EXPECT_EQ(watch(telling({job("paused", .5), job("painting", .5)}), {"--until", "painting"}).exit_code,
            kExitOk);
  EXPECT_EQ(watch(telling({job("failed", 0)}), {"--until", "ready"}).exit_code, kExitJobFailed);
}

constexpr const char* kFirstOfTwo = R"(,"copies":2,"copies_done":0)";
constexpr const char* kSecondOfTwo = R"(,"copies":2,"copies_done":1)";

TEST(Watch, UntilCanBeOnePartOfSeveral) {
  const CommandRun part =
      watch(telling({job("painting", .5, kFirstOfTwo), job("ready", 0, kSecondOfTwo)}), {"--until", "part"});
  EXPECT_EQ(part.exit_code, kExitOk) << part.err;
  EXPECT_NE(part.out.find("job 7: painting, copy 1 of 2, 50 of 100"), std::string::npos) << part.out;
  EXPECT_TRUE(part.out.ends_with("job 7: ready, copy 2 of 2, 0 of 100 dots exposed\n")) << part.out;
  EXPECT_EQ(watch(telling({job("ready", 0, kFirstOfTwo), job("painting", 0, kFirstOfTwo), job("done", 1)}),
                  {"--until", "part"})
                .out.find("job 7: done"),
            watch(telling({job("ready", 0, kFirstOfTwo), job("painting", 0, kFirstOfTwo), job("done", 1)}),
                  {"--until", "done"})
                .out.find("job 7: done"))
      << "a first part that has not begun is waited for";
  const CommandRun ready =
      watch(telling({job("painting", .5, kFirstOfTwo), job("ready", 0, kSecondOfTwo)}), {"--until", "ready"});
  EXPECT_NE(ready.out.find("job 7: ready"), std::string::npos) << "it will be ready again: " << ready.out;
  EXPECT_EQ(watch(telling({job("painting", .5, kSecondOfTwo)}), {"--until", "ready"}).exit_code, kExitOk)
      << "the last part: never ready again";
}

TEST(Watch, SaysWhyAJobIsPausedAndWhatItWaitsFor) {
  const std::string why = R"(,"error":{"at":"cell","message":"the cell was stopped: stopped by anna"})";
  const std::string line =
      "job 7: paused, 50 of 100 dots exposed, 50 %: cell: the cell was stopped: stopped by anna\n";
  const std::string wait =
      "job 7 waits for `hilbrush resume 7`; the cell must be armed (`hilbrush clear`, `hilbrush arm`)\n";
  const auto script = telling({job("painting", .5), job("paused", .5, why), job("done", 1)});
  EXPECT_NE(watch(script).out.find(line + wait), std::string::npos) << watch(script).out;
  EXPECT_NE(watch(script, {}, true).out.find(line + wait), std::string::npos) << "above the bar";
  EXPECT_EQ(watch(telling({job("paused", .5, why)}), {"--until", "paused"}).out, line);
}

TEST(Watch, ALostDaemonIsFour) {
  const CommandRun run = watch(telling({job("painting", .5)}, true));
  EXPECT_EQ(run.exit_code, kExitNoDaemon);
  EXPECT_EQ(run.err, "hilbrush: the daemon closed the connection\n");
}

TEST(Watch, CtrlCEndsWatchingAndSaysThatTheJobGoesOn) {
  sigset_t set, before;  // blocked in the threads made here, so that it can never end the test itself
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  pthread_sigmask(SIG_BLOCK, &set, &before);
  const CommandRun run = watch([](Peer& peer) {
    peer.read_line();
    peer.write_line(R"({"jsonrpc":"2.0","id":1,"result":{"seq":1,"job":)" + job("painting", .5) + "}}");
    kill(getpid(), SIGINT);
    peer.wait_for_close();
  });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  EXPECT_EQ(run.exit_code, kExitInterrupted);
  EXPECT_EQ(run.err, "hilbrush: no longer watching; the job goes on\n");
}

TEST(Watch, UpdatesOfOtherJobsAreNotMine) {
  const std::string other = R"({"id":"8","state":"done","progress":1})";
  EXPECT_EQ(watch(telling({job("painting", .5), other, job("done", 1)})).out,
            "job 7: painting, 50 of 100 dots exposed, 50 %\njob 7: done, 100 of 100 dots exposed\n");
}

}  // namespace
}  // namespace hilbrush
