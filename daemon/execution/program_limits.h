#pragma once
#include <cstddef>
#include <stdexcept>

#include "drivers/laser.h"
#include "planner/cell_model/exposure_program.h"

/// Limits that are checked again just before they matter, independently of the planner. Pure functions, any
/// thread.
namespace hilbrush {

/// The program asks for something outside the limits: no device is at fault.
struct ProgramRefused : std::runtime_error {
  using std::runtime_error::runtime_error;
};

bool is_within_limits(const CellDescription& cell, const Joints& target);
/// @throws ProgramRefused naming the axis; `exposure` is named in the sentence.
void check_pose(const CellDescription& cell, const Joints& target, std::size_t exposure);
/// @throws ProgramRefused
void check_pulse(const Laser::Limits& limits, const Exposure& exposure, std::size_t i);

}  // namespace hilbrush
