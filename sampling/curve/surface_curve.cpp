#include "sampling/curve/surface_curve.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sampling/base/check.h"
#include "sampling/base/input_error.h"
#include "sampling/curve/build_charts.h"
#include "sampling/disk/components.h"

namespace hilbrush {
namespace {

/// A beam that is aimed at the very edge of an open surface may pass it by.
constexpr double kInsetM = 2e-6, kMaxInsetShare = .1;

}  // namespace

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
      result[t].least_barycentric[c] = static_cast<float>(std::min(kMaxInsetShare, kInsetM * opposite / (2 * area)));
    }
  }
  return result;
}

SurfaceCurve::SurfaceCurve(const TexturedMesh& mesh, CurveKind kind, const Progress& progress)
    : implementation_(std::make_unique<Implementation>(mesh)) {
  Implementation& curve = *implementation_;
  CHECK(kind == CurveKind::kHilbert || kind == CurveKind::kPeano2);
  if (!(mesh.area_m2() > 0)) throw InputError("", "the model has no surface");
  curve.neighbors = find_neighbors(mesh.triangles);
  curve.dot_surfaces = find_dot_surfaces(mesh, curve.neighbors);
  const std::vector<Component> components = find_components(mesh, curve.neighbors);
  Charts laid_out = build_charts(mesh, curve.neighbors, components, kind, progress);
  curve.components = std::move(laid_out.reports);
  curve.charts = std::move(laid_out.charts);
}

SurfaceCurve::~SurfaceCurve() = default;
SurfaceCurve::SurfaceCurve(SurfaceCurve&&) noexcept = default;

const TexturedMesh& SurfaceCurve::mesh() const {
  return implementation_->mesh;
}
const std::vector<ComponentReport>& SurfaceCurve::components() const {
  return implementation_->components;
}

}  // namespace hilbrush
