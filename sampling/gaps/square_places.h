#pragma once
#include <optional>
#include <vector>

#include "sampling/curve/surface_curve.h"

/// Places of surface points on the unit squares through which the curve runs.
namespace hilbrush {

class SquarePlaces {
 public:
  /// Keeps a reference to `curve`. Cost O(triangles), 12 bytes each.
  explicit SquarePlaces(const SurfaceCurve& curve);

  std::uint32_t component(std::uint32_t triangle) const { return components_[triangle]; }

  struct Place {
    std::uint32_t chart = 0;
    Eigen::Vector2d place;  ///< x up to the chart's number of squares
  };
  /// None on a component that has no map.
  std::optional<Place> place(const SurfacePoint& point) const;

 private:
  const SurfaceCurve& curve_;
  std::vector<std::uint32_t> components_;
  /// Faces by triangle: faces_[first_[t]] .. faces_[first_[t + 1]].
  struct FaceIndex {
    std::uint32_t chart = 0;
    std::uint32_t face = 0;
  };
  std::vector<std::uint32_t> first_;
  std::vector<FaceIndex> faces_;
};

}  // namespace hilbrush
