#include "daemon/execution/executor.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <limits>
#include <random>
#include <thread>

#include "sim/devices/sim_cell.h"
#include "tests/daemon/execution/witnessed_cell.h"

namespace hilbrush {
namespace {

using test::expect_painted_once;
using test::key_of;
using test::small_cell;
using test::small_program;
using test::WitnessedCell;

TEST(ExecutorTest, PaintsEveryDotOnce) {
  WitnessedCell world;
  const auto program = small_program(1000);
  Journal journal = Journal::in_memory(1000);
  std::size_t reported = 0;
  const auto result = world.paint(program, journal, [&](std::size_t done) { EXPECT_EQ(done, ++reported); });
  EXPECT_EQ(result.outcome, ExecutionOutcome::kFinished) << result.reason;
  EXPECT_EQ(result.exposed, 1000u);
  EXPECT_EQ(reported, 1000u);
  EXPECT_EQ(journal.done_count(), 1000u);
  EXPECT_GT(result.elapsed_s, 1000 * .025);
  expect_painted_once(program, journal, world.emissions());
  EXPECT_EQ(key_of(world.sim().joints()), key_of(program.vias.back().joints)) << "the way home";
}

TEST(ExecutorTest, AnEmptyProgramIsFinished) {
  WitnessedCell world;
  Journal journal = Journal::in_memory(0);
  EXPECT_EQ(world.paint({}, journal).outcome, ExecutionOutcome::kFinished);
}

TEST(ExecutorTest, PassesDotsOverInTheDark) {
  WitnessedCell world;
  const auto program = small_program(300);
  Journal journal = Journal::in_memory(300);
  for (std::size_t i : {0u, 7u, 100u, 101u, 102u, 299u}) {
    journal.arm(i);
    journal.mark_in_doubt(i);
  }
  const auto result = world.paint(program, journal);
  EXPECT_EQ(result.outcome, ExecutionOutcome::kFinished) << result.reason;
  EXPECT_EQ(result.exposed, 294u);
  EXPECT_EQ(world.emissions().size(), 294u);
  expect_painted_once(program, journal, world.emissions());
}

TEST(ExecutorTest, PauseEndsBetweenTwoDotsAndTheRestFollows) {
  WitnessedCell world;
  const auto program = small_program(500);
  Journal journal = Journal::in_memory(500);
  const auto paused =
      world.paint(program, journal, [&](std::size_t done) { world.control.pause = done == 123; });
  EXPECT_EQ(paused.outcome, ExecutionOutcome::kPaused);
  EXPECT_EQ(paused.exposed, 123u);
  EXPECT_TRUE(journal.in_doubt().empty());
  world.control.pause = false;
  const auto rest =
      execute(program, {world.sim().joints()}, world.cell(), world.description, journal, world.control);
  EXPECT_EQ(rest.outcome, ExecutionOutcome::kFinished) << rest.reason;
  EXPECT_EQ(rest.exposed, 377u);
  expect_painted_once(program, journal, world.emissions());
}

TEST(ExecutorTest, StopsAtRandomMomentsLeaveAtMostOneDotInDoubtEach) {
  const unsigned seed = 20260;
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> moment_s(0.0005, 0.05);
  WitnessedCell world(0.02);
  const auto program = small_program(400);
  Journal journal = Journal::in_memory(400);
  std::size_t stops = 0;
  double worst_latency_s = 0;
  for (int round = 0; round < 1000; ++round) {
    const double after_s = moment_s(random);
    std::atomic<bool> ended{false};
    std::thread stopper([&] {
      std::this_thread::sleep_for(std::chrono::duration<double>(after_s));
      if (ended) return;
      const double asked_s = world.cell().clock.now_s();
      EXPECT_TRUE(request_stop(world.cell(), world.control));
      EXPECT_FALSE(world.cell().laser.status().is_emitting);
      worst_latency_s = std::max(worst_latency_s, world.cell().clock.now_s() - asked_s);
    });
    const auto result = world.paint(program, journal);
    ended = true;
    stopper.join();
    ASSERT_NE(result.outcome, ExecutionOutcome::kFailed) << result.reason;
    if (result.outcome == ExecutionOutcome::kFinished) break;
    ++stops;
    ASSERT_LE(journal.in_doubt().size(), stops);
    world.recover();
  }
  EXPECT_GT(stops, 3u);
  EXPECT_EQ(journal.done_count() + journal.in_doubt().size(), 400u);
  // The light goes out at the device's next tick; what is more is this machine's scheduling, in cell seconds.
  RecordProperty("worst_stop_latency_cell_ms", static_cast<int>(worst_latency_s * 1e3));
  for (const auto& emission : world.emissions()) EXPECT_LE(emission.length_s, emission.commanded_s);
  expect_painted_once(program, journal, world.emissions());
}

TEST(ExecutorTest, NothingIsEmittedAfterAStopWasAskedFor) {
  std::mt19937 random(7);
  for (int round = 0; round < 20; ++round) {
    WitnessedCell world(0.02);
    const auto program = small_program(200);
    Journal journal = Journal::in_memory(200);
    std::thread painter([&] { world.paint(program, journal); });
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 20000));
    request_stop(world.cell(), world.control);
    const double stopped_s = world.cell().clock.now_s();
    painter.join();
    for (const auto& emission : world.emissions()) {
      ASSERT_LE(emission.start_s, stopped_s);
      ASSERT_LE(emission.start_s + emission.length_s, stopped_s + 1e-6);
    }
    ASSERT_LE(journal.in_doubt().size(), 1u);
  }
}

