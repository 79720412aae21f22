#include "sampling/curve/surface_curve.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sampling/check.h"
#include "sampling/disk/components.h"
#include "sampling/disk/cut_to_disk.h"
#include "sampling/disk/square_map.h"
#include "sampling/input_error.h"

namespace hilbrush {
namespace {

Sheet sheet_on_square(const CutDisk& cut, const SquareMap& map, CurveKind kind) {
  Sheet sheet;
  sheet.kind = kind == CurveKind::kPeano2 ? SheetKind::kPeanoSquare : SheetKind::kHilbertSquare;
  sheet.square_count = map.square_count;
  for (std::size_t f = 0; f < cut.disk.faces().size(); ++f) {
    const FaceSource& source = cut.disk.sources()[f];
    if (source.triangle == kNoTriangle) continue;
    SheetFace face;
    face.triangle = source.triangle;
    for (std::size_t c = 0; c < 3; ++c) face.places[c] = map.places[cut.disk.faces()[f][c]];
    if (source.corners != sheet.corners_b(face)) {
      face.part = static_cast<std::uint32_t>(sheet.parts.size());
      sheet.parts.push_back(source.corners);
    }
    sheet.faces.push_back(face);
  }
  return sheet;
}

Sheet sheet_in_space(const Component& component) {
  Sheet sheet;
  sheet.kind = SheetKind::kHilbertCube;
  for (const auto t : component.triangles) {
    sheet.faces.emplace_back();
    sheet.faces.back().triangle = t;
  }
  return sheet;
}

Sheet make_sheet(const TexturedMesh& mesh, const Neighbours& neighbours, const Component& component, CurveKind kind,
                 ComponentReport& report) {
  if (auto cut = cut_to_disk(mesh, neighbours, component, report.order_reason)) {
    report.order_reason = "no map of it onto the square without a flipped triangle was found";
    if (const auto map = map_to_square(*cut)) {
      Sheet sheet = sheet_on_square(*cut, *map, kind);
      report.is_mapped = build_base_tree(sheet, mesh);
      report.order_reason = report.is_mapped ? "" : "its map onto the square is too sheared to be walked";
      if (report.is_mapped) return sheet;
    }
  }
  Sheet sheet = sheet_in_space(component);
  build_base_tree(sheet, mesh);
  return sheet;
}

/// A beam that is aimed at the very edge of an open surface may pass it by.
constexpr double kInsetM = 2e-6, kMostInsetShare = .1;

}  // namespace

std::vector<DotSurface> find_dot_surfaces(const TexturedMesh& mesh, const Neighbours& neighbours) {
  const auto corner_normals = smooth_corner_normals(mesh, neighbours);
  std::vector<DotSurface> result(mesh.triangle_count());
  for (std::uint32_t t = 0; t < result.size(); ++t) {
    const Eigen::Vector3d area_vector = mesh.area_vector(t);
    const double area = area_vector.norm();
    result[t].normal = (area_vector / area).cast<float>();
    result[t].corner_normals = corner_normals[t];
    for (int c = 0; c < 3; ++c) {
      const double opposite = (mesh.corner(t, (c + 1) % 3) - mesh.corner(t, (c + 2) % 3)).norm();
      result[t].least_barycentric[static_cast<std::size_t>(c)] =
          static_cast<float>(std::min(kMostInsetShare, kInsetM * opposite / (2 * area)));
    }
  }
  return result;
}

SurfaceCurve::SurfaceCurve(const TexturedMesh& mesh, CurveKind kind, const Progress& progress)
    : implementation_(std::make_unique<Implementation>(mesh)) {
  Implementation& curve = *implementation_;
  CHECK(kind == CurveKind::kHilbert || kind == CurveKind::kPeano2);
  if (!(mesh.area_m2() > 0)) throw InputError("", "the model has no surface");
  curve.neighbours = find_neighbours(mesh.triangles);
  curve.dot_surfaces = find_dot_surfaces(mesh, curve.neighbours);
  const std::vector<Component> components = find_components(mesh, curve.neighbours);
  std::size_t done = 0;
  std::vector<Sheet> sheets;
  for (const Component& component : components) {
    ComponentReport report;
    report.triangle_count = component.triangles.size();
    report.genus = component.genus;
    report.boundary_loops = component.boundary_loops;
    report.area_m2 = component.area_m2;
    Sheet sheet = make_sheet(mesh, curve.neighbours, component, kind, report);
    sheet.component = static_cast<std::uint32_t>(curve.components.size());
    sheets.push_back(std::move(sheet));
    curve.components.push_back(std::move(report));
    done += component.triangles.size();
    if (progress) progress(static_cast<double>(done) / static_cast<double>(mesh.triangle_count()));
  }
  for (const auto i : chain_sheets(sheets)) curve.sheets.push_back(std::move(sheets[i]));
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
