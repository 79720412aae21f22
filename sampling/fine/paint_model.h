#pragma once
#include <memory>
#include <vector>

#include "sampling/fine/cube_grid.h"
#include "sampling/fine/fine.h"

/// The painted picture as the sampler `fine` predicts it.
namespace hilbrush {

/// A coarse film of its own, because sampling does not use the simulator: nodes of equal area all over the
/// surface, nine a pitch squared, placed along the same curve as the dots. The dose is exact at nodes (spots
/// at normal incidence, cut off and kept from passing through thin walls as in sim/film/film_lattice.h).
/// Errors are blurred between blobs of a few neighboring nodes, which is much cheaper than between nodes.
class PaintModel {
 public:
  PaintModel(const SurfaceCurve& curve, const ToneField& tone, double pitch_m, const SpotModel& spot);

  /// A dot as the paint receives it.
  struct Exposure {
    Eigen::Vector3f
        place;  ///< relative to the middle of the mesh, in meters: single precision is enough there
    Eigen::Vector3f normal;  ///< unit
    float level = 1;
  };
  Eigen::Vector3f place_of(const Eigen::Vector3d& position_O) const {
    return (position_O - middle_O_).cast<float>();
  }

  /// Paints the picture from scratch. Returns the squared error of the blurred picture, averaged over the
  /// nodes.
  double expose(std::span<const Exposure> exposures);
  /// Gradient of the squared error with respect to this dot's place.
  Eigen::Vector3f gradient(const Exposure& exposure) const;

 private:
  struct Blob {
    Eigen::Vector3f place = Eigen::Vector3f::Zero();
    Eigen::Vector3f normal = Eigen::Vector3f::Zero();
    std::uint32_t begin = 0, end = 0;                 ///< its nodes
    float error = 0;                                  ///< painted minus wanted, summed over its nodes
    float blurred = 0;                                ///< that error, blurred twice
    Eigen::Vector3f slope = Eigen::Vector3f::Zero();  ///< gradient of `blurred`
  };

  /// A blob within reach of the blur, and the weight of its error.
  struct Link {
    std::uint32_t blob;
    float weight;
  };

  void place_nodes(const SurfaceCurve& curve, const ToneField& tone);
  void gather_blobs();
  void link_blobs();
  void tabulate(const SpotModel& spot);
  float spot_reach_m() const;
  /// Dose of one exposure at a node.
  struct NodeDose {
    float dose = 0;                                    ///< 0 outside of the light
    Eigen::Vector3f across = Eigen::Vector3f::Zero();  ///< from dot to node, without the part along the beam
  };
  NodeDose dose_at(const Exposure& exposure, std::size_t node) const;
  void collect_dose(std::span<const Exposure> exposures);
  void blur();

  double pitch_m_;
  float spot_radius_m_, peak_dose_;
  Eigen::Vector3d middle_O_;
  std::vector<Eigen::Vector3f> places_, normals_;
  std::vector<float> wanted_, dose_;
  std::vector<float> pull_;  ///< per node: 2 * (error blurred twice) * (slope of the coverage over the dose)
  std::vector<Blob> blobs_;
  std::vector<std::size_t> link_begins_;  ///< per blob, into links_
  std::vector<Link> links_;
  std::vector<float> coverage_, coverage_slope_;
  std::unique_ptr<CubeGrid> node_grid_;
};

}  // namespace hilbrush
