#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "planner/cell_model/exposure_program.h"
#include "planner/cell_model/plan_options.h"
#include "sampling/base/progress.h"
#include "sampling/dots/dots.h"
#include "sampling/model/textured_mesh.h"

/// Dots to program, the entry of planner/:
///   pose_search (aims, stations, leftovers with reach's reasons, ordering, yaw) or follow_normal (the baseline) ->
///   program_builder (clear ways between poses: transit; dose) -> time_model.
namespace hilbrush {

enum class SkipReason : std::uint8_t {
  kOccluded,    ///< every beam within the cone is blocked by the object
  kIncidence,   ///< no pose brings the beam within the cone
  kJointLimit,  ///< the poses that would do exceed a joint's limits
  kLensObject,  ///< the lens body or quill would touch the object
  kLensTable,   ///< ... or the table plate, post
  kEnergy,      ///< the laser cannot deliver the dot's energy
  kArm,         ///< a link of the arm or the robot's column would touch the object, the table or the tool
  kNoWay        ///< there are poses, but no clear way to one
};
inline constexpr int kSkipReasonCount = 8;
/// "occluded", "incidence", "joint_limit", "lens_object", "lens_table", "energy", "arm", "no_way"
const char* skip_reason_name(SkipReason reason);

struct SkippedDot {
  std::uint32_t dot_index = 0;
  SkipReason reason = SkipReason::kOccluded;
  std::string detail;          ///< a sentence with the amount, where there is one
  std::string_view what = {};  ///< the same without the amount, so that dots can be counted by it; of static storage
  double amount = 0;      ///< what the sentence says: past a limit, too near, or blocked so far from the dot; rad or m
  bool is_angle = false;  ///< the amount is in rad
};

/// Clearance and reach on one object in one cell. Thread-safe after construction.
class Reach {
 public:
  Reach(const TexturedMesh& mesh, const CellDescription& cell, const PlanOptions& options);
  ~Reach();
  Reach(Reach&&) noexcept;
  /// Whether some pose within the cone exposes the point; `skipped` (optional) gets the reason if none does.
  bool is_reachable(const Eigen::Vector3d& position_O, const Eigen::Vector3d& normal_O,
                    SkippedDot* skipped = nullptr) const;

  struct Implementation;
  const Implementation& implementation() const { return *implementation_; }

 private:
  std::unique_ptr<Implementation> implementation_;
};

/// Estimated seconds, by what they are spent on.
struct TimeSplit {
  double move_s = 0, settle_s = 0, expose_s = 0, retract_s = 0;
  double total_s() const { return move_s + settle_s + expose_s + retract_s; }
};

struct Plan {
  ExposureProgram program;          ///< provenance is filled in by the caller
  std::vector<SkippedDot> skipped;  ///< exposures.size() + skipped.size() == dots.size()
  TimeSplit time;
};

/// Cost: O(dots), memory O(dots).
Plan plan_exposures(const Reach& reach, const DotSequence& dots, const Progress& progress = {});

/// Told after each exposure what the program has taken so far.
using TimeVisitor = std::function<void(std::size_t exposure, const TimeSplit& so_far)>;

/// How long a program takes from home to home, by the time model.
TimeSplit estimate_time(const CellDescription& cell, const ExposureProgram& program, const TimeVisitor& visit = {});

/// What no order and no poses can beat: each exposure's shortest settling, its pulse and a move of one control tick.
double least_time_s(const CellDescription& cell, const ExposureProgram& program);

/// The checked way from measured joints to exposure `next` of the program: way-points, possibly none (the direct move
/// is clear).
/// @throws InputError if there is no clear way.
std::vector<Joints> plan_approach(const Reach& reach, const ExposureProgram& program, std::size_t next,
                                  const Joints& from);

}  // namespace hilbrush
