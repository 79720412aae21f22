#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "daemon/pipeline/quality/figures.h"

namespace hilbrush {

/// Writes what there is to show: discrepancy over the count, spectrum, directions, distances between neighbors, and
/// the dots themselves. Returns the files' names.
std::vector<std::string> write_plots(const std::string& title, const std::vector<SizedFigures>& sizes,
                                     const MeasuredDots& last, const std::filesystem::path& output);

/// Figures 5.21 and 5.22 for a curve. Returns the file's name.
std::string write_coherence(PlaneCurve curve, const Coherence& coherence, const std::filesystem::path& output);

}  // namespace hilbrush
