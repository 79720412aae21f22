#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <map>
#include <random>
#include <string>
#include <thread>

#include "daemon/execution/executor.h"
#include "drivers/driver_error.h"
#include "tests/cell/fault_plan.h"
#include "tests/cell/virtual_cell.h"
#include "tests/cell/wired_world.h"
#include "tests/cell/witness.h"

/// Faults of every kind in every phase of a dot. Whatever happens: no dot is lit twice, no light while an
/// axis moves, no pulse longer than its bound, no hang; each job ends painted, or stopped and resumable with
/// true counts. Every case follows from its number: run one alone with HILBRUSH_CASE=number.
namespace hilbrush {
namespace {

using test::broken_invariants;
using test::described;
using test::random_fault;
using test::VirtualCell;
using test::WiredWorld;

constexpr std::size_t kDots = 12;
constexpr double kDriftUnseen = 1e-3;         ///< rad, m
constexpr double kDriftUnseenOnWires = 3e-3;  ///< all of one there: see in_wall_time()

/// [first, end) of the cases to run.
std::pair<unsigned, unsigned> cases(unsigned slice, unsigned whole) {
  if (const char* one = std::getenv("HILBRUSH_CASE")) {
    const auto number = static_cast<unsigned>(std::atoi(one));
    return {number, number + 1};
  }
  return {0, std::getenv("HILBRUSH_LONG") != nullptr ? whole : slice};
}

/// The cell of a case, with or without wires.
class CampaignWorld {
 public:
  virtual ~CampaignWorld() = default;
  virtual Cell cell() = 0;
  virtual std::vector<Emission> emissions() = 0;
  virtual void add(const WireFault& fault) = 0;
  virtual bool is_emitting() = 0;
  virtual std::uint64_t faults_begun() = 0;
  /// Calls `stop` once, this many cell seconds from now, on the thread that lets time pass.
  virtual void stop_later(double after_s, std::function<void()> stop) = 0;
  /// What stop_later() was given has been called, or never will be.
  virtual void forget_stop() = 0;
  /// How long a case may take, in cell seconds: twelve dots take two; faults and patience the rest.
  virtual double patience_s() const = 0;
  /// How far an axis may drift without anybody's seeing it in time.
  virtual double drift_unseen() const = 0;
  /// Where the robot itself loses the queued end of a pulse (an alarm; a refusal or a lost connection between
  /// on and off): from there until its controller has seen that and turned the light off by another way.
  virtual double lost_end_s() const = 0;
};

class VirtualWorld final : public CampaignWorld {
 public:
  explicit VirtualWorld(const CellDescription& description) : cell_(description, options()) {}
  static WireOptions options() {
    WireOptions options;
    options.start_delay_s = .5;
    return options;
  }
  Cell cell() override { return cell_.cell(); }
  std::vector<Emission> emissions() override { return cell_.emissions; }
  void add(const WireFault& fault) override { cell_.devices.faults().add(fault); }
  bool is_emitting() override { return cell_.devices.cell().is_emitting(); }
  std::uint64_t faults_begun() override { return cell_.devices.faults().begun_count(); }
  void stop_later(double after_s, std::function<void()> stop) override {
    cell_.clock.on_time = [this, stop, due_s = cell_.clock.now_s() + after_s, has_stopped = false]() mutable {
      if (has_stopped || cell_.clock.now_s() < due_s) return;
      has_stopped = true;
      stop();
    };
  }
  void forget_stop() override { cell_.clock.on_time = {}; }
  double patience_s() const override { return 300; }
  double drift_unseen() const override { return kDriftUnseen; }
  /// Here asking for a status waits for a device that is late, unlike in real drivers: two patiences of the
  /// link.
  double lost_end_s() const override { return .25; }

 private:
  VirtualCell cell_;
};

class WorldOnWires final : public CampaignWorld {
 public:
  static constexpr double kTimeScale = .05;
  WorldOnWires() : world_(WiredWorld::quick(kTimeScale)) {}
  Cell cell() override { return world_.cell(); }
  std::vector<Emission> emissions() override { return world_.emissions(); }
  void add(const WireFault& fault) override {
    world_.wire().add_fault(test::in_wall_time(fault, kTimeScale));
  }
  bool is_emitting() override {
    bool is_lit = false;
    world_.wire().act([&](TrueCell& cell) { is_lit = cell.is_emitting(); });
    return is_lit;
  }
  std::uint64_t faults_begun() override { return world_.wire().faults_begun(); }
  void stop_later(double after_s, std::function<void()> stop) override {
    stopper_ = std::thread([after_s, stop] {
      std::this_thread::sleep_for(std::chrono::duration<double>(after_s * kTimeScale));
      stop();
    });
  }
  void forget_stop() override {
    if (stopper_.joinable()) stopper_.join();
  }
  double patience_s() const override { return 60 / kTimeScale; }
  double drift_unseen() const override { return kDriftUnseenOnWires; }
  /// Wall time, as the cell's clock counts it.
  double lost_end_s() const override { return .3 / kTimeScale; }
  const CellDescription& description() const { return world_.description; }

 private:
  WiredWorld world_;
  std::thread stopper_;
};

struct Tally {
  unsigned cases = 0;
  unsigned painted_at_once = 0;
  unsigned painted_later = 0;
  unsigned stops = 0;
  unsigned in_doubt = 0;
  std::uint64_t faults = 0;
  double worst_s = 0;
  double worst_overrun_s = 0;
};

/// One job with one or two faults, and now and then an operator's stop, resumed until it is done.
class Case {
 public:
  Case(unsigned number, CampaignWorld& world, const CellDescription& description)
      : random_(number),
        description_(description),
        program_(test::small_job(description, kDots, 1 + number % 50, 4)),
        world_(world),
        journal_(Journal::in_memory(kDots)),
        witness_{.joint_tolerance = world.drift_unseen()} {}
  ~Case() { world_.forget_stop(); }
  Case(const Case&) = delete;
  Case& operator=(const Case&) = delete;
  void run(Tally& tally);

