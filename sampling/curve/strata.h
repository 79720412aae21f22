#pragma once
#include <vector>

#include "sampling/curve/patch_walk.h"

/// Stretches of the curve that hold the mass of one dot, and where in a patch a share of its mass ends.
namespace hilbrush {

/// A small bit of surface: its centre of mass and what it weighs.
struct Crumb {
  SurfacePoint centre;
  double mass = 0;
};

/// The share of a stratum on one sheet.
struct StratumPart {
  std::uint32_t sheet = 0;
  double mass = 0;
  Eigen::Vector3d moment_O = Eigen::Vector3d::Zero();  ///< mass times place
  std::vector<Crumb> crumbs;
};

struct Stratum {
  std::vector<StratumPart> parts;

  void clear() { parts.clear(); }
  bool is_empty() const { return parts.empty(); }
  /// The part with most mass: a stratum that spans two sheets puts its dot on one of them.
  const StratumPart& heaviest() const;
  /// Takes in what lies after it on the curve.
  void append(Stratum&& next);
};

/// Adds the stretch of a patch between two shares of its mass, 0 <= from <= to <= 1.
void add_stretch(Stratum& stratum, const TexturedMesh& mesh, const Patch& patch, double from, double to);

/// The surface point where the curve has passed `share` of the patch's mass, or, where that is blank, one nearby that
/// is not.
SurfacePoint point_at(const ToneField& tone, const Patch& patch, double share);

/// A point of the piece that asks for dots, by halving it towards its mass.
SurfacePoint point_with_tone(const ToneField& tone, Piece piece);

/// A point with tone in the patch's heaviest piece.
SurfacePoint point_in_heaviest(const ToneField& tone, const Patch& patch);

/// Integral of the Hilbert curve's place over its first `share`, in a unit square (z = 0).
Eigen::Vector3d hilbert_moment(HilbertQuad quad, double share);

}  // namespace hilbrush
