#include "daemon/executor.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <random>
#include <thread>

#include "drivers/driver_error.h"
#include "sim/devices/sim_cell.h"
#include "tests/daemon/program_fixture.h"

namespace hilbrush {
namespace {

using test::small_cell;
using test::small_program;

/// A simulated cell and its witness.
class WitnessedCell {
 public:
  explicit WitnessedCell(double time_scale = 0)
      : description(small_cell(time_scale)), sim_(description, {.laser_start_delay_s = 0}) {
    sim_.set_emission_sink([this](const Emission& emission) {
      const std::lock_guard lock(mutex_);
      emissions_.push_back(emission);
    });
    bring_up(sim_.cell());
  }
  Cell cell() { return sim_.cell(); }
  SimCell& sim() { return sim_; }
  std::vector<Emission> emissions() const {
    const std::lock_guard lock(mutex_);
    return emissions_;
  }
  /// What an operator does after a stop or a fault.
  void recover(ExecutionControl& control) {
    control.stop = false;
    for (AxisGroup<4>* robot : {&sim_.cell().robot})
      if (robot->status().state == DeviceState::kFault) robot->clear_fault();
    if (sim_.cell().table.status().state == DeviceState::kFault) sim_.cell().table.clear_fault();
    if (sim_.cell().laser.status().state == DeviceState::kFault) sim_.cell().laser.clear_fault();
    bring_up(sim_.cell());
  }

  const CellDescription description;

