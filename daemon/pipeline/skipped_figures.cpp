#include "daemon/pipeline/skipped_figures.h"

#include <algorithm>
#include <cstdio>
#include <map>
#include <numbers>
#include <utility>

namespace hilbrush {
namespace {

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, value < 10 ? "%.2g" : "%.0f", value);
  return text;
}

/// How the amount is told after what it is an amount of.
std::string amounts_text(const SkippedFigures& figures, bool is_beam) {
  const std::string unit = figures.unit == "deg" ? "degrees" : figures.unit;
  if (figures.unit.empty()) return {};
  if (is_beam)
    return ", typically " + number(figures.typical) + " " + unit + " from the dot, nearest " + number(figures.worst) +
           " " + unit;
  return ", typically by " + number(figures.typical) + ", at most by " + number(figures.worst) + " " + unit;
}

}  // namespace

std::vector<SkippedFigures> skipped_figures(const std::vector<SkippedDot>& skipped) {
  std::map<std::pair<SkipReason, std::string_view>, std::vector<const SkippedDot*>> groups;
  for (const SkippedDot& dot : skipped) groups[{dot.reason, dot.what}].push_back(&dot);

  std::vector<SkippedFigures> all;
  for (auto& [key, dots] : groups) {
    SkippedFigures figures;
    figures.reason = skip_reason_name(key.first);
    figures.what = key.second.empty() ? dots.front()->detail : std::string(key.second);
    figures.count = dots.size();
    if (!key.second.empty()) {
      // A beam that is blocked near the dot is farther from being free than one that is blocked at the lens.
      const bool is_beam = key.second.starts_with("beam ");
      std::sort(dots.begin(), dots.end(),
                [](const SkippedDot* a, const SkippedDot* b) { return a->amount < b->amount; });
      const double scale = dots.front()->is_angle ? 180 / std::numbers::pi : 1e3;
      figures.unit = dots.front()->is_angle ? "deg" : "mm";
      figures.typical = scale * dots[dots.size() / 2]->amount;
      figures.worst = scale * (is_beam ? dots.front() : dots.back())->amount;
      figures.text = figures.what + amounts_text(figures, is_beam);
    } else {
      figures.text = figures.what;
    }
    all.push_back(std::move(figures));
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const SkippedFigures& a, const SkippedFigures& b) { return a.count > b.count; });
  return all;
}

}  // namespace hilbrush
