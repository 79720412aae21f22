#pragma once
#include <array>
#include <vector>

#include "sampling/tone/tone_layer.h"
#include "sampling/tone/triangle_frame.h"

/// An atlas: every triangle has a rectangle of texels of its own, which no other triangle touches. A mesh's
/// own texture coordinates overlap, tile and mirror, so that one texel is many places; here a texel is one
/// place.
namespace hilbrush {

/// Where each triangle lies in the atlas. Texels are nodes of a grid along the triangle's longest edge, at
/// most `spacing_m` apart, with nodes on its corners.
class AtlasLayout {
 public:
  struct Rectangle {
    int x = 0, y = 0;  ///< of the first texel
    int columns = 0, rows = 0;
  };

  /// Keeps a reference to `mesh`. Should it take more than `texel_limit` texels, the spacing grows until it
  /// does not.
  AtlasLayout(const TexturedMesh& mesh, double spacing_m, double texel_limit);

  const TexturedMesh& mesh() const { return mesh_; }
  int width() const { return width_; }
  int height() const { return height_; }
  std::size_t texel_count() const {
    return static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  }
  const Rectangle& rectangle(std::uint32_t triangle) const { return rectangles_[triangle]; }
  std::size_t texel_index(const Rectangle& r, int column, int row) const {
    return static_cast<std::size_t>(r.y + row) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(r.x + column);
  }
  /// Meters between texels, along and across the longest edge.
  Eigen::Vector2d step_m(const TriangleFrame& frame, std::uint32_t triangle) const;
  /// Texel coordinates of a triangle's corners.
  std::array<Eigen::Vector2d, 3> texel_corners(std::uint32_t triangle) const;

 private:
  void pack();

  const TexturedMesh& mesh_;
  std::vector<Rectangle> rectangles_;
  int width_ = 0, height_ = 0;
};

/// Asked coverage in an atlas; `layout` outlives it.
struct AskedAtlas {
  const AtlasLayout& layout;
  ToneLayer tones;
};

}  // namespace hilbrush
