#include "sampling/blue/touching_balls.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace hilbrush {
namespace {

/// Cells of a grid that one task looks at; fixed, so that pairs come in the same order whatever the threads.
constexpr std::size_t kChunk = 256;
constexpr int kCoordinateBits = 19;
constexpr std::uint64_t kCoordinateMask = (std::uint64_t{1} << kCoordinateBits) - 1;

using Pair = std::pair<std::uint32_t, std::uint32_t>;

/// A cube of one grid and its balls: entries_[begin] .. entries_[end - 1].
struct Cube {
  std::uint64_t key;
  std::uint32_t begin, end;
};

class OctaveGrids {
 public:
  explicit OctaveGrids(std::span<const SizedBall> balls) : balls_(balls) {
    smallest_ = balls[0].radius_m;
    double largest = smallest_;
    for (const SizedBall& ball : balls) {
      smallest_ = std::min(smallest_, ball.radius_m);
      largest = std::max(largest, ball.radius_m);
    }
    last_octave_ = std::min(octave_of(largest), kMaxOctaves - 1);
    entries_.resize(balls.size());
    tbb::parallel_for(std::size_t{0}, balls.size(), [&](std::size_t i) {
      entries_[i] = {key_of(octave_of(balls[i].radius_m), balls[i].center_O), static_cast<std::uint32_t>(i)};
    });
    tbb::parallel_sort(entries_);
    find_cubes();
  }

  std::size_t cube_count() const { return cubes_.size(); }

  /// Pairs of each ball of a cube with the balls of its own octave (once) and of larger ones.
  template <class Visit>
  void visit_pairs(std::size_t cube_index, Visit visit) const {
    const Cube& cube = cubes_[cube_index];
    const int octave = octave_of_key(cube.key);
    for (int other = octave; other <= last_octave_; ++other) {
      if (octave_is_empty_[static_cast<std::size_t>(other)]) continue;
      if (other == octave) {
        // All balls of the cube look into the same 27 cubes.
        const auto around = cubes_around(other, balls_[entries_[cube.begin].second].center_O);
        for (std::uint32_t k = cube.begin; k < cube.end; ++k)
          visit_balls(entries_[k].second, around, true, visit);
      } else {
        for (std::uint32_t k = cube.begin; k < cube.end; ++k) {
          const std::uint32_t ball = entries_[k].second;
          visit_balls(ball, cubes_around(other, balls_[ball].center_O), false, visit);
        }
      }
    }
  }

 private:
  static constexpr int kMaxOctaves = 64 - 3 * kCoordinateBits < 7 ? 1 << (64 - 3 * kCoordinateBits) : 128;
  using Surrounding = std::pair<std::array<std::uint32_t, 27>, std::uint32_t>;

  int octave_of(double radius_m) const {
    return std::clamp(static_cast<int>(std::ceil(std::log2(radius_m / smallest_) - 1e-9)), 0,
                      kMaxOctaves - 1);
  }
  /// Two balls of an octave that overlap lie in the same cube or in cubes that touch.
  double side_of(int octave) const { return 2 * smallest_ * std::ldexp(1., octave); }
  static int octave_of_key(std::uint64_t key) { return static_cast<int>(key >> (3 * kCoordinateBits)); }

  using Coordinates = std::array<std::int64_t, 3>;
  Coordinates coordinates_of(int octave, const Eigen::Vector3d& p_O) const {
    const Eigen::Vector3d place = p_O / side_of(octave);
    return {static_cast<std::int64_t>(std::floor(place.x())),
            static_cast<std::int64_t>(std::floor(place.y())),
            static_cast<std::int64_t>(std::floor(place.z()))};
  }
  /// Cubes half a million sides apart share a key; the distance between balls tells them apart.
  static std::uint64_t key_of(int octave, const Coordinates& c) {
    std::uint64_t key = static_cast<std::uint64_t>(octave);
    for (const std::int64_t x : c)
      key = key << kCoordinateBits | (static_cast<std::uint64_t>(x) & kCoordinateMask);
    return key;
  }
  std::uint64_t key_of(int octave, const Eigen::Vector3d& p_O) const {
    return key_of(octave, coordinates_of(octave, p_O));
  }

