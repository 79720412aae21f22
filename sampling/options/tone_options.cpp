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

}  // namespace hilbrush
