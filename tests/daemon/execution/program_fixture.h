#pragma once
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <random>
#include <string>

#include "planner/cell_model/cell_description.h"
#include "planner/cell_model/exposure_program.h"
#include "sampling/base/angles.h"
#include "tests/support/temporary_folder.h"

/// Cells and programs small enough to reason about: no mesh, no planner; positions follow from nothing but
/// the joints.
namespace hilbrush::test {

inline CellDescription small_cell(double time_scale = 0) {
  CellDescription cell;
  cell.name = "small";
  cell.sha256 = std::string(64, 'c');
  const auto axis = [](double min, double max, double speed, double acceleration, double saturation,
                       double home) {
    return AxisDescription{min, max, speed, acceleration, saturation, home};
  };
  cell.axes[kJ1] = axis(-132 * kDegree, 132 * kDegree, 720 * kDegree, 8000 * kDegree, 10 * kDegree, 0.5);
  cell.axes[kJ2] = axis(-150 * kDegree, 150 * kDegree, 720 * kDegree, 14000 * kDegree, 10 * kDegree, 0.5);
  cell.axes[kJ3] = axis(0, .3, 1.1, 18, .02, .1);
  cell.axes[kJ4] = axis(-2 * std::numbers::pi, 2 * std::numbers::pi, 45, 430, .8, 0);
  cell.axes[kTilt] = axis(-.2, 1.8, 2, 20, .17, 0);
  cell.axes[kRotation] = axis(-60, 60, 4.7, 47, .26, 0);
  cell.laser.power_min_w = 1e-3;
  cell.laser.power_max_w = .2;
  cell.laser.pulse_min_s = 1e-3;
  cell.laser.pulse_max_s = .05;
  cell.laser.pulse_s = .005;
  cell.timing = {.tick_s = .004, .settle_min_s = .02, .settle_max_s = .12, .retract_s = .12, .message_s = 0};
  cell.simulation.time_scale = time_scale;
  return cell;
}

/// The i-th exposure of a program: a pulse of 5 ms at 10 mW.
inline Exposure small_exposure(std::size_t i, const Joints& joints) {
  Exposure exposure;
  exposure.position_O = {1e-3 * static_cast<double>(i % 100), 1e-3 * static_cast<double>(i / 100), .05};
  exposure.normal_O = {0, 0, 1};
  exposure.tone = .5f;
  exposure.power_w = .01f;
  exposure.pulse_s = .005f;
  exposure.energy_j = exposure.power_w * exposure.pulse_s;
  exposure.joints = joints;
  exposure.dot_index = static_cast<std::uint32_t>(i);
  return exposure;
}

/// Small steps of the arm, a table move every 50 exposures with two way-points before it, a way home. Each
/// exposure's joints are its own.
inline ExposureProgram small_program(std::size_t count, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> step(-.004, .004);
  ExposureProgram program;
  program.provenance = {std::string(64, 'a'), std::string(64, 'b'), std::string(64, 'c'), "test"};
  program.pitch_m = 254e-6;
  Joints at{.5, .5, .1, 0, 0, 0};
  for (std::size_t i = 0; i < count; ++i) {
    if (i % 50 == 0 && i > 0) {
      at[kJ3] = .15;
      program.vias.push_back({static_cast<std::uint32_t>(i), at});
      at[kRotation] += .3 * (i / 50 % 2 == 0 ? 1 : -1);
      at[kTilt] = .1 * static_cast<double>(i / 50 % 5);
      program.vias.push_back({static_cast<std::uint32_t>(i), at});
      at[kJ3] = .1;
    }
    for (const std::size_t axis : {kJ1, kJ2, kJ4}) at[axis] = std::clamp(at[axis] + step(random), -1.5, 1.5);
    at[kJ3] = std::clamp(at[kJ3] + .1 * step(random), .05, .14);
    program.exposures.push_back(small_exposure(i, at));
  }
  program.vias.push_back({static_cast<std::uint32_t>(count), Joints{.5, .5, .1, 0, 0, 0}});
  return program;
}

using testing_support::TemporaryFolder;

}  // namespace hilbrush::test
