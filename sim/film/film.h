#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "planner/cell_model/cell_description.h"
#include "sampling/base/progress.h"
#include "sampling/model/textured_mesh.h"
#include "sim/devices/emission_record.h"
#include "sim/film/film_lattice.h"

/// The film: what the emissions expose on the object's surface, computed afterwards from their record.
/// Each emission is a beam from the pose of its joints (beam.h: independent forward kinematics), cast from
/// the lens onto the mesh (surface_index.h): a Gaussian spot, elliptical when oblique, larger when out of
/// focus. Its dose is summed on small lattices of spacing pitch/2 on the triangles (film_lattice.h), on those
/// that face the beam and lie within two cut radii of depth of where it hit.
namespace hilbrush {

struct Hit {
  bool is_hit = false;
  bool is_shadowed = false;  ///< something stood between lens and focus: the beam landed there instead
  SurfacePoint point;
  Eigen::Vector3d position_O = Eigen::Vector3d::Zero();
  double incidence = 0;  ///< rad, against the face normal
  double defocus_m = 0;  ///< from the focus to the hit along the beam
};

class Film {
 public:
  /// Keeps references to mesh and cell, which must outlive it. @throws InputError if the film would need more
  /// nodes than FilmLattice::kMaxNodes.
  Film(const TexturedMesh& mesh, const CellDescription& cell, double pitch_m);
  ~Film();
  Film(Film&&) noexcept;

  /// Adds the emissions' dose; returns where each landed (same order). Bit-identical for any number of
  /// threads. Cost: O(emissions), some .6 M a second and core.
  std::vector<Hit> expose(std::span<const Emission> emissions, const Progress& progress = {});
  /// Adds dose directly at given surface points at normal incidence, as a perfect cell would: for
  /// calibration. A level of 1 is the full energy.
  void expose_at(std::span<const SurfacePoint> points, std::span<const float> levels);

  double dose_j_m2(const SurfacePoint& point) const;  ///< interpolated
  /// Coverage 0..1 by the paint's response, which is applied at the film's nodes and then interpolated:
  /// interpolating the dose first would smooth it, and a curved response would then make every tone too dark
  /// or too light.
  double painted(const SurfacePoint& point) const;

  /// Replaces `points` by the film's nodes in the cylinder of this radius and half height about `center`,
  /// along its face normal, on triangles that face the same way.
  void points_near(const SurfacePoint& center, double radius_m, std::vector<FilmPoint>& points) const;
  /// Coverage 0..1 for a dose.
  double painted(double dose_j_m2) const;

  const TexturedMesh& mesh() const;
  const CellDescription& cell() const;
  double pitch_m() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace hilbrush
