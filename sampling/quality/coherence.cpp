#include <array>
#include <cmath>

#include "sampling/base/check.h"
#include "sampling/curve/hilbert.h"
#include "sampling/curve/peano.h"
#include "sampling/quality/quality.h"
#include "sampling/quality/test_shapes.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d;

/// Middle of the index-th of 4^depth squares along the Hilbert curve.
Vector2d hilbert_vertex(std::uint64_t index, int depth) {
  HilbertQuad quad;
  Vector2d corner = Vector2d::Zero();
  double size = 1;
  for (int level = depth - 1; level >= 0; --level) {
    const auto child = static_cast<unsigned>(index >> (2 * level) & 3u);
    const unsigned slot = quad.slot(child);
    size /= 2;
    corner += size * Vector2d(slot & 1u, slot >> 1u);
    quad = quad.child(child);
  }
  return corner + Vector2d::Constant(size / 2);
}

/// Middle of the index-th of 9^depth squares along the Peano II curve.
Vector2d peano_vertex(std::uint64_t index, int depth) {
  std::uint64_t scale = 1;
  for (int i = 1; i < depth; ++i) scale *= PeanoQuad::kChildCount;
  PeanoQuad quad;
  Vector2d corner = Vector2d::Zero();
  double size = 1;
  for (; scale > 0; scale /= PeanoQuad::kChildCount) {
    const auto child = static_cast<unsigned>(index / scale % PeanoQuad::kChildCount);
    const unsigned slot = quad.slot(child);
    size /= PeanoQuad::kSide;
    corner += size * Vector2d(slot % PeanoQuad::kSide, slot / PeanoQuad::kSide);
    quad = quad.child(child);
  }
  return corner + Vector2d::Constant(size / 2);
}

Vector2d z_vertex(std::uint64_t index, int depth) {
  std::uint64_t x = 0;
  std::uint64_t y = 0;
  for (int level = 0; level < depth; ++level) {
    x |= (index >> (2 * level) & 1u) << level;
    y |= (index >> (2 * level + 1) & 1u) << level;
  }
  const double size = std::ldexp(1., -depth);
  return {(static_cast<double>(x) + .5) * size, (static_cast<double>(y) + .5) * size};
}

/// Row by row, every second row backwards.
Vector2d rows_vertex(std::uint64_t index, int depth) {
  const std::uint64_t side = std::uint64_t{1} << depth;
  const std::uint64_t y = index / side;
  const std::uint64_t x = y % 2 == 0 ? index % side : side - 1 - index % side;
  return Vector2d(static_cast<double>(x) + .5, static_cast<double>(y) + .5) / static_cast<double>(side);
}

Vector2d vertex(PlaneCurve curve, std::uint64_t index, int depth) {
  switch (curve) {
    case PlaneCurve::kHilbert:
      return hilbert_vertex(index, depth);
    case PlaneCurve::kPeano2:
      return peano_vertex(index, depth);
    case PlaneCurve::kZ:
      return z_vertex(index, depth);
    case PlaneCurve::kRows:
      return rows_vertex(index, depth);
  }
  check_failed(__FILE__, __LINE__, "unknown curve");
}

std::uint64_t vertex_count(PlaneCurve curve, int depth) {
  std::uint64_t count = 1;
  for (int i = 0; i < depth; ++i) count *= curve == PlaneCurve::kPeano2 ? 9 : 4;
  return count;
}

/// Pearson's correlation coefficient.
double correlation_of(const std::vector<Vector2d>& pairs) {
  Vector2d mean = Vector2d::Zero();
  for (const Vector2d& pair : pairs) mean += pair / static_cast<double>(pairs.size());
  double xx = 0;
  double yy = 0;
  double xy = 0;
  for (const Vector2d& pair : pairs) {
    const Vector2d d = pair - mean;
    xx += d.x() * d.x();
    yy += d.y() * d.y();
    xy += d.x() * d.y();
  }
  return xx > 0 && yy > 0 ? xy / std::sqrt(xx * yy) : 0;
}

}  // namespace

Coherence spatial_coherence(PlaneCurve curve, int depth, const TestShapes& pairs) {
  CHECK(depth >= 1 && depth <= (curve == PlaneCurve::kPeano2 ? 10 : 16));
  const std::uint64_t count = vertex_count(curve, depth);
  const auto whole = static_cast<double>(count);
  const auto pair_of = [&](std::uint64_t a, std::uint64_t b) {
    return Vector2d((vertex(curve, a, depth) - vertex(curve, b, depth)).norm(),
                    std::abs(static_cast<double>(a) - static_cast<double>(b)) / whole);
  };
  Coherence result;
  const auto take = [&result](const Vector2d& pair) {
    if (pair.y() > 0) result.hoelder = std::max(result.hoelder, pair.x() * pair.x() / pair.y());
  };
  for (std::size_t i = 0; i < pairs.count; ++i) {
    const ShapeNumbers number(pairs, 4, i);
    result.pairs.push_back(pair_of(static_cast<std::uint64_t>(number(0) * whole),
                                   static_cast<std::uint64_t>(number(1) * whole)));
    take(result.pairs.back());
  }
  result.correlation = correlation_of(result.pairs);
  constexpr std::size_t kClosePairs = 100'000;
  for (std::size_t i = 0; i < kClosePairs; ++i) {  // close along the curve, on all scales
    const ShapeNumbers number(pairs, 5, i);
    const auto a = static_cast<std::uint64_t>(number(0) * whole);
    const auto step = static_cast<std::uint64_t>(std::pow(whole, number(1)));
    if (step > 0 && a + step < count) take(pair_of(a, a + step));
  }
  return result;
}

}  // namespace hilbrush
