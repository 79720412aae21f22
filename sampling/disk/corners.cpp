#include "sampling/disk/corners.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

namespace hilbrush {
namespace {

/// Radians. A boundary vertex that turns by more is a corner of the shape itself.
constexpr double kShapeCornerTurn = std::numbers::pi / 4;
constexpr double kMinSideShare = .005;
/// With more forks than this the corners are not chosen among them: the search takes all combinations of
/// four.
constexpr std::size_t kMaxForks = 16;

/// Distance of a slit's corners from its tips, as a share of the loop: x / pi where tan(x) = (sqrt(2) - 1)^2.
const double kSlitCorner = std::atan(3 - 2 * std::numbers::sqrt2) / std::numbers::pi;

/// Adds the side nearest to the middle of the longest stretch between two corners.
void add_middle_of_longest(std::vector<std::size_t>& corners, const std::vector<double>& along) {
  const std::size_t n = along.size() - 1;
  const auto at = [&](std::size_t i) { return along[i % n] + (i >= n ? along.back() : 0); };
  const auto end_of = [&](std::size_t k) { return k + 1 < corners.size() ? corners[k + 1] : corners[0] + n; };
  std::size_t longest = 0;
  for (std::size_t k = 1; k < corners.size(); ++k)
    if (at(end_of(k)) - at(corners[k]) > at(end_of(longest)) - at(corners[longest])) longest = k;
  const double middle = .5 * (at(corners[longest]) + at(end_of(longest)));
  std::size_t best = corners[longest] + 1;
  for (std::size_t i = best; i < end_of(longest); ++i)
    if (std::abs(at(i) - middle) < std::abs(at(best) - middle)) best = i;
  corners.push_back(best % n);
  std::sort(corners.begin(), corners.end());
}

/// The shape's own corners, sharpest first; a shape with fewer than four gets the others in the middle of its
/// longest sides.
std::optional<Corners> corners_of_shape(const CutDisk& cut, const std::vector<double>& along) {
  std::vector<double> turn(cut.disk.positions().size(), std::numbers::pi);
  for (std::uint32_t f = 0; f < cut.disk.faces().size(); ++f)
    for (std::size_t c = 0; c < 3; ++c) turn[cut.disk.faces()[f][c]] -= cut.disk.angle(f, c);
  const auto turn_at = [&](std::size_t i) { return turn[cut.disk.from(cut.outer[i])]; };
  std::vector<std::size_t> sharp;
  for (std::size_t i = 0; i < cut.outer.size(); ++i)
    if (turn_at(i) >= kShapeCornerTurn) sharp.push_back(i);
  if (sharp.empty()) return std::nullopt;
  std::stable_sort(sharp.begin(), sharp.end(),
                   [&](std::size_t a, std::size_t b) { return turn_at(a) > turn_at(b) + 1e-9; });
  if (sharp.size() > 4) sharp.resize(4);
  std::sort(sharp.begin(), sharp.end());
  while (sharp.size() < 4) add_middle_of_longest(sharp, along);
  const Corners corners{sharp[0], sharp[1], sharp[2], sharp[3]};
  const auto sides = side_lengths(corners, along);
  if (*std::min_element(sides.begin(), sides.end()) < kMinSideShare * along.back()) return std::nullopt;
  return corners;
}

/// The sides that begin nearest to given shares of the loop's length.
Corners corners_at(const std::array<double, 4>& shares, const std::vector<double>& along) {
  const std::size_t n = along.size() - 1;
  Corners corners{};
  for (std::size_t k = 0; k < 4; ++k) {
    const double wanted = shares[k] * along.back();
    const auto above =
        static_cast<std::size_t>(std::lower_bound(along.begin(), along.end(), wanted) - along.begin());
    const std::size_t nearest =
        above > 0 && wanted - along[above - 1] < along[above] - wanted ? above - 1 : above;
    corners[k] = std::min(std::max(nearest, k == 0 ? 0 : corners[k - 1] + 1), n - 4 + k);
  }
  return corners;
}

/// Four of the forks, so that opposite sides are about equal and none is short.
std::optional<Corners> corners_at_forks(const CutDisk& cut, const std::vector<double>& along) {
  std::vector<std::size_t> forks;
  for (std::size_t i = 0; i < cut.outer.size(); ++i)
    if (std::ranges::find(cut.forks, cut.disk.from(cut.outer[i])) != cut.forks.end()) forks.push_back(i);
  if (forks.size() < 4 || forks.size() > kMaxForks) return std::nullopt;
  std::optional<Corners> best;
  double best_score = std::numeric_limits<double>::infinity();
  const std::size_t n = forks.size();
  for (std::size_t a = 0; a + 3 < n; ++a)
    for (std::size_t b = a + 1; b + 2 < n; ++b)
      for (std::size_t c = b + 1; c + 1 < n; ++c)
        for (std::size_t d = c + 1; d < n; ++d) {
          const Corners corners{forks[a], forks[b], forks[c], forks[d]};
          const auto sides = side_lengths(corners, along);
          const double shortest = *std::min_element(sides.begin(), sides.end());
          const double score = std::abs(sides[0] - sides[2]) + std::abs(sides[1] - sides[3]) - .1 * shortest;
          if (shortest > kMinSideShare * along.back() && score < best_score) {
            best = corners;
            best_score = score;
          }
        }
  return best;
}

/// Where a point of a slit's loop lies on the boundary of the half plane, if the surface is a sphere and the
/// slit goes from pole to pole; corners at +-(sqrt(2) - 1) and +-(sqrt(2) + 1), the loop's start at 0.
double on_half_plane(double share) {
  const double root = std::sqrt(std::tan(std::numbers::pi * std::min(share, 1 - share)));
  return share < .5 ? root : -root;
}

/// Shares of a side of the square, 0 to 1, for the part of the boundary from sqrt(2) - 1 to sqrt(2) + 1: the
/// lemniscate's arc.
double along_square(double x) {
  const double p = std::clamp(.5 * (x - 1 / x), -1., 1.);
  const double arc =
      std::ellint_1(std::numbers::sqrt2 / 2, std::asin(std::abs(p) * std::sqrt(2 / (1 + p * p))));
  return .5 * (1 + std::copysign(arc / std::comp_ellint_1(std::numbers::sqrt2 / 2), p));
}

/// Sides of the square up to a point of a slit's loop, from the loop's start in the middle of a side: 0 to 4.
double along_slit(double share) {
  constexpr double kLow = std::numbers::sqrt2 - 1;
  constexpr double kHigh = std::numbers::sqrt2 + 1;
  const double x = on_half_plane(share);
  // A quarter turn of the square takes x to (1 + x) / (1 - x).
  if (x >= kLow && x <= kHigh) return .5 + along_square(x);
  if (x <= -kLow && x >= -kHigh) return 2.5 + along_square(-1 / x);
  if (std::abs(x) > kHigh) return 1.5 + along_square((x - 1) / (x + 1));
  return (x < 0 ? 4 : 0) - .5 + along_square((1 + x) / (1 - x));
}

/// How far along the long sides of a rectangle its corners must go towards their middles (back around the
/// ends if negative, in shares of the side they are on), for it to become a whole number of squares. Each end
/// is taken for that of a half strip, which cosh(pi z) maps to a half plane.
double shift_for_whole_squares(double length) {
  constexpr double kPi = std::numbers::pi;
  const double below = std::floor(length), whole = length * length < below * (below + 1) ? below : below + 1;
  const double c = std::exp(.5 * kPi * (length - whole));
  return c > 1 ? std::acosh(c) / (kPi * length) : -std::acos(c) / kPi;
}

bool is_slit(const CutDisk& cut) {
  return cut.is_cut && cut.forks.empty();
}

}  // namespace

std::vector<double> lengths_along(const CutDisk& cut) {
  std::vector<double> along{0};
  for (const TriangleSide s : cut.outer) along.push_back(along.back() + cut.disk.length(s));
  return along;
}

std::array<double, 4> side_lengths(const Corners& corners, const std::vector<double>& along) {
  std::array<double, 4> sides{};
  for (std::size_t k = 0; k < 4; ++k) {
    const std::size_t from = corners[k], to = corners[(k + 1) % 4];
    sides[k] = along[to] - along[from] + (to <= from ? along.back() : 0);
  }
  return sides;
}

std::vector<double> boundary_measure(const CutDisk& cut, const std::vector<double>& along) {
  std::vector<double> measure = along;
  if (!is_slit(cut)) return measure;
  for (double& place : measure) place = along_slit(std::min(place / along.back(), 1.));
  measure.front() = 0;
  measure.back() = 4;
  return measure;
}

Corners choose_corners(const CutDisk& cut, const std::vector<double>& along) {
  if (is_slit(cut))
    return corners_at({kSlitCorner, .5 - kSlitCorner, .5 + kSlitCorner, 1 - kSlitCorner}, along);
  const auto natural = cut.is_cut ? corners_at_forks(cut, along) : corners_of_shape(cut, along);
  if (!natural) return corners_at({.125, .375, .625, .875}, along);
  const Corners& c = *natural;
  const auto s = side_lengths(c, along);
  return s[0] + s[2] >= s[1] + s[3] ? c : Corners{c[1], c[2], c[3], c[0]};
}

std::optional<Corners> corners_for_whole_squares(const CutDisk& cut, const std::vector<double>& along,
                                                 double modulus) {
  constexpr double kFits = .03;
  if (!is_slit(cut) || std::abs(std::log(modulus / std::round(modulus))) < kFits) return std::nullopt;
  const double shift =
      modulus >= 1 ? shift_for_whole_squares(modulus) : -shift_for_whole_squares(1 / modulus);
  std::array<double, 4> shares{.5 + shift, 1.5 - shift, 2.5 + shift, 3.5 - shift};
  for (double& share : shares) share /= 4;
  return corners_at(shares, boundary_measure(cut, along));
}

}  // namespace hilbrush
