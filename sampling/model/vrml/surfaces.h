#pragma once
#include "sampling/model/files/face_list.h"
#include "sampling/model/model_file.h"
#include "sampling/model/vrml/binding.h"

/// The geometry nodes of VRML97 that hold their own numbers, as polygons. A Color or TextureCoordinate node
/// is passed in resolved (PROTO instances and USE followed); a null reference means there is none.
namespace hilbrush::vrml {

/// The nodes a surface refers to.
struct SurfaceParts {
  Reference coordinates;
  Reference colors;
  Reference texture_coordinates;
};

/// IndexedFaceSet (6.23). Faces that use a point that does not exist are dropped with a warning; colors and
/// texture coordinates that do not exist fall back to `otherwise` and to the default mapping.
FaceList indexed_face_set(const Reference& node, const SurfaceParts& parts, float otherwise,
                          std::vector<std::string>& warnings);

/// ElevationGrid (6.17). @throws InputError if its dimensions do not fit its heights.
FaceList elevation_grid(const Reference& node, const SurfaceParts& parts, float otherwise,
                        std::vector<std::string>& warnings);

/// Extrusion (6.18). @throws InputError if cross-section times spine exceeds `limits.triangles`.
FaceList extrusion(const Reference& node, const ModelLimits& limits);

/// Pieces that VRML 1.0 shares: the triples of a list of numbers, and the luminances of a list of colors.
std::vector<Eigen::Vector3d> points_of(const std::vector<double>& numbers);
std::vector<float> luminances_of(const std::vector<double>& numbers);

/// Layout of an index list as VRML writes it: one entry a corner and -1 after each face, or (when it is
/// empty) `fallback`.
class CornerIndices {
 public:
  CornerIndices(const std::vector<double>& indices, const std::vector<double>& fallback)
      : indices_(indices.empty() ? fallback : indices) {}
  /// The entry that belongs to an entry of the coordIndex list, or -1 if there is none.
  double operator[](std::size_t coord_entry) const {
    return coord_entry < indices_.size() ? indices_[coord_entry] : -1;
  }

 private:
  const std::vector<double>& indices_;
};

}  // namespace hilbrush::vrml
