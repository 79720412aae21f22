#include <gtest/gtest.h>

#include <cstdlib>
#include <deque>
#include <optional>
#include <random>
#include <utility>

#include "tests/daemon/execution/faulty_cell.h"
#include "tests/daemon/execution/witnessed_cell.h"

/// Everything that can go wrong, at every place and at every phase of a dot, under virtual time.
namespace hilbrush {
namespace {

using test::expect_painted_once;
using test::Fault;
using test::FaultyAxes;
using test::FaultyLaser;
using test::JumpingClock;
using test::Kind;
using test::Place;
using test::small_program;
using test::WitnessedCell;

/// Strikes at the `call`-th call of `place`.
Fault fault_at(Place place, Kind kind, int call) {
  Fault fault;
  fault.place = place;
  fault.kind = kind;
  fault.countdown = call;
  return fault;
}

/// Runs the program on a cell with one fault, then on one without; whatever the first run came to, the
/// witness must agree with the journal, and the rest must be painted. False if the fault never struck.
bool survives(Place place, Kind kind, int call, const ExposureProgram& program) {
  WitnessedCell world;
  const std::size_t count = program.exposures.size();
  Journal journal = Journal::in_memory(count);
  Fault fault = fault_at(place, kind, call);
  const Cell inner = world.cell();
  fault.open_interlock = [&] { world.sim().set_interlock_closed(false); };
  fault.stop = [&] { request_stop(inner, world.control); };
  FaultyAxes<4> robot(inner.robot, fault);
  FaultyAxes<2> table(inner.table, fault);
  FaultyLaser laser(inner.laser, fault);
  JumpingClock clock(inner.clock, fault);
  const auto result = world.paint_through({robot, table, laser, clock}, program, journal);
  if (!fault.has_struck) return false;
  EXPECT_FALSE(inner.laser.status().is_emitting);
  EXPECT_LE(journal.in_doubt().size(), 1u);
  EXPECT_EQ(result.outcome != ExecutionOutcome::kFinished, !result.reason.empty()) << result.reason;
  EXPECT_FALSE(result.is_program_at_fault);
  world.sim().set_interlock_closed(true);
  world.recover();
  const auto rest = world.paint_through(inner, program, journal);
  EXPECT_EQ(rest.outcome, ExecutionOutcome::kFinished) << rest.reason;
  EXPECT_EQ(journal.done_count() + journal.in_doubt().size(), count);
  expect_painted_once(program, journal, world.emissions());
  return true;
}

TEST(ExecutorFaultsTest, EveryKindAtEveryPlaceAndPhaseOfADot) {
  const auto program = small_program(60);  // with a table move after fifty
  int struck = 0;
  for (const Place place : test::kPlaces)
    for (const Kind kind : test::kKinds)
      for (int call = 1; call <= 24; ++call) {
        SCOPED_TRACE("place " + std::to_string(static_cast<int>(place)) + ", kind " +
                     std::to_string(static_cast<int>(kind)) + ", call " + std::to_string(call));
        struck += survives(place, kind, call, program);
        if (::testing::Test::HasFailure()) return;
      }
  EXPECT_GT(struck, 2500);
  RecordProperty("faults", struck);
}

TEST(ExecutorFaultsTest, RandomFaultsLaterInTheRun) {
  const bool is_long = std::getenv("HILBRUSH_LONG") != nullptr;
  const auto program = small_program(120);
  int struck = 0;
  for (unsigned seed = 1; seed <= (is_long ? 200000u : 2000u); ++seed) {
    std::mt19937 random(seed);
    const Place place = test::kPlaces[random() % std::size(test::kPlaces)];
    const Kind kind = test::kKinds[random() % std::size(test::kKinds)];
    const int call = 1 + static_cast<int>(random() % 400);
    SCOPED_TRACE("seed " + std::to_string(seed));
    struck += survives(place, kind, call, program);
    if (::testing::Test::HasFailure()) return;
  }
  RecordProperty("faults", struck);
  EXPECT_GT(struck, 500);
}

TEST(ExecutorFaultsTest, ALateAcknowledgementOfAPulseLeavesItsDotInDoubt) {
  WitnessedCell world;
  const auto program = small_program(20);
  Journal journal = Journal::in_memory(20);
  Fault fault = fault_at(Place::kFire, Kind::kThrowsLate, 8);
  FaultyLaser laser(world.cell().laser, fault);
  const auto result = world.paint_through({world.cell().robot, world.cell().table, laser, world.cell().clock},
                                          program, journal);
  EXPECT_EQ(result.outcome, ExecutionOutcome::kFailed);
  EXPECT_EQ(journal.in_doubt(), std::vector<std::size_t>{7});
  EXPECT_EQ(journal.done_count(), 7u);
}

TEST(ExecutorFaultsTest, AStaleInPositionIsNotBelieved) {
  WitnessedCell world;
  const auto program = small_program(40);
  Journal journal = Journal::in_memory(40);
  Fault fault = fault_at(Place::kRobotMove, Kind::kStalePosition, 10);
  FaultyAxes<4> robot(world.cell().robot, fault);
  const auto result = world.paint_through({robot, world.cell().table, world.cell().laser, world.cell().clock},
                                          program, journal);
  EXPECT_TRUE(fault.has_struck);
  EXPECT_EQ(result.outcome, ExecutionOutcome::kFinished) << result.reason;
  expect_painted_once(program, journal, world.emissions());
}

class AnAxisThatStandsElsewhere : public ::testing::TestWithParam<int> {};

/// Before, in or after a pulse, as the call falls.
TEST_P(AnAxisThatStandsElsewhere, IsAFaultAndSaysSo) {
  WitnessedCell world;
  const auto program = small_program(40);
  Journal journal = Journal::in_memory(40);
  Fault fault = fault_at(Place::kTableStatus, Kind::kElsewhere, GetParam());
  FaultyAxes<2> table(world.cell().table, fault);
  const auto result = world.paint_through({world.cell().robot, table, world.cell().laser, world.cell().clock},
                                          program, journal);
  EXPECT_EQ(result.outcome, ExecutionOutcome::kFailed);
  const bool is_reported =
      result.reason.find("the table says that it is in position but stands elsewhere") == 0 ||
      result.reason.find("the table left its position") == 0;
  EXPECT_TRUE(is_reported) << result.reason;
  expect_painted_once(program, journal, world.emissions());
}

INSTANTIATE_TEST_SUITE_P(Calls, AnAxisThatStandsElsewhere, ::testing::Range(20, 32));

/// A robot that takes way-points ahead, made of one that does not: the next move begins when the one before
/// has ended.
class BufferingRobot final : public Robot {
 public:
  BufferingRobot(Robot& robot, std::size_t look_ahead) : robot_(robot), look_ahead_(look_ahead) {}
  void connect() override { robot_.connect(); }
  void enable() override { robot_.enable(); }
  void home() override { robot_.home(); }
  void disable() noexcept override { robot_.disable(); }
  void clear_fault() override { robot_.clear_fault(); }
  std::size_t look_ahead() const override { return look_ahead_; }
  void prepare(const Positions&) override {
    EXPECT_TRUE(waiting_.empty()) << "a set-point is prepared only at rest";
    ++prepared;
  }
  void move_to(const Positions& target, double settle_s) override {
    if (!go_on()) {
      if (waiting_.size() >= look_ahead_) throw DriverError("the robot's queue is full");
      waiting_.emplace_back(target, settle_s);
      most_waiting = std::max(most_waiting, waiting_.size());
      return;
    }
    robot_.move_to(target, settle_s);
  }
  Status status() override {
    const bool is_last = go_on() || waiting_.empty();
    Status status = robot_.status();
    status.in_position = status.in_position && is_last && waiting_.empty();
    return status;
  }
  double expected_arrival_s() override { return robot_.expected_arrival_s(); }
  void stop() noexcept override {
    waiting_.clear();
    robot_.stop();
  }
  std::size_t most_waiting = 0;
  std::size_t prepared = 0;

