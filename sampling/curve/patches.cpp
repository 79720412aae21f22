#include "sampling/curve/patches.h"

#include "sampling/curve/stream_dots.h"

namespace hilbrush {
namespace {

template <class Curve>
void add_base_pieces(const CurveMass& mass, std::size_t quad_index, Patch& patch) {
  constexpr int kDimensions = kDimensionsOf<Curve>;
  const QuadMass& quad = mass.quads()[quad_index];
  const BaseQuad& base = mass.base_quad(quad);
  for (std::uint32_t i = 0; i < base.face_count; ++i) {
    if (!(mass.pieces_of(quad)[i].mass > 0)) continue;
    const ChartFace& face = mass.chart_of(quad).face_of(base, i);
    auto cut = whole_piece<kDimensions>(mass.chart_of(quad), mass.mesh(), face);
    clip_to_box<kDimensions>(cut, base.low.template head<kDimensions>(), base.size);
    PatchPiece piece{face.triangle, {}, integrate(mass.tone().on(face.triangle), cut)};
    for (const auto& corner : cut.all()) piece.corners_b.push_back(corner.b);
    patch.pieces.push_back(std::move(piece));
  }
}

Patch patch_of_quad(const CurveMass& mass, std::size_t index) {
  Patch patch;
  patch.chart = mass.quads()[index].chart;
  patch.depth = mass.base_quad(mass.quads()[index]).depth;
  patch.at = mass.mass_before(index);
  patch.mass = mass.mass_of(index);
  with_curve(mass.chart_of(mass.quads()[index]).kind,
             [&]<class Curve>(Curve) { add_base_pieces<Curve>(mass, index, patch); });
  return patch;
}

template <class Curve>
Patch patch_of(const CurveMass& mass, const QuadWalk<Curve>& walk, const typename QuadWalk<Curve>::Node& node,
               PatchKind kind) {
  if (node.pieces.empty()) {
    Patch patch = patch_of_quad(mass, walk.quad());
    patch.kind = kind;
    return patch;
  }
  Patch patch{walk.chart(), node.depth, kind, node.at, node.mass, {}};
  for (const auto index : node.pieces) {
    const auto& measured = walk.piece(index);
    PatchPiece piece{walk.frame(measured.frame).triangle, {}, measured.integral};
    piece.integral.mass *= node.scale;
    piece.integral.first *= node.scale;
    for (const auto& corner : measured.piece.all()) piece.corners_b.push_back(corner.b);
    patch.pieces.push_back(std::move(piece));
  }
  return patch;
}

struct AllPatches {
  const CurveMass& mass;
  const std::function<void(const Patch&)>& visit;

  bool wants(double, double) const { return true; }
  template <class Curve>
  void take(const QuadWalk<Curve>& walk, const typename QuadWalk<Curve>::Node& node, PatchKind kind) const {
    visit(patch_of(mass, walk, node, kind));
  }
};

struct Stretches {
  const CurveMass& mass;
  const std::function<void(std::uint64_t, const Patch&, double, double)>& visit;
  std::uint64_t stratum = 0;

  void add_quads(std::size_t first, std::size_t last) const {
    for (std::size_t q = first; q < last; ++q)
      if (mass.mass_of(q) > 0) visit(stratum, patch_of_quad(mass, q), 0, 1);
  }
  void add_quad(std::size_t quad, double from, double to) const {
    visit(stratum, patch_of_quad(mass, quad), from, to);
  }
  template <class Curve>
  void add(const QuadWalk<Curve>& walk, const typename QuadWalk<Curve>::Node& node, PatchKind kind,
           double from, double to) const {
    if (to > from) visit(stratum, patch_of(mass, walk, node, kind), from, to);
  }
  void close(std::uint64_t index) { stratum = index + 1; }
  template <class Curve>
  void add_strata(const QuadWalk<Curve>& walk, const typename QuadWalk<Curve>::Node& node, PatchKind kind,
                  std::span<const double> ends, std::uint64_t index) {
    const auto add_stretch = [&](double from, double to) { add(walk, node, kind, from, to); };
    add_one_by_one(*this, add_stretch, ends, index);
  }
};

}  // namespace

void visit_patches(const CurveMass& mass, const PatchRule& rule,
                   const std::function<void(const Patch&)>& visit) {
  const AllPatches sink{mass, visit};
  for (std::size_t q = 0; q < mass.quads().size(); ++q)
    with_curve(mass.chart_of(mass.quads()[q]).kind,
               [&]<class Curve>(Curve) { QuadWalk<Curve>(mass, rule).walk(q, sink); });
}

void visit_stretches(const CurveMass& mass, const SampleOptions& options,
                     const std::function<void(std::uint64_t, const Patch&, double, double)>& visit) {
  const DotPlan plan(mass, options, count_dots(mass, options));
  Stretches stretches{mass, visit};
  std::vector<std::size_t> patches_at_depth;
  Walks walks(plan);
  cut_strata(plan, walks, 0, plan.strata.count, stretches, patches_at_depth);
}

}  // namespace hilbrush
