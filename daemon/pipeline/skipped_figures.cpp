#include "daemon/pipeline/skipped_figures.h"

#include <algorithm>
#include <map>
#include <utility>

#include "sampling/base/angles.h"
#include "sampling/base/text.h"

namespace hilbrush {
namespace {

/// The end of the sentence: by how much.
std::string amounts_text(const SkippedFigures& figures, SkipMeasure measure) {
  const std::string unit = figures.unit == "deg" ? "degrees" : figures.unit;
  if (measure == SkipMeasure::kFreeLength)
    return ", typically " + amount(figures.typical) + " " + unit + " from the dot, nearest " +
           amount(figures.worst) + " " + unit;
  return ", typically by " + amount(figures.typical) + ", at most by " + amount(figures.worst) + " " + unit;
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
    if (dots.front()->measure != SkipMeasure::kNone) {
      const SkipMeasure measure = dots.front()->measure;
      const bool is_angle = measure == SkipMeasure::kExcessAngle;
      std::sort(dots.begin(), dots.end(),
                [](const SkippedDot* a, const SkippedDot* b) { return a->amount < b->amount; });
      const double scale = is_angle ? 1 / kDegree : 1e3;
      figures.unit = is_angle ? "deg" : "mm";
      figures.typical = scale * dots[dots.size() / 2]->amount;
      // The nearer to the dot a beam is blocked, the farther it is from being free.
      figures.worst = scale * (measure == SkipMeasure::kFreeLength ? dots.front() : dots.back())->amount;
      figures.text = figures.what + amounts_text(figures, measure);
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
