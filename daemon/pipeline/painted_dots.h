#pragma once
#include <cstdint>
#include <span>

#include "daemon/pipeline/report.h"
#include "planner/cell_model/exposure_program.h"
#include "sim/devices/emission_record.h"
#include "sim/film/film.h"

/// Which exposures of a program were really made, by the record of the simulated laser. The reported counts
/// come from this record, not from the program.
namespace hilbrush {

struct PaintedDots {
  std::uint64_t exposed = 0;   ///< emitted in full at least once
  std::uint64_t in_doubt = 0;  ///< emitted only in part
  std::uint64_t repeated = 0;  ///< emitted in full more than once
  std::uint64_t foreign = 0;   ///< emissions that match no exposure
  HitFigures hits;             ///< of the emissions that match one
};

/// Matches each emission, in any order, to the exposure with the nearest joints, within the in-position
/// windows of real axes (half a milliradian, 50 micrometers). Cost O(n log n), and for each emission the
/// number of exposures within half a milliradian of its J1.
PaintedDots match_emissions(const ExposureProgram& program, std::span<const Emission> emissions,
                            std::span<const Hit> hits);

}  // namespace hilbrush
