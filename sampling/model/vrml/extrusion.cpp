#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "sampling/base/input_error.h"
#include "sampling/model/vrml/surfaces.h"

namespace hilbrush::vrml {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

std::vector<Vector2d> cross_section_of(const Reference& node) {
  const BoundValue bound = find(node, "crossSection");
  if (!bound) return {{1, 1}, {1, -1}, {-1, -1}, {-1, 1}, {1, 1}};
  std::vector<Vector2d> section(bound.value->numbers.size() / 2);
  for (std::size_t i = 0; i < section.size(); ++i)
    section[i] = {bound.value->numbers[2 * i], bound.value->numbers[2 * i + 1]};
  return section;
}

std::vector<Vector3d> spine_of(const Reference& node) {
  const BoundValue bound = find(node, "spine");
  if (!bound) return {Vector3d::Zero(), Vector3d::UnitY()};
  return points_of(bound.value->numbers);
}

bool is_direction(const Vector3d& v) {
  return v.squaredNorm() > 1e-24;
}

/// Replaces each zero vector by the direction before it, and those at the begin by the first direction. False
/// if there is not a single direction.
bool fill_gaps(std::vector<Vector3d>& directions) {
  const auto first = std::find_if(directions.begin(), directions.end(), is_direction);
  if (first == directions.end()) return false;
  std::fill(directions.begin(), first, *first);
  for (auto d = first + 1; d < directions.end(); ++d)
    if (!is_direction(*d)) *d = *(d - 1);
  return true;
}

/// The cross-section plane of each spine point: columns x, y (along the spine), z (VRML97, 6.18.3).
std::vector<Matrix3d> spine_frames(std::vector<Vector3d> spine) {
  const std::size_t n = spine.size();
  const bool is_closed = n > 2 && (spine.front() - spine.back()).norm() == 0;
  // In units of the spine's size, so that thresholds mean something.
  double extent = 0;
  for (const Vector3d& p : spine) extent = std::max(extent, (p - spine[0]).norm());
  if (!(extent > 0) || !std::isfinite(extent)) return std::vector<Matrix3d>(n, Matrix3d::Identity());
  for (Vector3d& p : spine) p /= extent;

  std::vector<Vector3d> y(n);
  std::vector<Vector3d> z(n, Vector3d::Zero());
  for (std::size_t i = 0; i < n; ++i) {
    const bool is_end = i == 0 || i == n - 1;
    const Vector3d& before = is_end && is_closed ? spine[n - 2] : spine[i == 0 ? 0 : i - 1];
    const Vector3d& after = is_end && is_closed ? spine[1] : spine[std::min(i + 1, n - 1)];
    y[i] = after - before;
    if (!is_end || is_closed) z[i] = (after - spine[i]).cross(before - spine[i]);
  }
  fill_gaps(y);
  for (Vector3d& v : y) v.normalize();
  for (Vector3d& v : z) v = v.norm() > 1e-9 ? v.normalized() : Vector3d::Zero();
  if (!fill_gaps(z)) {
    // A straight spine: the upright cross-section, turned the shortest way.
    const Matrix3d turned = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitY(), y[0]).toRotationMatrix();
    return std::vector<Matrix3d>(n, turned);
  }
  std::vector<Matrix3d> frames(n);
  for (std::size_t i = 0; i < n; ++i) {
    if (i > 0 && z[i].dot(z[i - 1]) < 0) z[i] = -z[i];
    const Vector3d x = y[i].cross(z[i]);
    frames[i].col(0) =
        is_direction(x) ? x.normalized() : (i > 0 ? frames[i - 1].col(0) : Vector3d(y[i].unitOrthogonal()));
    frames[i].col(1) = y[i];
    frames[i].col(2) = frames[i].col(0).cross(y[i]).normalized();
  }
  return frames;
}

/// 0..1 along a polyline, by length.
template <class Point>
std::vector<double> arc_fractions(const std::vector<Point>& points) {
  std::vector<double> fractions(points.size(), 0);
  for (std::size_t i = 1; i < points.size(); ++i)
    fractions[i] = fractions[i - 1] + (points[i] - points[i - 1]).norm();
  const double length = fractions.back();
  for (std::size_t i = 0; i < fractions.size(); ++i)
    fractions[i] =
        length > 0 ? fractions[i] / length : static_cast<double>(i) / static_cast<double>(points.size() - 1);
  return fractions;
}

