#include "sampling/disk/orientation.h"

#include <array>
#include <cmath>

namespace hilbrush {
namespace {

/// The exact sum of many doubles, as doubles of which each is smaller than the last digit of the next.
class ExactSum {
 public:
  void add(double x) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      const double sum = x + parts_[i];
      const double from_part = sum - x;
      const double lost = (x - (sum - from_part)) + (parts_[i] - from_part);
      if (lost != 0) parts_[kept++] = lost;
      x = sum;
    }
    parts_[kept++] = x;
    count_ = kept;
  }
  void add_product(double x, double y) {
    const double product = x * y;
    add(std::fma(x, y, -product));
    add(product);
  }
  int sign() const {
    for (std::size_t i = count_; i-- > 0;)
      if (parts_[i] != 0) return parts_[i] > 0 ? 1 : -1;
    return 0;
  }

 private:
  std::array<double, 16> parts_{};
  std::size_t count_ = 0;
};

}  // namespace

int orientation(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  const double left = (b.x() - a.x()) * (c.y() - a.y());
  const double right = (b.y() - a.y()) * (c.x() - a.x());
  const double bound = 4e-16 * (std::abs(left) + std::abs(right));
  if (left - right > bound) return 1;
  if (right - left > bound) return -1;
  ExactSum sum;
  sum.add_product(a.x(), b.y());
  sum.add_product(b.x(), c.y());
  sum.add_product(c.x(), a.y());
  sum.add_product(-b.x(), a.y());
  sum.add_product(-c.x(), b.y());
  sum.add_product(-a.x(), c.y());
  return sum.sign();
}

}  // namespace hilbrush
