#include "sampling/parametric/point_sets.h"

#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <string>

#include "sampling/base/input_error.h"
#include "sampling/curve/sequence.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d;

constexpr std::uint64_t kMaxPoints = std::uint64_t{1} << 31;
/// "To avoid the leading zeros phenomenon" (section 5.1.3).
constexpr std::uint32_t kDroppedPoints = 100;

double radical_inverse_3(std::uint64_t k) {
  double number = 0;
  for (double digit = 1. / 3; k > 0; k /= 3, digit /= 3) number += static_cast<double>(k % 3) * digit;
  return number;
}

/// Direction numbers of both sequences, 32 binary digits. First dimension, polynomial x: the identity.
/// Second, polynomial x + 1: digit j of number r is the coefficient of x^-(r+1) in 1 / (x + 1)^(j+1), which
/// is binomial(r, j) modulo 2; so each number is the one before plus half of it.
struct DirectionNumbers {
  std::array<std::array<std::uint32_t, 32>, 2> of_dimension;

  constexpr DirectionNumbers() : of_dimension{} {
    of_dimension[1][0] = std::uint32_t{1} << 31;
    for (unsigned r = 0; r < 32; ++r) {
      of_dimension[0][r] = std::uint32_t{1} << (31 - r);
      if (r > 0) of_dimension[1][r] = of_dimension[1][r - 1] ^ of_dimension[1][r - 1] >> 1;
    }
  }
};
constexpr DirectionNumbers kDirections;

/// Points first .. first + count - 1 of the digital sequence, in order of Gray codes: each differs from the
/// one before by one direction number (Antonov and Saleev 1979).
std::vector<Vector2d> digital_points(std::uint32_t first, std::uint64_t count) {
  std::array<std::uint32_t, 2> digits{};
  for (std::uint32_t gray = first ^ first >> 1; gray != 0; gray &= gray - 1)
    for (unsigned d = 0; d < 2; ++d)
      digits[d] ^= kDirections.of_dimension[d][static_cast<unsigned>(std::countr_zero(gray))];
  std::vector<Vector2d> points;
  points.reserve(count);
  for (std::uint64_t k = first; points.size() < count; ++k) {
    points.emplace_back(digits[0] * 0x1p-32, digits[1] * 0x1p-32);
    for (unsigned d = 0; d < 2; ++d)
      digits[d] ^= kDirections.of_dimension[d][static_cast<unsigned>(std::countr_one(k))];
  }
  return points;
}

std::vector<Vector2d> jittered_grid(std::uint64_t count, std::uint64_t seed) {
  auto side = static_cast<std::uint64_t>(std::sqrt(static_cast<double>(count)));
  if (side * side < count) ++side;
  std::vector<Vector2d> points;
  points.reserve(side * side);
  for (std::uint64_t i = 0; i < side * side; ++i) {
    const std::uint64_t column = i % side;
    const std::uint64_t row = i / side;
    const Vector2d corner(static_cast<double>(column), static_cast<double>(row));
    const Vector2d offset(uniform_number(seed, 2 * i), uniform_number(seed, 2 * i + 1));
    points.emplace_back((corner + offset) / static_cast<double>(side));
  }
  return points;
}

template <class Point>
std::vector<Vector2d> one_by_one(std::uint64_t count, Point point) {
  std::vector<Vector2d> points;
  points.reserve(count);
  for (std::uint64_t k = 0; k < count; ++k) points.push_back(point(k));
  return points;
}

}  // namespace

std::vector<Vector2d> plane_set(PlaneSet set, std::uint64_t count, std::uint64_t seed) {
  if (count > kMaxPoints) throw InputError("count", "is above " + std::to_string(kMaxPoints));
  switch (set) {
    case PlaneSet::kRandom:
      return one_by_one(count, [&](std::uint64_t k) {
        return Vector2d(uniform_number(seed, 2 * k), uniform_number(seed, 2 * k + 1));
      });
    case PlaneSet::kJittered:
      return jittered_grid(count, seed);
    case PlaneSet::kHalton:
      return one_by_one(count,
                        [](std::uint64_t k) { return Vector2d(radical_inverse_2(k), radical_inverse_3(k)); });
    case PlaneSet::kHammersley:
      return one_by_one(count, [&](std::uint64_t k) {
        return Vector2d(radical_inverse_2(k), (static_cast<double>(k) + .5) / static_cast<double>(count));
      });
    case PlaneSet::kSobol:
      return digital_points(kDroppedPoints + 1, count);
    case PlaneSet::kNiederreiter:
      return digital_points(kDroppedPoints, count);
  }
  return {};
}

Eigen::Vector3d equal_area_sphere(const Vector2d& uv) {
  const double z = 2 * uv.y() - 1;
  const double radius = std::sqrt(std::max(0., 1 - z * z));
  const double turn = 2 * std::numbers::pi * uv.x();
  return {radius * std::cos(turn), radius * std::sin(turn), z};
}

std::vector<Eigen::Vector3d> sphere_set(PlaneSet set, std::uint64_t count, std::uint64_t seed) {
  std::vector<Eigen::Vector3d> points;
  for (const Vector2d& uv : plane_set(set, count, seed)) points.push_back(equal_area_sphere(uv));
  return points;
}

}  // namespace hilbrush
