#pragma once
#include <functional>
#include <span>
#include <vector>

#include "sampling/curve/sheet.h"

/// The walk along the curve below the base tree: from a base quad to its patches, in order, made anew each time and
/// never stored.
namespace hilbrush {

/// When a quad is fine enough to be a patch.
struct PatchRule {
  double dot_mass = 1;  ///< m^2 of asked coverage that one dot stands for
  double omega = 4;     ///< 1/omega of a dot may be misplaced
};

/// A leaf quad clipped to the surface.
struct Patch {
  std::uint32_t sheet = 0;
  Box box;
  HilbertQuad quad;
  HilbertCube cube;
  bool is_in_space = false;
  bool is_uniform = false;  ///< its mass lies evenly on the square
  double mass = 0;
  std::span<const Piece> pieces;
  std::span<const ToneIntegral> integrals;  ///< of the pieces, with their masses scaled to sum to `mass`
};

using PatchVisitor = std::function<void(const Patch&)>;

/// Hands on the patches of a base quad that have mass, in order of the curve; their masses sum to `mass` (which is that
/// of the quad), so that nothing drifts. `pieces` are those of the quad. Cost O(patches); memory O(depth). After the
/// thesis, section 4.2 and equations 7.3, 7.4; differs: the deviation is exact and decides on the mass that may be
/// misplaced.
void walk_patches(const Sheet& sheet, std::uint32_t sheet_index, const BaseQuad& quad, const ToneField& tone,
                  const PatchRule& rule, double mass, const PatchVisitor& visit);

/// Total mass of a base quad.
double mass_of(const Sheet& sheet, const BaseQuad& quad, const ToneField& tone);

}  // namespace hilbrush
