#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/stat.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <tuple>

#include "config/rpc_errors.h"
#include "daemon/server/job_queue.h"
#include "daemon/server/job_store.h"
#include "sim/devices/emission_record.h"
#include "tests/daemon/execution/sim_devices.h"
#include "tests/daemon/server/daemon_fixture.h"

/// Order, copies and what survives when files do not.
namespace hilbrush {
namespace {

namespace fs = std::filesystem;
using test::DaemonWorld;
using test::Json;
using test::LineClient;
using test::placed;

Json job_of(LineClient& client, const std::string& id) {
  return client.result("job.get", {{"id", id}}).at("job");
}

std::string queued(LineClient& client, const fs::path& model) {
  const Json answer =
      client.result("job.submit", {{"model", model.string()}, {"settings", {{"size_mm", 80}}}});
  return answer.at("job").at("id").get<std::string>();
}

std::vector<std::string> queue_of(LineClient& client) {
  std::vector<std::string> ids;
  const Json listed = client.result("job.list", {{"order", "queue"}});
  for (const Json& job : listed.at("jobs")) {
    ids.push_back(job.at("id").get<std::string>());
    EXPECT_EQ(job.at("position").get<std::size_t>(), ids.size());
  }
  return ids;
}

void execute_sql(const fs::path& file, const std::string& sql) {
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(file.c_str(), &database), SQLITE_OK);
  char* message = nullptr;
  EXPECT_EQ(sqlite3_exec(database, sql.c_str(), nullptr, nullptr, &message), SQLITE_OK)
      << (message != nullptr ? message : "");
  sqlite3_close(database);
}

TEST(ServerQueueTest, TheOrderCanBeChangedAndSurvivesARestart) {
  DaemonWorld world;
  world.begin();
  std::string blocking, a, b, c;
  {
    LineClient client = world.client();
    blocking = world.submit(client, world.model("hang.wrl"), "planning");
    a = queued(client, world.model("a.wrl"));
    b = queued(client, world.model("b.wrl"));
    c = queued(client, world.model("c.wrl"));
    EXPECT_EQ(queue_of(client), (std::vector{blocking, a, b, c}));
    EXPECT_EQ(client.result("job.move", {{"id", c}, {"position", 2}}).at("job").at("position"), 2);
    EXPECT_EQ(queue_of(client), (std::vector{blocking, c, a, b}));
    client.result("job.move", {{"id", a}, {"position", 99}});
    EXPECT_EQ(queue_of(client), (std::vector{blocking, c, b, a}));
    EXPECT_EQ(client.error_code("job.move", {{"id", a}, {"position", 0}}), kRpcBadParams);
    EXPECT_EQ(client.error_code("job.move", {{"id", "77"}, {"position", 1}}), kRpcNoSuchJob);
  }
  world.end();
  world.begin();
  LineClient client = world.client();
  EXPECT_EQ(queue_of(client), (std::vector{blocking, c, b, a}));
  client.result("job.cancel", {{"id", blocking}});
  EXPECT_EQ(client.error_code("job.move", {{"id", blocking}, {"position", 1}}), kRpcWrongState)
      << "a cancelled job has no place";
  // Planned in that order: b is not touched before c is ready.
  for (std::string state; state != "ready"; state = job_of(client, c).at("state").get<std::string>())
    EXPECT_TRUE(state.empty() || job_of(client, a).at("state") == "queued" ||
                job_of(client, c).at("state") == "ready");
  for (const auto& id : {b, a}) world.wait_for(client, id, "ready");
  EXPECT_EQ(queue_of(client), (std::vector{c, b, a}));
}

TEST(ServerQueueTest, AThousandJobsAreListedInBatchesAndMovedWhileAStopIsAnsweredAtOnce) {
  DaemonWorld world;
  {
    fs::create_directories(world.options.state);
    JobStore store(world.options.state / "jobs.sqlite");
    for (int i = 0; i < 1000; ++i) {
      Job job;
      job.state = JobState::kReady;
      job.rank = i + 1;
      job.warnings.assign(20, std::string(500, 'w'));
      store.insert(job);
    }
  }
  world.begin();
  LineClient client = world.client();
  LineClient greedy = world.client();
  std::string batch;
  for (int i = 0; i < 64; ++i)
    batch += (i > 0 ? "," : "[") +
             std::string(R"({"jsonrpc":"2.0","id":1,"method":"job.list","params":{"limit":1000}})");
  greedy.send_bytes(batch + "]\n");
  std::chrono::steady_clock::duration worst{};
  for (int i = 0; i < 20; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    client.result("cell.stop");
    worst = std::max(worst, std::chrono::steady_clock::now() - begin);
  }
  EXPECT_LT(worst, std::chrono::seconds(1));
  const auto answers = greedy.read_line();
  ASSERT_TRUE(answers);
  EXPECT_LT(answers->size(), 2000000u) << "the answer to a batch is bounded";
  EXPECT_EQ(Json::parse(*answers).size(), 64u) << "every request is answered";
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(client.result("job.move", {{"id", "1000"}, {"position", 1}}).at("job").at("position"), 1);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(2));
  EXPECT_EQ(job_of(client, "1").at("position"), 2);
  EXPECT_EQ(client.error_code("job.submit",
                              {{"model", world.model("a.wrl").string()}, {"settings", {{"size_mm", 80}}}}),
            kRpcWrongState)
      << "the queue is bounded";
  world.end();
  JobStore store(world.options.state / "jobs.sqlite");
  EXPECT_LT(store.find(1000)->rank, store.find(1)->rank) << "the new order is kept";
}

