#include "sampling/curve/surface_curve.h"

#include <utility>

#include "sampling/base/check.h"
#include "sampling/base/input_error.h"
#include "sampling/curve/build_charts.h"
#include "sampling/disk/components.h"

namespace hilbrush {
namespace {

const TexturedMesh& with_area(const TexturedMesh& mesh) {
  if (!(mesh.area_m2() > 0)) throw InputError("", "the model has no surface");
  return mesh;
}

}  // namespace

SurfaceCurve::SurfaceCurve(const TexturedMesh& mesh, CurveKind kind, const Progress& progress)
    : surface_(with_area(mesh)) {
  CHECK(kind == CurveKind::kHilbert || kind == CurveKind::kPeano2);
  const std::vector<Component> components = find_components(mesh, surface_.neighbors);
  Charts built = build_charts(mesh, surface_.neighbors, components, kind, progress);
  components_ = std::move(built.reports);
  charts_ = std::move(built.charts);
}

SurfaceCurve::~SurfaceCurve() = default;
SurfaceCurve::SurfaceCurve(SurfaceCurve&&) noexcept = default;

}  // namespace hilbrush
