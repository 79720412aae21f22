#include "sampling/tone/tone_layer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "sampling/check.h"

namespace hilbrush {
namespace {

using Index = std::int64_t;

/// Where the integer grid line `i` of an unbounded picture finds its texel.
Index texel_index(Index i, int size, bool repeats) {
  if (!repeats) return std::clamp<Index>(i, 0, size - 1);
  const Index r = i % size;
  return r < 0 ? r + size : r;
}

/// The column (or row) that holds `x`, when walking in direction `step`. Without repeats all before texel 0 is column
/// -1, and all after the last texel is the last column: the tone does not change there.
Index column_of(double x, double step, int size, bool repeats) {
  const double column = step < 0 ? std::ceil(x) - 1 : std::floor(x);
  if (repeats) return static_cast<Index>(column);
  return static_cast<Index>(std::clamp(column, -1., size - 1.));
}

constexpr std::array<double, 3> kGaussPlaces{0.1127016653792583, 0.5, 0.8872983346207417};
constexpr std::array<double, 3> kGaussWeights{5. / 18, 8. / 18, 5. / 18};

}  // namespace

/// Walks a polygon's edges through the texels. Between rows j and j + 1 the tone is (1 - t) f(x) + t g(x), t = y - j,
/// where f and g are piecewise linear; their integrals along x, from a fixed column x0, are kept while the walk crosses
/// columns.
class ToneLayer::BoundaryWalk {
 public:
  BoundaryWalk(const ToneLayer& layer, TexelAddressing addressing, Index x0, Index y0)
      : layer_(layer), addressing_(addressing), x0_(x0), y0_(y0) {}

  /// p and q relative to (x0, y0).
  void add_edge(const Eigen::Vector2d& p, const Eigen::Vector2d& q) {
    const Eigen::Vector2d d = q - p;
    result_.area += .5 * (p.x() + q.x()) * d.y();
    if (d.y() == 0) return;  // the integrals are along dy
    column_ = column_of(p.x() + static_cast<double>(x0_), d.x(), layer_.width_, addressing_.repeat_x);
    enter_row(column_of(p.y() + static_cast<double>(y0_), d.y(), layer_.height_, addressing_.repeat_y));
    for (double t = 0; t < 1;) {
      const double t_x = crossing(column_ - x0_, p.x(), d.x(), column_, layer_.width_, addressing_.repeat_x);
      const double t_y = crossing(row_ - y0_, p.y(), d.y(), row_, layer_.height_, addressing_.repeat_y);
      const double end = std::clamp(std::min(t_x, t_y), t, 1.);
      if (end > t) add_piece(p + t * d, p + end * d);
      t = end;
      if (t >= 1) break;
      if (t_x <= t_y)
        enter_column(column_ + (d.x() > 0 ? 1 : -1));
      else
        enter_row(row_ + (d.y() > 0 ? 1 : -1));
    }
  }

  const TexelIntegral& result() const { return result_; }

 private:
  /// Of one column between two rows: the tone at its four texels.
  struct Corners {
    double a, b;  ///< row j: at the column's left and right
    double c, d;  ///< row j + 1
  };
  /// Integrals along x from x0: of f, g, x f, x g, f^2, f g, g^2.
  struct RowSums {
    double f = 0, g = 0, xf = 0, xg = 0, ff = 0, fg = 0, gg = 0;
  };

  /// Where along the edge the walk leaves its column (or row).
  static double crossing(Index relative, double from, double step, Index index, int size, bool repeats) {
    const double never = std::numeric_limits<double>::infinity();
    if (step > 0) return !repeats && index == size - 1 ? never : (static_cast<double>(relative + 1) - from) / step;
    if (step < 0) return !repeats && index == -1 ? never : (static_cast<double>(relative) - from) / step;
    return never;
  }

  Corners corners(Index column) const {
    const Index left = texel_index(column, layer_.width_, addressing_.repeat_x);
    const Index right = texel_index(column + 1, layer_.width_, addressing_.repeat_x);
    return {lower_[left], lower_[right], upper_[left], upper_[right]};
  }

  void enter_row(Index row) {
    row_ = row;
    const float* tones = layer_.tones_.data();
    lower_ = tones + texel_index(row, layer_.height_, addressing_.repeat_y) * layer_.width_;
    upper_ = tones + texel_index(row + 1, layer_.height_, addressing_.repeat_y) * layer_.width_;
    sums_ = {};
    if (column_ - x0_ > 2 * kBlock)
      sums_ = long_row_sums();
    else
      for (Index i = x0_; i < column_; ++i) add_column(corners(i), static_cast<double>(i - x0_), 1);
    here_ = corners(column_);
  }

