#include "sampling/options/sample_options.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "sampling/base/input_error.h"

namespace hilbrush {

void check_pitch_or_count(const SampleOptions& options) {
  if (options.pitch_m.has_value() == options.dot_count.has_value())
    throw InputError("", "give either dpi or the number of dots, not both and not neither");
  if (options.pitch_m && (!(*options.pitch_m > 0) || !std::isfinite(*options.pitch_m)))
    throw InputError("", "the pitch must be more than 0 mm");
  if (options.dot_count && *options.dot_count < 1)
    throw InputError("", "the number of dots must be at least 1");
}

void check_dot_limit(const SampleOptions& options, double count) {
  if (count <= static_cast<double>(options.dot_limit)) return;
  throw InputError("", "the object would need " +
                           std::to_string(static_cast<std::uint64_t>(std::min(count, 1e18))) +
                           " dots, more than the limit of " + std::to_string(options.dot_limit) +
                           ": lower the dpi or the size");
}

}  // namespace hilbrush
