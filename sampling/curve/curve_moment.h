#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <array>

#include "sampling/curve/hilbert.h"
#include "sampling/curve/peano.h"

/// Where a curve in the plane is after a share of its length, and the integral of its position up to there,
/// by a table that takes a few levels at once.
namespace hilbrush {

/// All children of a few levels below a square, in order of the curve, by permutation.
template <class Curve>
struct CurveTable {
  static constexpr unsigned kLevels = Curve::kSide == 2 ? 3 : 2;
  static constexpr unsigned kAlong = Curve::kSide == 2 ? 8 : 9;  ///< children along a side
  static constexpr unsigned kCount = kAlong * kAlong;

  struct Entry {
    double x = 0, y = 0;                ///< low corner in the unit square
    double moment_x = 0, moment_y = 0;  ///< sum of the middles of the children before
    std::uint8_t permutation = 0;
  };
  std::array<std::array<Entry, kCount>, Curve::kPermutationCount> entries;

  constexpr CurveTable() : entries{} {
    for (unsigned p = 0; p < Curve::kPermutationCount; ++p) {
      double moment_x = 0, moment_y = 0;
      for (unsigned i = 0; i < kCount; ++i) {
        Entry& entry = entries[p][i];
        Curve curve(static_cast<std::uint8_t>(p));
        unsigned column = 0, row = 0, divisor = kCount;
        for (unsigned level = 0; level < kLevels; ++level) {
          divisor /= Curve::kChildCount;
          const unsigned child = i / divisor % Curve::kChildCount;
          const unsigned slot = curve.slot(child);
          column = column * Curve::kSide + slot % Curve::kSide;
          row = row * Curve::kSide + slot / Curve::kSide;
          curve = curve.child(child);
        }
        entry = {static_cast<double>(column) / kAlong, static_cast<double>(row) / kAlong, moment_x, moment_y,
                 curve.permutation};
        moment_x += entry.x + .5 / kAlong;
        moment_y += entry.y + .5 / kAlong;
      }
    }
  }
};

template <class Curve>
inline constexpr CurveTable<Curve> kCurveTable{};

/// As many steps of the table as doubles can tell apart.
inline constexpr int kMaxCurveSteps = 8;

/// Integral of the curve's position over its first `share`, in the unit square. Within each of the smallest
/// squares (side 8^-steps of a Hilbert curve, 9^-steps of a Peano curve) the position is taken as the
/// square's middle.
template <class Curve>
inline Eigen::Vector2d curve_moment(Curve curve, double share, int steps = kMaxCurveSteps) {
  using Table = CurveTable<Curve>;
  // In units of the child that the walk is in: its side, and its share of the curve.
  double moment_x = 0, moment_y = 0, low_x = 0, low_y = 0, size = 1, weight = 1;
  share = std::clamp(share, 0., 1.);
  for (int step = 0; step < steps; ++step) {
    const double f = Table::kCount * share;
    const int i = std::min(static_cast<int>(f), static_cast<int>(Table::kCount) - 1);
    const auto& entry = kCurveTable<Curve>.entries[curve.permutation][static_cast<std::size_t>(i)];
    weight *= 1. / Table::kCount;
    moment_x += weight * (i * low_x + size * entry.moment_x);
    moment_y += weight * (i * low_y + size * entry.moment_y);
    low_x += size * entry.x;
    low_y += size * entry.y;
    size *= 1. / Table::kAlong;
    curve = Curve(entry.permutation);
    share = f - i;
  }
  weight *= share;
  return {moment_x + weight * (low_x + size / 2), moment_y + weight * (low_y + size / 2)};
}

/// Where the curve is after `share` of its length, in the unit square.
template <class Curve>
Eigen::Vector2d curve_place(Curve curve, double share) {
  using Table = CurveTable<Curve>;
  Eigen::Vector2d low(0, 0);
  double size = 1;
  for (int step = 0; step < kMaxCurveSteps; ++step) {
    const double f = Table::kCount * std::clamp(share, 0., 1.);
    const unsigned i = std::min(static_cast<unsigned>(f), Table::kCount - 1);
    const auto& entry = kCurveTable<Curve>.entries[curve.permutation][i];
    low += size * Eigen::Vector2d(entry.x, entry.y);
    size /= Table::kAlong;
    curve = Curve(entry.permutation);
    share = f - i;
  }
  return low + Eigen::Vector2d::Constant(size / 2);
}

}  // namespace hilbrush
