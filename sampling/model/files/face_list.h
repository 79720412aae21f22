#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "sampling/model/files/polygon.h"
#include "sampling/model/model_file.h"
#include "sampling/model/textured_mesh.h"

namespace hilbrush {

/// In units of the file. Beyond this, squares and volumes of coordinates leave the range of numbers.
inline constexpr double kMaxCoordinate = 1e30;

/// A shape as every format's reader makes it: polygons of any size over a list of points, in the shape's own
/// frame.
struct FaceList {
  std::vector<Eigen::Vector3d> points;
  std::vector<std::uint32_t> corners;      ///< indices into points, face after face
  std::vector<std::size_t> face_ends;      ///< of each face: one past its last corner
  std::vector<Eigen::Vector2d> corner_uv;  ///< of each corner, or empty
  std::vector<float> corner_luminance;     ///< linear, of each corner, or empty: no colors of its own
  bool is_reversed = false;                ///< the faces run clockwise seen from outside
  bool maps_bounding_box = false;  ///< without corner_uv: VRML's default mapping over the bounding box
  std::string at;                  ///< "file:line", for messages

  void end_face() { face_ends.push_back(corners.size()); }
};

/// How a shape looks, apart from its own colors.
struct Look {
  ColorSource source =
      ColorSource::kNone;  ///< kNone or kMaterial; colors and texture are added by MeshBuilder
  float luminance = 1;     ///< linear, of the material
  double opacity = 1;
  int texture = -1;
  bool repeat_u = true;
  bool repeat_v = true;
  Eigen::Affine2d X_uv = Eigen::Affine2d::Identity();  ///< the texture transform
  std::string name;
};

/// Gathers shapes into one TexturedMesh.
class MeshBuilder {
 public:
  explicit MeshBuilder(const ModelLimits& limits) : limits_(limits) {}

  /// Adds `faces`, moved by `X`; a mirroring X turns the triangles over. Faces with fewer than three
  /// different corners or a corner that is not finite are dropped and counted. @throws InputError at faces.at
  /// if the limit of triangles is exceeded.
  void add(const FaceList& faces, const Eigen::Affine3d& X, const Look& look);

  int add_texture(Texture texture);
  const TexturedMesh& mesh() const { return mesh_; }
  /// Hands over the mesh; the counts of what was dropped go to `warnings`.
  TexturedMesh finish(std::vector<std::string>& warnings);

 private:
  std::uint32_t material_of(const FaceList& faces, const Look& look);
  std::vector<std::uint32_t> add_vertices(const FaceList& faces, const Eigen::Affine3d& X);
  /// Puts the usable outline of a face into kept_ and outline_; false if it is dropped, and counted.
  bool take_outline(const FaceList& faces, std::size_t begin, std::size_t end,
                    const std::vector<std::uint32_t>& vertex_of_point);
  void add_triangle(const FaceList& faces, const Look& look, const std::array<std::size_t, 3>& corners,
                    bool is_flipped, const std::vector<std::uint32_t>& vertex_of_point);

  using MaterialKey = std::tuple<int, int, bool, bool, double, std::string>;

  const ModelLimits& limits_;
  TexturedMesh mesh_;
  std::map<MaterialKey, std::uint32_t> material_indices_;
  PolygonCutter cutter_;
  std::vector<std::size_t> kept_;         ///< corners of the face at hand, without immediate repetitions
  std::vector<Eigen::Vector3d> outline_;  ///< their positions
  std::size_t short_face_count_ = 0;
  std::size_t infinite_face_count_ = 0;
  std::string first_short_face_;
};

/// VRML97, 6.23: s along the longest side of the bounding box, t along the second longest, both in units of
/// the longest.
std::vector<Eigen::Vector2d> bounding_box_mapping(const std::vector<Eigen::Vector3d>& points,
                                                  const std::vector<std::uint32_t>& corners);

/// sRGB-encoded color, channels 0..1 (clamped), to linear-light Rec. 709 luminance.
float luminance_of_srgb(double red, double green, double blue);

}  // namespace hilbrush
