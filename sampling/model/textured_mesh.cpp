#include "sampling/model/textured_mesh.h"

#include <Eigen/Geometry>
#include <limits>

namespace hilbrush {

double TexturedMesh::area_m2() const {
  double sum = 0;
  for (std::size_t t = 0; t < triangles.size(); ++t) sum += area_vector(t).norm();
  return sum;
}

Eigen::Vector3d position(const TexturedMesh& mesh, const SurfacePoint& point) {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  for (int c = 0; c < 3; ++c) p += point.barycentric[c] * mesh.corner(point.triangle, c);
  return p;
}

SurfacePoint foot_of_perpendicular(const TexturedMesh& mesh, std::uint32_t triangle,
                                   const Eigen::Vector3d& p_O) {
  const Eigen::Vector3d area = mesh.area_vector(triangle);
  const auto share = [&](int c) {
    const Eigen::Vector3d& from = mesh.corner(triangle, (c + 1) % 3);
    return .5 * (mesh.corner(triangle, (c + 2) % 3) - from).cross(p_O - from).dot(area) / area.squaredNorm();
  };
  const double u = share(0);
  const double v = share(1);
  return {triangle, {u, v, 1 - u - v}};
}

Eigen::Vector3d face_normal(const TexturedMesh& mesh, const SurfacePoint& point) {
  return mesh.area_vector(point.triangle).normalized();
}

std::array<Eigen::Vector3d, 2> bounds(const TexturedMesh& mesh) {
  const double infinity = std::numeric_limits<double>::infinity();
  std::array<Eigen::Vector3d, 2> box{Eigen::Vector3d::Constant(infinity),
                                     Eigen::Vector3d::Constant(-infinity)};
  for (const auto& triangle : mesh.triangles)
    for (const auto v : triangle) {
      box[0] = box[0].cwiseMin(mesh.vertices[v]);
      box[1] = box[1].cwiseMax(mesh.vertices[v]);
    }
  return box;
}

}  // namespace hilbrush
