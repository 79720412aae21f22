#pragma once
#include "sampling/textured_mesh.h"
#include "sampling/tone.h"

/// The picture on the surface: coverage at every surface point, as wanted (before the tone curve: what fidelity is measured against)
/// and as asked (after it: the density of dots). Bilinear between texels, linear between vertex colours.
namespace hilbrush {

class ToneField {
 public:
  /// Keeps a reference to `mesh`, which must outlive it. Cost: one pass over the texels and triangles.
  ToneField(const TexturedMesh& mesh, const ToneOptions& options);

  double wanted(const SurfacePoint& point) const;  ///< 0..1
  double asked(const SurfacePoint& point) const;   ///< 0..the curve's largest value

  const TexturedMesh& mesh() const { return mesh_; }
  /// True if the triangle gets no dots whatever its uv: blank by `untextured`, or transparent.
  bool is_blank(std::uint32_t triangle) const;

  // What the exact integrals of sampling need is added here by its owner (asked texels, prefix sums, ...).

 private:
  const TexturedMesh& mesh_;
};

}  // namespace hilbrush
