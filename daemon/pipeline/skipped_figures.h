#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "planner/plan.h"

/// Why dots are skipped, counted, as the report tells it.
namespace hilbrush {

struct SkippedFigures {
  std::string reason;  ///< its name, as in dots.skipped
  std::string what;    ///< finer than the reason: "tilt past its limit"
  std::uint64_t count = 0;
  std::string unit;               ///< of the amounts, "mm" or "deg"; empty: there are none
  double typical = 0, worst = 0;  ///< the median, and the farthest from being reached
  std::string text;               ///< all of it: "tilt past its limit, typically by 2.1, at most by 5.3 degrees"
};

/// The most frequent first.
std::vector<SkippedFigures> skipped_figures(const std::vector<SkippedDot>& skipped);

}  // namespace hilbrush
