#include "sampling/quality/dots_on_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hilbrush {
namespace {

std::vector<Eigen::Vector3d> places_of(std::span<const Dot> dots) {
  std::vector<Eigen::Vector3d> places(dots.size());
  std::transform(dots.begin(), dots.end(), places.begin(), [](const Dot& dot) { return dot.position_O; });
  return places;
}

}  // namespace

DotsOnSurface::DotsOnSurface(const TexturedMesh& mesh, const Neighbors& neighbors, std::span<const Dot> dots)
    : tree_(places_of(dots)), triangles_(dots.size()), balls_([&] { return GrowingBall(mesh, neighbors); }) {
  std::transform(dots.begin(), dots.end(), triangles_.begin(), [](const Dot& dot) { return dot.triangle; });
}

double DotsOnSurface::distance(const Eigen::Vector3d& place_O, std::uint32_t triangle,
                               std::uint32_t but) const {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  GrowingBall& ball = balls_.local();
  ball.begin(place_O, triangle);
  const auto along = tree_.cheapest(place_O, [&](std::uint32_t dot, double straight2, double least2) {
    return dot == but ? kInfinity : std::max(straight2, ball.entry2(triangles_[dot], least2));
  });
  if (std::isfinite(along.distance)) return along.distance;
  return tree_.nearest(place_O, [but](std::uint32_t dot) { return dot != but; }).distance;
}

}  // namespace hilbrush
