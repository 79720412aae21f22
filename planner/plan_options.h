#pragma once
#include <numbers>

/// Settings of planning. Std only, so that config/ can read them.
namespace hilbrush {

struct PlanOptions {
  double max_incidence = std::numbers::pi / 4;  ///< rad, against the face normal; never exceeded
  double preferred_incidence =
      std::numbers::pi / 9;  ///< rad, against the smooth normal; the table holds still while it can be kept
};

}  // namespace hilbrush
