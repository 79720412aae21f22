#include "sampling/curve/chart.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sampling/base/cross.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d;

constexpr std::size_t kMaxFaces = 8;
/// A quad with at most kSmallShare of a mean triangle's area may hold this many: around a vertex with many
/// triangles, and along needles, division would not end by itself.
constexpr std::size_t kMaxFacesIfSmall = 64;
constexpr double kSmallShare = .25;
/// No quad holds more than 1/kMinQuads of the mesh's area, however few its triangles: threads and strata
/// start from base quads, and the walk from one down to a patch stays short.
constexpr double kMinQuads = 4000;
/// Division also ends where it would multiply the listed triangles by more than kSide to this power: by 1.9
/// with four children.
constexpr double kTooManyExponent = .926;
constexpr int kMaxDepth = 24;
/// The first cube is larger than the box around the faces, and off its middle by an irregular share.
constexpr double kCubeMargin = 1.05;
constexpr double kCubeMiddle = .4871828;
/// A good map lists each face in a few quads only. Beyond these limits the map is too sheared.
constexpr std::size_t kMaxListed = 1'000'000;
constexpr std::size_t kMaxListedPerFace = 60;
/// In units of the square: what rounding may move an edge by. A triangle that touches a quad must not be
/// lost.
constexpr double kTouch = 1e-14;

/// Builds the base tree of one chart for one kind of curve.
template <class Curve>
class TreeBuilder {
 public:
  static constexpr int kDimensions = kDimensionsOf<Curve>;
  using Place = Eigen::Matrix<double, kDimensions, 1>;

  TreeBuilder(Chart& chart, const TexturedMesh& mesh, double mesh_area_m2)
      : chart_(chart), mesh_(mesh), too_many_(std::pow(Curve::kSide, kTooManyExponent)) {
    double area = 0;
    faces_.reserve(chart.faces.size());
    for (const ChartFace& face : chart.faces) {
      faces_.push_back(measure(face));
      area += faces_.back().area;
    }
    small_area_ = kSmallShare * area / static_cast<double>(std::max<std::size_t>(1, faces_.size()));
    large_area_ = mesh_area_m2 / kMinQuads;
  }

  void build() {
    std::vector<std::uint32_t> all(faces_.size());
    for (std::uint32_t f = 0; f < all.size(); ++f) all[f] = f;
    if constexpr (kDimensions == 3) {
      Place low = Place::Constant(std::numeric_limits<double>::infinity()), high = -low;
      for (const Face& face : faces_) {
        low = low.cwiseMin(face.low);
        high = high.cwiseMax(face.high);
      }
      // Off the middle: else a flat part may lie exactly between two cubes and count in both.
      const double size = (high - low).maxCoeff() * kCubeMargin;
      divide(.5 * (low + high) - Place::Constant(kCubeMiddle * size), size, Curve{}, 0, all);
    } else {
      Curve curve{};
      std::vector<std::uint32_t> here;
      for (int i = 0; i < chart_.square_count; ++i, curve = curve.next_square()) {
        here.clear();
        const Place low(i, 0);
        for (const auto f : all)
          if (chart_.square_count == 1 || overlaps(faces_[f], f, low, 1)) here.push_back(f);
        divide(low, 1, curve, 0, here);
      }
    }
  }

 private:
  struct Face {
    Place low, high;     ///< bounds
    double area = 0;     ///< m^2
    double density = 0;  ///< m^2 for a unit of the square
  };

  Face measure(const ChartFace& face) const {
    const auto piece = whole_piece<kDimensions>(chart_, mesh_, face);
    Face result;
    result.low = result.high = piece.corners[0].place;
    for (std::size_t c = 1; c < 3; ++c) {
      result.low = result.low.cwiseMin(piece.corners[c].place);
      result.high = result.high.cwiseMax(piece.corners[c].place);
    }
    result.area = 2 * piece.area_b() * mesh_.area_vector(face.triangle).norm();
    if constexpr (kDimensions == 2)
      result.density =
          result.area /
          (.5 * std::abs(cross(face.places[1] - face.places[0], face.places[2] - face.places[0])));
    return result;
  }

  bool overlaps(const Face& face, std::uint32_t f, const Place& low, double size) const {
    for (int k = 0; k < kDimensions; ++k)
      if (face.high[k] < low[k] || face.low[k] > low[k] + size) return false;
    if constexpr (kDimensions == 3) {
      auto piece = whole_piece<3>(chart_, mesh_, chart_.faces[f]);
      clip_to_box<3>(piece, low, size);
      return piece.corner_count >= 3;
    } else {
      // Beyond one of the three sides?
      const auto& p = chart_.faces[f].places;
      const double turn = cross(p[1] - p[0], p[2] - p[0]) < 0 ? -1 : 1;
      const Vector2d middle = low + Vector2d::Constant(size / 2);
      for (std::size_t k = 0; k < 3; ++k) {
        const Vector2d side = p[(k + 1) % 3] - p[k];
        const double reach = (.5 * size + kTouch) * (std::abs(side.x()) + std::abs(side.y()));
        if (turn * cross(side, middle - p[k]) + reach < 0) return false;
      }
      return true;
    }
  }

  /// At least the area that the box holds.
  double area_bound(const std::vector<std::uint32_t>& list, double size) const {
    double area = 0, density = 0;
    for (const auto f : list) {
      area += faces_[f].area;
      density = std::max(density, faces_[f].density);
    }
    return kDimensions == 2 ? std::min(area, density * size * size) : area;
  }

