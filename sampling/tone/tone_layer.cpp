#include "sampling/tone/tone_layer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "sampling/check.h"

namespace hilbrush {
namespace {

using Index = std::int64_t;

/// std::floor, which without SSE 4.1 is a call.
Index floor_index(double x) {
  const auto i = static_cast<Index>(x);
  return i - (static_cast<double>(i) > x ? 1 : 0);
}

/// Where the integer grid line `i` of an unbounded picture finds its texel.
Index texel_index(Index i, int size, bool repeats) {
  if (i >= 0 && i < size) return i;
  if (!repeats) return i < 0 ? 0 : size - 1;
  const Index r = i % size;
  return r < 0 ? r + size : r;
}

/// The column (or row) that holds `x`, when walking in direction `step`. Without repeats all before texel 0 is column
/// -1, and all after the last texel is the last column: the tone does not change there.
inline Index column_of(double x, double step, int size, bool repeats) {
  if (!repeats) x = std::clamp(x, -.5, size - .5);
  const Index column = floor_index(x);
  // A walk to the left that begins on a grid line is in the column before it.
  const Index walked = step < 0 && static_cast<double>(column) == x ? column - 1 : column;
  return repeats ? walked : std::clamp<Index>(walked, -1, size - 1);
}

/// Gauss, three places: exact to degree 5. The middle one is there twice, each time with half its weight: four places
/// fill whole registers.
using FourPlaces = Eigen::Array4d;
const FourPlaces kGaussPlaces(0.1127016653792583, 0.5, 0.5, 0.8872983346207417);
const FourPlaces kGaussWeights(5. / 18, 4. / 18, 4. / 18, 5. / 18);

/// Dunavant's rule of degree 4 on a triangle: two orbits of three places each, by the barycentric coordinate that
/// differs, the other one, and the weight.
struct Orbit {
  double alone, twice, weight;
};
constexpr std::array<Orbit, 2> kTriangleOrbits{{{0.108103018168070, 0.445948490915965, 0.223381589678011},
                                                {0.816847572980459, 0.091576213509771, 0.109951743655322}}};

}  // namespace

/// The tone at the four texels of one cell of the grid of texel centres; bilinear between them.
struct ToneLayer::Corners {
  double a, b;  ///< lower row: left and right
  double c, d;  ///< upper row

