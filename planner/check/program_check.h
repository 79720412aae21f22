#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "planner/cell_model/exposure_program.h"
#include "planner/cell_model/plan_options.h"
#include "planner/reach/skipped_dot.h"
#include "sampling/base/progress.h"
#include "sampling/dots/dots.h"
#include "sampling/model/textured_mesh.h"

/// An independent pass over a finished program, with forward kinematics and rays of its own rather than
/// planning's caches: limits, continuity, J4 and C winding, elbow flips, FK within 1e-9 m of the dot,
/// incidence, power and pulse, clearance at dots and along moves (arm links too), every dot exactly once or
/// skipped with a reason, provenance.
namespace hilbrush {

struct ProgramFault {
  std::string what;  ///< a sentence with amounts
  std::size_t exposure = 0;
};

/// At most `limit` faults, in the program's order; empty: the program may be run. `made_from` (optional) is
/// the provenance that the program must have.
std::vector<ProgramFault> check_program(const ExposureProgram& program,
                                        const std::vector<SkippedDot>& skipped, const DotSequence& dots,
                                        const TexturedMesh& mesh, const CellDescription& cell,
                                        const PlanOptions& options, std::size_t limit = 20,
                                        const Progress& progress = {}, const Provenance* made_from = nullptr);

}  // namespace hilbrush
