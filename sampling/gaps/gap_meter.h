#pragma once
#include <vector>

#include "sampling/curve/surface.h"
#include "sampling/gaps/dot_grid.h"
#include "sampling/tone/tone_field.h"

/// Measures the hole around a place; fill_holes.h defines a gap.
namespace hilbrush {

class GapMeter {
 public:
  /// Keeps references. `limit_m` is the largest gap in meters at tone 1; `darkest` the largest asked tone.
  GapMeter(const Surface& surface, const ToneField& tone, const DotGrid& grid, double limit_m,
           double darkest);

  double limit_m() const { return limit_; }
  /// The largest gap allowed where the tone is darkest, in meters.
  double strictest_m() const;

  struct Hole {
    SurfacePoint point;
    double size = 0;  ///< radius over the allowed one; 0: no hole
    double radius_m = 0;
  };
  /// The hole around a point that stands for all within `slack_m` of it. Thread-safe.
  Hole hole_at(const SurfacePoint& point, double slack_m) const;

  /// A point that stands for a piece of a triangle with this radius, which may not be covered.
  struct Suspect {
    SurfacePoint point;
    double radius_m = 0;
  };
  /// Halves the triangle until each piece is covered or small. Thread-safe.
  void find_suspects(std::uint32_t triangle, std::vector<Suspect>& suspects) const;

 private:
  using Corners = std::array<Eigen::Vector3d, 3>;  // barycentric

  /// Mean asked tone over the disc around a point.
  double mean_tone(const SurfacePoint& point, double radius_m) const;
  enum class Verdict { kCovered, kSuspect, kTooLarge };
  Verdict judge(std::uint32_t triangle, const Corners& corners, const SurfacePoint& center,
                double radius_m) const;

  const Surface& surface_;
  const ToneField& tone_;
  const DotGrid& grid_;
  double limit_, darkest_;
};

}  // namespace hilbrush
