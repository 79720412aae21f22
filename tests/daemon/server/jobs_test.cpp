#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/stat.h>

#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <random>
#include <set>
#include <sstream>

#include "config/rpc_errors.h"
#include "planner/cell_model/program_file.h"
#include "sim/devices/emission_record.h"
#include "tests/daemon/server/daemon_fixture.h"

namespace hilbrush {
namespace {

namespace fs = std::filesystem;
using test::DaemonWorld;
using test::Json;
using test::LineClient;
using test::named;
using test::placed;

/// The witness: emissions by exposure of the job's program, and none that belongs to no exposure or was made
/// in motion.
std::vector<std::size_t> emission_counts(const fs::path& job_folder) {
  const auto program = read_program(job_folder / "program.ply");
  std::map<std::array<long long, kAxisCount>, std::size_t> index;
  const auto key = [](const Joints& joints) {
    std::array<long long, kAxisCount> rounded{};
    for (std::size_t i = 0; i < kAxisCount; ++i) rounded[i] = std::llround(joints[i] * 1e10);
    return rounded;
  };
  for (std::size_t i = 0; i < program.exposures.size(); ++i) index[key(program.exposures[i].joints)] = i;
  std::vector<std::size_t> counts(program.exposures.size());
  for (const auto& emission : read_emission_record(job_folder / "emissions.ply")) {
    EXPECT_FALSE(emission.is_moving);
    const auto found = index.find(key(emission.joints));
    if (found == index.end())
      ADD_FAILURE() << "an emission belongs to no exposure";
    else
      ++counts[found->second];
  }
  return counts;
}

TEST(ServerJobsTest, AJobGoesTheWholeWay) {
  DaemonWorld world;
  world.begin();
  LineClient client = world.client();
  const auto id = world.submit(client, world.model("cup.wrl", 200), "ready");
  Json job = client.result("job.get", named(id)).at("job");
  EXPECT_EQ(job.at("dots").at("placed"), 205);
  EXPECT_EQ(job.at("dots").at("skipped"), 5);
  EXPECT_EQ(job.at("dots").at("remaining"), 200);
  EXPECT_EQ(job.at("warnings"), Json::array({"a texture is missing"}));
  EXPECT_EQ(job.at("plan").at("size_mm"), Json::array({80, 80, 60}));
  EXPECT_EQ(job.at("plan").at("min_mm"), Json::array({-40, -40, 0}));
  EXPECT_EQ(job.at("plan").at("skipped").at(0).at("text"), "beam blocked by the object");
  EXPECT_EQ(job.at("plan").at("suggestion"), "a post of 90 mm would reach more");
  EXPECT_TRUE(fs::exists(job.at("model_copy").get<std::string>()));

  EXPECT_EQ(client.result("cell.status").at("cell").at("state"), "stopped");
  EXPECT_EQ(client.error_code("job.start", placed(id)), kRpcWrongState);
  world.clear_and_arm(client);
  EXPECT_EQ(client.error_code("job.start", named(id)), kRpcBadParams) << "the part must be confirmed";
  EXPECT_EQ(client.error_code("job.start", {{"id", id}, {"part_in_place", false}}), kRpcBadParams);
  const Json watched = client.result("job.watch", named(id));
  EXPECT_EQ(client.result("job.start", placed(id)).at("job").at("state"), "painting");

  auto seq = watched.at("seq").get<std::int64_t>();
  for (std::string state; state != "done";) {
    const Json update = client.next_update();
    EXPECT_GT(update.at("seq").get<std::int64_t>(), seq);
    seq = update.at("seq").get<std::int64_t>();
    state = update.at("job").at("state").get<std::string>();
    const Json& dots = update.at("job").at("dots");
    EXPECT_EQ(dots.at("placed").get<int>(), dots.at("exposed").get<int>() + dots.at("in_doubt").get<int>() +
                                                dots.at("remaining").get<int>() +
                                                dots.at("skipped").get<int>());
  }
  job = client.result("job.get", named(id)).at("job");
  EXPECT_EQ(job.at("dots").at("exposed"), 200);
  EXPECT_EQ(job.at("error"), nullptr);
  EXPECT_EQ(emission_counts(world.job_folder(id)), std::vector<std::size_t>(200, 1));
  const Json cell = client.result("cell.status").at("cell");
  EXPECT_EQ(cell.at("state"), "idle") << "armed once a job";
  EXPECT_EQ(cell.at("laser"), "off");
  EXPECT_EQ(client.error_code("job.start", placed(id)), kRpcWrongState);
}

TEST(ServerJobsTest, StopsPausesAndResumesUntilEveryDotIsPaintedOnce) {
  DaemonWorld world;
  world.options.time_scale = 0.02;
  world.begin();
  LineClient operator_a = world.client();
  LineClient operator_b = world.client();
  const auto id = world.submit(operator_a, world.model("cup.wrl", 1000), "ready");
  world.clear_and_arm(operator_a);
  operator_a.result("job.start", placed(id));
  std::mt19937 random(11);
  int stops = 0;
  for (; stops < 5; ++stops) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20 + random() % 80));
    const Json stopped = operator_b.result("cell.stop").at("cell");
    EXPECT_EQ(stopped.at("state"), "stopped");
    EXPECT_EQ(stopped.at("laser"), "off");
    const Json job = world.wait_for(operator_a, id, "paused");
    EXPECT_LE(job.at("dots").at("in_doubt").get<int>(), stops + 1);
    EXPECT_EQ(job.at("in_doubt").size(), job.at("dots").at("in_doubt").get<std::size_t>());
    EXPECT_EQ(operator_a.error_code("job.resume", named(id)), kRpcWrongState) << "stopped: clear first";
    EXPECT_EQ(operator_a.error_code("cell.arm"), kRpcWrongState) << "stopped: clear first";
    operator_a.result("cell.clear");
    EXPECT_EQ(operator_a.error_code("job.resume", named(id)), kRpcWrongState) << "idle: arm first";
    operator_a.result("cell.arm");
    EXPECT_EQ(operator_a.error_code("job.resume", named(id)), kRpcWrongState)
        << "stopped since: confirm the part";
    EXPECT_EQ(operator_a.result("job.resume", placed(id)).at("job").at("state"), "painting");
  }
  operator_a.result("job.pause", named(id));
  world.wait_for(operator_a, id, "paused");
  EXPECT_EQ(operator_a.result("cell.status").at("cell").at("state"), "armed") << "a pause is not a stop";
  operator_a.result("job.resume", named(id));
  const Json job = world.wait_for(operator_a, id, "done");
  const auto counts = emission_counts(world.job_folder(id));
  const auto in_doubt = job.at("in_doubt").get<std::set<std::size_t>>();
  EXPECT_LE(in_doubt.size(), static_cast<std::size_t>(stops));
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (in_doubt.contains(i))
      EXPECT_LE(counts[i], 1u) << "dot " << i;
    else
      EXPECT_EQ(counts[i], 1u) << "dot " << i;
  }
  EXPECT_EQ(job.at("dots").at("exposed").get<std::size_t>() + in_doubt.size(), 1000u);
}

