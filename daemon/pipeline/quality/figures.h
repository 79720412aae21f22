#pragma once
#include <array>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "daemon/pipeline/quality/measured_set.h"

/// The quality figures of one set of dots, as values and as JSON.
namespace hilbrush {

struct SizedFigures {
  std::uint64_t count = 0;
  std::map<std::string, Discrepancy> discrepancy;  ///< by test shapes: "rectangles", ..., "balls"
  std::optional<Spacing> spacing;
  std::optional<double> largest_hole, path_constant;
  std::optional<Spectrum> spectrum;
  std::string no_spectrum;  ///< the reason if there is no spectrum
};

SizedFigures measure(const MeasuredSet& set, const MeasuredDots& dots, const TestShapes& shapes);

/// `is_whole`: with histogram and rings of the spectrum.
nlohmann::ordered_json json_of(const SizedFigures& figures, bool is_whole);

/// Slopes of the discrepancies over the counts, by test shapes; empty for a single count.
nlohmann::ordered_json slopes_of(const std::vector<SizedFigures>& sizes);

}  // namespace hilbrush
