#pragma once
#include <cstdint>

#include "sampling/base/progress.h"
#include "sampling/curve/surface_curve.h"
#include "sampling/dots/dots.h"
#include "sampling/tone/tone_field.h"

/// Adds dots where a placement has left holes (the thesis, section 7.1.1).
namespace hilbrush {

struct FillReport {
  std::uint64_t added = 0;
  std::uint64_t added_by_sweep =
      0;  ///< of these, in holes that the Voronoi diagram does not show (see below)
  int voronoi_rounds = 0;
};

/// Adds dots until no gap is larger than `largest_gap_pitches`. The gap at a surface point that asks for dots
/// is its distance to the nearest dot, in local pitches: pitch / sqrt(tone), where the tone is the smaller of
/// the asked tone at the point and of its mean over the disc from there to the nearest dot. So a disc of even
/// tone may be empty up to that radius, and noise finer than a pitch does not get dots. Dots on the far side
/// of a thin wall (normals more than 104 degrees apart) do not count. Surface without tone gets no dots.
///
/// As in the thesis, a global Voronoi diagram (Boost.Polygon) of the dots on the unit square gives the
/// centers of holes, the largest circle in space first; at most three rounds, as new dots make new holes. It
/// does not see across the cuts of the surface, nor components that have no map. So a sweep then halves
/// triangles until each piece is proved covered or gets a dot. The proof is exact for even tone; where the
/// tone varies, pieces below a quarter of a gap are judged by their mean tone.
///
/// Each new dot goes where the path grows least, next to dots near it; dots already there keep their order
/// and their level, and the sequence its pitch. On a sphere, 50,000 `centroid` dots get .1 % more for a gap
/// of 1, `jittered` ones 6 %. The same for any number of threads. The number of dots is bounded: a new dot is
/// at least .97 of the largest gap (at its tone) from all others. Cost: about 5 to 25 us a dot; ten times as
/// much on noise finer than a pitch.
/// @throws InputError if largest_gap_pitches is below .5: even a hexagonal grid has gaps of .62.
DotSequence fill_holes(const SurfaceCurve& curve, const ToneField& tone, DotSequence dots,
                       double largest_gap_pitches, FillReport* report = nullptr,
                       const Progress& progress = {});

}  // namespace hilbrush