 private:
  void order_faults();
  /// What an operator does: clears, arms, until the fault has gone.
  bool recover();
  ExecutionResult paint();

  std::mt19937 random_;
  const CellDescription& description_;
  const ExposureProgram program_;
  CampaignWorld& world_;
  Journal journal_;
  ExecutionControl control_;
  std::string story_;
  /// An axis that drifts a little is still in position: within what counts as that, and what passes before it
  /// is seen.
  test::WitnessOptions witness_;
};

void Case::order_faults() {
  const unsigned fault_count = 1 + random_() % 2;
  for (unsigned i = 0; i < fault_count; ++i) {
    const WireFault fault = random_fault(random_, kDots);
    story_ += described(fault) + "\n";
    world_.add(fault);
    const bool may_lose_end = is_of_exchange(fault.kind) || fault.kind == WireFaultKind::kDeviceAlarm;
    if (may_lose_end && fault.device == WireDevice::kRobot) witness_.overrun_s = world_.lost_end_s();
  }
  if (random_() % 8 != 0) return;
  const double after_s = static_cast<double>(random_() % 1000) * 1e-3;
  story_ += "a stop after " + std::to_string(after_s) + " s\n";
  world_.stop_later(after_s, [this] { request_stop(world_.cell(), control_); });
}

bool Case::recover() {
  constexpr int kAttempts = 400;
  if (control_.stop.load())
    world_.forget_stop();  // as in the daemon: nothing is cleared while a stop is under way
  control_.stop = false;
  const Cell cell = world_.cell();
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    try {
      if (cell.laser.status().state == DeviceState::kFault) cell.laser.clear_fault();
      if (cell.robot.status().state == DeviceState::kFault) cell.robot.clear_fault();
      if (cell.table.status().state == DeviceState::kFault) cell.table.clear_fault();
      bring_up(cell);
      // A pulse whose end the laser has not confirmed yet is not over.
      if (cell.laser.status().state == DeviceState::kReady) return true;
    } catch (const DriverError& error) {
      story_ += attempt < 5 ? std::string("recovering: ") + error.what() + "\n" : "";
    }
    cell.clock.sleep_until(cell.clock.now_s() + .1);
  }
  return false;
}

ExecutionResult Case::paint() {
  const auto robot = world_.cell().robot.status().positions;
  const auto table = world_.cell().table.status().positions;
  const Joints here{robot[0], robot[1], robot[2], robot[3], table[0], table[1]};
  return execute(program_, {here}, world_.cell(), description_, journal_, control_);
}

void Case::run(Tally& tally) {
  ASSERT_TRUE(recover()) << story_;
  order_faults();
  const double begun_s = world_.cell().clock.now_s();
  for (int round = 0; round < 30; ++round) {
    const ExecutionResult result = paint();
    story_ += "run " + std::to_string(round) + ": " + (result.reason.empty() ? "done" : result.reason) + "\n";
    ASSERT_FALSE(result.is_program_at_fault) << story_;
    ASSERT_EQ("", broken_invariants(program_, journal_, world_.emissions(), witness_)) << story_;
    ASSERT_FALSE(world_.is_emitting()) << "light after the run ended\n" << story_;
    const double took_s = world_.cell().clock.now_s() - begun_s;
    tally.worst_s = std::max(tally.worst_s, took_s);
    ASSERT_LT(took_s, world_.patience_s()) << "hangs\n" << story_;
    if (result.outcome == ExecutionOutcome::kFinished) {
      ++(round == 0 ? tally.painted_at_once : tally.painted_later);
      break;
    }
    ASSERT_FALSE(result.reason.empty());
    ++tally.stops;
    ASSERT_TRUE(recover()) << "cannot be resumed\n" << story_;
  }
  ++tally.cases;
  tally.faults += world_.faults_begun();
  tally.in_doubt += static_cast<unsigned>(journal_.in_doubt().size());
  const auto testimony = test::hear_witness(program_, world_.emissions(), witness_);
  tally.worst_overrun_s = std::max(tally.worst_overrun_s, testimony.longest_overrun_s);
  ASSERT_EQ(journal_.done_count() + journal_.in_doubt().size(), kDots) << story_;
}

void tell(const Tally& tally) {
  std::printf(
      "%u cases, %llu faults begun: %u painted at once, %u after resuming; %u stops, %u dots in doubt\n"
      "longest case %.1f s of the cell, longest light beyond its pulse %.1f ms\n",
      tally.cases, static_cast<unsigned long long>(tally.faults), tally.painted_at_once, tally.painted_later,
      tally.stops, tally.in_doubt, tally.worst_s, tally.worst_overrun_s * 1e3);
}

TEST(FaultCampaign, UnderVirtualTime) {
  const CellDescription description = test::shipped_cell();
  const auto [first, end] = cases(2000, 10'000);
  Tally tally;
  for (unsigned number = first; number < end && !HasFatalFailure(); ++number) {
    SCOPED_TRACE("case " + std::to_string(number));
    VirtualWorld world(description);
    Case(number, world, description).run(tally);
  }
  tell(tally);
}

TEST(FaultCampaign, OnTheWire) {
  const auto [first, end] = cases(40, 1500);
  Tally tally;
  for (unsigned number = first; number < end && !HasFatalFailure(); ++number) {
    SCOPED_TRACE("case " + std::to_string(number));
    WorldOnWires world;
    Case(number, world, world.description()).run(tally);
  }
  tell(tally);
}

}  // namespace
}  // namespace hilbrush
