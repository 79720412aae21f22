#pragma once
#include <cstddef>
#include <functional>

#include "planner/cell_model/exposure_program.h"

/// How long a whole program takes, by the time model.
namespace hilbrush {

/// Estimated seconds, by what they are spent on.
struct TimeSplit {
  double move_s = 0;
  double settle_s = 0;
  double expose_s = 0;
  double retract_s = 0;
  double total_s() const { return move_s + settle_s + expose_s + retract_s; }
};

/// Called after each exposure with what the program has taken so far.
using TimeVisitor = std::function<void(std::size_t exposure, const TimeSplit& so_far)>;

/// From home to home.
TimeSplit estimate_time(const CellDescription& cell, const ExposureProgram& program,
                        const TimeVisitor& visit = {});

/// A lower bound for any order and any poses: each exposure's shortest settling, its pulse and a move of one
/// control tick.
double least_time_s(const CellDescription& cell, const ExposureProgram& program);

}  // namespace hilbrush
