#include "planner/pose_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "planner/time_model.h"

namespace hilbrush {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::size_t kHorizon = 1000;                                  // dots looked ahead
constexpr std::array<std::size_t, 6> kWindows{1, 4, 12, 40, 120, 400};  // dots whose mean normal the beam is aimed at
constexpr std::size_t kExactCandidates = 10;
constexpr double kInset = .3;  // of the yaw slack's half width: where yaw goes when it has to move

/// An arc of yaw: center +- half_width.
struct Arc {
  double center, half_width;
};

/// The yaws at which the beam is within acos(cos_limit) of the normal.
std::optional<Arc> yaw_arc(const Kinematics& kinematics, const Eigen::Vector3d& normal_W, double cos_limit) {
  const double across = kinematics.cos_depression() * normal_W.head<2>().norm();
  const double rest = cos_limit - kinematics.sin_depression() * normal_W.z();
  if (rest > across) return std::nullopt;
  const double center = std::atan2(-normal_W.y(), -normal_W.x());
  if (rest <= -across) return Arc{center, kPi};
  return Arc{center, std::acos(rest / across)};
}

/// Both arcs at once; of two pieces the one nearer to `yaw`.
std::optional<Arc> intersection(const Arc& a, const Arc& b, double yaw) {
  if (a.half_width >= kPi) return b;
  if (b.half_width >= kPi) return a;
  std::optional<Arc> nearest;
  double nearest_gap = 0;
  const double offset = std::remainder(b.center - a.center, 2 * kPi);
  for (const double shift : {offset - 2 * kPi, offset, offset + 2 * kPi}) {
    const double low = std::max(-a.half_width, shift - b.half_width);
    const double high = std::min(a.half_width, shift + b.half_width);
    if (low >= high) continue;
    const Arc piece{a.center + (low + high) / 2, (high - low) / 2};
    const double gap = std::abs(std::remainder(yaw - piece.center, 2 * kPi)) - piece.half_width;
    if (nearest && gap >= nearest_gap) continue;
    nearest = piece;
    nearest_gap = gap;
  }
  return nearest;
}

}  // namespace

bool PoseSearch::is_allowed(const TablePose& table, double yaw, std::size_t i) const {
  const Eigen::Vector3d beam_O = table.R_WO.transpose() * reach_.kinematics.beam_W(yaw);
  const ReachableDot& dot = dots_[i];
  return -beam_O.dot(dot.target.smooth_normal_O) >= dot.cos_allowed &&
         -beam_O.dot(dot.target.face_normal_O) >= reach_.cos_max_incidence();
}

/// The finished pose at this yaw if joints, beam and bodies agree.
std::optional<DotPose> PoseSearch::pose_at(const DotPose& now, double yaw, std::size_t i) const {
  const Target& target = dots_[i].target;
  DotPose pose = now;
  pose.yaw = yaw;
  if (!reach_.arm_fits(now.table, target.position_O, yaw, now.elbow, now.joints, pose.joints, nullptr))
    return std::nullopt;
  const Eigen::Vector3d beam_O = now.table.R_WO.transpose() * reach_.kinematics.beam_W(yaw);
  if (reach_.clearance.lens_obstruction(target.position_O, beam_O) != Obstruction::kNone ||
      reach_.clearance.beam_obstruction(target.position_O, beam_O) != Obstruction::kNone)
    return std::nullopt;
  pose.from_smooth = std::acos(std::clamp(-beam_O.dot(target.smooth_normal_O), -1., 1.));
  return pose;
}

std::optional<DotPose> PoseSearch::hold(const DotPose& now, std::size_t i) const {
  const ReachableDot& dot = dots_[i];
  if (is_allowed(now.table, now.yaw, i))
    if (auto pose = pose_at(now, now.yaw, i)) return pose;

  const auto& kinematics = reach_.kinematics;
  const auto smooth = yaw_arc(kinematics, now.table.R_WO * dot.target.smooth_normal_O, dot.cos_allowed);
  if (!smooth) return std::nullopt;
  const auto face = yaw_arc(kinematics, now.table.R_WO * dot.target.face_normal_O, reach_.cos_max_incidence());
  if (!face) return std::nullopt;
  const auto arc = intersection(*smooth, *face, now.yaw);
  if (!arc) return std::nullopt;

  // The nearest yaw that is allowed, drawn in a little so that the next dots need not move it again; then others all
  // over the arc.
  const double side = std::remainder(now.yaw - arc->center, 2 * kPi) >= 0 ? 1 : -1;
  for (const double share : {1 - kInset, 0., -(1 - kInset), .98, .35, -.35, -.98})
    if (auto pose = pose_at(now, arc->center + side * share * arc->half_width, i)) return pose;
  return std::nullopt;
}