  void find_cubes() {
    octave_is_empty_.assign(static_cast<std::size_t>(last_octave_) + 1, true);
    for (std::uint32_t k = 0; k < entries_.size(); ++k) {
      if (cubes_.empty() || cubes_.back().key != entries_[k].first)
        cubes_.push_back({entries_[k].first, k, k});
      cubes_.back().end = k + 1;
      octave_is_empty_[static_cast<std::size_t>(octave_of_key(entries_[k].first))] = false;
    }
    std::size_t size = 1;
    while (size < 2 * cubes_.size()) size *= 2;
    table_.assign(size, kNoCube);
    for (std::uint32_t i = 0; i < cubes_.size(); ++i) {
      std::size_t slot = slot_of(cubes_[i].key);
      while (table_[slot] != kNoCube) slot = (slot + 1) & (size - 1);
      table_[slot] = i;
    }
  }
  static constexpr std::uint32_t kNoCube = ~std::uint32_t{0};
  std::size_t slot_of(std::uint64_t key) const {
    return static_cast<std::size_t>((key ^ key >> 29) * 0x9e3779b97f4a7c15u >> 20) & (table_.size() - 1);
  }
  std::uint32_t find(std::uint64_t key) const {
    for (std::size_t slot = slot_of(key); table_[slot] != kNoCube; slot = (slot + 1) & (table_.size() - 1))
      if (cubes_[table_[slot]].key == key) return table_[slot];
    return kNoCube;
  }

  Surrounding cubes_around(int octave, const Eigen::Vector3d& p_O) const {
    Surrounding around{};
    const Coordinates middle = coordinates_of(octave, p_O);
    for (int k = 0; k < 27; ++k) {
      const std::uint32_t cube = find(key_of(
          octave, Coordinates{middle[0] + k % 3 - 1, middle[1] + k / 3 % 3 - 1, middle[2] + k / 9 - 1}));
      if (cube != kNoCube) around.first[around.second++] = cube;
    }
    return around;
  }

  template <class Visit>
  void visit_balls(std::uint32_t ball, const Surrounding& around, bool only_later, Visit& visit) const {
    const SizedBall& mine = balls_[ball];
    for (std::uint32_t c = 0; c < around.second; ++c) {
      const Cube& cube = cubes_[around.first[c]];
      for (std::uint32_t k = cube.begin; k < cube.end; ++k) {
        const std::uint32_t other = entries_[k].second;
        if (only_later && other <= ball) continue;
        const double reach = mine.radius_m + balls_[other].radius_m;
        if ((balls_[other].center_O - mine.center_O).squaredNorm() < reach * reach) visit(ball, other);
      }
    }
  }

  std::span<const SizedBall> balls_;
  double smallest_ = 0;
  int last_octave_ = 0;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> entries_;  ///< key and ball, sorted
  std::vector<Cube> cubes_;
  std::vector<std::uint32_t> table_;  ///< key to cube: open addressing
  std::vector<bool> octave_is_empty_;
};

IndexLists lists_of(std::size_t count, const std::vector<std::vector<Pair>>& chunks) {
  IndexLists lists;
  lists.begins.assign(count + 1, 0);
  for (const auto& pairs : chunks)
    for (const auto& [a, b] : pairs) {
      ++lists.begins[a + 1];
      ++lists.begins[b + 1];
    }
  for (std::size_t i = 0; i < count; ++i) lists.begins[i + 1] += lists.begins[i];
  lists.indices.resize(lists.begins.back());
  std::vector<std::size_t> next(lists.begins.begin(), lists.begins.end() - 1);
  for (const auto& pairs : chunks)
    for (const auto& [a, b] : pairs) {
      lists.indices[next[a]++] = b;
      lists.indices[next[b]++] = a;
    }
  return lists;
}

}  // namespace

IndexLists find_touching_balls(std::span<const SizedBall> balls,
                               const std::function<bool(std::uint32_t, std::uint32_t)>& accept) {
  if (balls.empty()) return {{0}, {}};
  const OctaveGrids grids(balls);
  std::vector<std::vector<Pair>> chunks((grids.cube_count() + kChunk - 1) / kChunk);
  tbb::parallel_for(std::size_t{0}, chunks.size(), [&](std::size_t chunk) {
    for (std::size_t cube = chunk * kChunk; cube < std::min((chunk + 1) * kChunk, grids.cube_count()); ++cube)
      grids.visit_pairs(cube, [&](std::uint32_t a, std::uint32_t b) {
        if (accept(a, b)) chunks[chunk].emplace_back(a, b);
      });
  });
  return lists_of(balls.size(), chunks);
}

}  // namespace hilbrush
