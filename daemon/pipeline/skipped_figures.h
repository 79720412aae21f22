#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "planner/reach/skipped_dot.h"

/// Why dots are skipped, and how many for each cause, for the report.
namespace hilbrush {

struct SkippedFigures {
  std::string reason;  ///< name of the reason, a key of dots.skipped
  std::string what;    ///< more precise than the reason: "tilt past its limit"
  std::uint64_t count = 0;
  std::string unit;    ///< of the amounts, "mm" or "deg"; empty: there are none
  double typical = 0;  ///< the median of the amounts
  double worst = 0;    ///< the amount of the dot that is farthest from being reached
  std::string text;  ///< the whole sentence: "tilt past its limit, typically by 2.1, at most by 5.3 degrees"
};

/// Sorted by count, most frequent first.
std::vector<SkippedFigures> skipped_figures(const std::vector<SkippedDot>& skipped);

}  // namespace hilbrush
