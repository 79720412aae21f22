#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "sampling/curve/chart.h"
#include "sampling/tone/tone_field.h"

/// The affine maps between a face's triangle, the square, space and the texture; and a cache of the latest
/// ones, so that quads which share a face share its frame.
namespace hilbrush {

/// A face, with the affine maps of its triangle.
struct FaceFrame {
  FaceFrame(const Chart& chart, const TexturedMesh& mesh, const ChartFace& face);

  std::uint32_t triangle;
  Eigen::Vector3d origin_O, e1_O, e2_O;  ///< corner 0 of the triangle; from there to corners 1 and 2
  Eigen::Vector2d place;                 ///< of the face's first corner on the square
  Eigen::Matrix2d to_face;               ///< from there to coordinates along the face's sides
  Eigen::Vector2d b;                     ///< barycentric coordinates of the face's first corner
  Eigen::Matrix2d face_to_b;
  double space;                      ///< m^2 for a unit of barycentric area
  double density;                    ///< m^2 for a unit of the square; infinite where the map has no area
  std::optional<TriangleTone> tone;  ///< see FaceFrames::tone_on

  Eigen::Vector3d at(const Eigen::Vector2d& point_b) const {
    return origin_O + point_b.x() * e1_O + point_b.y() * e2_O;
  }
};

/// Keeps about a thousand frames. What it returns depends on its arguments alone.
class FaceFrames {
 public:
  explicit FaceFrames(const ToneField& tone) : tone_(tone) {}

  /// The frames of a quad's faces, in the quad's order; valid until the next call.
  void fetch(const Chart& chart, const BaseQuad& quad, std::vector<FaceFrame*>& frames);
  /// The tone on a frame's triangle, computed at first use: many frames need none.
  const TriangleTone& tone_on(FaceFrame& frame) const {
    if (!frame.tone) frame.tone = tone_.on(frame.triangle);
    return *frame.tone;
  }

 private:
  static constexpr std::size_t kMaxFrames = 1024;
  static constexpr std::size_t kSlots = 4096;
  static constexpr std::uint32_t kEmpty = ~std::uint32_t{0};
  struct Slot {
    std::uint32_t face = kEmpty, frame = 0;
  };

  void clear(std::size_t room);
  FaceFrame& frame_of(const Chart& chart, std::uint32_t face);

  const ToneField& tone_;
  const Chart* chart_ = nullptr;
  std::vector<FaceFrame> frames_;  ///< never grows beyond its reserved memory: pointers to frames stay valid
  std::vector<Slot> slots_;        ///< a hash table, with linear probing
};

}  // namespace hilbrush