TEST(ServerQueueTest, CopiesArePaintedOneAfterAnotherEachOnItsOwnPart) {
  DaemonWorld world;
  world.begin();
  auto connected = std::make_unique<LineClient>(world.options.socket);
  const Json order{{"model", world.model("cup.wrl", 120).string()},
                   {"settings", {{"size_mm", 80}}},
                   {"copies", 3},
                   {"key", "three cups"}};
  const auto id = connected->result("job.submit", order).at("job").at("id").get<std::string>();
  world.wait_for(*connected, id, "ready");
  for (int copy = 1; copy <= 3; ++copy) {
    EXPECT_EQ(connected->error_code("job.start", {{"id", id}}), kRpcBadParams) << "each part is confirmed";
    if (copy == 1)
      world.clear_and_arm(*connected);
    else
      connected->result("cell.arm");
    connected->result("job.start", placed(id));
    const Json job = world.wait_for(*connected, id, copy == 3 ? "done" : "ready");
    EXPECT_EQ(job.at("copies_done"), copy);
    EXPECT_EQ(job.at("dots").at("exposed"), copy == 3 ? 120 : 0)
        << "the counts are those of the present part";
    EXPECT_EQ(connected->result("cell.status").at("cell").at("state"), "idle") << "armed again for each part";
    if (copy == 2) {
      world.end();
      world.begin();
      connected = std::make_unique<LineClient>(world.options.socket);
      EXPECT_EQ(job_of(*connected, id).at("copies_done"), 2);
      connected->result("cell.clear");
    }
  }
  for (const char* name : {"emissions.ply", "emissions-2.ply", "emissions-3.ply"})
    EXPECT_EQ(read_emission_record(world.job_folder(id) / name).size(), 120u) << name;
  EXPECT_EQ(connected->result("job.submit", order).at("job").at("id"), id);
  Json other = order;
  other["copies"] = 4;
  EXPECT_EQ(connected->error_code("job.submit", other), kRpcBadParams) << "the same key, another order";
  other["copies"] = 0;
  EXPECT_EQ(connected->error_code("job.submit", other), kRpcBadParams);
  other = {
      {"model", order.at("model")}, {"settings", order.at("settings")}, {"copies", 2}, {"dry_run", true}};
  EXPECT_EQ(connected->error_code("job.submit", other), kRpcBadParams);
}