 private:
  mutable std::mutex mutex_;
  std::vector<Emission> emissions_;
  SimCell sim_;
};

using JointsKey = std::array<long long, kAxisCount>;
JointsKey key_of(const Joints& joints) {
  JointsKey key{};
  for (std::size_t i = 0; i < kAxisCount; ++i) key[i] = std::llround(joints[i] * 1e10);
  return key;
}

/// The safety invariants, by the witness: no dot twice, all done dots once and in full, those in doubt at most once,
/// nothing else, never in motion.
void expect_painted_once(const ExposureProgram& program, const Journal& journal,
                         const std::vector<Emission>& emissions) {
  std::map<JointsKey, std::vector<Emission>> by_pose;
  for (const auto& emission : emissions) {
    EXPECT_FALSE(emission.is_moving) << "light in motion at " << emission.start_s << " s";
    by_pose[key_of(emission.joints)].push_back(emission);
  }
  for (std::size_t i = 0; i < program.exposures.size(); ++i) {
    const auto found = by_pose.find(key_of(program.exposures[i].joints));
    const std::size_t count = found == by_pose.end() ? 0 : found->second.size();
    switch (journal.state(i)) {
      case ExposureState::kDone:
        ASSERT_EQ(count, 1u) << "exposure " << i;
        EXPECT_DOUBLE_EQ(found->second[0].length_s, static_cast<double>(program.exposures[i].pulse_s))
            << "exposure " << i;
        EXPECT_DOUBLE_EQ(found->second[0].power_w, static_cast<double>(program.exposures[i].power_w))
            << "exposure " << i;
        break;
      case ExposureState::kInDoubt:
        ASSERT_LE(count, 1u) << "exposure " << i;
        break;
      default:
        ASSERT_EQ(count, 0u) << "exposure " << i;
    }
    if (found != by_pose.end()) by_pose.erase(found);
  }
  EXPECT_TRUE(by_pose.empty()) << by_pose.size() << " emissions belong to no exposure";
}

TEST(ExecutorTest, PaintsEveryDotOnce) {
  WitnessedCell world;
  const auto program = small_program(1000);
  Journal journal = Journal::in_memory(1000);
  ExecutionControl control;
  std::size_t told = 0;
  const auto result = execute(program, {}, world.cell(), world.description, journal, control,
                              [&](std::size_t done) { EXPECT_EQ(done, ++told); });
  EXPECT_EQ(result.outcome, ExecutionOutcome::kFinished) << result.reason;
  EXPECT_EQ(result.exposed, 1000u);
  EXPECT_EQ(told, 1000u);
  EXPECT_EQ(journal.done_count(), 1000u);
  EXPECT_GT(result.elapsed_s, 1000 * .025);
  expect_painted_once(program, journal, world.emissions());
  EXPECT_EQ(key_of(world.sim().joints()), key_of(program.vias.back().joints)) << "the way home";
}

TEST(ExecutorTest, AnEmptyProgramIsFinished) {
  WitnessedCell world;
  Journal journal = Journal::in_memory(0);
  ExecutionControl control;
  EXPECT_EQ(execute({}, {}, world.cell(), world.description, journal, control).outcome, ExecutionOutcome::kFinished);
}

TEST(ExecutorTest, PassesDotsOverInTheDark) {
  WitnessedCell world;
  const auto program = small_program(300);
  Journal journal = Journal::in_memory(300);
  for (std::size_t i : {0u, 7u, 100u, 101u, 102u, 299u}) {
    journal.arm(i);
    journal.doubt(i);
  }
  ExecutionControl control;
  const auto result = execute(program, {}, world.cell(), world.description, journal, control);
  EXPECT_EQ(result.outcome, ExecutionOutcome::kFinished) << result.reason;
  EXPECT_EQ(result.exposed, 294u);
  EXPECT_EQ(world.emissions().size(), 294u);
  expect_painted_once(program, journal, world.emissions());
}

TEST(ExecutorTest, PauseEndsBetweenTwoDotsAndTheRestFollows) {
  WitnessedCell world;
  const auto program = small_program(500);
  Journal journal = Journal::in_memory(500);
  ExecutionControl control;
  const auto paused = execute(program, {}, world.cell(), world.description, journal, control,
                              [&](std::size_t done) { control.pause = done == 123; });
  EXPECT_EQ(paused.outcome, ExecutionOutcome::kPaused);
  EXPECT_EQ(paused.exposed, 123u);
  EXPECT_TRUE(journal.in_doubt().empty());
  control.pause = false;
  const auto rest = execute(program, {world.sim().joints()}, world.cell(), world.description, journal, control);
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
  ExecutionControl control;
  std::size_t stops = 0;
  double worst_latency_s = 0;
  for (int round = 0; round < 1000; ++round) {
    const double after_s = moment_s(random);
    std::atomic<bool> ended{false};
    std::thread stopper([&] {
      std::this_thread::sleep_for(std::chrono::duration<double>(after_s));
      if (ended) return;
      const double asked_s = world.cell().clock.now_s();
      EXPECT_TRUE(request_stop(world.cell(), control));
      EXPECT_FALSE(world.cell().laser.status().is_emitting);
      worst_latency_s = std::max(worst_latency_s, world.cell().clock.now_s() - asked_s);
    });
    const auto result = execute(program, {}, world.cell(), world.description, journal, control);
    ended = true;
    stopper.join();
    ASSERT_NE(result.outcome, ExecutionOutcome::kFailed) << result.reason;
    if (result.outcome == ExecutionOutcome::kFinished) break;
    ++stops;
    ASSERT_LE(journal.in_doubt().size(), stops);
    world.recover(control);
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
    ExecutionControl control;
    std::thread painter([&] { execute(program, {}, world.cell(), world.description, journal, control); });
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 20000));
    request_stop(world.cell(), control);
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
  ExecutionControl control;
  control.stop = true;
  EXPECT_EQ(execute(program, {}, world.cell(), world.description, journal, control).outcome,
            ExecutionOutcome::kStopped);
  EXPECT_TRUE(world.emissions().empty());
  EXPECT_TRUE(journal.in_doubt().empty());
}

TEST(ExecutorTest, AnOpenInterlockEndsTheRunInTheDark) {
  WitnessedCell world;
  const auto program = small_program(100);
  Journal journal = Journal::in_memory(100);
  ExecutionControl control;
  const auto result = execute(program, {}, world.cell(), world.description, journal, control, [&](std::size_t done) {
    if (done == 40) world.sim().set_interlock_closed(false);
  });
  EXPECT_EQ(result.outcome, ExecutionOutcome::kFailed);
  EXPECT_NE(result.reason.find("interlock"), std::string::npos) << result.reason;
  EXPECT_EQ(world.emissions().size(), 40u);
  world.sim().set_interlock_closed(true);
  world.recover(control);
  EXPECT_EQ(execute(program, {}, world.cell(), world.description, journal, control).outcome,
            ExecutionOutcome::kFinished);
  expect_painted_once(program, journal, world.emissions());
}

TEST(ExecutorTest, AnInterlockOpenedInAPulseLeavesThatDotInDoubt) {
  WitnessedCell world(0.05);
  auto program = small_program(60);
  for (auto& exposure : program.exposures) exposure.pulse_s = .05f;
  Journal journal = Journal::in_memory(60);
  ExecutionControl control;
  std::thread guard([&] {
    while (!world.cell().laser.status().is_emitting) std::this_thread::yield();
    world.sim().set_interlock_closed(false);
  });
  const auto result = execute(program, {}, world.cell(), world.description, journal, control);
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
    ExecutionControl control;
    const auto result = execute(program, {}, world.cell(), world.description, journal, control);
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
  expect_refused("no pulse",
                 [nan](ExposureProgram& program) { program.exposures[10].pulse_s = static_cast<float>(nan); });
}

/// Which call of which device fails, counted from one; or, for the laser's off, goes unconfirmed.
struct ScriptedFault {
  enum class Where {
    kRobotMove,
    kTableMove,
    kRobotStatus,
    kTableStatus,
    kArrival,
    kFire,
    kLaserStatus,
    kOffUnconfirmed
  } where;
  int countdown = 0;

