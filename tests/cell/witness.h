#pragma once
#include <string>
#include <vector>

#include "daemon/execution/journal.h"
#include "planner/cell_model/exposure_program.h"
#include "sim/devices/emission_record.h"

/// The safety invariants by the film's side alone: from the devices' own record of emissions, and what the
/// program wanted. The controller is asked for nothing but what it claims.
namespace hilbrush::test {

struct WitnessOptions {
  double joint_tolerance = 2e-5;  ///< rad or m: what quantized axes may be off
  /// Of a whole pulse: what a laser may be off before its driver objects, and rounding.
  double energy_tolerance = 6e-3;
  /// The longest light allowed beyond the wanted pulse: by default the resolution of a gate that counts
  /// milliseconds (its power makes up for it).
  double overrun_s = 1e-3;
};

struct Testimony {
  std::vector<int> light;      ///< how often each exposure's place was lit
  std::vector<bool> is_whole;  ///< lit once, in full length and power
  std::size_t in_motion = 0;   ///< emissions while an axis moved or had not settled
  std::size_t strays = 0;      ///< emissions at no exposure's place
  std::size_t too_long = 0;    ///< longer than the commanded pulse and the overrun
  double longest_overrun_s = 0;
};

Testimony hear_witness(const ExposureProgram& program, std::vector<Emission> emissions,
                       const WitnessOptions& options = {});

/// All invariants against what the journal claims; empty if they hold, else what is broken. A done dot was
/// lit once, in full; one in doubt at most once; one that remains never.
std::string broken_invariants(const ExposureProgram& program, const Journal& journal,
                              const std::vector<Emission>& emissions, const WitnessOptions& options = {});

}  // namespace hilbrush::test
