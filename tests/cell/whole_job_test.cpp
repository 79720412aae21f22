#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "sim/film/beam.h"
#include "tests/cell/wired_world.h"
#include "tests/cell/witness.h"

namespace hilbrush {
namespace {

using test::broken_invariants;
using test::small_job;
using test::WiredWorld;

/// The journal of a program that was painted from beginning to end.
Journal painted(WiredWorld& world, const ExposureProgram& program) {
  ExecutionControl control;
  world.recover(control);
  Journal journal = Journal::in_memory(program.exposures.size());
  const ExecutionResult result = execute(program, {}, world.cell(), world.description, journal, control);
  EXPECT_EQ(result.outcome, ExecutionOutcome::kFinished) << result.reason;
  EXPECT_EQ(result.exposed, program.exposures.size());
  return journal;
}

TEST(WholeJobTest, ASmallProgramThroughTheRealDrivers) {
  WiredWorld world(WiredWorld::quick(.05));
  const ExposureProgram program = small_job(world.description, 60);
  const Journal journal = painted(world, program);
  EXPECT_EQ(journal.done_count(), 60u);
  EXPECT_EQ("", broken_invariants(program, journal, world.emissions()));
  // Where the light was, by the simulated cell's own kinematics.
  const auto emissions = world.emissions();
  for (std::size_t i = 0; i < std::min(emissions.size(), program.exposures.size()); ++i) {
    const auto real = beam_from_joints(world.description, emissions[i].joints).focus_O;
    const auto wanted = beam_from_joints(world.description, program.exposures[i].joints).focus_O;
    EXPECT_LT((real - wanted).norm(), 10e-6) << "exposure " << i;
  }
}

/// Modbus RTU and SCPI on pseudo-terminals, through libmodbus and libserialport as on a real line. That
/// library must be made to take a pseudo-terminal for a serial port: see tests/support/preload, loaded in
/// front of this program.
TEST(WholeJobTest, OverSerialLines) {
  if (std::getenv("HILBRUSH_SERIAL_PRELOADED") == nullptr)
    GTEST_SKIP() << "needs LD_PRELOAD=libserial_over_pty.so and HILBRUSH_SERIAL_PRELOADED=1";
  WireOptions options = WiredWorld::quick(.1);
  options.is_table_serial = options.is_laser_serial = true;
  WiredWorld world(options);
  const ExposureProgram program = small_job(world.description, 40, 3, 8);
  const Journal journal = painted(world, program);
  EXPECT_EQ("", broken_invariants(program, journal, world.emissions()));
}

/// Axes by the shipped register maps.
TEST(WholeJobTest, ByRegisterMaps) {
  for (const auto table : {WireOptions::Table::kCia402, WireOptions::Table::kLeadshinePr}) {
    SCOPED_TRACE(static_cast<int>(table));
    WireOptions options = WiredWorld::quick(.1);
    options.table = table;
    WiredWorld world(options);
    const ExposureProgram program = small_job(world.description, 20, 4, 5);
    const Journal journal = painted(world, program);
    EXPECT_EQ("", broken_invariants(program, journal, world.emissions()));
  }
}

/// A laser whose gate is its own serial command, timed by the guard: as exact as a process can be, never in
/// motion.
TEST(WholeJobTest, ByASerialGate) {
  WireOptions options = WiredWorld::quick(1);
  options.laser = WireOptions::LaserHead::kCobolt;
  WiredWorld world(options);
  const ExposureProgram program = small_job(world.description, 6, 4, 5);
  painted(world, program);
  const auto testimony = test::hear_witness(program, world.emissions());
  EXPECT_EQ(testimony.in_motion, 0u);
  EXPECT_EQ(testimony.strays, 0u);
  for (std::size_t i = 0; i < program.exposures.size(); ++i)
    EXPECT_EQ(testimony.light[i], 1) << "exposure " << i;
}

}  // namespace
}  // namespace hilbrush