TEST(ServerJobsTest, DotsInDoubtAreExposedAgainOnlyWhenOrdered) {
  DaemonWorld world;
  world.options.time_scale = 0.02;
  world.begin();
  LineClient client = world.client();
  const auto id = world.submit(client, world.model("long.wrl", 2000), "ready");
  world.clear_and_arm(client);
  client.result("job.start", placed(id));
  Json job;
  const auto now = [&] { return client.result("job.get", named(id)).at("job"); };
  // Until a stop happens to cut a pulse, in which the cell spends most of its time; each after some dots
  // more.
  for (int round = 0; round < 100; ++round) {
    const Json before = now();
    for (job = before; job.at("state") == "painting" && job.at("dots") == before.at("dots");) job = now();
    ASSERT_NE(job.at("state"), "done") << "no stop has cut a pulse";
    std::this_thread::sleep_for(
        std::chrono::microseconds(137 * round % 2000));  // another phase of the dot each time
    client.result("cell.stop");
    job = world.wait_for(client, id, "paused");
    if (job.at("dots").at("in_doubt").get<int>() > 0) break;
    world.clear_and_arm(client);
    client.result("job.resume", placed(id));
  }
  ASSERT_EQ(job.at("in_doubt").size(), 1u);
  const auto doubtful = job.at("in_doubt")[0].get<std::size_t>();
  world.clear_and_arm(client);
  EXPECT_EQ(client.error_code("job.resume", {{"id", id}, {"in_doubt", "perhaps"}}), kRpcBadParams);
  client.result("job.resume", {{"id", id}, {"in_doubt", "expose"}, {"part_in_place", true}});
  job = world.wait_for(client, id, "done");
  EXPECT_EQ(job.at("dots").at("exposed"), 2000);
  EXPECT_EQ(job.at("dots").at("in_doubt"), 0);
  const auto counts = emission_counts(world.job_folder(id));
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (i == doubtful)
      EXPECT_GE(counts[i], 1u);
    else
      EXPECT_EQ(counts[i], 1u) << "dot " << i;
  }
}