  /// From the stored prefixes, those of whole repeats taken off.
  RowSums long_row_sums() const {
    const Index repeats_before = addressing_.repeat_x ? (x0_ - texel_index(x0_, layer_.width_, true)) : 0;
    const Index from = x0_ - repeats_before, to = column_ - repeats_before;
    const auto along = [&](const float* tones) {
      const int row = static_cast<int>((tones - layer_.tones_.data()) / layer_.width_);
      const RowPrefix a = layer_.repeated_prefix(row, from), b = layer_.repeated_prefix(row, to);
      const double f = b.f - a.f;
      return RowPrefix{f, b.xf - a.xf - static_cast<double>(from) * f, b.ff - a.ff, b.fg - a.fg};
    };
    const RowPrefix low = along(lower_), high = along(upper_);
    return {low.f, high.f, low.xf, high.xf, low.ff, lower_ == upper_ ? low.ff : low.fg, high.ff};
  }

  void enter_column(Index column) {
    if (column > column_) {
      if (column_ >= x0_) add_column(here_, static_cast<double>(column_ - x0_), 1);
      here_ = corners(column);
    } else {
      here_ = corners(column);
      if (column >= x0_) add_column(here_, static_cast<double>(column - x0_), -1);
    }
    column_ = column;
  }

  /// Adds the integrals over the column's first `s` (1: all of it), times `sign`.
  static RowSums column_sums(const Corners& k, double left, double s) {
    const double s2 = .5 * s * s, s3 = s * s * s / 3;
    const double df = k.b - k.a, dg = k.d - k.c;
    RowSums sums;
    sums.f = k.a * s + df * s2;
    sums.g = k.c * s + dg * s2;
    sums.xf = left * sums.f + k.a * s2 + df * s3;
    sums.xg = left * sums.g + k.c * s2 + dg * s3;
    sums.ff = k.a * k.a * s + 2 * k.a * df * s2 + df * df * s3;
    sums.fg = k.a * k.c * s + (k.a * dg + k.c * df) * s2 + df * dg * s3;
    sums.gg = k.c * k.c * s + 2 * k.c * dg * s2 + dg * dg * s3;
    return sums;
  }

  static RowSums sum_of(const RowSums& p, const RowSums& q, double sign) {
    return {p.f + sign * q.f,   p.g + sign * q.g,   p.xf + sign * q.xf, p.xg + sign * q.xg,
            p.ff + sign * q.ff, p.fg + sign * q.fg, p.gg + sign * q.gg};
  }

  void add_column(const Corners& k, double left, double sign) { sums_ = sum_of(sums_, column_sums(k, left, 1), sign); }

  /// A straight piece within one column and row: the integrands are polynomials of degree at most 5 along it.
  void add_piece(const Eigen::Vector2d& p, const Eigen::Vector2d& q) {
    // Left of texel 0 of a picture that does not repeat the column has no left end; the integrals start at x0 = 0.
    const double left = static_cast<double>(std::max(column_, x0_) - x0_);
    for (std::size_t k = 0; k < kGaussPlaces.size(); ++k) {
      const Eigen::Vector2d m = p + kGaussPlaces[k] * (q - p);
      const double weight = kGaussWeights[k] * (q.y() - p.y());
      const double t = m.y() - static_cast<double>(row_ - y0_);
      const RowSums s = sum_of(sums_, column_sums(here_, left, m.x() - left), 1);
      const double mass = (1 - t) * s.f + t * s.g;
      result_.mass += weight * mass;
      result_.first.x() += weight * ((1 - t) * s.xf + t * s.xg);
      result_.first.y() += weight * m.y() * mass;
      result_.square += weight * ((1 - t) * (1 - t) * s.ff + 2 * t * (1 - t) * s.fg + t * t * s.gg);
    }
  }