TEST(ExecutorTest, AStopBeforeTheRunLetsNothingBegin) {
  WitnessedCell world;
  const auto program = small_program(10);
  Journal journal = Journal::in_memory(10);
  world.control.stop = true;
  EXPECT_EQ(world.paint(program, journal).outcome, ExecutionOutcome::kStopped);
  EXPECT_TRUE(world.emissions().empty());
  EXPECT_TRUE(journal.in_doubt().empty());
}

TEST(ExecutorTest, AnOpenInterlockEndsTheRunInTheDark) {
  WitnessedCell world;
  const auto program = small_program(100);
  Journal journal = Journal::in_memory(100);
  const auto result = world.paint(program, journal, [&](std::size_t done) {
    if (done == 40) world.sim().set_interlock_closed(false);
  });
  EXPECT_EQ(result.outcome, ExecutionOutcome::kFailed);
  EXPECT_NE(result.reason.find("interlock"), std::string::npos) << result.reason;
  EXPECT_EQ(world.emissions().size(), 40u);
  world.sim().set_interlock_closed(true);
  world.recover();
  EXPECT_EQ(world.paint(program, journal).outcome, ExecutionOutcome::kFinished);
  expect_painted_once(program, journal, world.emissions());
}

TEST(ExecutorTest, AnInterlockOpenedInAPulseLeavesThatDotInDoubt) {
  WitnessedCell world(0.05);
  auto program = small_program(60);
  for (auto& exposure : program.exposures) exposure.pulse_s = .05f;
  Journal journal = Journal::in_memory(60);
  std::thread guard([&] {
    while (!world.cell().laser.status().is_emitting) std::this_thread::yield();
    world.sim().set_interlock_closed(false);
  });
  const auto result = world.paint(program, journal);
  guard.join();
  EXPECT_EQ(result.outcome, ExecutionOutcome::kFailed);
  EXPECT_LE(journal.in_doubt().size(), 1u);
  expect_painted_once(program, journal, world.emissions());
}

TEST(ExecutorTest, RefusesWhatIsOutsideTheLimits) {
  const auto expect_refused = [](const char* what, auto change) {
    WitnessedCell world;
    auto program = small_program(20);
    change(program);
    Journal journal = Journal::in_memory(20);
    const auto result = world.paint(program, journal);
    EXPECT_EQ(result.outcome, ExecutionOutcome::kFailed) << what;
    EXPECT_TRUE(result.is_program_at_fault) << what << ": " << result.reason;
    EXPECT_EQ(journal.done_count(), 10u) << what;
    EXPECT_EQ(world.emissions().size(), 10u) << what;
    EXPECT_TRUE(journal.in_doubt().empty()) << what;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  expect_refused("j1", [](ExposureProgram& program) { program.exposures[10].joints[kJ1] = 3; });
  expect_refused("j3", [](ExposureProgram& program) { program.exposures[10].joints[kJ3] = -.01; });
  expect_refused("c", [](ExposureProgram& program) { program.exposures[10].joints[kRotation] = 1e6; });
  expect_refused("no number", [nan](ExposureProgram& program) { program.exposures[10].joints[kTilt] = nan; });
  expect_refused("via", [](ExposureProgram& program) {
    program.vias.insert(program.vias.begin(), {10, Joints{9, 0, 0, 0, 0, 0}});
  });
  expect_refused("power", [](ExposureProgram& program) { program.exposures[10].power_w = 5; });
  expect_refused("pulse", [](ExposureProgram& program) { program.exposures[10].pulse_s = 1; });
  expect_refused("no pulse", [nan](ExposureProgram& program) {
    program.exposures[10].pulse_s = static_cast<float>(nan);
  });
}

TEST(ExecutorTest, AFaultReportedByADeviceIsToldInItsWords) {
  WitnessedCell world;
  const auto program = small_program(100);
  Journal journal = Journal::in_memory(100);
  const auto result = world.paint(program, journal, [&](std::size_t done) {
    if (done == 10) world.sim().fail_table("overload on axis C");
  });
  EXPECT_EQ(result.outcome, ExecutionOutcome::kFailed);
  EXPECT_NE(result.reason.find("overload on axis C"), std::string::npos) << result.reason;
  expect_painted_once(program, journal, world.emissions());
}

TEST(ExecutorTest, RefusesACellThatIsNotReady) {
  const CellDescription description = small_cell();
  SimCell sim(description);
  const auto program = small_program(5);
  Journal journal = Journal::in_memory(5);
  ExecutionControl control;
  const auto result = execute(program, {}, sim.cell(), description, journal, control);
  EXPECT_EQ(result.outcome, ExecutionOutcome::kFailed);
  EXPECT_FALSE(result.is_program_at_fault);
}

TEST(ExecutorTest, TravelsInTheDarkWithoutAnArmedLaser) {
  WitnessedCell world;
  world.cell().laser.disable();
  const Joints goal{.2, .3, .2, 1, .1, 1};
  const auto result = travel({{.4, .4, .2, 0, 0, 0}, goal}, world.cell(), world.description, world.control);
  EXPECT_EQ(result.outcome, ExecutionOutcome::kFinished) << result.reason;
  EXPECT_EQ(key_of(world.sim().joints()), key_of(goal));
  EXPECT_TRUE(world.emissions().empty());
}

}  // namespace
}  // namespace hilbrush
