#pragma once
#include <functional>
#include <vector>

#include "sampling/curve/dot_block.h"

/// Patches as plain values, to show what the walk does in tests and pictures.
namespace hilbrush {

/// What a patch holds of one triangle.
struct PatchPiece {
  std::uint32_t triangle = 0;
  std::vector<Eigen::Vector2d> corners_b;  ///< second and third barycentric coordinate
  ToneIntegral integral;
};

/// A leaf quad (in space: cube) clipped to the surface.
struct Patch {
  std::uint32_t chart = 0;
  int depth = 0;
  PatchKind kind = PatchKind::kWhole;
  double at = 0, mass = 0;  ///< where on the curve it begins, and its mass
  std::vector<PatchPiece> pieces;
};

/// All patches with mass, in order of the curve, as if something were needed everywhere.
void visit_patches(const CurveMass& mass, const PatchRule& rule,
                   const std::function<void(const Patch&)>& visit);

/// All strata, as the stretches of patches that they are cut from: visit(stratum, patch, from, to), with
/// shares of the patch's mass. The same walk that places dots.
void visit_stretches(const CurveMass& mass, const SampleOptions& options,
                     const std::function<void(std::uint64_t, const Patch&, double, double)>& visit);

}  // namespace hilbrush