TEST(ServerQueueTest, AMissingJournalIsNeverMadeAnew) {
  DaemonWorld world;
  world.options.time_scale = .02;
  world.begin();
  LineClient client = world.client();
  const auto id = world.submit(client, world.model("cup.wrl", 500), "ready");
  world.clear_and_arm(client);
  client.result("job.start", placed(id));
  while (job_of(client, id).at("dots").at("exposed").get<int>() < 20) std::this_thread::yield();
  client.result("job.pause", {{"id", id}});
  world.wait_for(client, id, "paused");
  const auto before = read_emission_record(world.job_folder(id) / "emissions.ply").size();
  fs::remove(world.job_folder(id) / "journal");
  client.result("job.resume", {{"id", id}});
  const auto deadline = std::chrono::steady_clock::now() + LineClient::kPatience;
  Json job;
  do job = job_of(client, id);
  while (job.at("error").is_null() && std::chrono::steady_clock::now() < deadline);
  EXPECT_EQ(job.at("state"), "paused");
  EXPECT_NE(job.at("error").at("message").get<std::string>().find("the journal is missing"),
            std::string::npos);
  EXPECT_EQ(read_emission_record(world.job_folder(id) / "emissions.ply").size(), before);
}

/// As a power cut may leave it: the store is behind, the journal is not.
TEST(ServerQueueTest, TheJournalIsBelievedWhereTheStoreIsBehind) {
  DaemonWorld world;
  world.options.time_scale = .02;
  world.begin();
  std::string id;
  {
    LineClient client = world.client();
    id = world.submit(client, world.model("cup.wrl", 500), "ready");
    world.clear_and_arm(client);
    client.result("job.start", placed(id));
    while (job_of(client, id).at("dots").at("exposed").get<int>() < 60) std::this_thread::yield();
  }
  world.end();
  execute_sql(world.options.state / "jobs.sqlite",
              "UPDATE job SET state = 'ready', is_begun = 0, exposed = 0");
  world.begin();
  LineClient client = world.client();
  const Json job = world.wait_for(client, id, "paused");
  EXPECT_TRUE(job.at("needs_part_in_place").get<bool>());
  const auto deadline = std::chrono::steady_clock::now() + LineClient::kPatience;
  while (job_of(client, id).at("dots").at("exposed").get<int>() < 60 &&
         std::chrono::steady_clock::now() < deadline)
    std::this_thread::yield();
  EXPECT_EQ(client.error_code("job.start", placed(id)), kRpcWrongState);
  world.clear_and_arm(client);
  client.result("job.resume", placed(id));
  world.wait_for(client, id, "done");
  std::map<std::string, int> counts;
  for (const auto& emission : read_emission_record(world.job_folder(id) / "emissions.ply")) {
    std::string key;
    for (const double value : emission.joints) key += std::to_string(std::llround(value * 1e10)) + " ";
    EXPECT_EQ(++counts[key], 1);
  }
}

TEST(ServerQueueTest, AProgramOfAnotherVersionRefusesToRun) {
  DaemonWorld world;
  world.begin();
  LineClient client = world.client();
  const auto id = world.submit(client, world.model("older.wrl"), "ready");
  world.clear_and_arm(client);
  client.result("job.start", placed(id));
  const Json job = world.wait_for(client, id, "failed");
  EXPECT_NE(job.at("error").at("message").get<std::string>().find("version 0.0.1"), std::string::npos) << job;
}

