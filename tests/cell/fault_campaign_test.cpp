#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <map>
#include <random>
#include <string>

#include "daemon/executor.h"
#include "drivers/driver_error.h"
#include "tests/cell/fault_plan.h"
#include "tests/cell/virtual_cell.h"
#include "tests/cell/wired_world.h"
#include "tests/cell/witness.h"

/// Faults of every kind in every phase of a dot. Whatever happens: no dot is lit twice, no light while an axis moves,
/// no pulse longer than its bound, no hang; each job ends painted, or stopped and resumable with true counts. Every
/// case follows from its number: run one alone with HILBRUSH_CASE=number.
namespace hilbrush {
namespace {

using test::broken_invariants;
using test::described;
using test::random_fault;
using test::VirtualCell;

constexpr std::size_t kDots = 12;
constexpr double kAlarmSeenS = .15;
constexpr double kDriftUnseen = 1e-3;  ///< rad, m
constexpr double kOperatorS = .15;     ///< nobody is quicker to say go on

bool is_long() {
  return std::getenv("HILBRUSH_LONG") != nullptr;
}
/// [first, end) of the cases to run.
std::pair<unsigned, unsigned> cases(unsigned slice, unsigned whole) {
  if (const char* one = std::getenv("HILBRUSH_CASE")) {
    const auto number = static_cast<unsigned>(std::atoi(one));
    return {number, number + 1};
  }
  return {0, is_long() ? whole : slice};
}

struct Tally {
  std::map<std::string, unsigned> outcomes;
  unsigned faults = 0, stops = 0, in_doubt = 0;
};

/// One job with one or two faults on a virtual cell, resumed until it is done.
class VirtualCase {
 public:
  VirtualCase(unsigned number, const CellDescription& description)
      : random_(number),
        description_(description),
        program_(test::small_job(description, kDots, 1 + number % 50, 4)),
        world_(description, options()),
        journal_(Journal::in_memory(kDots)) {}

  void run(Tally& tally);

 private:
  static WireOptions options() {
    WireOptions options;
    options.start_delay_s = .5;
    return options;
  }
  /// What an operator does: clears, arms, until the fault has gone.
  bool recover();
  ExecutionResult paint();

  std::mt19937 random_;
  const CellDescription& description_;
  const ExposureProgram program_;
  VirtualCell world_;
  Journal journal_;
  ExecutionControl control_;
  std::string story_;
  /// An axis that drifts a little is still in position: within what counts as that, and what passes before it is seen.
  test::WitnessOptions witness_{.joint_tolerance = kDriftUnseen};
};

bool VirtualCase::recover() {
  control_.stop = false;
  world_.clock.sleep_until(world_.clock.now_s() + kOperatorS);
  for (int attempt = 0; attempt < 400; ++attempt) {
    try {
      const Cell cell = world_.cell();
      if (cell.laser.status().state == DeviceState::kFault) cell.laser.clear_fault();
      if (cell.robot.status().state == DeviceState::kFault) cell.robot.clear_fault();
      if (cell.table.status().state == DeviceState::kFault) cell.table.clear_fault();
      bring_up(cell);
      return true;
    } catch (const DriverError&) {
      world_.clock.sleep_until(world_.clock.now_s() + .1);
    }
  }
  return false;
}

ExecutionResult VirtualCase::paint() {
  const auto robot = world_.robot.status().positions;
  const auto table = world_.table.status().positions;
  const Joints here{robot[0], robot[1], robot[2], robot[3], table[0], table[1]};
  return execute(program_, {here}, world_.cell(), description_, journal_, control_);
}

void VirtualCase::run(Tally& tally) {
  ASSERT_TRUE(recover());
  const unsigned fault_count = 1 + random_() % 2;
  for (unsigned i = 0; i < fault_count; ++i) {
    const WireFault fault = random_fault(random_, kDots);
    story_ += described(fault) + "\n";
    world_.devices.faults().add(fault);
    // An alarm drops the queued end of a pulse: its light ends when the controller sees it.
    if (fault.kind == WireFaultKind::kDeviceAlarm && fault.device == WireDevice::kRobot)
      witness_.overrun_s = kAlarmSeenS;
  }
  // Now and then an operator stops the cell as well.
  const double stop_s = random_() % 8 == 0 ? static_cast<double>(random_() % 1000) * 1e-3 : 1e9;
  world_.clock.on_time = [this, stop_at_s = world_.clock.now_s() + stop_s, has_stopped = false]() mutable {
    if (has_stopped || world_.clock.now_s() < stop_at_s) return;
    has_stopped = true;
    request_stop(world_.cell(), control_);
  };
  SCOPED_TRACE(story_);
  constexpr double kLongestS = 300;  // of the cell: twelve dots take two, faults and patience the rest
  const double begun_s = world_.clock.now_s();
  for (int round = 0; round < 30; ++round) {
    const ExecutionResult result = paint();
    ASSERT_FALSE(result.is_program_at_fault) << result.reason;
    ASSERT_EQ("", broken_invariants(program_, journal_, world_.emissions, witness_)) << "after: " << result.reason;
    ASSERT_FALSE(world_.devices.cell().is_emitting()) << "light after the run ended: " << result.reason;
    ASSERT_LT(world_.clock.now_s() - begun_s, kLongestS) << "hangs";
    if (result.outcome == ExecutionOutcome::kFinished) {
      ++tally.outcomes[round == 0 ? "painted at once" : "painted after resuming"];
      break;
    }
    ASSERT_FALSE(result.reason.empty());
    ++tally.stops;
    ASSERT_TRUE(recover()) << "after: " << result.reason;
  }
  tally.faults += static_cast<unsigned>(world_.devices.faults().begun_count());
  tally.in_doubt += static_cast<unsigned>(journal_.in_doubt().size());
  ASSERT_EQ(journal_.done_count() + journal_.in_doubt().size(), kDots) << "not resumable";
}

TEST(FaultCampaign, UnderVirtualTime) {
  const CellDescription description = test::shipped_cell();
  const auto [first, end] = cases(1500, 10'000);
  Tally tally;
  for (unsigned number = first; number < end && !HasFatalFailure(); ++number) {
    SCOPED_TRACE("case " + std::to_string(number));
    VirtualCase(number, description).run(tally);
  }
  std::string text;
  for (const auto& [outcome, count] : tally.outcomes) text += std::to_string(count) + " " + outcome + ", ";
  std::printf("%u cases: %u faults begun, %s%u stops, %u dots in doubt\n", end - first, tally.faults, text.c_str(),
              tally.stops, tally.in_doubt);
}

}  // namespace
}  // namespace hilbrush