  const ToneLayer& layer_;
  TexelAddressing addressing_;
  Index x0_, y0_;
  Index column_ = 0, row_ = 0;
  const float* lower_ = nullptr;
  const float* upper_ = nullptr;
  Corners here_{};
  RowSums sums_;
  TexelIntegral result_;
};

ToneLayer::ToneLayer(int width, int height, std::vector<float> tones)
    : width_(width), height_(height), tones_(std::move(tones)) {
  CHECK(width > 0 && height > 0);
  CHECK_EQ(tones_.size(), static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (const float tone : tones_) mean_ += tone;
  mean_ /= static_cast<double>(tones_.size());
  blocks_ = width / kBlock + 1;
  prefixes_.reserve(static_cast<std::size_t>(blocks_) * static_cast<std::size_t>(height));
  for (int row = 0; row < height; ++row) {
    RowPrefix sum;
    for (int column = 0; column <= width; ++column) {
      if (column % kBlock == 0) prefixes_.push_back(sum);
      if (column < width) add_column(sum, row, column);
    }
  }
}

void ToneLayer::add_column(RowPrefix& sum, int row, int column) const {
  const std::size_t lower = static_cast<std::size_t>(row) * static_cast<std::size_t>(width_);
  const std::size_t upper = row + 1 == height_ ? 0 : lower + static_cast<std::size_t>(width_);
  const auto left = static_cast<std::size_t>(column),
             right = static_cast<std::size_t>(column + 1 == width_ ? 0 : column + 1);
  const double a = tones_[lower + left], b = tones_[lower + right], c = tones_[upper + left], d = tones_[upper + right];
  const double f = .5 * (a + b);
  sum.f += f;
  sum.xf += column * f + a / 6 + b / 3;
  sum.ff += (a * a + a * b + b * b) / 3;
  sum.fg += (2 * a * c + a * d + b * c + 2 * b * d) / 6;
}

ToneLayer::RowPrefix ToneLayer::prefix(int row, int column) const {
  const int block = column / kBlock;
  RowPrefix sum =
      prefixes_[static_cast<std::size_t>(row) * static_cast<std::size_t>(blocks_) + static_cast<std::size_t>(block)];
  for (int i = block * kBlock; i < column; ++i) add_column(sum, row, i);
  return sum;
}

ToneLayer::RowPrefix ToneLayer::repeated_prefix(int row, std::int64_t column) const {
  const std::int64_t repeats = column / width_;
  RowPrefix sum = prefix(row, static_cast<int>(column - repeats * width_));
  if (repeats == 0) return sum;
  const RowPrefix all = prefix(row, width_);
  const double n = static_cast<double>(repeats), w = width_;
  sum.xf += n * w * sum.f + n * all.xf + .5 * n * (n - 1) * w * all.f;
  sum.f += n * all.f;
  sum.ff += n * all.ff;
  sum.fg += n * all.fg;
  return sum;
}

double ToneLayer::at(const Eigen::Vector2d& point, TexelAddressing addressing) const {
  const Index column = column_of(point.x(), 0, width_, addressing.repeat_x);
  const Index row = column_of(point.y(), 0, height_, addressing.repeat_y);
  const Index left = texel_index(column, width_, addressing.repeat_x);
  const Index right = texel_index(column + 1, width_, addressing.repeat_x);
  const float* lower = tones_.data() + texel_index(row, height_, addressing.repeat_y) * width_;
  const float* upper = tones_.data() + texel_index(row + 1, height_, addressing.repeat_y) * width_;
  const double s = std::clamp(point.x() - static_cast<double>(column), 0., 1.);
  const double t = std::clamp(point.y() - static_cast<double>(row), 0., 1.);
  return (1 - t) * ((1 - s) * lower[left] + s * lower[right]) + t * ((1 - s) * upper[left] + s * upper[right]);
}

TexelIntegral ToneLayer::integrate(std::span<const Eigen::Vector2d> polygon, TexelAddressing addressing) const {
  if (polygon.size() < 3) return {};
  Eigen::Vector2d low = polygon[0];
  for (const Eigen::Vector2d& p : polygon) low = low.cwiseMin(p);
  // Sums start at the polygon, so that tiny polygons lose no digits.
  const Index x0 = std::max<Index>(column_of(low.x(), 0, width_, addressing.repeat_x),
                                   addressing.repeat_x ? std::numeric_limits<Index>::min() : 0);
  const Index y0 = column_of(low.y(), 0, height_, addressing.repeat_y);
  const Eigen::Vector2d origin(static_cast<double>(x0), static_cast<double>(y0));
  BoundaryWalk walk(*this, addressing, x0, y0);
  for (std::size_t i = 0; i < polygon.size(); ++i)
    walk.add_edge(polygon[i] - origin, polygon[(i + 1) % polygon.size()] - origin);
  TexelIntegral result = walk.result();
  result.first += result.mass * origin;
  return result;
}

}  // namespace hilbrush
