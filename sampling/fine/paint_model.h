#pragma once
#include <memory>
#include <vector>

#include "sampling/fine/cube_grid.h"
#include "sampling/fine/fine.h"

/// The painted picture as `fine` sees it.
namespace hilbrush {

/// A small film of sampling's own: nodes of equal area all over the surface, nine a pitch squared, laid along the same
/// curve as the dots. Dose is exact at nodes (spots at normal incidence, cut off and kept from thin walls as in
/// sim/film/film_lattice.h). Errors are blurred through blobs of a few nodes each.
class PaintModel {
 public:
  PaintModel(const SurfaceCurve& curve, const ToneField& tone, double pitch_m, const SpotModel& spot);

  /// A dot as the paint meets it.
  struct Exposure {
    Eigen::Vector3f place;   ///< about the middle of the mesh
    Eigen::Vector3f normal;  ///< unit
    float level = 1;
  };
  Eigen::Vector3f place_of(const Eigen::Vector3d& position_O) const { return (position_O - middle_O_).cast<float>(); }

  /// Paints the picture anew. Returns the squared error of its blur, a node on average.
  double expose(std::span<const Exposure> exposures);
  /// Which way the squared error of the blur rises fastest as this dot moves.
  Eigen::Vector3f gradient(const Exposure& exposure) const;

 private:
  struct Blob {
    Eigen::Vector3f place = Eigen::Vector3f::Zero(), normal = Eigen::Vector3f::Zero();
    std::uint32_t begin = 0, end = 0;                 ///< its nodes
    float error = 0;                                  ///< painted minus wanted, summed over its nodes
    float blurred = 0;                                ///< blurred twice
    Eigen::Vector3f slope = Eigen::Vector3f::Zero();  ///< of it
  };

  /// A blob within reach of the blur, and how much of its error arrives.
  struct Link {
    std::uint32_t blob;
    float weight;
  };

  void lay_nodes(const SurfaceCurve& curve, const ToneField& tone);
  void gather_blobs();
  void link_blobs();
  void tabulate(const SpotModel& spot);
  float spot_reach_m() const;
  /// Dose of one exposure at a node, with the way across the beam from dot to node; 0 out of its light.
  float dose_at(const Exposure& exposure, std::size_t node, Eigen::Vector3f& way) const;
  void collect_dose(std::span<const Exposure> exposures);
  void blur();

  double pitch_m_;
  float spot_radius_m_, peak_dose_;
  Eigen::Vector3d middle_O_;
  std::vector<Eigen::Vector3f> places_, normals_;
  std::vector<float> wanted_, dose_;
  std::vector<float> pull_;  ///< per node: twice the twice blurred error times the slope of the paint's answer
  std::vector<Blob> blobs_;
  std::vector<std::size_t> link_begins_;  ///< per blob, into links_
  std::vector<Link> links_;
  std::vector<float> coverage_, coverage_slope_;
  std::unique_ptr<CubeGrid> node_grid_;
};

}  // namespace hilbrush
