#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "planner/cell_model/cell_description.h"

/// How long moves really take, compared with the time model: least squares of
///   measured = delay + factor of the slowest axis * the time by its speed and acceleration
/// over all moves, in constant memory. Plain value, one thread.
namespace hilbrush {

/// In the form that a cell file's `measured` takes.
struct MeasuredMotion {
  double move_delay_s = 0;
  std::array<std::optional<double>, kAxisCount> time_factor;  ///< of axes that were the slowest often enough
  std::array<std::uint64_t, kAxisCount> moves{};              ///< from which each factor is

  /// The times of moves scatter by about a fifth about the best line, by settling and control ticks: a factor
  /// from this many is good to one percent.
  static constexpr std::uint64_t kMovesEnough = 400;
  /// Whether every factor may go into a cell file.
  bool is_enough() const;
};

class MotionTimes {
 public:
  /// A move from rest to rest that was over `seconds` after it was ordered, the settling that was ordered not
  /// counted.
  void add(const CellDescription& cell, const Joints& from, const Joints& to, double seconds);
  void add(const MotionTimes& other);
  std::uint64_t count() const;
  /// Empty before some hundred moves.
  std::optional<MeasuredMotion> measured() const;

 private:
  struct Sums {
    std::uint64_t moves = 0;
    double promised = 0;
    double measured = 0;
    double promised2 = 0;
    double product = 0;
  };
  double delay_s() const;

  std::array<Sums, kAxisCount> axes_;  ///< by the axis that is the slowest
};

}  // namespace hilbrush