 private:
  /// True if nothing is under way any more.
  bool go_on() {
    while (!waiting_.empty() && robot_.status().in_position) {
      const auto [target, settle_s] = waiting_.front();
      waiting_.pop_front();
      robot_.move_to(target, settle_s);
    }
    return waiting_.empty() && robot_.status().state == DeviceState::kReady;
  }

  Robot& robot_;
  const std::size_t look_ahead_;
  std::deque<std::pair<Positions, double>> waiting_;
};

/// Every tenth exposure is approached over three way-points of the arm alone, then one of the table.
ExposureProgram roundabout_program(std::size_t count) {
  ExposureProgram program = small_program(count);
  program.vias.clear();
  for (std::size_t i = 10; i < count; i += 10) {
    const auto at = static_cast<std::uint32_t>(i);
    Joints joints = program.exposures[i - 1].joints;
    for (int step = 0; step < 3; ++step) {
      joints[kJ3] += .02;
      program.vias.push_back({at, joints});
    }
    joints[kTilt] = program.exposures[i].joints[kTilt];
    joints[kRotation] = program.exposures[i].joints[kRotation] + .2;
    program.vias.push_back({at, joints});
  }
  return program;
}

TEST(ExecutorTest, HandsWayPointsAheadWhereOneChainMovesAlone) {
  const auto program = roundabout_program(100);
  double elapsed_s[2] = {};
  for (const std::size_t look_ahead : {0u, 2u}) {
    WitnessedCell world;
    Journal journal = Journal::in_memory(100);
    BufferingRobot robot(world.cell().robot, look_ahead);
    const auto result = world.paint_through(
        {robot, world.cell().table, world.cell().laser, world.cell().clock}, program, journal);
    ASSERT_EQ(result.outcome, ExecutionOutcome::kFinished) << result.reason;
    EXPECT_EQ(robot.most_waiting, look_ahead);
    EXPECT_GT(robot.prepared, 80u);
    expect_painted_once(program, journal, world.emissions());
    elapsed_s[look_ahead / 2] = result.elapsed_s;
  }
  EXPECT_NEAR(elapsed_s[0], elapsed_s[1], .05 * elapsed_s[0]) << "the same way";
}

/// Counts the targets that it is sent ahead, and that it moves there next.
class NotingTable final : public Table {
 public:
  explicit NotingTable(Table& table) : table_(table) {}
  void connect() override { table_.connect(); }
  void enable() override { table_.enable(); }
  void home() override { table_.home(); }
  void disable() noexcept override { table_.disable(); }
  void clear_fault() override { table_.clear_fault(); }
  void prepare(const Positions& target) override {
    EXPECT_TRUE(table_.status().in_position);
    EXPECT_NE(target, at_);
    ahead_ = target;
    ++prepared;
  }
  void move_to(const Positions& target, double settle_s) override {
    if (target != at_ && ahead_) followed += *std::exchange(ahead_, {}) == target;
    at_ = target;
    table_.move_to(target, settle_s);
  }
  Status status() override { return table_.status(); }
  double expected_arrival_s() override { return table_.expected_arrival_s(); }
  void stop() noexcept override { table_.stop(); }
  std::size_t prepared = 0;
  std::size_t followed = 0;

