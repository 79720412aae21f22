#pragma once
#include <vector>

#include "sampling/dots/dots.h"

/// The order of dots while more are inserted.
namespace hilbrush {

/// The order of dots as a doubly linked list.
class DotPath {
 public:
  /// In the order of `dots`, to which it keeps a reference and to which new ones are appended.
  explicit DotPath(const std::vector<Dot>& dots);

  /// Inserts the last of the dots before or after one of `nearby`, where the path grows least; at the end if
  /// `nearby` is empty.
  void insert_last(const std::vector<std::uint32_t>& nearby);

  /// The dots along the path.
  std::vector<Dot> in_order() const;

 private:
  static constexpr std::uint32_t kEnd = ~std::uint32_t{0};
  double growth(std::uint32_t before, std::uint32_t after, const Dot& dot) const;

  const std::vector<Dot>& dots_;
  std::vector<std::uint32_t> next_, previous_;
  std::uint32_t first_ = kEnd;
  std::uint32_t last_ = kEnd;
};

}  // namespace hilbrush
