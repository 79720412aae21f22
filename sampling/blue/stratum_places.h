#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "sampling/curve/stream_dots.h"
#include "sampling/curve/surface_place.h"

/// The strata as `blue` sees them: a few places along each, where its dot may be, and how large it is.
namespace hilbrush {

/// Evenly along the stratum: each stands for the same mass.
inline constexpr std::size_t kPlacesAStratum = 8;

struct PlacedStratum {
  Eigen::Vector3d middle_O;
  Eigen::Vector3d normal_O;      ///< unit
  double spacing_m = 0;          ///< root of its area
  double radius_m = 0;           ///< of its open places, about the middle
  std::uint8_t open_places = 0;  ///< bit p: place p may be chosen. Of a stratum that spans a gap, only the
                                 ///< heavier side is open.
};

struct PlacedStrata {
  double pitch_m = 0;                ///< root of a dot's mass
  std::vector<SurfacePlace> places;  ///< kPlacesAStratum for each stratum
  std::vector<PlacedStratum> strata;

  const SurfacePlace& place(std::size_t stratum, std::size_t p) const {
    return places[stratum * kPlacesAStratum + p];
  }
};

/// The strata of `count` dots. `report` gets the figures of the walk, without the path.
PlacedStrata place_strata(const CurveMass& mass, const ToneField& tone, const SampleOptions& options,
                          std::uint64_t count, SampleReport& report, const Progress& progress);

}  // namespace hilbrush
