#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "sampling/curve/surface.h"
#include "sampling/dots/dots.h"
#include "sampling/tone/tone_field.h"

/// Dots at points of triangles.
namespace hilbrush {

/// What the dots of one triangle take from it, prepared once for many dots.
class DotTriangle {
 public:
  DotTriangle() = default;
  DotTriangle(const Surface& surface, const ToneField& tone, std::uint32_t triangle);

  std::uint32_t triangle() const { return triangle_; }
  /// The asked tone.
  double asked(const Eigen::Vector3d& barycentric) const {
    return tone_.asked({barycentric[1], barycentric[2]});
  }
  /// The dot there, moved a hair inside the triangle. `asked` is the tone at `barycentric`, if it is known:
  /// it is used unless the dot was moved.
  Dot dot_at(const Eigen::Vector3d& barycentric, std::uint32_t component,
             std::optional<double> asked = {}) const;

 private:
  std::uint32_t triangle_ = kNoTriangle;
  std::array<Eigen::Vector3d, 3> corners_O_;
  DotSurface surface_;
  TriangleTone tone_;
};

/// A cache of triangles. What it returns depends on its argument alone.
class DotTriangles {
 public:
  DotTriangles(const Surface& surface, const ToneField& tone) : surface_(surface), tone_(tone) {}

  /// Valid until the next call.
  const DotTriangle& operator[](std::uint32_t triangle) {
    DotTriangle& slot = slots_[triangle % slots_.size()];
    if (slot.triangle() != triangle) slot = DotTriangle(surface_, tone_, triangle);
    return slot;
  }

 private:
  const Surface& surface_;
  const ToneField& tone_;
  std::array<DotTriangle, 128> slots_;
};

/// The dot at a surface point, moved a hair inside its triangle.
Dot make_dot(const Surface& surface, const ToneField& tone, const SurfacePoint& point,
             std::uint32_t component);

}  // namespace hilbrush
