#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

/// What sampling makes: dots, in the order of the curve.
namespace hilbrush {

struct Dot {
  Eigen::Vector3d position_O;       ///< meters, on the surface
  Eigen::Vector3f normal_O;         ///< unit, of the dot's triangle
  Eigen::Vector3f smooth_normal_O;  ///< unit, interpolated between vertices over smooth edges; what "near the
                                    ///< normal" is measured against
  std::uint32_t triangle = 0;
  std::uint32_t component = 0;  ///< index into SampleReport::components
  float tone = 0;               ///< wanted coverage at the dot, before the tone curve, 0..1
  float level = 1;              ///< wanted energy; 1 blackens one pitch squared
};

struct DotSequence {
  double pitch_m = 0;
  std::vector<Dot> dots;
};

}  // namespace hilbrush
