#include "sampling/blue/stratum_places.h"

#include <tbb/parallel_for.h>

#include <bit>
#include <cmath>

#include "sampling/base/check.h"

namespace hilbrush {
namespace {

/// In spacings: a stratum is about one spacing wide; places farther apart than this are on two sides of a
/// gap.
constexpr double kMaxWidth = 2.5;

/// The places within kMaxWidth spacings of the one that has the most others within that distance.
std::uint8_t open_places(const PlacedStrata& strata, std::size_t s, double spacing_m) {
  const double widest2 = std::pow(kMaxWidth * spacing_m, 2);
  std::uint8_t best = 0;
  for (std::size_t a = 0; a < kPlacesAStratum; ++a) {
    std::uint8_t near = 0;
    for (std::size_t b = 0; b < kPlacesAStratum; ++b)
      if ((strata.place(s, b).position_O - strata.place(s, a).position_O).squaredNorm() <= widest2)
        near = static_cast<std::uint8_t>(near | 1u << b);
    if (std::popcount(near) > std::popcount(best)) best = near;
  }
  return best;
}

PlacedStratum measure(const PlacedStrata& strata, std::size_t s, const ToneField& tone, double dot_mass_m2) {
  // The mean over places of equal mass is weighted by mass: where a stratum has a dark and a light part it
  // keeps to the dark one, where neighbors are near.
  double asked = 0;
  for (std::size_t p = 0; p < kPlacesAStratum; p += 2) {
    const SurfacePlace& place = strata.place(s, p);
    asked +=
        tone.asked(surface_point_at(tone.mesh(), place.triangle, place.position_O)) * 2 / kPlacesAStratum;
  }
  PlacedStratum stratum;
  stratum.spacing_m = std::sqrt(dot_mass_m2 / std::max(asked, 1e-4));
  stratum.open_places = open_places(strata, s, stratum.spacing_m);
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (std::size_t p = 0; p < kPlacesAStratum; ++p)
    if (stratum.open_places >> p & 1u) middle += strata.place(s, p).position_O;
  stratum.middle_O = middle / std::popcount(stratum.open_places);
  const auto normal_of = [&](int p) {
    return tone.mesh().area_vector(strata.place(s, static_cast<std::size_t>(p)).triangle).normalized();
  };
  const Eigen::Vector3d first = normal_of(std::countr_zero(stratum.open_places)),
                        last = normal_of(std::bit_width(stratum.open_places) - 1);
  stratum.normal_O = (first + last).norm() > .1 ? Eigen::Vector3d((first + last).normalized()) : first;
  for (std::size_t p = 0; p < kPlacesAStratum; ++p)
    if (stratum.open_places >> p & 1u)
      stratum.radius_m =
          std::max(stratum.radius_m, (strata.place(s, p).position_O - stratum.middle_O).norm());
  return stratum;
}

}  // namespace

PlacedStrata place_strata(const CurveMass& mass, const ToneField& tone, const SampleOptions& options,
                          std::uint64_t count, SampleReport& report, const Progress& progress) {
  SampleOptions even = options;
  even.sampler = Sampler::kEven;
  even.pitch_m.reset();
  even.dot_count = kPlacesAStratum * count;
  even.dot_limit = *even.dot_count;
  PlacedStrata strata;
  strata.places.reserve(*even.dot_count);
  stream_dots(
      mass, even,
      [&](std::span<const Dot> dots) {
        for (const Dot& dot : dots) strata.places.push_back({dot.position_O, dot.triangle, dot.component});
      },
      &report, progress);
  CHECK_EQ(strata.places.size(), kPlacesAStratum * count);
  strata.strata.resize(count);
  const double dot_mass_m2 = mass.total_m2() / static_cast<double>(count);
  tbb::parallel_for(std::size_t{0}, strata.strata.size(),
                    [&](std::size_t s) { strata.strata[s] = measure(strata, s, tone, dot_mass_m2); });
  return strata;
}

}  // namespace hilbrush
