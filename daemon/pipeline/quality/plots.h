#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "daemon/pipeline/quality/figures.h"

namespace hilbrush {

/// Writes plots of the figures that there are: discrepancy over the count, spectrum, directions, distances
/// between neighbors, and the dots themselves. Returns the names of the files.
std::vector<std::string> write_plots(const std::string& title, const std::vector<SizedFigures>& sizes,
                                     const MeasuredDots& last, const std::filesystem::path& output);

/// Figures 5.21 and 5.22 of the thesis for one curve. Returns the name of the file.
std::string write_coherence(PlaneCurve curve, const Coherence& coherence,
                            const std::filesystem::path& output);

}  // namespace hilbrush
