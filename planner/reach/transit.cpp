#include "planner/reach/transit.h"

#include <algorithm>
#include <cmath>

#include "planner/cell_model/time_model.h"
#include "sampling/base/angles.h"

namespace hilbrush {
namespace {

/// The distance that the tool keeps from everything where a move is looked at; half of Clearance::kMarginM.
constexpr double kMinSlackM = .5e-3;
/// ... unless it starts nearer, because it was stopped there: it may leave such a pose.
constexpr double kMinSlackOfEscapeM = .05e-3;
/// The share of that distance which it keeps for certain in between. The program check wants .3 mm around the
/// lens, and looks at a lens that is longer and wider by as much: .42 mm at its rim.
constexpr double kKeptShare = .86;
/// Looks at one leg under one law; those that need more pass something closely over a long distance.
constexpr int kMaxLooks = 3000;
/// How far the tool backs off along its beam, tried in this order.
constexpr double kBackOffsM[] = {.005, .01, .02, .03, .045, .06, .08, .1};

Elbow elbow_of(const Joints& joints) {
  return joints[kJ2] >= 0 ? Elbow::kPositive : Elbow::kNegative;
}

}  // namespace

bool Transit::needs_retract(const Joints& from, const Joints& to) {
  constexpr double kHalfTurn = kTurn / 2;
  return (from[kJ2] >= 0) != (to[kJ2] >= 0) || std::abs(to[kJ4] - from[kJ4]) > kHalfTurn ||
         std::abs(to[kRotation] - from[kRotation]) > kHalfTurn;
}

double Transit::arm_travel_bound_m(const Joints& a, const Joints& b, bool is_one_law) const {
  const auto& arm = reach_.cell().arm;
  const auto& lens = reach_.cell().lens;
  // From the flange's axis to the farthest point of lens or quill, horizontally.
  const double lens_m = std::hypot(
      std::max(lens.far_m - arm.flange_to_focus_m, arm.flange_to_focus_m - lens.near_m), lens.radius_m);
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
  for (const std::size_t axis : {kJ1, kJ2, kJ4})
    (b[axis] > a[axis] ? left : right) += std::abs(b[axis] - a[axis]);
  const double yaw_change = is_one_law ? std::max(left, right) : left + right;
  // With the arm folded the elbow is the farthest point of the links.
  return moved(kJ1) * std::max(flange_m, l1) + moved(kJ2) * l2 + yaw_change * tool_m + moved(kJ3);
}

double Transit::table_travel_bound_m(const Joints& a, const Joints& b) const {
  return std::abs(b[kTilt] - a[kTilt]) * reach_.clearance().radius_around_tilt_m() +
         std::abs(b[kRotation] - a[kRotation]) * reach_.clearance().radius_around_rotation_m();
}

Transit::Limits Transit::limits_from(double slack_m) const {
  const double refused_m = slack_m >= kMinSlackM ? kMinSlackM : std::max(.5 * slack_m, kMinSlackOfEscapeM);
  return {refused_m, kKeptShare * refused_m};
}

bool Transit::is_clear_at(const Joints& joints) const {
  return slack_m(joints) >= kMinSlackM;
}

/// One leg with one law for each chain. Boxes of time and lag cover all that can happen: in each, nothing
/// moves farther from the middle than the clearance there, less what is to be kept.
class Transit::Leg {
 public:
  struct Law {
    Interpolation robot, table;
    bool is_table_late;  ///< else the robot
  };

  Leg(const Transit& transit, const Joints& from, const Joints& to, const Limits& limits, const Law& law)
      : transit_(transit), cell_(transit.reach_.cell()), from_(from), to_(to), limits_(limits), law_(law) {}

  bool is_clear(double lag_max_s) {
    const double end_s = std::max(chain_move_s(cell_, kRobotChain, law_.robot, from_, to_),
                                  chain_move_s(cell_, kTableChain, law_.table, from_, to_));
    looks_left_ = kMaxLooks;
    return is_clear({0, end_s + lag_max_s, 0, lag_max_s});
  }

 private:
  struct Box {
    double begin_s, end_s, lag_low_s, lag_high_s;
  };