/// The closed cross-section as one polygon; its bounding square is mapped onto the texture.
void add_cap(FaceList& faces, const std::vector<Vector2d>& section, std::size_t first_point, bool is_begin) {
  const std::size_t n =
      section.size() > 1 && section.front() == section.back() ? section.size() - 1 : section.size();
  if (n < 3) return;
  Vector2d low = section[0];
  Vector2d high = section[0];
  for (const Vector2d& p : section) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const double side = (high - low).maxCoeff();
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t j = is_begin ? n - 1 - i : i;
    faces.corners.push_back(static_cast<std::uint32_t>(first_point + j));
    faces.corner_uv.push_back(side > 0 ? Vector2d((section[j] - low) / side) : Vector2d(0, 0));
  }
  faces.end_face();
}

/// A point of the cross-section at spine point i, scaled and oriented. Beyond the end of `scale` or
/// `orientation` the last entry holds.
Vector3d on_section(const Vector2d& p, const std::vector<double>& scale,
                    const std::vector<double>& orientation, std::size_t i) {
  Vector2d s(1, 1);
  if (scale.size() >= 2) {
    const std::size_t k = std::min(i, scale.size() / 2 - 1);
    s = {scale[2 * k], scale[2 * k + 1]};
  }
  Vector3d scaled(p.x() * s.x(), 0, p.y() * s.y());
  if (orientation.size() < 4) return scaled;
  const std::size_t k = std::min(i, orientation.size() / 4 - 1);
  return rotation_matrix(
             {orientation[4 * k], orientation[4 * k + 1], orientation[4 * k + 2], orientation[4 * k + 3]}) *
         scaled;
}

}  // namespace

FaceList extrusion(const Reference& node, const ModelLimits& limits) {
  const std::vector<Vector2d> section = cross_section_of(node);
  const std::vector<Vector3d> spine = spine_of(node);
  if (section.size() < 2 || spine.size() < 2)
    throw InputError(at(*node.node),
                     "Extrusion needs at least 2 points in crossSection and in spine, found " +
                         std::to_string(section.size()) + " and " + std::to_string(spine.size()));
  if (section.size() > limits.triangles / spine.size())
    throw InputError(at(*node.node),
                     "Extrusion makes more triangles than the limit of " + std::to_string(limits.triangles));

  FaceList faces;
  faces.at = at(*node.node);
  faces.is_reversed = !flag_of(node, "ccw", true);
  const std::vector<double>& scale = numbers_of(node, "scale");
  const std::vector<double>& orientation = numbers_of(node, "orientation");
  const std::vector<Matrix3d> frames = spine_frames(spine);
  for (std::size_t i = 0; i < spine.size(); ++i)
    for (const Vector2d& p : section)
      faces.points.push_back(spine[i] + frames[i] * on_section(p, scale, orientation, i));

  const std::vector<double> s = arc_fractions(section);
  const std::vector<double> t = arc_fractions(spine);
  const auto add_corner = [&](std::size_t i, std::size_t j) {
    faces.corners.push_back(static_cast<std::uint32_t>(i * section.size() + j));
    faces.corner_uv.emplace_back(s[j], t[i]);
  };
  for (std::size_t i = 0; i + 1 < spine.size(); ++i)
    for (std::size_t j = 0; j + 1 < section.size(); ++j) {
      add_corner(i, j);
      add_corner(i, j + 1);
      add_corner(i + 1, j + 1);
      add_corner(i + 1, j);
      faces.end_face();
    }
  // The standard puts caps into the tube of a closed spine as well. They can be neither seen nor hit by the
  // beam, and would make the tube non-manifold.
  const bool is_ring = spine.size() > 2 && spine.front() == spine.back();
  if (!is_ring && flag_of(node, "beginCap", true)) add_cap(faces, section, 0, true);
  if (!is_ring && flag_of(node, "endCap", true))
    add_cap(faces, section, (spine.size() - 1) * section.size(), false);
  return faces;
}

}  // namespace hilbrush::vrml
