#include "sampling/curve/face_frame.h"

#include <algorithm>

namespace hilbrush {

FaceFrame::FaceFrame(const Chart& chart, const TexturedMesh& mesh, const ChartFace& face)
    : triangle(face.triangle),
      origin_O(mesh.corner(face.triangle, 0)),
      e1_O(mesh.corner(face.triangle, 1) - origin_O),
      e2_O(mesh.corner(face.triangle, 2) - origin_O),
      place(face.places[0]) {
  const auto corners = chart.corners_b(face);
  b = corners[0];
  face_to_b.col(0) = corners[1] - corners[0];
  face_to_b.col(1) = corners[2] - corners[0];
  const Eigen::Vector2d u = face.places[1] - place, v = face.places[2] - place;
  const double determinant = u.x() * v.y() - u.y() * v.x();
  to_face << v.y(), -v.x(), -u.y(), u.x();
  to_face *= 1 / determinant;
  space = e1_O.cross(e2_O).norm();
  density = std::abs(face_to_b.determinant() / determinant) * space;
}

void FaceFrames::clear(std::size_t room) {
  frames_.clear();
  frames_.reserve(std::max(kMaxFrames, room));
  // Half of the slots stay empty, so that searches are short.
  std::size_t slot_count = kSlots;
  while (slot_count < 2 * room) slot_count *= 2;
  slots_.assign(slot_count, {});
}

void FaceFrames::fetch(const Chart& chart, const BaseQuad& quad, std::vector<FaceFrame*>& frames) {
  const bool has_room = frames_.size() + quad.face_count <= std::min(frames_.capacity(), slots_.size() / 2);
  if (&chart != chart_ || !has_room) clear(quad.face_count);
  chart_ = &chart;
  frames.clear();
  for (std::uint32_t i = 0; i < quad.face_count; ++i)
    frames.push_back(&frame_of(chart, chart.face_lists[quad.first_face + i]));
}

FaceFrame& FaceFrames::frame_of(const Chart& chart, std::uint32_t face) {
  // Fibonacci hashing: the multiplier is 2^32 over the golden ratio.
  std::size_t slot = (face * 2654435769u >> 8) & (slots_.size() - 1);
  while (slots_[slot].face != face) {
    if (slots_[slot].face == kEmpty) {
      slots_[slot] = {face, static_cast<std::uint32_t>(frames_.size())};
      frames_.emplace_back(chart, tone_.mesh(), chart.faces[face]);
      break;
    }
    slot = (slot + 1) & (slots_.size() - 1);
  }
  return frames_[slots_[slot].frame];
}

}  // namespace hilbrush