  bool is_clear(const Box& box) {
    if (--looks_left_ < 0) return false;
    const double time_s = .5 * (box.begin_s + box.end_s);
    const double lag_s = .5 * (box.lag_low_s + box.lag_high_s);
    const Joints middle = joints_at(time_s, lag_s);
    const double slack_m = transit_.slack_m(middle);
    if (slack_m < limits_.refused_m) return false;
    const Joints low = joints_at(box.begin_s, box.lag_high_s);
    const Joints high = joints_at(box.end_s, box.lag_low_s);
    const double arm_m =
        std::max(transit_.arm_travel_bound_m(low, middle), transit_.arm_travel_bound_m(middle, high));
    const double table_m =
        std::max(transit_.table_travel_bound_m(low, middle), transit_.table_travel_bound_m(middle, high));
    if (arm_m + table_m <= slack_m - limits_.kept_m) return true;
    if (box.end_s - box.begin_s >= box.lag_high_s - box.lag_low_s)
      return is_clear({box.begin_s, time_s, box.lag_low_s, box.lag_high_s}) &&
             is_clear({time_s, box.end_s, box.lag_low_s, box.lag_high_s});
    return is_clear({box.begin_s, box.end_s, box.lag_low_s, lag_s}) &&
           is_clear({box.begin_s, box.end_s, lag_s, box.lag_high_s});
  }
  Joints joints_at(double time_s, double lag_s) const {
    Joints joints = to_;
    put_chain(cell_, kRobotChain, law_.robot, from_, to_, law_.is_table_late ? time_s : time_s - lag_s,
              joints);
    put_chain(cell_, kTableChain, law_.table, from_, to_, law_.is_table_late ? time_s - lag_s : time_s,
              joints);
    return joints;
  }

  const Transit& transit_;
  const CellDescription& cell_;
  const Joints& from_;
  const Joints& to_;
  const Limits limits_;
  const Law law_;
  int looks_left_ = 0;
};

namespace {

/// The laws that a chain may follow; one is enough where they are the same.
std::vector<Interpolation> laws_of(Interpolation interpolation, Chain chain, const Joints& from,
                                   const Joints& to) {
  int moving = 0;
  for (std::size_t i = chain.first; i < chain.first + chain.count; ++i) moving += to[i] != from[i];
  if (moving < 2) return {Interpolation::kIndependent};
  if (interpolation == Interpolation::kUnknown)
    return {Interpolation::kIndependent, Interpolation::kCoordinated};
  return {interpolation};
}

bool moves(Chain chain, const Joints& from, const Joints& to) {
  return !std::equal(from.begin() + chain.first, from.begin() + chain.first + chain.count,
                     to.begin() + chain.first);
}

}  // namespace

bool Transit::is_clear(const Joints& from, const Joints& to) const {
  const double slack_from_m = slack_m(from);
  const Limits limits = limits_from(slack_from_m);
  if (slack_m(to) < kMinSlackM) return false;
  if (arm_travel_bound_m(from, to) + table_travel_bound_m(from, to) <= slack_from_m - limits.kept_m)
    return true;
  // The same around the middle, from which each joint has half of its move to either side, whatever the law.
  Joints middle;
  for (std::size_t i = 0; i < kAxisCount; ++i) middle[i] = .5 * (from[i] + to[i]);
  if (.5 * (arm_travel_bound_m(from, to, false) + table_travel_bound_m(from, to)) <=
      slack_m(middle) - limits.kept_m)
    return true;
  const auto& motion = reach_.cell().motion;
  const bool has_lag = motion.start_lag_s > 0 && moves(kRobotChain, from, to) && moves(kTableChain, from, to);
  for (const Interpolation robot : laws_of(motion.robot, kRobotChain, from, to))
    for (const Interpolation table : laws_of(motion.table, kTableChain, from, to)) {
      if (!Leg(*this, from, to, limits, {robot, table, false}).is_clear(has_lag ? motion.start_lag_s : 0))
        return false;
      if (has_lag && !Leg(*this, from, to, limits, {robot, table, true}).is_clear(motion.start_lag_s))
        return false;
    }
  return true;
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
    for (const std::size_t axis : {kJ1, kJ2, kJ3, kJ4})
      before[axis] = after[axis] = reach_.cell().axes[axis].home;
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
  // In one move; or in steps, because the axes do not arrive together, and shorter steps deviate less from
  // the beam.
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