  bool is_leaf(const std::vector<std::uint32_t>& list, double size, int depth) const {
    if (depth == kMaxDepth) return true;
    if (list.size() > kMaxFacesIfSmall) return false;
    return area_bound(list, size) <=
           (list.size() <= kMaxFaces ? large_area_ : std::min(small_area_, large_area_));
  }

  bool is_out_of_bounds() const {
    return chart_.face_lists.size() > kMaxListed + kMaxListedPerFace * chart_.faces.size();
  }

  void add_leaf(const Place& low, double size, Curve curve, int depth,
                const std::vector<std::uint32_t>& list) {
    BaseQuad quad;
    quad.low.template head<kDimensions>() = low;
    quad.size = size;
    quad.first_face = static_cast<std::uint32_t>(chart_.face_lists.size());
    quad.face_count = static_cast<std::uint32_t>(list.size());
    quad.depth = static_cast<std::uint8_t>(depth);
    if constexpr (kDimensions == 3) {
      quad.permutation = curve.entry;
      quad.cube_direction = curve.direction;
    } else {
      quad.permutation = curve.permutation;
    }
    chart_.face_lists.insert(chart_.face_lists.end(), list.begin(), list.end());
    chart_.base_quads.push_back(quad);
  }

  static Place child_low(const Place& low, double size, unsigned slot) {
    Place result = low;
    for (int k = 0; k < kDimensions; ++k, slot /= Curve::kSide) result[k] += size * (slot % Curve::kSide);
    return result;
  }

  void divide(const Place& low, double size, Curve curve, int depth, const std::vector<std::uint32_t>& list) {
    if (list.empty()) return;
    const bool is_too_much = is_out_of_bounds();
    if (is_too_much && kDimensions == 2) return;
    if (is_too_much || is_leaf(list, size, depth)) return add_leaf(low, size, curve, depth, list);
    auto& children = levels_[static_cast<std::size_t>(depth)];
    children.resize(Curve::kChildCount);  // not before: most charts of a mesh in many parts are shallow
    const double child_size = size / Curve::kSide;
    std::size_t count = 0;
    for (unsigned slot = 0; slot < Curve::kChildCount; ++slot) {
      children[slot].clear();
      const Place at = child_low(low, child_size, slot);
      for (const auto f : list)
        if (overlaps(faces_[f], f, at, child_size)) children[slot].push_back(f);
      count += children[slot].size();
    }
    if (list.size() > kMaxFaces && list.size() <= kMaxFacesIfSmall &&
        static_cast<double>(count) > too_many_ * static_cast<double>(list.size()) &&
        area_bound(list, size) <= large_area_)
      return add_leaf(low, size, curve, depth, list);
    for (unsigned i = 0; i < Curve::kChildCount; ++i) {
      const unsigned slot = curve.slot(i);
      divide(child_low(low, child_size, slot), child_size, curve.child(i), depth + 1, children[slot]);
    }
  }

  Chart& chart_;
  const TexturedMesh& mesh_;
  std::vector<Face> faces_;
  double small_area_ = 0, large_area_ = 0;
  double too_many_;
  std::array<std::vector<std::vector<std::uint32_t>>, kMaxDepth + 1>
      levels_;  ///< lists of the children on the way down
};

}  // namespace

template <int kDimensions>
Piece<kDimensions> whole_piece(const Chart& chart, const TexturedMesh& mesh, const ChartFace& face) {
  const auto b = chart.corners_b(face);
  Piece<kDimensions> piece;
  for (std::size_t c = 0; c < 3; ++c) {
    if constexpr (kDimensions == 3)
      piece.add({position(mesh, {face.triangle, {1 - b[c].sum(), b[c].x(), b[c].y()}}), b[c]});
    else
      piece.add({face.places[c], b[c]});
  }
  return piece;
}
template Piece<2> whole_piece<2>(const Chart&, const TexturedMesh&, const ChartFace&);
template Piece<3> whole_piece<3>(const Chart&, const TexturedMesh&, const ChartFace&);

template <int kDimensions>
void clip_to_box(Piece<kDimensions>& piece, const Eigen::Matrix<double, kDimensions, 1>& low, double size) {
  for (int axis = 0; axis < kDimensions; ++axis) {
    double least = std::numeric_limits<double>::infinity(), most = -least;
    for (const auto& corner : piece.all()) {
      least = std::min(least, corner.place[axis]);
      most = std::max(most, corner.place[axis]);
    }
    const double high = low[axis] + size;
    if (most < low[axis] || least > high) piece.corner_count = 0;
    if (least < low[axis]) piece = part_of(piece, axis, low[axis], true);
    if (most > high) piece = part_of(piece, axis, high, false);
  }
}
template void clip_to_box<2>(Piece<2>&, const Eigen::Vector2d&, double);
template void clip_to_box<3>(Piece<3>&, const Eigen::Vector3d&, double);

bool build_base_tree(Chart& chart, const TexturedMesh& mesh, double mesh_area_m2) {
  return with_curve(chart.kind, [&]<class Curve>(Curve) {
    TreeBuilder<Curve>(chart, mesh, mesh_area_m2).build();
    return kDimensionsOf<Curve> == 3 ||
           chart.face_lists.size() <= kMaxListed + kMaxListedPerFace * chart.faces.size();
  });
}

}  // namespace hilbrush
