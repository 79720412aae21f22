#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "sampling/dots/dots.h"

/// How long the path along dots is.
namespace hilbrush {

/// The dots of one component, within it.
struct ComponentPath {
  std::uint64_t dot_count = 0;
  double painted_area_m2 = 0;
  double path_length_m = 0;
  double path_constant = 0;  ///< path_length / sqrt(dot_count * painted_area); 0 with fewer than two dots
};

/// What placing dots has measured.
struct SampleReport {
  double painted_area_m2 = 0;                 ///< of the pieces of triangles that ask for dots
  double path_length_m = 0;                   ///< along the dots, in order, jumps between components included
  double path_constant = 0;                   ///< path_length / sqrt(count * painted area)
  std::size_t patch_count = 0;                ///< leaves of the quadtree that were visited
  std::vector<std::size_t> patches_at_depth;  ///< the same by depth below the square
  std::vector<ComponentPath> components;      ///< as SurfaceCurve::components(); empty for laminar slices
};

/// Measures the path along dots that come one after another: of all, and within each component that the
/// report lists.
class PathMeter {
 public:
  /// Keeps a reference to `report` and sets its counts and lengths back to zero.
  explicit PathMeter(SampleReport& report);

  void follow(std::span<const Dot> dots);
  /// Derives the constants, after the last dot; the painted areas must be in the report by then.
  void finish();

 private:
  SampleReport& report_;
  std::uint64_t count_ = 0;
  Eigen::Vector3d last_O_ = Eigen::Vector3d::Zero();
  std::uint32_t last_component_ = 0;
};

}  // namespace hilbrush
