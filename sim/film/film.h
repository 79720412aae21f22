#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "planner/cell_description.h"
#include "sampling/progress.h"
#include "sampling/textured_mesh.h"
#include "sim/devices/emission_record.h"

/// The film: what the emissions expose on the object's surface, developed afterwards from their record.
/// Each emission is a beam from the pose its joints give (forward kinematics of this folder's own), cast onto the mesh: a Gaussian spot,
/// elliptical when oblique, larger when out of focus; its dose gathers in per-triangle micro-grids of spacing pitch/2.
namespace hilbrush {

struct Hit {
  bool is_hit = false;
  bool is_shadowed = false;             ///< something stood between lens and focus: the beam landed there instead
  SurfacePoint point;
  Eigen::Vector3d position_O = Eigen::Vector3d::Zero();
  double incidence = 0;                 ///< rad, against the face normal
  double defocus_m = 0;                 ///< from the focus to the hit along the beam
};

class Film {
 public:
  /// Keeps references to mesh and cell, which must outlive it.
  Film(const TexturedMesh& mesh, const CellDescription& cell, double pitch_m);
  ~Film();
  Film(Film&&) noexcept;

  /// Adds the emissions' dose; returns where each landed (same order). Bit-identical for any number of threads.
  std::vector<Hit> expose(std::span<const Emission> emissions, const Progress& progress = {});
  /// Adds dose straight at given surface points at normal incidence, as a perfect cell would: for calibration.
  void expose_at(std::span<const SurfacePoint> points, std::span<const float> levels);

  double dose_j_m2(const SurfacePoint& point) const;  ///< interpolated
  double painted(const SurfacePoint& point) const;    ///< coverage 0..1 by the paint's response

  const TexturedMesh& mesh() const;
  double pitch_m() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace hilbrush