TEST(ServerJobsTest, AStopWhileTheWayIsPlannedLeavesTheJobResumable) {
  DaemonWorld world;
  world.begin();
  LineClient client = world.client();
  const auto id = world.submit(client, world.model("slowway.wrl"), "ready");
  world.clear_and_arm(client);
  client.result("job.start", placed(id));
  while (client.result("job.get", named(id)).at("job").at("stage") != "approach") std::this_thread::yield();
  client.result("cell.stop");
  EXPECT_EQ(client.result("job.get", named(id)).at("job").at("state"), "paused");
  world.clear_and_arm(client);
  EXPECT_EQ(client.result("job.resume", placed(id)).at("job").at("state"), "painting");
  while (client.result("job.get", named(id)).at("job").at("stage") != "approach") std::this_thread::yield();
  EXPECT_EQ(client.result("job.pause", named(id)).at("job").at("state"), "paused");
  EXPECT_EQ(client.result("job.pause", named(id)).at("job").at("state"), "paused") << "repeated";
  EXPECT_EQ(client.result("cell.status").at("cell").at("state"), "armed");
}

TEST(ServerJobsTest, NoWayToTheNextDotPausesTheJobWithASentence) {
  DaemonWorld world;
  world.begin();
  LineClient client = world.client();
  const auto id = world.submit(client, world.model("lost.wrl"), "ready");
  world.clear_and_arm(client);
  client.result("job.start", placed(id));
  const Json job = world.wait_for(client, id, "paused");
  EXPECT_NE(job.at("error").at("message").get<std::string>().find("every way is blocked"), std::string::npos);
}

TEST(ServerJobsTest, AProgramForAnotherModelOrBeyondTheLimitsIsNeverPainted) {
  DaemonWorld world;
  world.begin();
  LineClient client = world.client();
  const auto stray = world.submit(client, world.model("stray.wrl"), "ready");
  const auto wild = world.submit(client, world.model("wild.wrl"), "ready");
  world.clear_and_arm(client);
  client.result("job.start", placed(stray));
  Json job = world.wait_for(client, stray, "failed");
  EXPECT_NE(job.at("error").at("message").get<std::string>().find("another model"), std::string::npos);
  world.wait_for(client, stray, "failed");
  client.result("cell.arm");
  client.result("job.start", placed(wild));
  job = world.wait_for(client, wild, "failed");
  EXPECT_NE(job.at("error").at("message").get<std::string>().find("j1"), std::string::npos);
  EXPECT_EQ(job.at("dots").at("exposed"), 50);
}

