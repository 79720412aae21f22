#include "planner/plan.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "planner/dose.h"
#include "planner/pose_search.h"
#include "planner/reach.h"
#include "planner/time_model.h"
#include "planner/transit.h"
#include "sampling/check.h"
#include "sampling/input_error.h"

namespace hilbrush {
namespace {

/// Where a dot cannot be exposed within the preferred incidence, its pose may deviate so much more than the best one
/// found.
constexpr double kIncidenceSlack = 4 * std::numbers::pi / 180;
/// Of several re-poses, as many are tried if no clear way leads to the best.
constexpr std::size_t kRoutesTried = 6;

Joints home_joints(const CellDescription& cell) {
  Joints home;
  for (std::size_t i = 0; i < kAxisCount; ++i) home[i] = cell.axes[i].home;
  return home;
}

Target target_of(const Dot& dot) {
  Target target{dot.position_O, dot.normal_O.cast<double>().normalized(), dot.smooth_normal_O.cast<double>()};
  const double length = target.smooth_normal_O.norm();
  target.smooth_normal_O = length > .5 ? Eigen::Vector3d(target.smooth_normal_O / length) : target.face_normal_O;
  return target;
}

/// What is known of each dot before poses are chosen.
struct Survey {
  std::vector<ReachableDot> reachable;
  std::vector<std::uint32_t> dot_index;  ///< of each reachable dot
  std::vector<Dose> dose;                ///< of each reachable dot
  std::vector<SkippedDot> skipped;
};

Survey survey_dots(const Reach::Implementation& reach, const DotSequence& dots) {
  struct Finding {
    bool is_reachable = false;
    float cos_allowed = 1;
    SkippedDot skipped;
  };
  std::vector<Finding> findings(dots.dots.size());
  const Joints home = home_joints(reach.cell);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, findings.size(), 256), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      const auto pose = reach.find_pose(target_of(dots.dots[i]), home, &findings[i].skipped);
      findings[i].is_reachable = pose.has_value();
      if (!pose) continue;
      const double preferred = reach.options.preferred_incidence;
      const double allowed = pose->from_smooth <= preferred ? preferred : pose->from_smooth + kIncidenceSlack;
      findings[i].cos_allowed = static_cast<float>(std::cos(std::min(allowed, std::numbers::pi)));
    }
  });

  Survey survey;
  for (std::size_t i = 0; i < findings.size(); ++i) {
    const auto index = static_cast<std::uint32_t>(i);
    Finding& finding = findings[i];
    Dose dose;
    if (finding.is_reachable &&
        !find_dose(reach.cell, dots.pitch_m, dots.dots[i].level, dose, finding.skipped.detail)) {
      finding.is_reachable = false;
      finding.skipped.reason = SkipReason::kEnergy;
    }
    if (finding.is_reachable) {
      survey.reachable.push_back({target_of(dots.dots[i]), finding.cos_allowed});
      survey.dot_index.push_back(index);
      survey.dose.push_back(dose);
    } else {
      finding.skipped.dot_index = index;
      survey.skipped.push_back(std::move(finding.skipped));
    }
  }
  return survey;
}

/// Strings poses and the ways between them together.
class ProgramBuilder {
 public:
  ProgramBuilder(const Reach::Implementation& reach, const Survey& survey, const DotSequence& dots, Plan& plan)
      : reach_(reach), survey_(survey), dots_(dots), plan_(plan), search_(reach, survey.reachable), transit_(reach) {
    now_.joints = home_joints(reach.cell);
    now_.table = reach.kinematics.table_pose(now_.joints[kTilt], now_.joints[kRotation]);
    now_.yaw = reach.kinematics.yaw(now_.joints);
    now_.elbow = now_.joints[kJ2] >= 0 ? Elbow::kPositive : Elbow::kNegative;
    add_via(now_.joints);
  }

  void add_dot(std::size_t i) {
    if (is_first_) {
      is_first_ = false;
    } else if (const auto held = search_.hold(now_, i)) {
      if (go_to(*held, i)) return;
    }
    const std::vector<DotPose> poses = search_.repose(now_, i);
    for (std::size_t k = 0; k < std::min(poses.size(), kRoutesTried); ++k)
      if (go_to(poses[k], i)) return;
    if (poses.size() > kRoutesTried && go_to(poses.back(), i)) return;
    plan_.skipped.push_back({survey_.dot_index[i], SkipReason::kLensObject, "no clear way leads to a pose for it"});
  }

  void go_home() {
    const Joints home = home_joints(reach_.cell);
    if (const auto way = transit_.route(now_.joints, home))
      for (const Joints& via : *way) add_via(via);
    add_via(home);
  }

