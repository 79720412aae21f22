#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "planner/cell_model/cell_description.h"

/// The result of planning, which the executor runs: exposures in order, and the way-points of the moves
/// between them.
namespace hilbrush {

struct Exposure {
  Eigen::Vector3d position_O = Eigen::Vector3d::Zero();  ///< where the beam is to land, m
  Eigen::Vector3f normal_O = Eigen::Vector3f::Zero();    ///< of the face there
  float tone = 0;                                        ///< wanted coverage, 0..1
  float energy_j = 0;                                    ///< = power_w * pulse_s
  Joints joints{};
  float power_w = 0, pulse_s = 0;
  float incidence = 0;          ///< rad, against the face normal
  std::uint32_t dot_index = 0;  ///< in dots.ply
};

/// A way-point passed (at rest, laser off) before `before_exposure`; several in order of appearance.
/// before_exposure == exposures.size(): on the path home.
struct Via {
  std::uint32_t before_exposure = 0;
  Joints joints{};
};

/// What the program was made from. A program is never run on another cell or model.
struct Provenance {
  std::string model_sha256, settings_sha256, cell_sha256, version;
};

/// What a program `found` was made for instead of what is `wanted`: "another cell", "another model", "other
/// settings"; empty if these agree. The version is not compared: programs of other versions may be read, but
/// are not painted.
std::string provenance_mismatch(const Provenance& found, const Provenance& wanted);

struct ExposureProgram {
  Provenance provenance;
  double pitch_m = 0;
  std::vector<Exposure> exposures;
  std::vector<Via> vias;

  /// The way-points before exposure i, in order.
  std::span<const Via> vias_before(std::size_t i) const;
};

}  // namespace hilbrush