 private:
  Table& table_;
  Positions at_{};
  std::optional<Positions> ahead_;
};

TEST(ExecutorTest, TellsTheTableItsNextTargetAlthoughTheArmMovesAloneFirst) {
  const auto program = roundabout_program(60);
  WitnessedCell world;
  Journal journal = Journal::in_memory(60);
  NotingTable table(world.cell().table);
  const auto result = world.paint_through({world.cell().robot, table, world.cell().laser, world.cell().clock},
                                          program, journal);
  ASSERT_EQ(result.outcome, ExecutionOutcome::kFinished) << result.reason;
  EXPECT_EQ(table.followed, table.prepared);
  EXPECT_GE(table.followed, 5u);
  expect_painted_once(program, journal, world.emissions());
}

/// The power is there before the axes are.
class NotingLaser final : public Laser {
 public:
  explicit NotingLaser(Laser& laser) : laser_(laser) {}
  void connect() override { laser_.connect(); }
  Limits limits() override { return laser_.limits(); }
  void enable() override { laser_.enable(); }
  void disable() noexcept override { laser_.disable(); }
  void prepare(double power_w, double) override {
    EXPECT_FALSE(laser_.status().is_emitting);
    power_w_ = power_w;
  }
  void fire(double power_w, double pulse_s) override {
    EXPECT_EQ(power_w_, power_w);
    power_w_ = 0;
    laser_.fire(power_w, pulse_s);
  }
  bool off() noexcept override { return laser_.off(); }
  Status status() override { return laser_.status(); }
  void clear_fault() override { laser_.clear_fault(); }

