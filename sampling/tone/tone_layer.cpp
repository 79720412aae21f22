#include "sampling/tone/tone_layer.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "sampling/base/check.h"
#include "sampling/tone/boundary_walk.h"

namespace hilbrush {
namespace {

using Index = std::int64_t;

/// Farther from the picture's own texels columns are not counted one by one.
constexpr double kFar = 1e9;

/// The column (or row) that holds `x`, when walking in direction `step`. Without repeats all before texel 0
/// is column -1, and all after the last texel is the last column: the tone does not change there.
inline Index column_of(double x, double step, int size, bool repeats) {
  if (!repeats) x = std::clamp(x, -.5, size - .5);
  const Index column = floor_index(x);
  // A walk to the left that begins on a grid line is in the column before it.
  const Index walked = step < 0 && static_cast<double>(column) == x ? column - 1 : column;
  return repeats ? walked : std::clamp<Index>(walked, -1, size - 1);
}

/// Dunavant's rule of degree 4 on a triangle: two orbits of three places each, by the barycentric coordinate
/// that differs, the other one, and the weight.
struct Orbit {
  double alone, twice, weight;
};
constexpr std::array<Orbit, 2> kTriangleOrbits{{{0.108103018168070, 0.445948490915965, 0.223381589678011},
                                                {0.816847572980459, 0.091576213509771, 0.109951743655322}}};

}  // namespace

/// The cells around a small polygon, all made beforehand: most of its edges pass most of them.
class ToneLayer::WindowCells {
 public:
  static constexpr Index kMaxCells = 36;

  WindowCells(const ToneLayer& layer, TexelAddressing addressing, Index x0, Index y0, Index columns,
              Index rows)
      : columns_(columns), rows_(rows) {
    std::array<Index, kMaxCells + 1> texels;
    for (Index i = 0; i <= columns; ++i)
      texels[static_cast<std::size_t>(i)] = texel_index(x0 + i, layer.width_, addressing.repeat_x);
    const auto fill = [&](Index row, Line& line) {
      const float* tones = layer.row(row, addressing);
      TexelOnLine sum{};
      for (std::size_t i = 0; i <= static_cast<std::size_t>(columns); ++i) {
        const double tone = tones[texels[i]], left = static_cast<double>(i) - 1;
        if (i > 0) {
          const double before = sum.tone, f = .5 * (before + tone);
          sum.f += f;
          sum.xf += left * f + before * (1. / 6) + tone * (1. / 3);
          sum.ff += (before * before + before * tone + tone * tone) * (1. / 3);
        }
        sum.tone = tone;
        line[i] = sum;
      }
    };
    std::array<Line, 2> lines;
    fill(y0, lines[0]);
    BoundaryCell* cell = cells_.data();
    for (Index row = 0; row < rows; ++row) {
      const Line& lower = lines[static_cast<std::size_t>(row % 2)];
      Line& upper = lines[static_cast<std::size_t>((row + 1) % 2)];
      fill(y0 + row + 1, upper);
      double fg = 0;
      for (std::size_t i = 0; i < static_cast<std::size_t>(columns); ++i) {
        const TexelOnLine &a = lower[i], &b = lower[i + 1], &c = upper[i], &d = upper[i + 1];
        *cell++ = {static_cast<double>(i),
                   static_cast<double>(row),
                   {a.tone, b.tone, c.tone, d.tone},
                   {a.f, c.f, a.xf, c.xf, a.ff, fg, c.ff}};
        fg += (a.tone * c.tone + .5 * (a.tone * d.tone + b.tone * c.tone) + b.tone * d.tone) * (1. / 3);
      }
    }
  }

  static Index column_of(double x, double step) {
    const auto column = static_cast<Index>(x);
    return step < 0 && static_cast<double>(column) == x ? column - 1 : column;
  }
  static Index row_of(double y, double step) { return column_of(y, step); }
  void enter(Index column, Index row) { column_ = column, row_ = row; }
  static bool has_next_column(double) { return true; }
  static bool has_next_row(double) { return true; }
  void step(int columns, int rows) { column_ += columns, row_ += rows; }
  /// Rounding may lead an edge's end over the window's side; the tone goes on there.
  const BoundaryCell& here() const {
    return cells_[static_cast<std::size_t>(std::clamp<Index>(row_, 0, rows_ - 1) * columns_ +
                                           std::clamp<Index>(column_, 0, columns_ - 1))];
  }

