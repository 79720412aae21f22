#include "sampling/disk/disk.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

namespace hilbrush {

Disk::Disk(const TexturedMesh& mesh, const Neighbors& neighbors,
           const std::vector<std::uint32_t>& triangles) {
  const auto side_of = [&](TriangleSide other) {
    const auto at = std::lower_bound(triangles.begin(), triangles.end(), other.triangle);
    if (at == triangles.end() || *at != other.triangle) return kNoSide;
    return TriangleSide{static_cast<std::uint32_t>(at - triangles.begin()), other.side};
  };
  for (const auto t : triangles) {
    faces_.push_back(mesh.triangles[t]);
    sources_.push_back({t, {Eigen::Vector2d(0, 0), Eigen::Vector2d(1, 0), Eigen::Vector2d(0, 1)}});
    neighbors_.push_back(neighbors[t]);
    for (TriangleSide& other : neighbors_.back())
      if (other != kNoSide) other = side_of(other);
  }
  const Fans fans = find_fans(neighbors_);
  positions_.resize(fans.count);
  for (std::size_t f = 0; f < faces_.size(); ++f)
    for (std::size_t c = 0; c < 3; ++c) positions_[fans.of_corners[f][c]] = mesh.vertices[faces_[f][c]];
  faces_ = fans.of_corners;
}

double Disk::angle(std::uint32_t face, std::size_t corner) const {
  const Triangle& f = faces_[face];
  const Eigen::Vector3d& p = positions_[f[corner]];
  const Eigen::Vector3d a = positions_[f[(corner + 1) % 3]] - p, b = positions_[f[(corner + 2) % 3]] - p;
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

std::uint32_t Disk::split_edge(TriangleSide s, double share) {
  const auto middle = static_cast<std::uint32_t>(positions_.size());
  positions_.push_back((1 - share) * positions_[from(s)] + share * positions_[to(s)]);
  const TriangleSide across = neighbors_[s.triangle][s.side];
  // Cuts one face from the middle of a side to its apex: it keeps the first half, a new face takes the
  // second.
  const auto halve = [&](TriangleSide side, double f_share) {
    const auto [f, i] = side;
    const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
    const auto added = static_cast<std::uint32_t>(faces_.size());
    FaceSource second = sources_[f];
    const Eigen::Vector2d middle_b = (1 - f_share) * second.corners[i] + f_share * second.corners[j];
    second.corners = {middle_b, sources_[f].corners[j], sources_[f].corners[k]};
    sources_[f].corners[j] = middle_b;
    faces_.push_back({middle, faces_[f][j], faces_[f][k]});
    faces_[f][j] = middle;
    sources_.push_back(second);
    const TriangleSide beyond = neighbors_[f][j];
    neighbors_.push_back({kNoSide, beyond, {f, static_cast<std::uint8_t>(j)}});
    if (beyond != kNoSide) neighbors_[beyond.triangle][beyond.side] = {added, 1};
    neighbors_[f][j] = {added, 2};
    return added;
  };
  const std::uint32_t second = halve(s, share);
  if (across == kNoSide) return middle;
  const std::uint32_t second_across = halve(across, 1 - share);
  neighbors_[s.triangle][s.side] = {second_across, 0};
  neighbors_[second_across][0] = s;
  neighbors_[second][0] = across;
  neighbors_[across.triangle][across.side] = {second, 0};
  return middle;
}

void Disk::cut_edge(TriangleSide s) {
  const TriangleSide across = std::exchange(neighbors_[s.triangle][s.side], kNoSide);
  if (across != kNoSide) neighbors_[across.triangle][across.side] = kNoSide;
}

void Disk::finish_cuts() {
  Fans fans = find_fans(neighbors_);
  std::vector<Eigen::Vector3d> positions(fans.count);
  for (std::size_t f = 0; f < faces_.size(); ++f)
    for (std::size_t c = 0; c < 3; ++c) positions[fans.of_corners[f][c]] = positions_[faces_[f][c]];
  positions_ = std::move(positions);
  faces_ = std::move(fans.of_corners);
}

void Disk::fill(const BoundaryLoop& loop) {
  if (loop.size() == 2) {
    // A slit: its sides go together again.
    neighbors_[loop[0].triangle][loop[0].side] = loop[1];
    neighbors_[loop[1].triangle][loop[1].side] = loop[0];
    return;
  }
  const auto center = static_cast<std::uint32_t>(positions_.size());
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const TriangleSide s : loop) sum += positions_[from(s)];
  positions_.push_back(sum / static_cast<double>(loop.size()));
  const auto first = static_cast<std::uint32_t>(faces_.size());
  const auto n = static_cast<std::uint32_t>(loop.size());
  for (std::uint32_t i = 0; i < n; ++i) {
    const TriangleSide s = loop[i];
    faces_.push_back({to(s), from(s), center});
    sources_.push_back({});
    neighbors_.push_back({s, {first + (i + n - 1) % n, 2}, {first + (i + 1) % n, 1}});
    neighbors_[s.triangle][s.side] = {first + i, 0};
  }
}

}  // namespace hilbrush
