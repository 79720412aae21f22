#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "planner/reach/reach.h"

/// The beam directions from which a dot can be hit, as a subset of directions in O that lie evenly over the
/// sphere: within the cone, beam and lens clear, and with some tilt, yaw and elbow that bring the beam there
/// with joints within their limits and quill, links and column clear. Thread-safe.
namespace hilbrush {

class BeamDirections {
 public:
  /// About `spacing` (rad) apart, a Fibonacci lattice.
  explicit BeamDirections(double spacing);

  std::size_t size() const { return directions_O_.size(); }
  const Eigen::Vector3d& operator[](std::size_t i) const { return directions_O_[i]; }

  /// Indices, in ascending order, of all directions that hit the target within acos(cos_least) of its smooth
  /// normal and within the cone of its face normal. Cost: some microseconds for each direction within the two
  /// cones.
  std::vector<std::uint32_t> that_hit(const Reach& reach, const Target& target, double cos_least) const;

 private:
  std::vector<Eigen::Vector3d> directions_O_;
};

}  // namespace hilbrush
