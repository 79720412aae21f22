#include "sampling/quality/spectrum.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sampling/base/check.h"
#include "sampling/quality/point_transform.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d;

/// Points of one square of plane_spectrum (quality.h).
constexpr double kMaxPointsPerSquare = 60000;
/// Rings up to twice the principal frequency, and sectors of half a turn: 5 degrees each.
constexpr std::size_t kMaxRings = 80;
constexpr std::size_t kMaxDirections = 36;

/// The spectrum of one square; `expected` points in it.
Spectrum spectrum_of_square(std::span<const Vector2d> points, double expected) {
  const double principal = std::sqrt(expected);
  const int highest = std::max(1, static_cast<int>(SpectrumSums::kHighest * principal));
  const PointTransform transform(points, highest);
  // A ring holds at least one frequency in its width, a sector a few hundred.
  SpectrumSums sums(std::clamp<std::size_t>(static_cast<std::size_t>(highest), 1, kMaxRings),
                    std::clamp<std::size_t>(static_cast<std::size_t>(expected / 400), 4, kMaxDirections));
  for (int kx = 0; kx <= highest; ++kx)
    for (int ky = -highest; ky <= highest; ++ky) {
      if (kx == 0 && ky <= 0) continue;  // the other half of the plane mirrors this one
      sums.add(Vector2d(kx, ky) / principal, std::norm(transform.at(kx, ky)) / expected);
    }
  return sums.result();
}

}  // namespace

SpectrumSums::SpectrumSums(std::size_t ring_count, std::size_t direction_count)
    : rings_(ring_count), directions_(direction_count) {}

void SpectrumSums::add(const Vector2d& frequency, double power) {
  const double radius = frequency.norm();
  if (radius >= kHighest) return;
  rings_[static_cast<std::size_t>(radius / kHighest * static_cast<double>(rings_.size()))].add(power);
  if (radius < .5) half_.add(power);
  if (radius < .25) quarter_.add(power);
  if (directions_.empty() || std::abs(radius - 1) > .1) return;
  const double turn =
      std::atan2(frequency.y(), frequency.x()) / std::numbers::pi;  // -1..1; a half turn is the same
  const auto sector =
      static_cast<std::size_t>((turn - std::floor(turn)) * static_cast<double>(directions_.size()));
  directions_[std::min(sector, directions_.size() - 1)].add(power);
}

Spectrum SpectrumSums::result() const {
  Spectrum spectrum;
  for (std::size_t i = 0; i < rings_.size(); ++i) {
    const double mean = rings_[i].mean();
    const double variance = rings_[i].count > 0 ? rings_[i].square / rings_[i].count - mean * mean : 0;
    spectrum.rings.push_back({(static_cast<double>(i) + .5) * kHighest / static_cast<double>(rings_.size()),
                              mean, mean > 0 ? std::max(0., variance) / (mean * mean) : 0});
  }
  for (const Sum& sum : directions_) spectrum.directions.push_back(sum.mean());
  spectrum.below_half = half_.mean();
  spectrum.below_quarter = quarter_.mean();
  complete_spectrum(spectrum);
  return spectrum;
}

void complete_spectrum(Spectrum& spectrum) {
  spectrum.peak = spectrum.anisotropy = 0;
  for (const Spectrum::Ring& ring : spectrum.rings) spectrum.peak = std::max(spectrum.peak, ring.power);
  double mean = 0;
  for (const double power : spectrum.directions)
    mean += power / static_cast<double>(spectrum.directions.size());
  if (!(mean > 0)) return;
  for (const double power : spectrum.directions)
    spectrum.anisotropy = std::max(spectrum.anisotropy, std::abs(power / mean - 1));
}

Spectrum plane_spectrum(std::span<const Vector2d> points) {
  CHECK(!points.empty());
  const auto n = static_cast<double>(points.size());
  const auto per_side = static_cast<std::size_t>(std::ceil(std::sqrt(n / kMaxPointsPerSquare)));
  if (per_side == 1) return spectrum_of_square(points, n);
  std::vector<std::vector<Vector2d>> squares(per_side * per_side);
  const auto side = static_cast<double>(per_side);
  for (const Vector2d& point : points) {
    const Vector2d scaled = side * point;
    const Vector2d corner = scaled.array().floor().max(0.).min(side - 1).matrix();
    squares[static_cast<std::size_t>(corner.y() * side + corner.x())].push_back(scaled - corner);
  }
  std::vector<Spectrum> spectra;
  for (const auto& square : squares) spectra.push_back(spectrum_of_square(square, n / (side * side)));
  return average(spectra);
}

Spectrum average(std::span<const Spectrum> spectra) {
  CHECK(!spectra.empty());
  Spectrum mean = spectra.front();
  for (const Spectrum& spectrum : spectra.subspan(1)) {
    CHECK_EQ(spectrum.rings.size(), mean.rings.size());
    CHECK_EQ(spectrum.directions.size(), mean.directions.size());
    for (std::size_t i = 0; i < mean.rings.size(); ++i) {
      mean.rings[i].power += spectrum.rings[i].power;
      mean.rings[i].anisotropy += spectrum.rings[i].anisotropy;
    }
    for (std::size_t i = 0; i < mean.directions.size(); ++i) mean.directions[i] += spectrum.directions[i];
    mean.below_half += spectrum.below_half;
    mean.below_quarter += spectrum.below_quarter;
  }
  const double share = 1 / static_cast<double>(spectra.size());
  for (Spectrum::Ring& ring : mean.rings) {
    ring.power *= share;
    ring.anisotropy *= share;
  }
  for (double& power : mean.directions) power *= share;
  mean.below_half *= share;
  mean.below_quarter *= share;
  complete_spectrum(mean);
  return mean;
}

}  // namespace hilbrush