 private:
  void add_via(const Joints& joints) {
    plan_.program.vias.push_back({static_cast<std::uint32_t>(plan_.program.exposures.size()), joints});
  }

  bool go_to(const DotPose& pose, std::size_t i) {
    const auto way = transit_.route(now_.joints, pose.joints);
    if (!way) return false;
    for (const Joints& via : *way) add_via(via);
    const Dot& dot = dots_.dots[survey_.dot_index[i]];
    const Dose& dose = survey_.dose[i];
    const Eigen::Vector3d beam_O = pose.table.R_WO.transpose() * reach_.kinematics.beam_W(pose.yaw);
    Exposure exposure;
    exposure.position_O = dot.position_O;
    exposure.normal_O = dot.normal_O;
    exposure.tone = dot.tone;
    exposure.energy_j = dose.energy_j;
    exposure.power_w = dose.power_w;
    exposure.pulse_s = dose.pulse_s;
    exposure.joints = pose.joints;
    exposure.incidence =
        static_cast<float>(std::acos(std::clamp(-beam_O.dot(survey_.reachable[i].target.face_normal_O), -1., 1.)));
    exposure.dot_index = survey_.dot_index[i];
    plan_.program.exposures.push_back(exposure);
    now_ = pose;
    return true;
  }

  const Reach::Implementation& reach_;
  const Survey& survey_;
  const DotSequence& dots_;
  Plan& plan_;
  PoseSearch search_;
  Transit transit_;
  DotPose now_;
  bool is_first_ = true;
};

}  // namespace

Plan plan_exposures(const Reach& reach, const DotSequence& dots, const Progress& progress) {
  const Reach::Implementation& implementation = reach.implementation();
  Survey survey = survey_dots(implementation, dots);
  Plan plan;
  plan.program.pitch_m = dots.pitch_m;
  plan.program.exposures.reserve(survey.reachable.size());
  plan.skipped = std::move(survey.skipped);

  ProgramBuilder builder(implementation, survey, dots, plan);
  for (std::size_t i = 0; i < survey.reachable.size(); ++i) {
    builder.add_dot(i);
    if (progress && i % 512 == 0) progress(static_cast<double>(i) / static_cast<double>(survey.reachable.size()));
  }
  builder.go_home();
  std::stable_sort(plan.skipped.begin(), plan.skipped.end(),
                   [](const SkippedDot& a, const SkippedDot& b) { return a.dot_index < b.dot_index; });
  CHECK_EQ(plan.program.exposures.size() + plan.skipped.size(), dots.dots.size());
  plan.time = estimate_time(implementation.cell, plan.program);
  if (progress) progress(1);
  return plan;
}

TimeSplit estimate_time(const CellDescription& cell, const ExposureProgram& program) {
  TimeSplit time;
  Joints at = home_joints(cell);
  std::size_t next_via = 0;
  for (std::size_t i = 0; i <= program.exposures.size(); ++i) {
    bool is_repose = false;
    for (; next_via < program.vias.size() && program.vias[next_via].before_exposure <= i; ++next_via) {
      time.retract_s += move_s(cell, at, program.vias[next_via].joints) + cell.timing.message_s;
      at = program.vias[next_via].joints;
      is_repose = true;
    }
    if (i == program.exposures.size()) break;
    const Exposure& exposure = program.exposures[i];
    (is_repose ? time.retract_s : time.move_s) += move_s(cell, at, exposure.joints) + cell.timing.message_s;
    time.settle_s += settle_s(cell, at, exposure.joints);
    time.expose_s += static_cast<double>(exposure.pulse_s) + cell.timing.message_s;
    at = exposure.joints;
  }
  return time;
}

std::vector<Joints> plan_approach(const Reach& reach, const ExposureProgram& program, std::size_t next,
                                  const Joints& from) {
  const Reach::Implementation& implementation = reach.implementation();
  if (next >= program.exposures.size()) throw InputError("next", "the program has no such exposure");
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const auto& axis = implementation.cell.axes[i];
    if (!(from[i] >= axis.min - 1e-6 && from[i] <= axis.max + 1e-6))
      throw InputError("from", std::string("the joint ") + kAxisNames[i] + " is outside its limits");
  }
  const auto way = Transit(implementation).route(from, program.exposures[next].joints);
  if (!way)
    throw InputError("from", "no clear way leads to exposure " + std::to_string(next) +
                                 ": jog the arm clear of the object, then ask again");
  return *way;
}

}  // namespace hilbrush
