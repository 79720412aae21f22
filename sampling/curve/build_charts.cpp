#include "sampling/curve/build_charts.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <utility>

#include "sampling/disk/chain.h"
#include "sampling/disk/flatten.h"

namespace hilbrush {
namespace {

/// Progress is reported about this many times.
constexpr std::size_t kProgressSteps = 16;
/// Share of flattening in the whole work, for progress.
constexpr double kFlattenShare = .7;

std::vector<FlatComponent> flatten_all(const TexturedMesh& mesh, const Neighbors& neighbors,
                                       const std::vector<Component>& components, double area,
                                       const Progress& progress) {
  std::vector<FlatComponent> flats(components.size());
  std::size_t done = 0;
  for (std::size_t begin = 0, end = 0; begin < components.size(); begin = end) {
    for (std::size_t batch = 0; end < components.size() && batch * kProgressSteps <= mesh.triangle_count();
         ++end)
      batch += components[end].triangles.size();
    tbb::parallel_for(begin, end, [&](std::size_t i) {
      flats[i] = flatten(mesh, neighbors, components[i], components[i].area_m2 / area);
    });
    for (std::size_t i = begin; i < end; ++i) done += components[i].triangles.size();
    progress.step(done, mesh.triangle_count());
  }
  return flats;
}

ComponentReport report_on(const Component& component, const FlatComponent& flat) {
  ComponentReport report;
  report.triangle_count = component.triangles.size();
  report.genus = component.genus;
  report.boundary_loops = component.boundary_loops;
  report.area_m2 = component.area_m2;
  report.is_mapped = flat.is_mapped();
  report.order_reason = flat.reason;
  report.piece_count = flat.pieces.size();
  report.cut_length_m = flat.cut_length_m;
  report.map_shear = flat.shear;
  return report;
}

ChainPiece chain_piece(const FlatPiece& piece, CurveKind kind) {
  ChainPiece result{piece.corners_O, 1, Turns::kNone};
  if (!piece.is_mapped()) return result;
  result.turns = piece.square_count == 1 ? Turns::kMirrorsAndSwap : Turns::kMirrors;
  // The Peano II curve crosses each square.
  if (kind == CurveKind::kPeano2 && piece.square_count % 2 == 1) result.end_corner = 2;
  return result;
}

Chart chart_on_square(const FlatPiece& piece, const Symmetry& symmetry, CurveKind kind) {
  Chart chart;
  chart.kind = kind == CurveKind::kPeano2 ? ChartKind::kPeanoSquare : ChartKind::kHilbertSquare;
  chart.square_count = piece.square_count;
  chart.faces.reserve(piece.faces.size());
  for (const FlatFace& flat : piece.faces) {
    ChartFace face;
    face.triangle = flat.triangle;
    for (std::size_t c = 0; c < 3; ++c) face.places[c] = symmetry(flat.places[c], piece.square_count);
    if (flat.barycentric != chart.corners_b(face)) {
      face.part = static_cast<std::uint32_t>(chart.parts.size());
      chart.parts.push_back(flat.barycentric);
    }
    chart.faces.push_back(face);
  }
  return chart;
}

Chart chart_in_space(const std::vector<std::uint32_t>& triangles) {
  Chart chart;
  chart.kind = ChartKind::kHilbertCube;
  for (const auto t : triangles) {
    chart.faces.emplace_back();
    chart.faces.back().triangle = t;
  }
  return chart;
}

std::vector<std::uint32_t> triangles_of(const FlatPiece& piece) {
  if (!piece.is_mapped()) return piece.triangles_in_space;
  std::vector<std::uint32_t> triangles;
  for (const FlatFace& face : piece.faces) triangles.push_back(face.triangle);
  std::sort(triangles.begin(), triangles.end());
  triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());
  return triangles;
}

struct PieceIndex {
  std::uint32_t component, piece;
};

}  // namespace

Charts build_charts(const TexturedMesh& mesh, const Neighbors& neighbors,
                    const std::vector<Component>& components, CurveKind kind, const Progress& progress) {
  const double area = mesh.area_m2();
  std::vector<FlatComponent> flats =
      flatten_all(mesh, neighbors, components, area, progress.part(0, kFlattenShare));
  Charts result;
  std::vector<PieceIndex> pieces;
  std::vector<ChainPiece> chain_pieces_of;
  for (std::uint32_t c = 0; c < flats.size(); ++c) {
    result.reports.push_back(report_on(components[c], flats[c]));
    for (std::uint32_t p = 0; p < flats[c].pieces.size(); ++p) {
      pieces.push_back({c, p});
      chain_pieces_of.push_back(chain_piece(flats[c].pieces[p], kind));
    }
  }
  const std::vector<ChainLink> chain = chain_pieces(chain_pieces_of);
  result.charts.resize(chain.size());
  std::vector<char> is_too_sheared(chain.size(), 0);
  tbb::parallel_for(std::size_t{0}, chain.size(), [&](std::size_t i) {
    const PieceIndex index = pieces[chain[i].piece];
    FlatPiece& piece = flats[index.component].pieces[index.piece];
    Chart& chart = result.charts[i];
    if (piece.is_mapped()) {
      chart = chart_on_square(piece, chain[i].symmetry, kind);
      is_too_sheared[i] = !build_base_tree(chart, mesh, area);
    }
    if (!piece.is_mapped() || is_too_sheared[i]) {
      chart = chart_in_space(triangles_of(piece));
      build_base_tree(chart, mesh, area);
    }
    chart.component = index.component;
    piece = {};
  });
  for (std::size_t i = 0; i < chain.size(); ++i)
    if (is_too_sheared[i]) {
      ComponentReport& report = result.reports[result.charts[i].component];
      report.is_mapped = false;
      report.order_reason = "its map onto the square is too sheared to be walked";
    }
  progress(1);
  return result;
}

}  // namespace hilbrush
