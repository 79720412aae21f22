#include "sampling/laminar/contours.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace hilbrush {
namespace {

using Eigen::Vector3d;

/// Where a plane crosses an edge of a triangle. Calculated from the vertex with the lower index, so that the
/// triangles on both sides get the same place, to the last bit.
struct Crossing {
  std::uint64_t edge = 0;
  Vector3d b = Vector3d::Zero(), place;
};

Crossing cross_edge(const TexturedMesh& mesh, std::uint32_t t, int side, double z) {
  int from = side;
  int to = (side + 1) % 3;
  const auto vertex = [&](int corner) { return mesh.triangles[t][static_cast<std::size_t>(corner)]; };
  if (vertex(from) > vertex(to)) std::swap(from, to);
  const Vector3d &p = mesh.corner(t, from), &q = mesh.corner(t, to);
  const double share = std::clamp((z - p.z()) / (q.z() - p.z()), 0., 1.);
  Crossing crossing;
  crossing.edge = std::uint64_t{vertex(from)} << 32 | vertex(to);
  crossing.b[from] = 1 - share;
  crossing.b[to] = share;
  crossing.place = p + share * (q - p);
  return crossing;
}

/// One of the two ends of a piece: 2 * index for its start, 2 * index + 1 for its end.
using End = std::size_t;
constexpr End kNoEnd = std::numeric_limits<End>::max();

/// For each end the other end on the same edge; kNoEnd if there is none or more than one.
std::vector<End> find_partners(const std::vector<ContourPiece>& pieces) {
  std::vector<std::pair<std::uint64_t, End>> ends;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    ends.emplace_back(pieces[i].from_edge, 2 * i);
    ends.emplace_back(pieces[i].to_edge, 2 * i + 1);
  }
  std::sort(ends.begin(), ends.end());
  std::vector<End> partners(ends.size(), kNoEnd);
  for (std::size_t i = 0, next = 0; i < ends.size(); i = next) {
    while (next < ends.size() && ends[next].first == ends[i].first) ++next;
    if (next - i != 2) continue;
    partners[ends[i].second] = ends[i + 1].second;
    partners[ends[i + 1].second] = ends[i].second;
  }
  return partners;
}

}  // namespace

void ContourPiece::reverse() {
  std::swap(from_b, to_b);
  std::swap(from_O, to_O);
  std::swap(from_edge, to_edge);
}

Slices::Slices(const TexturedMesh& mesh, double distance_m) : mesh_(mesh), distance_(distance_m) {
  const auto [low, high] = bounds(mesh);
  lowest_ = low.z();
  first_.assign(static_cast<std::size_t>(std::max(0., std::ceil((high.z() - low.z()) / distance_m))) + 2, 0);
  const auto range = [&](std::size_t t) {
    const double a = mesh.corner(t, 0).z(), b = mesh.corner(t, 1).z(), c = mesh.corner(t, 2).z();
    // Slices with height in (lowest corner, highest corner].
    return std::pair{slice_at_or_above(std::nextafter(std::min({a, b, c}), 1e300)),
                     slice_at_or_above(std::nextafter(std::max({a, b, c}), 1e300))};
  };
  const auto last = static_cast<std::int64_t>(first_.size()) - 1;
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t)
    for (auto [k, end] = range(t); k < std::min(end, last); ++k) ++first_[static_cast<std::size_t>(k) + 1];
  for (std::size_t k = 1; k < first_.size(); ++k) first_[k] += first_[k - 1];
  triangles_.resize(first_.back());
  std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t)
    for (auto [k, end] = range(t); k < std::min(end, last); ++k)
      triangles_[next[static_cast<std::size_t>(k)]++] = static_cast<std::uint32_t>(t);
}

std::int64_t Slices::slice_at_or_above(double z) const {
  auto k = static_cast<std::int64_t>(std::max(0., std::floor((z - lowest_) / distance_ - .5)));
  while (height(static_cast<std::size_t>(k)) < z) ++k;
  return k;
}

std::vector<ContourPiece> Slices::pieces(std::size_t slice) const {
  const double z = height(slice);
  std::vector<ContourPiece> pieces;
  for (std::size_t i = first_[slice]; i < first_[slice + 1]; ++i) {
    const std::uint32_t t = triangles_[i];
    ContourPiece piece;
    piece.triangle = t;
    int crossings = 0;
    for (int side = 0; side < 3; ++side) {
      const bool starts_above = mesh_.corner(t, side).z() >= z;
      const bool ends_above = mesh_.corner(t, (side + 1) % 3).z() >= z;
      if (starts_above == ends_above) continue;
      const Crossing crossing = cross_edge(mesh_, t, side, z);
      ++crossings;
      (starts_above ? piece.to_edge : piece.from_edge) = crossing.edge;
      (starts_above ? piece.to_b : piece.from_b) = crossing.b;
      (starts_above ? piece.to_O : piece.from_O) = crossing.place;
    }
    if (crossings == 2) pieces.push_back(piece);
  }
  return pieces;
}

std::vector<Contour> join(std::vector<ContourPiece> pieces) {
  const std::vector<End> partners = find_partners(pieces);
  std::vector<bool> is_taken(pieces.size(), false);
  std::vector<Contour> contours;
  const auto follow = [&](End start) {
    Contour contour;
    for (End end = start; end != kNoEnd && !is_taken[end / 2]; end = partners[end ^ 1u]) {
      is_taken[end / 2] = true;
      ContourPiece piece = pieces[end / 2];
      if (end % 2 == 1) piece.reverse();
      contour.pieces.push_back(piece);
    }
    contour.is_closed = partners[start] != kNoEnd;
    contours.push_back(std::move(contour));
  };
  for (End end = 0; end < partners.size(); ++end)
    if (partners[end] == kNoEnd && !is_taken[end / 2]) follow(end);
  for (End end = 0; end < partners.size(); end += 2)
    if (!is_taken[end / 2]) follow(end);
  return contours;
}

}  // namespace hilbrush