TEST(ServerQueueTest, ALostStoreIsMadeAgainFromTheJobsFolders) {
  for (const bool is_damaged : {true, false}) {
    SCOPED_TRACE(is_damaged ? "damaged" : "missing");
    DaemonWorld world;
    world.options.time_scale = .02;
    world.begin();
    std::string done, painting, nameless;
    {
      LineClient client = world.client();
      done = world.submit(client, world.model("dry.wrl"), "done", true);
      nameless = world.submit(client, world.model("other.wrl"), "ready");
      painting = world.submit(client, world.model("cup.wrl", 600), "ready");
      client.result("job.move", {{"id", painting}, {"position", 1}});
      world.clear_and_arm(client);
      client.result("job.start", placed(painting));
      while (job_of(client, painting).at("dots").at("exposed").get<int>() < 50) std::this_thread::yield();
    }
    world.end();
    if (is_damaged)
      std::ofstream(world.options.state / "jobs.sqlite") << std::string(10000, 'x');
    else
      fs::remove(world.options.state / "jobs.sqlite");
    for (const char* suffix : {"-wal", "-shm"})
      fs::remove(world.options.state / ("jobs.sqlite" + std::string(suffix)));
    fs::remove(world.job_folder(nameless) / "job.json");
    world.begin();
    EXPECT_NE(world.daemon().notice().find("2 jobs were found again"), std::string::npos)
        << world.daemon().notice();
    LineClient client = world.client();
    EXPECT_EQ(job_of(client, done).at("state"), "done");
    EXPECT_EQ(job_of(client, nameless).at("state"), "failed") << "its files keep its number";
    const Json job = job_of(client, painting);
    EXPECT_EQ(job.at("state"), "paused");
    EXPECT_EQ(queue_of(client), std::vector{painting});
    world.clear_and_arm(client);
    client.result("job.resume", placed(painting));
    const Json end = world.wait_for(client, painting, "done");
    EXPECT_EQ(end.at("dots").at("exposed").get<int>() + end.at("dots").at("in_doubt").get<int>(), 600);
    const auto fresh = world.submit(client, world.model("new.wrl"), "ready");
    EXPECT_GT(std::stoi(fresh), std::stoi(painting)) << "no job gets another's folder";
  }
}

/// As the first version wrote it.
constexpr const char* kFirstSchema = R"(
  CREATE TABLE job (
    id INTEGER PRIMARY KEY AUTOINCREMENT, key TEXT UNIQUE, uid INTEGER NOT NULL, gid INTEGER NOT NULL,
    state TEXT NOT NULL, model TEXT NOT NULL, model_copy TEXT NOT NULL, model_sha256 TEXT NOT NULL,
    settings TEXT NOT NULL, settings_sha256 TEXT NOT NULL, cell TEXT NOT NULL, dry_run INTEGER NOT NULL,
    created TEXT NOT NULL, placed INTEGER NOT NULL, skipped INTEGER NOT NULL, exposed INTEGER NOT NULL,
    planned_s REAL NOT NULL, error_at TEXT, error_message TEXT, warnings TEXT NOT NULL);
  PRAGMA user_version = 1;
  INSERT INTO job VALUES (3, 'k', 1000, 1000, 'paused', '/m.wrl', '/c/m.wrl', 'ab', '{}', 'cd', '/cell.json', 0,
    '2026-01-01T00:00:00Z', 10, 2, 5, 1.5, NULL, NULL, '["w"]');
  INSERT INTO job VALUES (5, NULL, 1000, 1000, 'ready', '/n.wrl', '', '', '{}', '', '/cell.json', 0,
    '2026-01-02T00:00:00Z', 10, 2, 0, 1.5, 'n.wrl:3', 'a sentence', '[]');
  INSERT INTO job VALUES (6, NULL, 1000, 1000, 'done', '/o.wrl', '', '', '{}', '', '/cell.json', 1,
    '2026-01-02T00:00:00Z', 10, 2, 0, 1.5, NULL, NULL, '[]');
)";

