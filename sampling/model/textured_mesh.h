#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

/// A triangle mesh with a color at every point of its surface: what the pipeline starts from.
/// Plain data. Readers make it, place_on_table() moves it into the object frame O, repair_mesh() cleans it;
/// it is not changed later.
namespace hilbrush {

/// A picture as painting needs it. Row 0 is the bottom row: texel (i, j) has its center at u = (i +
/// .5)/width, v = (j + .5)/height.
struct Texture {
  int width = 0;
  int height = 0;
  int channels =
      3;  ///< of the image: with 1 or 2 it multiplies the surface's color, with 3 or 4 it replaces it
  std::vector<float> luminance;  ///< linear light, 0..1, width * height
  std::vector<float> opacity;    ///< 0..1, width * height, or empty: opaque
  std::string name;              ///< for messages
};

/// Where a triangle's color comes from, weakest first.
enum class ColorSource {
  kNone,      ///< no material at all: white
  kMaterial,  ///< a material's diffuse color
  kColors,    ///< colors per vertex or per face
  kTexture    ///< an image (over, or times, the corner luminance: Texture::channels)
};

/// What the triangles of one appearance share.
struct Material {
  std::string name;
  ColorSource source = ColorSource::kNone;
  int texture = -1;  ///< index into TexturedMesh::textures, or -1
  bool repeat_u = true;
  bool repeat_v = true;
  double opacity = 1;  ///< 0..1; fully transparent surface gets no dots
};

/// A corner is one of the three places where a triangle meets its vertices; uv and luminance are per corner,
/// so seams need no split vertices.
struct TexturedMesh {
  std::vector<Eigen::Vector3d> vertices;                ///< #V; meters, frame O once placed
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< #T; counter-clockwise seen from outside
  std::vector<std::array<Eigen::Vector2d, 3>>
      corner_uv;  ///< #T; zero where there is no texture; VRML's TextureTransform is applied
  std::vector<std::array<float, 3>>
      corner_luminance;  ///< #T; linear-light reflectance 0..1: material, face or vertex color
  std::vector<std::uint32_t> material_index;  ///< #T
  std::vector<Material> materials;
  std::vector<Texture> textures;

  std::size_t triangle_count() const { return triangles.size(); }
  const Eigen::Vector3d& corner(std::size_t t, std::size_t c) const { return vertices[triangles[t][c]]; }
  /// Half the cross product of two edges: area times unit normal.
  Eigen::Vector3d area_vector(std::size_t t) const {
    return .5 * (corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0));
  }
  double area_m2() const;
};

/// A point on the surface: what all queries take.
struct SurfacePoint {
  std::uint32_t triangle = 0;
  Eigen::Vector3d barycentric = Eigen::Vector3d::Constant(1. / 3);  ///< sums to 1
};

/// Position of `point` in the mesh's frame.
Eigen::Vector3d position(const TexturedMesh& mesh, const SurfacePoint& point);
/// The point of `triangle` at the foot of the perpendicular from `p_O`.
SurfacePoint foot_of_perpendicular(const TexturedMesh& mesh, std::uint32_t triangle,
                                   const Eigen::Vector3d& p_O);
/// Unit normal of the point's triangle.
Eigen::Vector3d face_normal(const TexturedMesh& mesh, const SurfacePoint& point);
/// Axis-aligned bounds of the vertices that triangles use: {minimum, maximum}.
std::array<Eigen::Vector3d, 2> bounds(const TexturedMesh& mesh);

}  // namespace hilbrush