/// By incidence alone: how many dots from `i` on this table pose could serve.
std::size_t PoseSearch::served_at_most(const TablePose& table, std::size_t i) const {
  const double ce = reach_.kinematics.cos_depression(), se = reach_.kinematics.sin_depression();
  const std::size_t end = std::min(dots_.size(), i + kHorizon);
  std::size_t k = i;
  for (; k < end; ++k) {
    const Eigen::Vector3d normal_W = table.R_WO * dots_[k].target.smooth_normal_O;
    if (ce * normal_W.head<2>().norm() + se * normal_W.z() < dots_[k].cos_allowed) break;
  }
  return k - i;
}

/// What holding really gives, up to `limit` dots; dot `i` is served by `pose` itself.
std::size_t PoseSearch::served(const DotPose& pose, std::size_t i, std::size_t limit) const {
  DotPose now = pose;
  std::size_t k = i + 1;
  for (; k < i + limit; ++k) {
    const auto next = hold(now, k);
    if (!next) break;
    now = *next;
  }
  return k - i;
}

double PoseSearch::repose_s(const DotPose& from, const DotPose& to) const {
  const auto& cell = reach_.cell;
  const bool is_flip = from.elbow != to.elbow;
  return move_s(cell, from.joints, to.joints) + settle_s(cell, from.joints, to.joints) +
         (is_flip ? 2 : 1) * cell.timing.retract_s;
}

/// Table poses that aim the beam at the mean normal of the next few, dozens, hundreds of dots.
std::vector<PoseSearch::Candidate> PoseSearch::propose(const DotPose& now, std::size_t i) const {
  const auto& kinematics = reach_.kinematics;
  std::vector<Candidate> candidates;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  std::size_t summed = 0;
  for (const std::size_t window : kWindows) {
    const std::size_t end = std::min(dots_.size(), i + window);
    if (i + summed == end) break;
    for (; i + summed < end; ++summed) sum += dots_[i + summed].target.smooth_normal_O;
    if (sum.norm() < 1e-6) continue;
    const Eigen::Vector3d beam_O = -sum.normalized();
    for (const double tilt : reach_.tilts()) {
      TableSolution solutions[2];
      const int count = solve_table(kinematics, tilt, beam_O, solutions);
      for (int s = 0; s < count; ++s) {
        Candidate candidate;
        candidate.pose = now;
        candidate.pose.yaw = solutions[s].yaw;
        candidate.pose.table =
            kinematics.table_pose(tilt, kinematics.wind(kRotation, solutions[s].rotation, now.table.rotation));
        candidate.pose.joints[kTilt] = tilt;
        candidate.pose.joints[kRotation] = candidate.pose.table.rotation;
        const std::size_t count_served = served_at_most(candidate.pose.table, i);
        if (count_served == 0) continue;
        candidate.overhead_s = repose_s(now, candidate.pose) / static_cast<double>(count_served);
        candidates.push_back(candidate);
      }
    }
  }
  return candidates;
}

std::vector<DotPose> PoseSearch::repose(const DotPose& now, std::size_t i) const {
  const auto by_overhead = [](const Candidate& a, const Candidate& b) { return a.overhead_s < b.overhead_s; };
  std::vector<Candidate> proposed = propose(now, i);
  const std::size_t exact_count = std::min(kExactCandidates, proposed.size());
  std::partial_sort(proposed.begin(), proposed.begin() + static_cast<std::ptrdiff_t>(exact_count), proposed.end(),
                    by_overhead);
  std::vector<Candidate> found;
  for (std::size_t c = 0; c < proposed.size() && (c < exact_count || found.empty()); ++c)
    for (const Elbow elbow : {Elbow::kPositive, Elbow::kNegative}) {
      DotPose start = proposed[c].pose;
      start.elbow = elbow;
      const auto pose = hold(start, i);
      if (!pose) continue;
      const std::size_t count = served(*pose, i, std::min(kHorizon, dots_.size() - i));
      found.push_back({*pose, repose_s(now, *pose) / static_cast<double>(count)});
    }
  std::stable_sort(found.begin(), found.end(), by_overhead);
  std::vector<DotPose> poses;
  for (const Candidate& candidate : found) poses.push_back(candidate.pose);
  if (const auto last_resort = reach_.find_pose(dots_[i].target, now.joints)) poses.push_back(*last_resort);
  return poses;
}

}  // namespace hilbrush