TEST(JobStoreTest, AnOldSchemaIsMigratedAndNothingIsLost) {
  const test::TemporaryFolder folder;
  execute_sql(folder / "jobs.sqlite", kFirstSchema);
  {
    JobStore store(folder / "jobs.sqlite");
    EXPECT_EQ(store.notice(), "");
    EXPECT_FALSE(store.is_new());
    const auto jobs = store.load_recent(10);
    ASSERT_EQ(jobs.size(), 3u);
    EXPECT_EQ(jobs[0].key, "k");
    EXPECT_EQ(jobs[0].state, JobState::kPaused);
    EXPECT_TRUE(jobs[0].is_begun) << "a paused job has a journal";
    EXPECT_EQ(jobs[0].rank, 3);
    EXPECT_EQ(jobs[0].copies, 1);
    EXPECT_EQ(jobs[0].warnings, std::vector<std::string>{"w"});
    EXPECT_FALSE(jobs[1].is_begun);
    ASSERT_TRUE(jobs[1].error);
    EXPECT_EQ(jobs[1].error->at, "n.wrl:3");
    EXPECT_EQ(jobs[2].copies_done, 0) << "a dry run paints no part";
    EXPECT_EQ(store.find_key("k")->id, 3);
    EXPECT_FALSE(store.find_key("l"));
    EXPECT_FALSE(store.find(4));
    Job job = jobs[0];
    job.key.clear();
    store.insert(job);
    EXPECT_EQ(job.id, 7);
  }
  JobStore again(folder / "jobs.sqlite");
  EXPECT_EQ(again.load_recent(10).size(), 4u);
  EXPECT_EQ(again.notice(), "");
}

TEST(JobStoreTest, AStoreOfANewerDaemonIsRefusedAndLeftAsItIs) {
  const test::TemporaryFolder folder;
  execute_sql(folder / "jobs.sqlite", "CREATE TABLE job (id INTEGER); PRAGMA user_version = 99;");
  try {
    const JobStore store(folder / "jobs.sqlite");
    ADD_FAILURE() << "taken";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("newer"), std::string::npos) << error.what();
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 1)
      << "not set aside";
}

/// A change that could not be written is written later, although others could be written meanwhile.
TEST(JobStoreTest, WhatCouldNotBeStoredIsStoredLater) {
  const test::TemporaryFolder folder;
  JobStore store(folder / "jobs.sqlite");
  JobQueue queue(folder / "jobs", store);
  const auto a = queue.add(Job{}).id;
  const auto b = queue.add(Job{}).id;
  const fs::path record = folder / "jobs" / std::to_string(a);
  fs::remove_all(record);
  std::ofstream(record) << "no folder";
  execute_sql(folder / "jobs.sqlite", "CREATE TRIGGER full BEFORE UPDATE ON job WHEN NEW.id = " +
                                          std::to_string(a) + " BEGIN SELECT RAISE(ABORT, 'full'); END;");
  queue.find(a)->state = JobState::kCancelled;
  queue.changed(*queue.find(a));
  queue.changed(*queue.find(b));
  EXPECT_FALSE(queue.store_fault().empty()) << "another job that could be stored mends nothing";
  EXPECT_EQ(store.find(a)->state, JobState::kQueued);
  execute_sql(folder / "jobs.sqlite", "DROP TRIGGER full");
  fs::remove(record);
  queue.keep_unkept();
  EXPECT_EQ(store.find(a)->state, JobState::kCancelled);
  EXPECT_EQ(queue.store_fault(), "");
}

TEST(ServerQueueTest, APipeInPlaceOfARecordHangsNothing) {
  DaemonWorld world;
  fs::create_directories(world.job_folder("3"));
  ASSERT_EQ(::mkfifo((world.job_folder("3") / "job.json").c_str(), 0600), 0);
  world.begin();
  LineClient client = world.client();
  EXPECT_EQ(job_of(client, "3").at("state"), "failed") << "its files keep its number";
}

