#pragma once
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <mutex>
#include <vector>

#include "daemon/execution/executor.h"
#include "daemon/execution/journal.h"
#include "sim/devices/sim_cell.h"
#include "tests/daemon/execution/program_fixture.h"

/// The safety invariants as a witness sees them: what the simulated laser really emitted against what the
/// journal says.
namespace hilbrush::test {

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
  void recover() {
    control.stop = false;
    if (sim_.cell().robot.status().state == DeviceState::kFault) sim_.cell().robot.clear_fault();
    if (sim_.cell().table.status().state == DeviceState::kFault) sim_.cell().table.clear_fault();
    if (sim_.cell().laser.status().state == DeviceState::kFault) sim_.cell().laser.clear_fault();
    bring_up(sim_.cell());
  }

  ExecutionResult paint(const ExposureProgram& program, Journal& journal,
                        const ExecutionProgress& progress = {}) {
    return execute(program, {}, cell(), description, journal, control, progress);
  }
  /// The same through other devices, which stand before those of the simulated cell.
  ExecutionResult paint_through(const Cell& devices, const ExposureProgram& program, Journal& journal) {
    return execute(program, {}, devices, description, journal, control);
  }

  const CellDescription description;
  ExecutionControl control;

 private:
  mutable std::mutex mutex_;
  std::vector<Emission> emissions_;
  SimCell sim_;
};

using JointsKey = std::array<long long, kAxisCount>;
inline JointsKey key_of(const Joints& joints) {
  JointsKey key{};
  for (std::size_t i = 0; i < kAxisCount; ++i) key[i] = std::llround(joints[i] * 1e10);
  return key;
}

/// The safety invariants, by the witness: no dot twice, all done dots once and in full, those in doubt at
/// most once, nothing else, never in motion.
inline void expect_painted_once(const ExposureProgram& program, const Journal& journal,
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

}  // namespace hilbrush::test