TEST(ServerJobsTest, PipelinesInTroubleFailTheirJobsWithASentenceAndDisturbNoPainting) {
  DaemonWorld world;
  world.options.time_scale = 0.02;
  world.options.pipeline_silence_s = 5;
  world.options.pipeline_memory_mb = 100;
  world.begin();
  LineClient client = world.client();
  const auto painting = world.submit(client, world.model("cup.wrl", 3000), "ready");
  world.clear_and_arm(client);
  client.result("job.start", placed(painting));
  const std::vector<std::pair<const char*, const char*>> troubles{
      {"hang.wrl", "no progress"}, {"crash.wrl", "crashed"},
      {"fat.wrl", "memory"},       {"bad.wrl", "a face has no corners"},
      {"mute.wrl", "out of luck"}, {"garbage.wrl", "does not belong to its protocol"},
      {"endless.wrl", "a line"},   {"outside.wrl", "outside the model's folder"}};
  for (const auto& [name, sentence] : troubles) {
    const auto id = world.submit(client, world.model(name), "failed", name == std::string("mute.wrl"));
    const Json error = client.result("job.get", named(id)).at("job").at("error");
    EXPECT_NE(error.at("message").get<std::string>().find(sentence), std::string::npos)
        << name << ": " << error.dump();
  }
  const auto dry = world.submit(client, world.model("dry.wrl"), "done", true);
  EXPECT_EQ(client.error_code("job.start", placed(dry)), kRpcWrongState);
  const Json job = client.result("job.get", named(painting)).at("job");
  EXPECT_TRUE(job.at("state") == "painting" || job.at("state") == "done") << job.dump();
  EXPECT_EQ(job.at("dots").at("in_doubt"), 0);
  world.wait_for(client, painting, "done");
  EXPECT_EQ(emission_counts(world.job_folder(painting)), std::vector<std::size_t>(3000, 1));
}

TEST(ServerJobsTest, AModelBelowALinkedFolderIsTaken) {
  DaemonWorld world;
  world.begin();
  LineClient client = world.client();
  const auto model = world.model("linked.wrl");
  const fs::path real = world.folder() / "real";
  fs::create_directories(real);
  fs::copy_file(model, real / "linked.wrl");
  fs::create_directory_symlink(real, world.folder() / "link");
  const auto id = client.result("job.submit", {{"model", (world.folder() / "link" / "linked.wrl").string()},
                                               {"settings", {{"size_mm", 80}}}});
  EXPECT_EQ(world.wait_for(client, id.at("job").at("id").get<std::string>(), "ready").at("model_copy"),
            (world.job_folder(id.at("job").at("id").get<std::string>()) / "model" / "linked.wrl").string());
}

/// More than the queue of orders ever held, while a gigabyte is copied.
TEST(ServerJobsTest, QuickCancelsWhileAModelIsCopiedEndNothingButTheirJobs) {
  DaemonWorld world;
  world.begin();
  LineClient client = world.client();
  const auto submit = [&](const fs::path& model) {
    const Json answer =
        client.result("job.submit", {{"model", model.string()}, {"settings", {{"size_mm", 80}}}});
    return answer.at("job").at("id").get<std::string>();
  };
  const auto large = world.model("large.wrl");
  fs::resize_file(large, std::uintmax_t{1} << 30);
  const auto copied = submit(large);
  const auto copy = world.job_folder(copied) / "model" / "large.wrl";
  const auto deadline = std::chrono::steady_clock::now() + LineClient::kPatience;
  while (!fs::exists(copy) && std::chrono::steady_clock::now() < deadline) std::this_thread::yield();
  std::vector<std::string> others;
  const auto hang = world.model("hang.wrl");
  for (int i = 0; i < 60; ++i) others.push_back(submit(hang));
  client.result("job.cancel", named(copied));
  for (const auto& id : others)
    EXPECT_EQ(client.result("job.cancel", named(id)).at("job").at("state"), "cancelled");
  world.submit(client, world.model("cup.wrl"), "ready");
  EXPECT_FALSE(fs::exists(copy)) << "nothing of it is left";
}

TEST(ServerJobsTest, APipelineThatIsNotThereFailsTheJob) {
  DaemonWorld world;
  world.options.pipeline = "/nowhere/hilbrush-pipeline";
  world.begin();
  LineClient client = world.client();
  const auto id = world.submit(client, world.model("cup.wrl"), "failed");
  EXPECT_NE(client.result("job.get", named(id))
                .at("job")
                .at("error")
                .at("message")
                .get<std::string>()
                .find("cannot be started"),
            std::string::npos);
}