  /// The tone at height t is level(t) + slope(t) s.
  template <class Places>
  Places level(const Places& t) const {
    return a + t * (c - a);
  }
  template <class Places>
  Places slope(const Places& t) const {
    return b - a + t * (d - c - b + a);
  }
};

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
    const double per_column = 1 / d.x(), per_row = 1 / d.y();
    column_ = column_of(p.x() + static_cast<double>(x0_), d.x(), layer_.width_, addressing_.repeat_x);
    enter_row(column_of(p.y() + static_cast<double>(y0_), d.y(), layer_.height_, addressing_.repeat_y));
    const int column_step = d.x() > 0 ? 1 : -1, row_step = d.y() > 0 ? 1 : -1;
    for (double t = 0;;) {
      const double t_x =
          crossing(column_ - x0_, p.x(), d.x(), per_column, column_, layer_.width_, addressing_.repeat_x);
      const double t_y = crossing(row_ - y0_, p.y(), d.y(), per_row, row_, layer_.height_, addressing_.repeat_y);
      const double end = std::clamp(std::min(t_x, t_y), t, 1.);
      if (end > t) add_piece(p + t * d, p + end * d);
      t = end;
      if (t >= 1) break;
      if (t_x <= t_y)
        enter_column(column_ + column_step);
      else
        enter_row(row_ + row_step);
    }
  }

  const TexelIntegral& result() const { return result_; }

 private:
  /// Integrals along x from x0: of f, g, x f, x g, f^2, f g, g^2.
  struct RowSums {
    double f = 0, g = 0, xf = 0, xg = 0, ff = 0, fg = 0, gg = 0;
  };

  /// Where along the edge the walk leaves its column (or row).
  static double crossing(Index relative, double from, double step, double per_step, Index index, int size,
                         bool repeats) {
    constexpr double kNever = std::numeric_limits<double>::infinity();
    if (step > 0) return !repeats && index == size - 1 ? kNever : (static_cast<double>(relative + 1) - from) * per_step;
    if (step < 0) return !repeats && index == -1 ? kNever : (static_cast<double>(relative) - from) * per_step;
    return kNever;
  }

  Corners corners(Index column) const {
    const Index left = texel_index(column, layer_.width_, addressing_.repeat_x);
    const Index right = texel_index(column + 1, layer_.width_, addressing_.repeat_x);
    return {lower_[left], lower_[right], upper_[left], upper_[right]};
  }

  void enter_row(Index row) {
    row_ = row;
    lower_ = layer_.row(row, addressing_);
    upper_ = layer_.row(row + 1, addressing_);
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

  /// Adds the integrals over a whole column, times `sign`.
  void add_column(const Corners& k, double left, double sign) {
    const double f = .5 * (k.a + k.b), g = .5 * (k.c + k.d);
    sums_.f += sign * f;
    sums_.g += sign * g;
    sums_.xf += sign * (left * f + k.a * (1. / 6) + k.b * (1. / 3));
    sums_.xg += sign * (left * g + k.c * (1. / 6) + k.d * (1. / 3));
    const double third = sign * (1. / 3);
    sums_.ff += third * (k.a * k.a + k.a * k.b + k.b * k.b);
    sums_.fg += third * (k.a * k.c + .5 * (k.a * k.d + k.b * k.c) + k.b * k.d);
    sums_.gg += third * (k.c * k.c + k.c * k.d + k.d * k.d);
  }

  /// A straight piece within one column and row: the integrands are polynomials of degree at most 5 along it.
  void add_piece(const Eigen::Vector2d& p, const Eigen::Vector2d& q) {
    // Left of texel 0 of a picture that does not repeat the column has no left end; the integrals start at x0 = 0.
    const double left = static_cast<double>(std::max(column_, x0_) - x0_), low = static_cast<double>(row_ - y0_);
    const double dx = q.x() - p.x(), dy = q.y() - p.y();
    const FourPlaces y = p.y() + kGaussPlaces * dy, t = y - low, u = 1 - t, s = p.x() - left + kGaussPlaces * dx;
    const FourPlaces level = here_.level(t), slope = here_.slope(t);
    const FourPlaces here = s * (level + s * (.5 * slope));
    const FourPlaces weighted = kGaussWeights * (sums_.f + t * (sums_.g - sums_.f) + here);
    const FourPlaces x_mass =
        sums_.xf + t * (sums_.xg - sums_.xf) + left * here + s * s * (.5 * level + s * slope * (1. / 3));
    const FourPlaces row_square = u * (u * sums_.ff + t * (2 * sums_.fg)) + t * t * sums_.gg;
    const FourPlaces mean_square = level * level + s * slope * (level + s * slope * (1. / 3));
    const FourPlaces square = row_square + s * mean_square;
    result_.mass += dy * weighted.sum();
    result_.first.x() += dy * (kGaussWeights * x_mass).sum();
    result_.first.y() += dy * (weighted * y).sum();
    result_.square += dy * (kGaussWeights * square).sum();
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

/// Within one cell the tone is bilinear: its square has degree 4 at most.
TexelIntegral ToneLayer::integrate_in_cell(std::span<const Eigen::Vector2d> polygon, const Corners& k,
                                           const Eigen::Vector2d& origin) {
  TexelIntegral sum;
  const double x0 = polygon[0].x() - origin.x(), y0 = polygon[0].y() - origin.y();
  for (std::size_t i = 2; i < polygon.size(); ++i) {
    const std::array<double, 3> x{x0, polygon[i - 1].x() - origin.x(), polygon[i].x() - origin.x()};
    const std::array<double, 3> y{y0, polygon[i - 1].y() - origin.y(), polygon[i].y() - origin.y()};
    const double area = .5 * ((x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]));
    const double x_sum = x[0] + x[1] + x[2], y_sum = y[0] + y[1] + y[2];
    double mass = 0, x_mass = 0, y_mass = 0, square = 0;
    for (const Orbit& orbit : kTriangleOrbits)
      for (std::size_t c = 0; c < 3; ++c) {
        const double s = orbit.twice * x_sum + (orbit.alone - orbit.twice) * x[c];
        const double t = orbit.twice * y_sum + (orbit.alone - orbit.twice) * y[c];
        const double tone = k.level(t) + s * k.slope(t), weighted = orbit.weight * tone;
        mass += weighted;
        x_mass += weighted * s;
        y_mass += weighted * t;
        square += weighted * tone;
      }
    sum.area += area;
    sum.mass += area * mass;
    sum.first += area * Eigen::Vector2d(x_mass, y_mass);
    sum.square += area * square;
  }
  sum.first += sum.mass * origin;
  return sum;
}

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
  Eigen::Vector2d low = polygon[0], high = low;
  for (const Eigen::Vector2d& p : polygon.subspan(1)) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const Index column = column_of(low.x(), 0, width_, addressing.repeat_x);
  const Index y0 = column_of(low.y(), 0, height_, addressing.repeat_y);
  const bool is_inside = column >= 0 && y0 >= 0 && column + 1 < width_ && y0 + 1 < height_;
  if (is_inside && high.x() <= static_cast<double>(column + 1) && high.y() <= static_cast<double>(y0 + 1)) {
    const float* lower = tones_.data() + y0 * width_ + column;
    const float* upper = lower + width_;
    return integrate_in_cell(polygon, {lower[0], lower[1], upper[0], upper[1]},
                             {static_cast<double>(column), static_cast<double>(y0)});
  }
  // Sums start at the polygon, so that tiny polygons lose no digits.
  const Index x0 = addressing.repeat_x ? column : std::max<Index>(column, 0);
  const Eigen::Vector2d origin(static_cast<double>(x0), static_cast<double>(y0));
  BoundaryWalk walk(*this, addressing, x0, y0);
  for (std::size_t i = 0; i < polygon.size(); ++i)
    walk.add_edge(polygon[i] - origin, polygon[i + 1 == polygon.size() ? 0 : i + 1] - origin);
  TexelIntegral result = walk.result();
  result.first += result.mass * origin;
  return result;
}

const float* ToneLayer::row(std::int64_t row, TexelAddressing addressing) const {
  return tones_.data() + texel_index(row, height_, addressing.repeat_y) * width_;
}

}  // namespace hilbrush