  bool strikes(Where here) { return here == where && --countdown == 0; }
  void strike(Where here) {
    if (strikes(here)) throw DriverError("the device does not answer");
  }
};
using Where = ScriptedFault::Where;

template <std::size_t N>
class FaultyAxes final : public AxisGroup<N> {
 public:
  FaultyAxes(AxisGroup<N>& axes, ScriptedFault& fault) : axes_(axes), fault_(fault) {}
  void connect() override { axes_.connect(); }
  void enable() override { axes_.enable(); }
  void home() override { axes_.home(); }
  void disable() noexcept override { axes_.disable(); }
  void clear_fault() override { axes_.clear_fault(); }
  void move_to(const typename AxisGroup<N>::Positions& target, double settle_s) override {
    fault_.strike(N == 4 ? Where::kRobotMove : Where::kTableMove);
    axes_.move_to(target, settle_s);
  }
  typename AxisGroup<N>::Status status() override {
    fault_.strike(N == 4 ? Where::kRobotStatus : Where::kTableStatus);
    return axes_.status();
  }
  double expected_arrival_s() override {
    fault_.strike(Where::kArrival);
    return axes_.expected_arrival_s();
  }
  void stop() noexcept override { axes_.stop(); }

 private:
  AxisGroup<N>& axes_;
  ScriptedFault& fault_;
};

class FaultyLaser final : public Laser {
 public:
  FaultyLaser(Laser& laser, ScriptedFault& fault) : laser_(laser), fault_(fault) {}
  void connect() override { laser_.connect(); }
  Limits limits() override { return laser_.limits(); }
  void enable() override { laser_.enable(); }
  void disable() noexcept override { laser_.disable(); }
  void fire(double power_w, double pulse_s) override {
    fault_.strike(Where::kFire);
    laser_.fire(power_w, pulse_s);
  }
  bool off() noexcept override {
    const bool is_off = laser_.off();
    return is_off && !fault_.strikes(Where::kOffUnconfirmed);
  }
  Status status() override {
    fault_.strike(Where::kLaserStatus);
    return laser_.status();
  }
  void clear_fault() override { laser_.clear_fault(); }

 private:
  Laser& laser_;
  ScriptedFault& fault_;
};

TEST(ExecutorTest, ADeviceThatFailsAnywhereLeavesTheCellDarkAndAtMostOneDotInDoubt) {
  for (const Where where : {Where::kRobotMove, Where::kTableMove, Where::kRobotStatus, Where::kTableStatus,
                            Where::kArrival, Where::kFire, Where::kLaserStatus, Where::kOffUnconfirmed}) {
    for (int call = 1; call <= 40; ++call) {
      SCOPED_TRACE("place " + std::to_string(static_cast<int>(where)) + ", call " + std::to_string(call));
      WitnessedCell world;
      const auto program = small_program(60);
      Journal journal = Journal::in_memory(60);
      ExecutionControl control;
      ScriptedFault fault{where, call};
      const Cell inner = world.cell();
      FaultyAxes<4> robot(inner.robot, fault);
      FaultyAxes<2> table(inner.table, fault);
      FaultyLaser laser(inner.laser, fault);
      const auto result = execute(program, {}, {robot, table, laser, inner.clock}, world.description, journal, control);
      if (result.outcome == ExecutionOutcome::kFinished) {
        EXPECT_GT(fault.countdown, 0);
        continue;
      }
      EXPECT_EQ(result.outcome, ExecutionOutcome::kFailed);
      EXPECT_FALSE(result.is_program_at_fault);
      EXPECT_FALSE(result.reason.empty());
      EXPECT_FALSE(inner.laser.status().is_emitting);
      EXPECT_LE(journal.in_doubt().size(), 1u);
      world.recover(control);
      const auto rest = execute(program, {}, inner, world.description, journal, control);
      ASSERT_EQ(rest.outcome, ExecutionOutcome::kFinished) << rest.reason;
      expect_painted_once(program, journal, world.emissions());
    }
  }
}

TEST(ExecutorTest, AFaultReportedByADeviceIsToldInItsWords) {
  WitnessedCell world;
  const auto program = small_program(100);
  Journal journal = Journal::in_memory(100);
  ExecutionControl control;
  const auto result = execute(program, {}, world.cell(), world.description, journal, control, [&](std::size_t done) {
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
  ExecutionControl control;
  const Joints goal{.2, .3, .2, 1, .1, 1};
  const auto result = travel({{.4, .4, .2, 0, 0, 0}, goal}, world.cell(), world.description, control);
  EXPECT_EQ(result.outcome, ExecutionOutcome::kFinished) << result.reason;
  EXPECT_EQ(key_of(world.sim().joints()), key_of(goal));
  EXPECT_TRUE(world.emissions().empty());
}

}  // namespace
}  // namespace hilbrush
