#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "sampling/tone/boundary_sum.h"

/// The way along a polygon's edges from cell to cell of the grid of texel centers.
namespace hilbrush {

/// Where an edge crosses the lines between columns (or rows), as shares of its length.
class Crossings {
 public:
  /// `from` in units of columns; `column` holds it, or, when walking downwards from a line, the one below.
  Crossings(double from, double step, std::int64_t column) {
    // What hardly moves crosses nothing.
    if (std::abs(step) < kMinStep) return;
    line_ = static_cast<double>(step > 0 ? column + 1 : column) - from;
    per_step_ = 1 / step;
    steps_[1] = step > 0 ? 1 : -1;
  }

  static constexpr double kNever = std::numeric_limits<double>::infinity();

  double next() const { return line_ * per_step_; }
  /// Goes on to the next line, or stays. No branch: which lines come next is a toss.
  void pass(bool goes_on) { line_ += static_cast<double>(steps_[goes_on]); }
  /// The step to the next column that this is, or 0.
  int step(bool goes_on) const { return steps_[goes_on]; }

 private:
  static constexpr double kMinStep = 1e-300;

  double line_ = kNever, per_step_ = 1;  ///< from the edge's begin
  std::array<int, 2> steps_{};
};

/// Adds the edge from p to q to a sum. `Cells` knows the cells; all coordinates are relative to its origin:
///   std::int64_t column_of(double x, double step), row_of(double y, double step)   of a walk in that
///   direction void enter(std::int64_t column, std::int64_t row) bool has_next_column(double step),
///   has_next_row(double step)   there is one in that direction void step(int columns, int rows)   to a
///   neighbor const BoundaryCell& here()        valid as BoundarySum::add() asks
template <class Cells>
void add_edge(const Eigen::Vector2d& p, const Eigen::Vector2d& q, Cells& cells, BoundarySum& sum) {
  const Eigen::Vector2d d = q - p;
  if (d.y() == 0) return;  // the integrals are along dy
  const std::int64_t column = cells.column_of(p.x(), d.x()), row = cells.row_of(p.y(), d.y());
  cells.enter(column, row);
  Crossings columns(p.x(), d.x(), column), rows(p.y(), d.y(), row);
  Eigen::Vector2d from = p;
  for (double t = 0;;) {
    const double t_x = cells.has_next_column(d.x()) ? columns.next() : Crossings::kNever;
    const double t_y = cells.has_next_row(d.y()) ? rows.next() : Crossings::kNever;
    const double end = std::min(std::min(t_x, t_y), 1.);
    if (end > t) {
      const Eigen::Vector2d to = p + end * d;
      const BoundaryCell& cell = cells.here();
      sum.add(from.x() - cell.left, from.y() - cell.low, to.x() - from.x(), to.y() - from.y(), cell);
      from = to;
      t = end;
    }
    if (end >= 1) return;
    const bool is_column_next = t_x <= t_y;
    cells.step(columns.step(is_column_next), rows.step(!is_column_next));
    columns.pass(is_column_next);
    rows.pass(!is_column_next);
  }
}

}  // namespace hilbrush
