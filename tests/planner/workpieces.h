#pragma once
#include <random>
#include <string>

#include "planner/plan.h"
#include "sampling/dots/dots.h"
#include "sampling/model/textured_mesh.h"

/// Small workpieces and dots for the tests of planning.
namespace hilbrush {

/// The shipped cell.
CellDescription default_cell();

/// A body of revolution around z from its outline (r, z), from the axis at the bottom round to the axis.
TexturedMesh revolve(const std::vector<std::array<double, 2>>& outline, int sides = 48);
/// Standing on z = 0.
TexturedMesh ball(double radius_m);
/// A cup of 50 mm with walls of 2 mm.
TexturedMesh small_cup();
/// A block of 40 x 40 mm (round, 40 mm high) with a hole of 8 mm width and 30 mm depth from above.
TexturedMesh drilled_block();

/// Dots all over the surface, in an order whose steps are short, with interpolated vertex normals.
DotSequence scatter(const TexturedMesh& mesh, double pitch_m, unsigned seed = 1);

}  // namespace hilbrush
