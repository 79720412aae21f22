#include "sampling/curve/surface_curve.h"

#include <cmath>
#include <utility>

#include "sampling/disk/components.h"
#include "sampling/disk/cut_to_disk.h"
#include "sampling/disk/square_map.h"
#include "sampling/input_error.h"

namespace hilbrush {
namespace {

Sheet sheet_on_square(const CutDisk& cut, const SquareMap& map) {
  Sheet sheet;
  sheet.is_on_square = true;
  sheet.square_count = map.square_count;
  for (std::size_t f = 0; f < cut.disk.faces().size(); ++f) {
    const FaceSource& source = cut.disk.sources()[f];
    if (source.triangle == kNoTriangle) continue;
    SheetFace face{source.triangle, {}};
    for (std::size_t c = 0; c < 3; ++c) {
      const Eigen::Vector2d& place = map.places[cut.disk.faces()[f][c]];
      face.corners[c] = {{place.x(), place.y(), 0}, source.corners[c]};
    }
    sheet.faces.push_back(face);
  }
  return sheet;
}

Sheet sheet_in_space(const TexturedMesh& mesh, const Component& component) {
  Sheet sheet;
  for (const auto t : component.triangles)
    sheet.faces.push_back({t,
                           {PieceCorner{mesh.corner(t, 0), {0, 0}}, PieceCorner{mesh.corner(t, 1), {1, 0}},
                            PieceCorner{mesh.corner(t, 2), {0, 1}}}});
  return sheet;
}

Sheet make_sheet(const TexturedMesh& mesh, const Neighbours& neighbours, const Component& component,
                 ComponentReport& report) {
  if (auto cut = cut_to_disk(mesh, neighbours, component, report.order_reason)) {
    report.order_reason = "no map of it onto the square without a flipped triangle was found";
    if (const auto map = map_to_square(*cut)) {
      Sheet sheet = sheet_on_square(*cut, *map);
      report.is_mapped = build_base_tree(sheet, mesh);
      report.order_reason = report.is_mapped ? "" : "its map onto the square is too sheared to be walked";
      if (report.is_mapped) return sheet;
    }
  }
  Sheet sheet = sheet_in_space(mesh, component);
  build_base_tree(sheet, mesh);
  return sheet;
}

}  // namespace

SurfaceCurve::SurfaceCurve(const TexturedMesh& mesh, const Progress& progress)
    : implementation_(std::make_unique<Implementation>(mesh)) {
  Implementation& curve = *implementation_;
  if (!(mesh.area_m2() > 0)) throw InputError("", "the model has no surface");
  curve.neighbours = find_neighbours(mesh.triangles);
  curve.corner_normals = smooth_corner_normals(mesh, curve.neighbours);
  const std::vector<Component> components = find_components(mesh, curve.neighbours);
  std::size_t done = 0;
  std::vector<Sheet> sheets;
  for (const Component& component : components) {
    ComponentReport report;
    report.triangle_count = component.triangles.size();
    report.genus = component.genus;
    report.boundary_loops = component.boundary_loops;
    report.area_m2 = component.area_m2;
    Sheet sheet = make_sheet(mesh, curve.neighbours, component, report);
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
