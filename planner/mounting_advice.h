#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "planner/cell_model/cell_description.h"
#include "planner/cell_model/mounting_options.h"
#include "planner/cell_model/plan_options.h"
#include "planner/reach/skipped_dot.h"
#include "sampling/dots/dots.h"
#include "sampling/model/model_file.h"

/// What an operator could change about the mounting so that more dots are reached.
namespace hilbrush {

struct MountingAdvice {
  std::optional<double> post_height_m;  ///< a post this high; or
  std::optional<UpAxis> up;             ///< the object standing on this axis
  double reached_now = 0;               ///< shares of all dots; poses only, not the paths between them
  double reached_then = 0;              ///< ... estimated
};

/// How the object stands now.
struct Standing {
  MountingOptions mounting;
  UpAxis up = UpAxis::kZ;
};

/// Tries a few other post heights and the other up axis on a seeded sample of the skipped dots and of the
/// others. Nothing if no skipped dot could be helped by that, or no trial gains enough to be worth another
/// mounting.
/// @param mesh, cell  as planned with: mounted, and with the job's fixture.
/// Cost: a Reach a trial and some 100 us for each of 300 dots.
std::optional<MountingAdvice> advise_mounting(const TexturedMesh& mesh, const CellDescription& cell,
                                              const Standing& standing, const PlanOptions& options,
                                              const DotSequence& dots, const std::vector<SkippedDot>& skipped,
                                              std::uint64_t seed);

/// "a post of 90 mm (--post-height-mm 90) would reach about 99.7 % of the dots instead of 96.1 %".
std::string advice_sentence(const MountingAdvice& advice);

}  // namespace hilbrush
