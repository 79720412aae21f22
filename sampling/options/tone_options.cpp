#include "sampling/options/tone_options.h"

#include <algorithm>

namespace hilbrush {

double ToneCurve::operator()(double coverage) const {
  if (wanted.empty()) return coverage;
  const auto above = std::upper_bound(wanted.begin(), wanted.end(), coverage);
  if (above == wanted.begin()) return asked.front();
  if (above == wanted.end()) return asked.back();
  const auto k = static_cast<std::size_t>(above - wanted.begin());
  const double f = (coverage - wanted[k - 1]) / (wanted[k] - wanted[k - 1]);
  return asked[k - 1] + f * (asked[k] - asked[k - 1]);
}

double ToneCurve::inverse(double asked_coverage) const {
  if (wanted.empty()) return asked_coverage;
  const auto above = std::lower_bound(asked.begin(), asked.end(), asked_coverage);
  if (above == asked.begin()) return wanted.front();
  if (above == asked.end()) return wanted.back();
  const auto k = static_cast<std::size_t>(above - asked.begin());
  const double share = (asked_coverage - asked[k - 1]) / (asked[k] - asked[k - 1]);
  return wanted[k - 1] + share * (wanted[k] - wanted[k - 1]);
}

}  // namespace hilbrush
