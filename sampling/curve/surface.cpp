#include "sampling/curve/surface.h"

#include <algorithm>

#include "sampling/curve/smooth_normals.h"

namespace hilbrush {
namespace {

/// A beam that is aimed at the very edge of an open surface may miss it: dots keep this far away from the
/// edges of their triangles, 2 micrometers, but no farther than a tenth of the triangle's height.
constexpr double kInsetM = 2e-6;
constexpr double kMaxInsetShare = .1;

std::vector<DotSurface> find_dot_surfaces(const TexturedMesh& mesh, const Neighbors& neighbors) {
  const auto corner_normals = smooth_corner_normals(mesh, neighbors);
  std::vector<DotSurface> result(mesh.triangle_count());
  for (std::uint32_t t = 0; t < result.size(); ++t) {
    const Eigen::Vector3d area_vector = mesh.area_vector(t);
    const double area = area_vector.norm();
    result[t].normal = (area_vector / area).cast<float>();
    result[t].corner_normals = corner_normals[t];
    for (int c = 0; c < 3; ++c) {
      const double opposite = (mesh.corner(t, (c + 1) % 3) - mesh.corner(t, (c + 2) % 3)).norm();
      result[t].least_barycentric[c] =
          static_cast<float>(std::min(kMaxInsetShare, kInsetM * opposite / (2 * area)));
    }
  }
  return result;
}

}  // namespace

Surface::Surface(const TexturedMesh& m)
    : mesh(m), neighbors(find_neighbors(m.triangles)), dot_surfaces(find_dot_surfaces(m, neighbors)) {}

}  // namespace hilbrush