 private:
  Laser& laser_;
  double power_w_ = 0;
};

TEST(ExecutorTest, TellsTheLaserItsNextPowerWhileTheAxesMove) {
  auto program = roundabout_program(40);
  for (std::size_t i = 0; i < 40; ++i) program.exposures[i].power_w *= i % 2 == 0 ? 1.f : .5f;
  WitnessedCell world;
  Journal journal = Journal::in_memory(40);
  NotingLaser laser(world.cell().laser);
  const auto result = world.paint_through({world.cell().robot, world.cell().table, laser, world.cell().clock},
                                          program, journal);
  ASSERT_EQ(result.outcome, ExecutionOutcome::kFinished) << result.reason;
  expect_painted_once(program, journal, world.emissions());
}

/// A table whose status is not received from the first pulse on, for a given time; it drifts meanwhile.
class UnheardTable final : public Table {
 public:
  UnheardTable(Cell cell, double unheard_s) : cell_(cell), unheard_s_(unheard_s) {}
  void connect() override {}
  void enable() override {}
  void home() override {}
  void disable() noexcept override { cell_.table.disable(); }
  void clear_fault() override {}
  void move_to(const Positions& target, double settle_s) override { cell_.table.move_to(target, settle_s); }
  Status status() override {
    const double now_s = cell_.clock.now_s();
    if (!heard_ && cell_.laser.status().is_emitting) {
      heard_ = cell_.table.status();
      heard_->read_s = now_s;
    }
    if (heard_ && now_s < heard_->read_s + unheard_s_) return *heard_;
    Status status = cell_.table.status();
    status.read_s = now_s;
    if (heard_) status.positions[0] += .01;
    return status;
  }
  double expected_arrival_s() override { return cell_.table.expected_arrival_s(); }
  void stop() noexcept override { cell_.table.stop(); }

 private:
  const Cell cell_;
  const double unheard_s_;
  std::optional<Status> heard_;
};

TEST(ExecutorTest, APulseIsNotBelievedByWhatWasKnownBeforeIt) {
  for (const double unheard_s : {.2, 1e6}) {
    auto program = small_program(10);
    for (auto& exposure : program.exposures) exposure.pulse_s = .05f;
    WitnessedCell world;
    Journal journal = Journal::in_memory(10);
    UnheardTable table(world.cell(), unheard_s);
    const auto result = world.paint_through(
        {world.cell().robot, table, world.cell().laser, world.cell().clock}, program, journal);
    EXPECT_EQ(result.outcome, ExecutionOutcome::kFailed);
    EXPECT_EQ(result.reason, unheard_s < 1 ? "the table left its position during a pulse"
                                           : "the table has sent no status for too long");
    EXPECT_EQ(journal.in_doubt(), std::vector<std::size_t>{0});
    EXPECT_EQ(journal.done_count(), 0u);
  }
}

TEST(ExecutorTest, AStopForgetsWhatWasHandedAhead) {
  const auto program = roundabout_program(60);
  for (int call = 1; call < 200; call += 3) {
    SCOPED_TRACE(call);
    WitnessedCell world;
    Journal journal = Journal::in_memory(60);
    Fault fault;
    fault.place = Place::kSleep;
    fault.kind = Kind::kStop;
    fault.countdown = call;
    const Cell inner = world.cell();
    BufferingRobot robot(inner.robot, 4);
    JumpingClock clock(inner.clock, fault);
    const Cell cell{robot, inner.table, inner.laser, clock};
    fault.stop = [&] { request_stop(cell, world.control); };
    const auto result = world.paint_through(cell, program, journal);
    if (!fault.has_struck) break;
    EXPECT_EQ(result.outcome, ExecutionOutcome::kStopped);
    const auto stopped_at = world.sim().joints();
    inner.clock.sleep_until(inner.clock.now_s() + 10);
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
      EXPECT_NEAR(world.sim().joints()[axis], stopped_at[axis], .5) << "it goes on moving";
    EXPECT_TRUE(robot.status().state == DeviceState::kReady);
    world.recover();
    const auto rest = world.paint_through(cell, program, journal);
    ASSERT_EQ(rest.outcome, ExecutionOutcome::kFinished) << rest.reason;
    expect_painted_once(program, journal, world.emissions());
  }
}

TEST(ExecutorTest, CountsItsOwnTimeOfEachDot) {
  WitnessedCell world(1);  // real time
  const auto program = small_program(20);
  Journal journal = Journal::in_memory(20);
  const auto result = world.paint(program, journal);
  ASSERT_EQ(result.outcome, ExecutionOutcome::kFinished) << result.reason;
  EXPECT_EQ(result.own_time.count(), 20u);
  EXPECT_GT(result.own_time.quantile_s(.5), 0);
  EXPECT_LT(result.own_time.quantile_s(.5), .02) << "the moves take more than twice as long";
}

}  // namespace
}  // namespace hilbrush