/// A daemon with another cell keeps the job for one with the job's cell.
TEST(ServerQueueTest, AJobOfAnotherCellIsRefusedAndKept) {
  DaemonWorld world;
  world.options.time_scale = .02;
  const std::string cell = world.options.cell;
  std::string ready, paused;
  world.begin();
  {
    LineClient client = world.client();
    paused = world.submit(client, world.model("cup.wrl", 400), "ready");
    ready = world.submit(client, world.model("other.wrl", 20), "ready");
    world.clear_and_arm(client);
    client.result("job.start", placed(paused));
    while (job_of(client, paused).at("dots").at("exposed").get<int>() < 20) std::this_thread::yield();
  }
  world.end();
  std::ifstream in(cell);
  Json changed = Json::parse(in);
  changed["limit_margin"] = changed.at("limit_margin").get<double>() + .001;
  world.options.cell = world.folder() / "changed.json";
  std::ofstream(world.options.cell) << changed;
  world.begin();
  {
    LineClient client = world.client();
    world.clear_and_arm(client);
    for (const auto& [id, act, kept] :
         {std::tuple(paused, "job.resume", "paused"), {ready, "job.start", "ready"}}) {
      client.result(act, placed(id));
      const Json job = world.wait_for(client, id, kept);
      EXPECT_NE(job.at("error").at("message").get<std::string>().find("another cell"), std::string::npos)
          << job;
    }
    EXPECT_EQ(client.result("cell.status").at("cell").at("state"), "idle")
        << "not stopped: the cell is sound";
  }
  world.end();
  world.options.cell = cell;
  world.begin();
  LineClient client = world.client();
  world.clear_and_arm(client);
  client.result("job.resume", placed(paused));
  const Json end = world.wait_for(client, paused, "done");
  EXPECT_EQ(end.at("dots").at("exposed").get<int>() + end.at("dots").at("in_doubt").get<int>(), 400);
  client.result("cell.arm");
  client.result("job.start", placed(ready));
  EXPECT_EQ(world.wait_for(client, ready, "done").at("dots").at("exposed"), 20);
}

TEST(JobStoreTest, KeepsTheHistoryButLoadsOnlyItsEnd) {
  const test::TemporaryFolder folder;
  JobStore store(folder / "jobs.sqlite");
  for (int i = 0; i < 20; ++i) {
    Job job;
    job.state = i == 4 ? JobState::kReady : JobState::kDone;
    job.own_time = {7, .001, .002};
    job.measured = R"({"move_delay_ms":1.5})";
    store.insert(job);
  }
  const auto recent = store.load_recent(5);
  ASSERT_EQ(recent.size(), 6u);
  EXPECT_EQ(recent.front().id, 5);
  EXPECT_EQ(recent.back().id, 20);
  ASSERT_TRUE(store.find(1)) << "the rest is still there";
  EXPECT_EQ(store.find(1)->own_time.p99_s, .002);
  EXPECT_EQ(store.find(1)->measured, R"({"move_delay_ms":1.5})");
}

/// After a start the journals of all jobs are read, the newest first; meanwhile a job may end and push the
/// oldest out.
TEST(ServerQueueTest, AJobThatLeavesTheHistoryBeforeItsJournalIsReadDisturbsNobody) {
  DaemonWorld world;
  {
    std::filesystem::create_directories(world.options.state);
    JobStore store(world.options.state / "jobs.sqlite");
    for (std::size_t i = 0; i < JobQueue::kHistoryMax; ++i) {
      Job job;
      job.state = JobState::kDone;
      job.is_begun = true;
      job.placed = 10;
      job.created = job.ended = "2026-01-01T00:00:00Z";
      store.insert(job);
      // A journal as large as may be keeps its reader busy.
      std::filesystem::create_directories(world.job_folder(std::to_string(job.id)));
      std::ofstream(world.job_folder(std::to_string(job.id)) / "journal") << std::string(100'000, 'x');
    }
  }
  world.begin();
  LineClient client = world.client();
  for (int i = 0; i < 3; ++i) {
    const std::string id = world.submit(client, world.model("cup.wrl", 5), "done", true);
    EXPECT_EQ(client.result("job.get", {{"id", id}}).at("job").at("state"), "done");
  }
  std::size_t count = 0;
  Json params{{"limit", 1000}};
  for (Json next = ""; !next.is_null(); params["after"] = next) {
    const Json page = client.result("job.list", params);
    EXPECT_LT(page.dump().size(), 400000u) << "a page is bounded";
    count += page.at("jobs").size();
    next = page.at("next");
  }
  EXPECT_EQ(count, 1000u) << "the pages are the whole list";
  EXPECT_EQ(client.result("job.get", {{"id", "1"}}).at("job").at("state"), "done")
      << "older ones are looked up";
}

}  // namespace
}  // namespace hilbrush
