#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "sampling/base/enum_names.h"

/// Point sets in the unit square with which the thesis compares its own (sections 2.1.2 and 5.1.3).
namespace hilbrush {

enum class PlaneSet {
  kRandom,        ///< pairs of independent numbers
  kJittered,      ///< one random point in each of ceil(sqrt N)^2 equal squares, row by row: ceil(sqrt N)^2
                  ///< points, not N
  kHalton,        ///< (psi_2(k), psi_3(k)), k = 0 .. N - 1
  kHammersley,    ///< (psi_2(k), (k + 1/2) / N), as Wong, Luk and Heng, "Sampling with Hammersley and Halton
                  ///< points", 1997
  kSobol,         ///< ACM algorithm 659, the first 100 points dropped
  kNiederreiter,  ///< ACM algorithm 738 in base 2, the first 100 points dropped
};

inline constexpr EnumName<PlaneSet> kPlaneSetNames[] = {
    {PlaneSet::kRandom, "random"}, {PlaneSet::kJittered, "jittered"},
    {PlaneSet::kHalton, "halton"}, {PlaneSet::kHammersley, "hammersley"},
    {PlaneSet::kSobol, "sobol"},   {PlaneSet::kNiederreiter, "niederreiter"},
};

/// The set's points in order of their index; `seed` has an effect on kRandom and kJittered only. Cost O(N),
/// up to 2^31 points. In two dimensions Sobol's and Niederreiter's matrices are the same (their polynomials
/// are x and x + 1), and algorithm 738 counts from 0 where 659 counts from 1: the sets differ in their first
/// and last point.
/// @throws InputError if there are too many.
std::vector<Eigen::Vector2d> plane_set(PlaneSet set, std::uint64_t count, std::uint64_t seed);

/// Equation 5.3: maps the unit square to the unit sphere so that equal areas stay equal.
Eigen::Vector3d equal_area_sphere(const Eigen::Vector2d& uv);
std::vector<Eigen::Vector3d> sphere_set(PlaneSet set, std::uint64_t count, std::uint64_t seed);

}  // namespace hilbrush