TEST(ServerJobsTest, CancelWorksInEveryStateThatIsNotFinal) {
  DaemonWorld world;
  world.options.time_scale = 0.02;
  world.begin();
  LineClient client = world.client();
  const auto planning = world.submit(client, world.model("hang.wrl"), "planning");
  const auto queued = client.result(
      "job.submit", {{"model", world.model("cup.wrl", 3000).string()}, {"settings", {{"size_mm", 80}}}});
  const auto queued_id = queued.at("job").at("id").get<std::string>();
  const auto waiting = client.result(
      "job.submit", {{"model", world.model("cup2.wrl").string()}, {"settings", {{"size_mm", 80}}}});
  const auto waiting_id = waiting.at("job").at("id").get<std::string>();
  EXPECT_EQ(client.result("job.cancel", named(waiting_id)).at("job").at("state"), "cancelled");
  EXPECT_EQ(client.result("job.cancel", named(planning)).at("job").at("state"), "cancelled");
  world.wait_for(client, queued_id, "ready");
  world.clear_and_arm(client);
  client.result("job.start", placed(queued_id));
  EXPECT_EQ(client.error_code("job.start", placed(queued_id)), kRpcWrongState);
  client.result("job.cancel", named(queued_id));
  world.wait_for(client, queued_id, "cancelled");
  EXPECT_EQ(client.result("job.cancel", named(queued_id)).at("job").at("state"), "cancelled") << "repeated";
  EXPECT_EQ(client.error_code("job.pause", named(queued_id)), kRpcWrongState);
  EXPECT_EQ(client.error_code("job.resume", named(queued_id)), kRpcWrongState);
  EXPECT_EQ(client.result("cell.status").at("cell").at("state"), "idle");
}

TEST(ServerJobsTest, AJobOfWhichNoDotCanBeExposedFailsWithASentence) {
  DaemonWorld world;
  world.begin();
  LineClient client = world.client();
  for (const bool is_dry : {false, true}) {
    const auto id = world.submit(client, world.model("hidden.wrl"), "failed", is_dry);
    const Json job = client.result("job.get", named(id)).at("job");
    EXPECT_NE(job.at("error").at("message").get<std::string>().find(
                  "none of the 5 dots can be exposed: beam blocked"),
              std::string::npos)
        << job.at("error");
    EXPECT_EQ(job.at("dots").at("skipped"), 5);
  }
}

TEST(ServerJobsTest, JobsSurviveARestart) {
  DaemonWorld world;
  world.options.time_scale = 0.02;
  world.begin();
  std::string done, painting, failed, planning;
  {
    LineClient client = world.client();
    failed = world.submit(client, world.model("bad.wrl"), "failed");
    done = world.submit(client, world.model("dry.wrl"), "done", true);
    painting = world.submit(client, world.model("cup.wrl", 2000), "ready");
    planning = world.submit(client, world.model("hang.wrl"), "planning");
    world.clear_and_arm(client);
    client.result("job.start", placed(painting));
    while (client.result("job.get", named(painting)).at("job").at("dots").at("exposed").get<int>() < 100)
      std::this_thread::yield();
  }
  world.end();
  world.begin();
  LineClient client = world.client();
  EXPECT_EQ(client.result("cell.status").at("cell").at("state"), "stopped");
  EXPECT_EQ(client.result("job.get", named(failed)).at("job").at("error").at("at"), "bad.wrl:12");
  EXPECT_EQ(client.result("job.get", named(done)).at("job").at("state"), "done");
  const auto replanned = client.result("job.get", named(planning)).at("job").at("state");
  EXPECT_TRUE(replanned == "planning" || replanned == "queued") << replanned;
  const Json job = client.result("job.get", named(painting)).at("job");
  EXPECT_EQ(job.at("state"), "paused");
  EXPECT_GE(job.at("dots").at("exposed").get<int>(), 100);
  EXPECT_LE(job.at("dots").at("in_doubt").get<int>(), 1);
  world.clear_and_arm(client);
  EXPECT_EQ(client.error_code("job.resume", named(painting)), kRpcWrongState)
      << "the part must be confirmed again";
  client.result("job.resume", {{"id", painting}, {"in_doubt", "leave"}, {"part_in_place", true}});
  const Json end = world.wait_for(client, painting, "done");
  EXPECT_EQ(end.at("dots").at("exposed").get<int>() + end.at("dots").at("in_doubt").get<int>(), 2000);
  for (const std::size_t count : emission_counts(world.job_folder(painting))) EXPECT_LE(count, 1u);
}

