#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <vector>

#include "sampling/dots/dots.h"

/// Dots sorted into cells, to find the nearest one or all that are near. Dots may be added; look-ups are
/// thread-safe between additions. Why this is not the grid of sampling/fine: see cube_grid.h.
namespace hilbrush {

/// Normals with a smaller cosine between them (more than 104 degrees apart) belong to different sides of a
/// wall.
inline constexpr double kSameSide = -.25;

class DotGrid {
 public:
  /// Keeps a reference to `dots`; a new dot must be appended there before add(). `size_m` is the side of a
  /// cell: a few pitches.
  DotGrid(const std::vector<Dot>& dots, double size_m);

  /// Adds the dot with this index.
  void add(std::uint32_t dot);

  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  struct Nearest {
    std::uint32_t dot = kNone;
    double distance_m = std::numeric_limits<double>::infinity();
  };
  /// The nearest dot on the same side; none if there is none within `reach_m`.
  Nearest nearest(const Eigen::Vector3d& place_O, const Eigen::Vector3f& normal_O, double reach_m) const;

  /// All dots on the same side within `reach_m`.
  std::vector<std::uint32_t> within(const Eigen::Vector3d& place_O, const Eigen::Vector3f& normal_O,
                                    double reach_m) const;

 private:
  using Cell = Eigen::Matrix<std::int64_t, 3, 1>;
  struct Slot {
    std::uint64_t key = 0;
    std::uint32_t head = kNone;  ///< kNone: free
  };

  Cell cell_of(const Eigen::Vector3d& place_O) const;
  static std::uint64_t key_of(const Cell& cell);
  std::size_t slot_of(std::uint64_t key) const;
  void grow();
  /// Calls visit(dot, distance) for the dots of one cell.
  template <class Visit>
  void visit_cell(const Cell& cell, const Eigen::Vector3d& place_O, const Eigen::Vector3f& normal_O,
                  Visit visit) const;

  const std::vector<Dot>& dots_;
  double size_;
  std::vector<Slot> slots_;  ///< open addressing; their number is a power of two
  std::size_t used_ = 0;
  std::vector<std::uint32_t> next_;  ///< per dot: the next one in its cell
};

}  // namespace hilbrush