 private:
  /// A texel, and the integrals along its row up to it.
  struct TexelOnLine {
    double tone, f, xf, ff;
  };
  using Line = std::array<TexelOnLine, kMaxCells + 1>;

  Index columns_, rows_;
  Index column_ = 0, row_ = 0;
  std::array<BoundaryCell, kMaxCells> cells_;
};

/// The cells along the way through a large polygon. Between rows j and j + 1 the tone is (1 - t) f(x) + t
/// g(x), t = y - j, where f and g are piecewise linear; their integrals along x, from a fixed column x0, are
/// kept while the walk crosses columns.
class ToneLayer::WalkedCells {
 public:
  WalkedCells(const ToneLayer& layer, TexelAddressing addressing, Index x0, Index y0)
      : layer_(layer), addressing_(addressing), x0_(x0), y0_(y0) {}

  Index column_of(double x, double step) const {
    return hilbrush::column_of(x + static_cast<double>(x0_), step, layer_.width_, addressing_.repeat_x) - x0_;
  }
  Index row_of(double y, double step) const {
    return hilbrush::column_of(y + static_cast<double>(y0_), step, layer_.height_, addressing_.repeat_y) -
           y0_;
  }
  void enter(Index column, Index row) {
    column_ = column + x0_;
    enter_row(row + y0_);
  }
  /// Beyond the first and the last texel of a picture that does not repeat there are no more columns.
  bool has_next_column(double step) const {
    return addressing_.repeat_x || (step > 0 ? column_ < layer_.width_ - 1 : column_ > -1);
  }
  bool has_next_row(double step) const {
    return addressing_.repeat_y || (step > 0 ? row_ < layer_.height_ - 1 : row_ > -1);
  }

  void step(int columns, int rows) {
    if (columns == 0) return enter_row(row_ + rows);
    if (columns > 0) {
      if (column_ >= x0_) add_column(here_, static_cast<double>(column_ - x0_), 1);
      here_ = tones(++column_);
    } else {
      here_ = tones(--column_);
      if (column_ >= x0_) add_column(here_, static_cast<double>(column_ - x0_), -1);
    }
  }

  const BoundaryCell& here() {
    BoundaryCell& cell = cells_[next_];
    next_ = next_ + 1 == cells_.size() ? 0 : next_ + 1;
    // Left of texel 0 of a picture that does not repeat the column has no left end; the integrals start at x0
    // = 0.
    cell = {static_cast<double>(std::max(column_, x0_) - x0_), static_cast<double>(row_ - y0_), here_, sums_};
    return cell;
  }

