#include <tbb/parallel_for.h>

#include <algorithm>

#include "sampling/base/check.h"
#include "sampling/quality/point_tree.h"
#include "sampling/quality/surface_quality.h"
#include "sampling/quality/test_shapes.h"

namespace hilbrush {
namespace {

using Eigen::Vector3d;
using Sets = std::span<const std::span<const Dot>>;

/// The triangles around each vertex, all lists in one vector.
struct Fans {
  std::vector<std::uint32_t> begin, triangles;

  explicit Fans(const TexturedMesh& mesh) : begin(mesh.vertices.size() + 1, 0) {
    for (const auto& triangle : mesh.triangles)
      for (const std::uint32_t v : triangle) ++begin[v + 1];
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) begin[v + 1] += begin[v];
    triangles.resize(begin.back());
    std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
    for (std::uint32_t t = 0; t < mesh.triangle_count(); ++t)
      for (const std::uint32_t v : mesh.triangles[t]) triangles[next[v]++] = t;
  }
  std::span<const std::uint32_t> around(std::uint32_t vertex) const {
    return std::span(triangles).subspan(begin[vertex], begin[vertex + 1] - begin[vertex]);
  }
};

/// The number of dots of each set on each triangle: that of set s on triangle t is at [t * set_count + s].
std::vector<std::uint32_t> count_on_triangles(std::size_t triangle_count, Sets sets) {
  std::vector<std::uint32_t> counts(triangle_count * sets.size(), 0);
  for (std::size_t s = 0; s < sets.size(); ++s)
    for (const Dot& dot : sets[s]) {
      CHECK_LT(dot.triangle, triangle_count);
      ++counts[dot.triangle * sets.size() + s];
    }
  return counts;
}

/// Grows sets of triangles; keeps its memory from one to the next.
class Grower {
 public:
  Grower(const SurfaceQuality::Implementation& surface, const Fans& fans)
      : surface_(surface),
        fans_(fans),
        taken_(surface.masses.size(), false),
        seen_(fans.begin.size() - 1, false) {}

  /// Calls take(triangle) ring by ring around `vertex`, until the mass reaches `wanted` or the component
  /// ends. Returns the mass.
  template <class Take>
  double grow(std::uint32_t vertex, double wanted, const Take& take) {
    queue_.assign(1, vertex);
    seen_[vertex] = true;
    double mass = 0;
    for (std::size_t head = 0; head < queue_.size() && mass < wanted; ++head)
      for (const std::uint32_t t : fans_.around(queue_[head])) {
        if (mass >= wanted) break;
        if (taken_[t]) continue;
        taken_[t] = true;
        order_.push_back(t);
        take(t);
        mass += surface_.masses[t];
        for (const std::uint32_t v : surface_.mesh.triangles[t]) {
          if (!seen_[v]) queue_.push_back(v);
          seen_[v] = true;
        }
      }
    for (const std::uint32_t t : order_) taken_[t] = false;
    for (const std::uint32_t v : queue_) seen_[v] = false;
    order_.clear();
    return mass;
  }

 private:
  const SurfaceQuality::Implementation& surface_;
  const Fans& fans_;
  std::vector<bool> taken_, seen_;
  std::vector<std::uint32_t> queue_, order_;
};

/// A random vertex that belongs to a triangle.
std::uint32_t random_vertex(const TexturedMesh& mesh, const Fans& fans, const ShapeNumbers& number) {
  for (unsigned attempt = 1; attempt + 1 < ShapeNumbers::kPerShape; ++attempt) {
    const auto v = static_cast<std::uint32_t>(number(attempt) * static_cast<double>(mesh.vertices.size()));
    if (!fans.around(v).empty()) return v;
  }
  return mesh.triangles[static_cast<std::size_t>(number(1) * static_cast<double>(mesh.triangle_count()))][0];
}

}  // namespace

std::vector<Discrepancy> SurfaceQuality::triangle_sets(Sets sets, const TestShapes& shapes) const {
  const Implementation& surface = *implementation_;
  const Fans fans(surface.mesh);
  const std::vector<std::uint32_t> counts = count_on_triangles(surface.mesh.triangle_count(), sets);
  std::vector<std::vector<double>> errors(sets.size(), std::vector<double>(shapes.count));

  constexpr std::size_t kShapesPerGrower = 16;
  tbb::parallel_for(
      std::size_t{0}, (shapes.count + kShapesPerGrower - 1) / kShapesPerGrower, [&](std::size_t group) {
        Grower grower(surface, fans);
        std::vector<std::uint64_t> sums(sets.size());
        for (std::size_t i = group * kShapesPerGrower;
             i < std::min(shapes.count, (group + 1) * kShapesPerGrower); ++i) {
          const ShapeNumbers number(shapes, 6, i);
          std::fill(sums.begin(), sums.end(), 0u);
          const double mass = grower.grow(random_vertex(surface.mesh, fans, number), number(0) * surface.mass,
                                          [&](std::uint32_t t) {
                                            const std::uint32_t* row = counts.data() + t * sets.size();
                                            for (std::size_t s = 0; s < sums.size(); ++s) sums[s] += row[s];
                                          });
          for (std::size_t s = 0; s < sets.size(); ++s)
            errors[s][i] =
                static_cast<double>(sums[s]) / static_cast<double>(sets[s].size()) - mass / surface.mass;
        }
      });
  std::vector<Discrepancy> result;
  for (const auto& of_set : errors) result.push_back(discrepancy_of(of_set));
  return result;
}

std::vector<Discrepancy> SurfaceQuality::balls(Sets sets, const TestShapes& shapes) const {
  const Implementation& surface = *implementation_;
  std::vector<Ball<3>> balls(shapes.count);
  std::vector<double> shares(shapes.count);
  tbb::parallel_for(std::size_t{0}, shapes.count, [&](std::size_t i) {
    const ShapeNumbers number(shapes, 7, i);
    const SurfacePoint center = surface.random_point(number(0), number(1), number(2));
    balls[i] = {position(surface.mesh, center), (1 - number(3)) * surface.diagonal_m / 2};
    shares[i] = share_in_ball(balls[i].center, balls[i].radius);
  });
  std::vector<Discrepancy> result;
  for (const std::span<const Dot> dots : sets) {
    std::vector<Vector3d> places(dots.size());
    for (std::size_t i = 0; i < dots.size(); ++i) places[i] = dots[i].position_O;
    const PointTree<3> tree(places);
    result.push_back(measure_shapes(shapes.count, [&](std::size_t i) {
      return static_cast<double>(tree.count(balls[i])) / static_cast<double>(dots.size()) - shares[i];
    }));
  }
  return result;
}

}  // namespace hilbrush
