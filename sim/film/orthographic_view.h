#pragma once
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "sampling/model/textured_mesh.h"

namespace hilbrush {

/// How a view is turned. Right-handed: writing on a surface is not mirrored.
struct ViewDirection {
  const char* name;
  Eigen::Vector3d forward_O;  ///< unit, from the eye to the object
  Eigen::Vector3d up_O;       ///< unit, upwards in the picture, perpendicular to forward
  Eigen::Vector3d right_O() const { return forward_O.cross(up_O); }
};

/// The mesh as seen from infinitely far away: which triangle each pixel shows. Filled by scan conversion with
/// a depth buffer, which for square pixels in parallel rays gives the same picture as casting a ray for each,
/// many times faster.
class OrthographicView {
 public:
  /// Square pixels of side pixel_m, just enough of them for the whole mesh and a margin of `margin` pixels.
  /// `mesh` must outlive the view.
  OrthographicView(const TexturedMesh& mesh, const ViewDirection& direction, double pixel_m, int margin = 0);

  int width() const { return width_; }
  int height() const { return height_; }
  double pixel_m() const { return pixel_m_; }

  enum class Side : std::uint8_t { kBackground, kFront, kBack };
  struct Pixel {
    Side side = Side::kBackground;  ///< back: a face seen from behind, which has no film
    SurfacePoint point;             ///< what the center of the pixel shows; not valid on the background
  };
  Pixel pixel(int x, int y) const;
  /// Replaces `pixels` by row y, 0 being the top. Cheaper than one by one.
  void read_row(int y, std::vector<Pixel>& pixels) const;
  /// The pixel at which p_O is seen, if nothing is more than tolerance_m in front of it.
  std::optional<Eigen::Vector2i> pixel_of(const Eigen::Vector3d& p_O, double tolerance_m) const;

 private:
  static constexpr std::uint32_t kNothing = std::numeric_limits<std::uint32_t>::max();

  Eigen::Vector3d project(const Eigen::Vector3d& p_O) const;  ///< x and y in pixels, depth in meters
  void fill(std::uint32_t triangle);
  std::uint32_t triangle_at(int x, int y) const {
    return triangles_[static_cast<std::size_t>(y) * width_ + x];
  }

  struct PlaneCoordinates;
  PlaneCoordinates coordinates_of(std::uint32_t triangle) const;
  Pixel pixel_on(std::uint32_t triangle, const PlaneCoordinates& coordinates, int x, int y) const;

  const TexturedMesh& mesh_;
  const Eigen::Vector3d right_O_, up_O_, forward_O_;
  const double pixel_m_;
  int width_ = 0, height_ = 0;
  double left_m_ = 0, top_m_ = 0;
  std::vector<std::uint32_t> triangles_;  ///< one a pixel
  std::vector<float> depths_m_;
};

}  // namespace hilbrush