 private:
  CellTones tones(Index column) const {
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
      for (Index i = x0_; i < column_; ++i) add_column(tones(i), static_cast<double>(i - x0_), 1);
    here_ = tones(column_);
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

  /// Adds the integrals over a whole column, times `sign`.
  void add_column(const CellTones& k, double left, double sign) {
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

  const ToneLayer& layer_;
  TexelAddressing addressing_;
  Index x0_, y0_;
  Index column_ = 0, row_ = 0;
  const float* lower_ = nullptr;
  const float* upper_ = nullptr;
  CellTones here_{};
  RowSums sums_{};
  std::array<BoundaryCell, BoundarySum::kMax + 1> cells_;
  std::size_t next_ = 0;
};

/// Within one cell the tone is bilinear: its square has degree 4 at most.
TexelIntegral ToneLayer::integrate_in_cell(std::span<const Eigen::Vector2d> polygon, const CellTones& k,
                                           const Eigen::Vector2d& origin) {
  TexelIntegral sum;
  const double across = k.b - k.a, up = k.c - k.a, twist = k.d - k.c - across;
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
        const double tone = k.a + t * up + s * (across + t * twist), weighted = orbit.weight * tone;
        mass += weighted;
        x_mass += weighted * s;
        y_mass += weighted * t;
        square += weighted * tone;
      }
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
  const double a = tones_[lower + left], b = tones_[lower + right], c = tones_[upper + left],
               d = tones_[upper + right];
  const double f = .5 * (a + b);
  sum.f += f;
  sum.xf += column * f + a / 6 + b / 3;
  sum.ff += (a * a + a * b + b * b) / 3;
  sum.fg += (2 * a * c + a * d + b * c + 2 * b * d) / 6;
}

ToneLayer::RowPrefix ToneLayer::prefix(int row, int column) const {
  const int block = column / kBlock;
  RowPrefix sum = prefixes_[static_cast<std::size_t>(row) * static_cast<std::size_t>(blocks_) +
                            static_cast<std::size_t>(block)];
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
  const auto between = [](double s, double t, const float* lower, const float* upper, Index left,
                          Index right) {
    return (1 - t) * ((1 - s) * lower[left] + s * lower[right]) +
           t * ((1 - s) * upper[left] + s * upper[right]);
  };
  if (point.x() >= 0 && point.y() >= 0 && point.x() < width_ - 1 && point.y() < height_ - 1) {
    const auto column = static_cast<Index>(point.x()), row = static_cast<Index>(point.y());
    const float* lower = tones_.data() + row * width_;
    return between(point.x() - static_cast<double>(column), point.y() - static_cast<double>(row), lower,
                   lower + width_, column, column + 1);
  }
  const Index column = column_of(point.x(), 0, width_, addressing.repeat_x);
  const Index row = column_of(point.y(), 0, height_, addressing.repeat_y);
  return between(std::clamp(point.x() - static_cast<double>(column), 0., 1.),
                 std::clamp(point.y() - static_cast<double>(row), 0., 1.), this->row(row, addressing),
                 this->row(row + 1, addressing), texel_index(column, width_, addressing.repeat_x),
                 texel_index(column + 1, width_, addressing.repeat_x));
}

TexelIntegral ToneLayer::integrate(std::span<const Eigen::Vector2d> polygon,
                                   TexelAddressing addressing) const {
  if (polygon.size() < 3) return {};
  Eigen::Vector2d low = polygon[0], high = low;
  for (const Eigen::Vector2d& p : polygon.subspan(1)) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const auto sum_along = [&](auto& cells, Index x0, Index y0) {
    // Sums start at the polygon, so that tiny polygons lose no digits.
    const Eigen::Vector2d origin(static_cast<double>(x0), static_cast<double>(y0));
    BoundarySum sum;
    Eigen::Vector2d p = polygon.back() - origin;
    for (const Eigen::Vector2d& corner : polygon) {
      const Eigen::Vector2d q = corner - origin;
      add_edge(p, q, cells, sum);
      p = q;
    }
    TexelIntegral result = sum.total();
    result.first += result.mass * origin;
    return result;
  };
  if (low.minCoeff() > -kFar && high.maxCoeff() < kFar) {
    const Index x0 = floor_index(low.x()), y0 = floor_index(low.y());
    const Index columns = floor_index(high.x()) - x0 + 1, rows = floor_index(high.y()) - y0 + 1;
    if (columns * rows == 1) {
      const float* lower = row(y0, addressing);
      const float* upper = row(y0 + 1, addressing);
      const Index left = texel_index(x0, width_, addressing.repeat_x);
      const Index right = texel_index(x0 + 1, width_, addressing.repeat_x);
      return integrate_in_cell(polygon, {lower[left], lower[right], upper[left], upper[right]},
                               {static_cast<double>(x0), static_cast<double>(y0)});
    }
    if (columns * rows <= WindowCells::kMaxCells) {
      WindowCells cells(*this, addressing, x0, y0, columns, rows);
      return sum_along(cells, x0, y0);
    }
  }
  const Index column = column_of(low.x(), 0, width_, addressing.repeat_x);
  const Index x0 = addressing.repeat_x ? column : std::max<Index>(column, 0);
  const Index y0 = column_of(low.y(), 0, height_, addressing.repeat_y);
  WalkedCells cells(*this, addressing, x0, y0);
  return sum_along(cells, x0, y0);
}

const float* ToneLayer::row(std::int64_t row, TexelAddressing addressing) const {
  return tones_.data() + texel_index(row, height_, addressing.repeat_y) * width_;
}

}  // namespace hilbrush
