#pragma once
#include <memory>
#include <string>
#include <vector>

#include "sampling/dots.h"
#include "sampling/progress.h"
#include "sampling/sample_options.h"
#include "sampling/textured_mesh.h"
#include "sampling/tone_field.h"

/// Mesh to dots, the entry of sampling/:
///   repair_mesh -> components -> cut_to_disk -> square_map -> surface_curve (adaptive Hilbert quadtree) -> strata ->
///   dots.
/// A component that can't be mapped validly is ordered along a 3D Hilbert curve, and the report says why.
namespace hilbrush {

struct ComponentReport {
  std::size_t triangle_count = 0;
  int genus = -1;  ///< -1: not a manifold of known genus
  int boundary_loops = 0;
  double area_m2 = 0;
  bool is_mapped = false;    ///< on the square; else in 3D Hilbert order
  std::string order_reason;  ///< why not mapped
};

struct SampleReport {
  double path_length_m = 0;     ///< along the dots, in order, jumps between components included
  double path_constant = 0;     ///< path_length / sqrt(count * painted area)
  std::size_t patch_count = 0;  ///< leaves of the quadtree that were visited
};

/// The curve over one repaired mesh. Independent of tone, count and sampler, so that re-sampling costs only the last
/// step.
class SurfaceCurve {
 public:
  /// Keeps a reference to `mesh`, which must outlive it. @throws InputError if the mesh has no area.
  SurfaceCurve(const TexturedMesh& mesh, const Progress& progress = {});
  ~SurfaceCurve();
  SurfaceCurve(SurfaceCurve&&) noexcept;

  const TexturedMesh& mesh() const;
  const std::vector<ComponentReport>& components() const;

  struct Implementation;
  const Implementation& implementation() const { return *implementation_; }

 private:
  std::unique_ptr<Implementation> implementation_;
};

/// Spreads dots along the curve so that every stretch of equal mass (asked coverage times area) gets one.
/// Same input and seed: same bytes, whatever the number of threads.
/// No dots at all where everything is white, blank or transparent; a count other than 0 is an InputError then.
/// @throws InputError if neither or both of pitch and count are given, or dot_limit is exceeded.
DotSequence place_dots(const SurfaceCurve& curve, const ToneField& tone, const SampleOptions& options,
                       SampleReport* report = nullptr, const Progress& progress = {});

}  // namespace hilbrush
