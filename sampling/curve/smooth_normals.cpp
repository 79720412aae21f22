#include "sampling/curve/smooth_normals.h"

#include <cmath>
#include <numbers>

namespace hilbrush {
namespace {

/// Radians. Edges that turn by more are edges of the object, not of its triangulation.
constexpr double kSharpEdge = 40 * std::numbers::pi / 180;

class CornerNormals {
 public:
  CornerNormals(const TexturedMesh& mesh, const Neighbors& neighbors) : mesh_(mesh), neighbors_(neighbors) {
    face_normals_.reserve(mesh.triangle_count());
    for (std::size_t t = 0; t < mesh.triangle_count(); ++t)
      face_normals_.push_back(mesh.area_vector(t).normalized());
    normals_.assign(mesh.triangle_count(),
                    {Eigen::Vector3f::Zero(), Eigen::Vector3f::Zero(), Eigen::Vector3f::Zero()});
    for (std::uint32_t t = 0; t < mesh.triangle_count(); ++t)
      for (std::uint8_t c = 0; c < 3; ++c)
        if (normals_[t][c].isZero()) fill_around({t, c});
  }

  std::vector<std::array<Eigen::Vector3f, 3>> take() { return std::move(normals_); }

 private:
  /// A side stands for the corner where it begins.
  TriangleSide smooth_step(TriangleSide across, std::uint32_t from) const {
    if (across == kNoSide) return kNoSide;
    const double cosine = face_normals_[from].dot(face_normals_[across.triangle]);
    return cosine < std::cos(kSharpEdge) ? kNoSide : across;
  }
  TriangleSide clockwise(TriangleSide corner) const {
    TriangleSide across = smooth_step(neighbors_[corner.triangle][corner.side], corner.triangle);
    if (across != kNoSide) across.side = static_cast<std::uint8_t>((across.side + 1) % 3);
    return across;
  }
  TriangleSide counter_clockwise(TriangleSide corner) const {
    return smooth_step(neighbors_[corner.triangle][(corner.side + 2) % 3], corner.triangle);
  }

  void fill_around(TriangleSide corner) {
    TriangleSide first = corner;
    for (TriangleSide at = clockwise(corner); at != kNoSide; at = clockwise(at)) {
      first = at;
      if (at == corner) break;
    }
    std::vector<TriangleSide> around;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    TriangleSide at = first;
    do {
      around.push_back(at);
      sum += angle_at(at) * face_normals_[at.triangle];
      at = counter_clockwise(at);
    } while (at != kNoSide && at != first);
    for (const TriangleSide member : around) {
      // Around a vertex like the tip of a screw the mean may vanish: then the triangle's own normal is taken.
      const bool is_usable = sum.dot(face_normals_[member.triangle]) > 1e-3 * sum.norm() && sum.norm() > 1e-9;
      normals_[member.triangle][member.side] =
          (is_usable ? sum.normalized() : face_normals_[member.triangle]).cast<float>();
    }
  }

  double angle_at(TriangleSide corner) const {
    const Eigen::Vector3d& p = mesh_.corner(corner.triangle, corner.side);
    const Eigen::Vector3d a = mesh_.corner(corner.triangle, (corner.side + 1) % 3) - p;
    const Eigen::Vector3d b = mesh_.corner(corner.triangle, (corner.side + 2) % 3) - p;
    return std::atan2(a.cross(b).norm(), a.dot(b));
  }

  const TexturedMesh& mesh_;
  const Neighbors& neighbors_;
  std::vector<Eigen::Vector3d> face_normals_;
  std::vector<std::array<Eigen::Vector3f, 3>> normals_;
};

}  // namespace

std::vector<std::array<Eigen::Vector3f, 3>> smooth_corner_normals(const TexturedMesh& mesh,
                                                                  const Neighbors& neighbors) {
  return CornerNormals(mesh, neighbors).take();
}

}  // namespace hilbrush
