#include "planner/reach/transit.h"

#include <algorithm>
#include <cmath>

#include "planner/cell_model/time_model.h"
#include "sampling/base/angles.h"

namespace hilbrush {
namespace {

/// The distance that the tool keeps from everything while it moves; less than half of Clearance::kMarginM.
constexpr double kMinSlackM = .4e-3;
/// ... unless it starts nearer, because it was stopped there: it may leave such a pose.
constexpr double kMinSlackOfEscapeM = .05e-3;
/// How far the tool backs off along its beam, tried in this order.
constexpr double kBackOffsM[] = {.005, .01, .02, .03, .045, .06, .08, .1};

/// Distance covered `time_s` into a move over `distance` from rest to rest.
double covered(double distance, const AxisDescription& axis, double time_s) {
  const double v = axis.speed_max;
  const double a = axis.acceleration_max;
  const double whole_s = trapezoid_s(distance, v, a);
  if (time_s >= whole_s) return distance;
  const double ramp_s = std::min(v / a, whole_s / 2);
  if (time_s <= ramp_s) return .5 * a * time_s * time_s;
  if (time_s >= whole_s - ramp_s) return distance - .5 * a * (whole_s - time_s) * (whole_s - time_s);
  return .5 * a * ramp_s * ramp_s + v * (time_s - ramp_s);
}

Elbow elbow_of(const Joints& joints) {
  return joints[kJ2] >= 0 ? Elbow::kPositive : Elbow::kNegative;
}

}  // namespace

bool Transit::needs_retract(const Joints& from, const Joints& to) {
  constexpr double kHalfTurn = kTurn / 2;
  return (from[kJ2] >= 0) != (to[kJ2] >= 0) || std::abs(to[kJ4] - from[kJ4]) > kHalfTurn ||
         std::abs(to[kRotation] - from[kRotation]) > kHalfTurn;
}

Joints joints_during(const CellDescription& cell, const Joints& from, const Joints& to, double time_s) {
  Joints now = to;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const double distance = to[i] - from[i];
    if (distance == 0) continue;
    now[i] = from[i] + std::copysign(covered(std::abs(distance), cell.axes[i], time_s), distance);
  }
  return now;
}

double Transit::travel_bound_m(const Joints& a, const Joints& b) const {
  const auto& arm = reach_.cell().arm;
  const auto& lens = reach_.cell().lens;
  // From the flange's axis to the farthest point of lens or quill, horizontally.
  const double lens_m =
      std::hypot(std::max(lens.far_m - arm.flange_to_focus_m, arm.flange_to_focus_m - lens.near_m), lens.radius_m);
  const double tool_m = std::max(lens_m, arm.quill_radius_m);
  const auto moved = [&](std::size_t axis) { return std::abs(b[axis] - a[axis]); };
  // Along the arm the flange is farthest from J1 at the straighter of the two ends.
  const double c = std::cos(std::min(std::abs(a[kJ2]), std::abs(b[kJ2])));
  const double l1 = arm.upper_arm_m;
  const double l2 = arm.forearm_m;
  const double flange_m = a[kJ2] * b[kJ2] > 0 ? std::sqrt(l1 * l1 + l2 * l2 + 2 * l1 * l2 * c) : l1 + l2;
  // Yaws that cancel do not add up, whichever of them comes first.
  double left = 0;
  double right = 0;
  for (const std::size_t axis : {kJ1, kJ2, kJ4}) (b[axis] > a[axis] ? left : right) += std::abs(b[axis] - a[axis]);
  const double yaw_change = std::max(left, right);
  // With the arm folded the elbow is the farthest point of the links.
  return moved(kJ1) * std::max(flange_m, l1) + moved(kJ2) * l2 + yaw_change * tool_m + moved(kJ3) +
         moved(kTilt) * reach_.clearance().radius_around_tilt_m() +
         moved(kRotation) * reach_.clearance().radius_around_rotation_m();
}

double Transit::least_slack_m(const Joints& from) const {
  const double slack_m = reach_.clearance().slack_m(reach_.kinematics(), from);
  return std::clamp(.5 * slack_m, kMinSlackOfEscapeM, kMinSlackM);
}

bool Transit::is_clear_at(const Joints& joints) const {
  return reach_.clearance().slack_m(reach_.kinematics(), joints) >= kMinSlackM;
}

