#include "sampling/gaps/dot_path.h"

#include <limits>

#include "sampling/base/check.h"

namespace hilbrush {

DotPath::DotPath(const std::vector<Dot>& dots) : dots_(dots) {
  for (std::uint32_t i = 0; i < dots.size(); ++i) {
    previous_.push_back(i == 0 ? kEnd : i - 1);
    next_.push_back(i + 1 == dots.size() ? kEnd : i + 1);
  }
  if (dots.empty()) return;
  first_ = 0;
  last_ = static_cast<std::uint32_t>(dots.size() - 1);
}

double DotPath::growth(std::uint32_t before, std::uint32_t after, const Dot& dot) const {
  const auto distance = [&](std::uint32_t i) {
    return i == kEnd ? 0 : (dots_[i].position_O - dot.position_O).norm();
  };
  const double removed =
      before == kEnd || after == kEnd ? 0 : (dots_[before].position_O - dots_[after].position_O).norm();
  return distance(before) + distance(after) - removed;
}

void DotPath::insert_last(const std::vector<std::uint32_t>& nearby) {
  CHECK_EQ(next_.size() + 1, dots_.size());
  const auto dot = static_cast<std::uint32_t>(dots_.size() - 1);
  std::uint32_t before = last_;
  std::uint32_t after = kEnd;
  double least = std::numeric_limits<double>::infinity();
  const auto consider = [&](std::uint32_t b, std::uint32_t a) {
    const double grown = growth(b, a, dots_[dot]);
    if (!(grown < least)) return;
    least = grown;
    before = b;
    after = a;
  };
  for (const std::uint32_t near : nearby) {
    consider(previous_[near], near);
    consider(near, next_[near]);
  }
  previous_.push_back(before);
  next_.push_back(after);
  (before == kEnd ? first_ : next_[before]) = dot;
  (after == kEnd ? last_ : previous_[after]) = dot;
}

std::vector<Dot> DotPath::in_order() const {
  std::vector<Dot> ordered;
  ordered.reserve(dots_.size());
  for (std::uint32_t i = first_; i != kEnd; i = next_[i]) ordered.push_back(dots_[i]);
  CHECK_EQ(ordered.size(), dots_.size());
  return ordered;
}

}  // namespace hilbrush
