#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "sampling/base/progress.h"
#include "sampling/curve/surface.h"
#include "sampling/model/textured_mesh.h"
#include "sampling/options/sample_options.h"

/// A repaired mesh with the curve that orders its surface.
namespace hilbrush {

struct Chart;

struct ComponentReport {
  std::size_t triangle_count = 0;
  int genus = -1;  ///< -1: not a manifold of known genus
  int boundary_loops = 0;
  double area_m2 = 0;
  bool is_mapped = false;       ///< on the square; else in 3D Hilbert order
  std::string order_reason;     ///< why not mapped, or not in one piece
  std::size_t piece_count = 1;  ///< more where no map of the whole is valid: each has a curve of its own
  double cut_length_m = 0;      ///< of the cuts that open it
  double map_shear = 1;         ///< mean over the surface of the map's larger stretch over the smaller one
};

/// Independent of tone, count and sampler.
class SurfaceCurve {
 public:
  /// Keeps a reference to `mesh`, which must outlive it. `kind` is kHilbert or kPeano2; what cannot be mapped
  /// follows a 3D Hilbert curve either way. @throws InputError if the mesh has no area.
  explicit SurfaceCurve(const TexturedMesh& mesh, CurveKind kind = CurveKind::kHilbert,
                        const Progress& progress = {});
  ~SurfaceCurve();
  SurfaceCurve(SurfaceCurve&&) noexcept;

  const Surface& surface() const { return surface_; }
  const TexturedMesh& mesh() const { return surface_.mesh; }
  const std::vector<ComponentReport>& components() const { return components_; }
  /// In the order in which they are walked; see chart.h.
  const std::vector<Chart>& charts() const { return charts_; }

 private:
  Surface surface_;
  std::vector<ComponentReport> components_;
  std::vector<Chart> charts_;
};

}  // namespace hilbrush