bool Transit::is_clear(const Joints& from, const Joints& to) const {
  const double least_m = least_slack_m(from);
  const auto slack_at = [&](const Joints& joints) { return reach_.clearance().slack_m(reach_.kinematics(), joints); };
  double slack_m = slack_at(from);
  if (travel_bound_m(from, to) <= slack_m) return true;
  if (slack_at(to) < kMinSlackM) return false;

  double end_s = 0;
  for (std::size_t i = 0; i < kAxisCount; ++i)
    end_s = std::max(end_s, trapezoid_s(std::abs(to[i] - from[i]), reach_.cell().axes[i].speed_max,
                                        reach_.cell().axes[i].acceleration_max));
  Joints now = from;
  double now_s = 0;
  double step_s = end_s / 4;
  while (true) {
    if (slack_m < least_m) return false;
    if (travel_bound_m(now, to) <= slack_m) return true;
    // The axes do not reverse during a move, so the bound between two moments holds for all between them.
    step_s = std::min(2 * step_s, end_s - now_s);
    Joints next = joints_during(reach_.cell(), from, to, now_s + step_s);
    while (travel_bound_m(now, next) > slack_m) {
      step_s /= 2;
      next = joints_during(reach_.cell(), from, to, now_s + step_s);
    }
    now_s += step_s;
    now = next;
    slack_m = slack_at(now);
  }
}

bool Transit::are_clear(const std::vector<Joints>& path) const {
  for (std::size_t i = 1; i < path.size(); ++i)
    if (!is_clear(path[i - 1], path[i])) return false;
  return true;
}

std::optional<Joints> Transit::backed_off(const Joints& joints, double distance_m) const {
  const auto& kinematics = reach_.kinematics();
  const TablePose table = kinematics.table_pose(joints[kTilt], joints[kRotation]);
  const ToolPose tool = kinematics.tool_pose(joints);
  const double yaw = kinematics.yaw(joints);
  const Eigen::Vector3d focus_W = table.to_W(tool.focus_O);
  const Eigen::Vector3d beam_W = kinematics.beam_W(yaw);
  for (double back_m = distance_m; back_m > .003; back_m *= .7) {
    Joints back = joints;
    if (!kinematics.solve_arm(focus_W - back_m * beam_W, yaw, elbow_of(joints), back)) continue;
    back[kJ4] = kinematics.unwrap_near(kJ4, back[kJ4], joints[kJ4]);
    // Near J4's limit the same direction may only be found a turn away.
    if (kinematics.limit_excess(back).is_inside() && !needs_retract(joints, back)) return back;
  }
  return std::nullopt;
}

Joints Transit::lifted(Joints joints) const {
  joints[kJ3] = std::max(joints[kJ3], reach_.kinematics().axis_max(kJ3));
  return joints;
}

std::optional<std::vector<Joints>> Transit::route(const Joints& from, const Joints& to) const {
  if (!needs_retract(from, to) && is_clear(from, to)) return std::vector<Joints>{};

  for (const double back_m : kBackOffsM) {
    const auto out = backed_off(from, back_m);
    const auto in = backed_off(to, back_m);
    if (!out || !in) continue;
    if (are_clear({from, *out, *in, to})) return std::vector<Joints>{*out, *in};
  }
  const auto out = retreat(from, true);
  const auto in = retreat(to, false);
  if (!out || !in) return std::nullopt;
  std::vector<Joints> path = *out;
  if (!is_clear(out->back(), in->back())) {
    // The arm goes home, the table turns, the arm comes back.
    Joints before = out->back();
    Joints after = in->back();
    for (const std::size_t axis : {kJ1, kJ2, kJ3, kJ4}) before[axis] = after[axis] = reach_.cell().axes[axis].home;
    if (!are_clear({out->back(), before, after, in->back()})) return std::nullopt;
    path.push_back(before);
    path.push_back(after);
  }
  path.insert(path.end(), in->rbegin(), in->rend());
  return path;
}

std::optional<std::vector<Joints>> Transit::retreat(const Joints& pose, bool is_outwards) const {
  const auto is_usable = [&](const std::vector<Joints>& outwards) {
    std::vector<Joints> path{pose};
    path.insert(path.end(), outwards.begin(), outwards.end());
    if (!is_outwards) std::reverse(path.begin(), path.end());
    return are_clear(path);
  };
  // In one move; or in steps, because the axes do not arrive together, and shorter steps deviate less from the beam.
  std::vector<Joints> steps;
  for (const double back_m : kBackOffsM) {
    const auto back = backed_off(pose, back_m);
    if (!back) continue;
    if (is_usable({*back, lifted(*back)})) return std::vector<Joints>{*back, lifted(*back)};
    steps.push_back(*back);
    std::vector<Joints> stepwise = steps;
    stepwise.push_back(lifted(*back));
    if (is_usable(stepwise)) return stepwise;
  }
  if (is_usable({lifted(pose)})) return std::vector<Joints>{lifted(pose)};
  return std::nullopt;
}

}  // namespace hilbrush