TEST(ServerJobsTest, AnIdempotencyKeyIsOneJob) {
  DaemonWorld world;
  world.begin();
  const auto model = world.model("cup.wrl");
  const Json order{{"model", model.string()}, {"settings", {{"size_mm", 80}}}, {"key", "order-17"}};
  std::string id;
  {
    LineClient client = world.client();
    id = client.result("job.submit", order).at("job").at("id").get<std::string>();
    EXPECT_EQ(client.result("job.submit", order).at("job").at("id"), id);
    world.wait_for(client, id, "ready");
  }
  world.end();
  world.begin();
  LineClient client = world.client();
  EXPECT_EQ(client.result("job.submit", order).at("job").at("id"), id) << "also after a restart";
  Json other = order;
  other["settings"]["size_mm"] = 90;
  EXPECT_EQ(client.error_code("job.submit", other), kRpcBadParams);
  EXPECT_EQ(client.result("job.list").at("jobs").size(), 1u);
}

TEST(ServerJobsTest, ADamagedJobStoreIsSetAside) {
  DaemonWorld world;
  fs::create_directories(world.options.state);
  std::ofstream(world.options.state / "jobs.sqlite") << std::string(10000, 'x');
  world.begin();
  LineClient client = world.client();
  EXPECT_TRUE(client.result("job.list").at("jobs").empty());
  std::size_t aside = 0;
  for (const auto& entry : fs::directory_iterator(world.options.state))
    aside += entry.path().filename().string().find("damaged") != std::string::npos;
  EXPECT_EQ(aside, 1u);
}

TEST(ServerJobsTest, BadOrdersAreRefusedWithTheirPlace) {
  DaemonWorld world;
  world.begin();
  LineClient client = world.client();
  const auto refusal = [&](const Json& params) { return client.call("job.submit", params).at("error"); };
  EXPECT_EQ(refusal(Json::object()).at("data").at("at"), "$.model");
  EXPECT_EQ(refusal({{"model", "cup.wrl"}}).at("code"), kRpcBadParams) << "a relative path";
  EXPECT_EQ(refusal({{"model", "/nowhere/cup.wrl"}}).at("code"), kRpcBadInput);
  EXPECT_EQ(refusal({{"model", "/tmp"}}).at("code"), kRpcBadInput) << "a folder";
  EXPECT_EQ(refusal({{"model", "/dev/null"}}).at("code"), kRpcBadInput) << "a device";
  ASSERT_EQ(::mkfifo((world.folder() / "fifo").c_str(), 0600), 0);
  EXPECT_EQ(refusal({{"model", (world.folder() / "fifo").string()}}).at("code"), kRpcBadInput) << "a pipe";
  const auto model = world.model("cup.wrl").string();
  EXPECT_EQ(refusal({{"model", model}, {"settings", {{"size_mm", -3}}}}).at("code"), kRpcBadInput);
  EXPECT_NE(refusal({{"model", model}, {"settings", {{"color", "red"}}}}).dump().find("color"),
            std::string::npos);
  EXPECT_EQ(
      refusal({{"model", model}, {"settings", {{"size_mm", 80}, {"cell", "../../etc/passwd"}}}}).at("code"),
      kRpcBadInput);
  EXPECT_EQ(refusal({{"model", model}, {"modle", 1}}).at("data").at("at"), "$.modle");
  EXPECT_EQ(client.error_code("job.get", named("99")), kRpcNoSuchJob);
  EXPECT_EQ(client.error_code("job.get", named("../7")), kRpcNoSuchJob);
  EXPECT_EQ(client.error_code("job.get", {{"id", 7}}), kRpcBadParams);
}

TEST(ServerJobsTest, ActsAreAudited) {
  DaemonWorld world;
  world.begin();
  LineClient client = world.client();
  client.result("cell.stop");
  client.call("job.start", placed("4"));
  client.result("cell.status");
  std::ifstream in(world.options.state / "audit.log");
  std::vector<Json> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(Json::parse(line));
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[0].at("method"), "cell.stop");
  EXPECT_EQ(lines[0].at("uid"), ::getuid());
  EXPECT_EQ(lines[0].at("result"), "ok");
  EXPECT_EQ(lines[1].at("method"), "job.start");
  EXPECT_NE(lines[1].at("result"), "ok");
}

}  // namespace
}  // namespace hilbrush
