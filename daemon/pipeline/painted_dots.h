#pragma once
#include <cstdint>
#include <span>

#include "daemon/pipeline/report.h"
#include "planner/cell_model/exposure_program.h"
#include "sim/devices/emission_record.h"
#include "sim/film/film.h"

/// Which exposures of a program the simulated laser's own record shows as made: the witness against which counts are
/// reported.
namespace hilbrush {

struct PaintedDots {
  std::uint64_t exposed = 0;   ///< emitted once or more, at least once in full
  std::uint64_t in_doubt = 0;  ///< emitted only in part
  std::uint64_t repeated = 0;  ///< exposures emitted in full more than once
  std::uint64_t foreign = 0;   ///< emissions that fit no exposure
  HitFigures hits;             ///< of the emissions that fit
};

/// Each emission is matched to the exposure whose joints are nearest to its own, within what real axes are in position
/// by (half a milliradian, 50 micrometers), in whatever order they were made. Cost O(n log n) and, for each emission,
/// the exposures within half a milliradian of its J1.
PaintedDots match_emissions(const ExposureProgram& program, std::span<const Emission> emissions,
                            std::span<const Hit> hits);

}  // namespace hilbrush
