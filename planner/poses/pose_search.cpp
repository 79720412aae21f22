#include "planner/poses/pose_search.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "planner/cell_model/time_model.h"
#include "planner/poses/ordering.h"
#include "planner/poses/stations.h"
#include "planner/poses/unserved_dots.h"
#include "planner/poses/yaw_redundancy.h"
#include "sampling/base/angles.h"
#include "sampling/base/batches.h"
#include "sampling/base/check.h"

namespace hilbrush {
namespace {

constexpr std::size_t kMaxKicksOfFastPlan = 500'000;  // of the whole plan, so that planning time is bounded
constexpr std::size_t kToursAtOnce = 16;              // between two reports of progress

std::vector<Tour> tours_of(const SharedBeams& beams, std::vector<std::uint32_t>& unserved) {
  std::vector<Tour> tours(beams.beams_O.size());
  for (std::size_t k = 0; k < tours.size(); ++k) tours[k].beam_O = beams.beams_O[k];
  for (std::size_t i = 0; i < beams.of_dot.size(); ++i)
    (beams.of_dot[i] == kNoBeam ? unserved : tours[beams.of_dot[i]].dots)
        .push_back(static_cast<std::uint32_t>(i));
  std::erase_if(tours, [](const Tour& tour) { return tour.dots.empty(); });
  return tours;
}

/// Moves dots that their tour's station turns out not to serve to `unserved`.
void remove_unserved_dots(const DotsToPose& dots, std::vector<Tour>& tours,
                          std::vector<std::uint32_t>& unserved) {
  std::vector<std::vector<std::uint32_t>> of_tour(tours.size());
  tbb::parallel_for(std::size_t{0}, tours.size(), [&](std::size_t t) {
    std::erase_if(tours[t].dots, [&](std::uint32_t dot) {
      if (joints_at(dots.reach(), tours[t].station, dots.position_O(dot), {})) return false;
      of_tour[t].push_back(dot);
      return true;
    });
  });
  for (const auto& dots_of_tour : of_tour)
    unserved.insert(unserved.end(), dots_of_tour.begin(), dots_of_tour.end());
  std::erase_if(tours, [](const Tour& tour) { return tour.dots.empty(); });
}

/// Sets C by the shortest turn from the tour before. Returns the joints at the tour's first dot, with J4 by
/// the shortest turn.
Joints unwrap_near(const Reach& reach, const Eigen::Vector3d& first_O, const Joints& before,
                   Station& station) {
  station.rotation = reach.kinematics().unwrap_near(kRotation, station.rotation, before[kRotation]);
  // J4 stays away from its limits, so that it need not unwind within the tour.
  const double middle = (reach.kinematics().axis_min(kJ4) + reach.kinematics().axis_max(kJ4)) / 2;
  const double half =
      std::max(kTurn / 2, (reach.kinematics().axis_max(kJ4) - reach.kinematics().axis_min(kJ4)) / 2 - 1);
  auto joints = joints_at(reach, station, first_O, before);
  if (joints && std::abs((*joints)[kJ4] - middle) > half) {
    Joints reference = *joints;
    reference[kJ4] -= std::copysign(kTurn, reference[kJ4] - middle);
    joints = joints_at(reach, station, first_O, reference);
  }
  return joints ? *joints : before;
}

/// The tour's dots with their joints, in the order in which they are exposed.
std::vector<PosedDot> posed_tour(const DotsToPose& dots, const PoseCosts& costs, Tour& tour,
                                 const Joints& first) {
  const Reach& reach = dots.reach();
  std::vector<Joints> joints;
  joints.reserve(tour.dots.size());
  for (const std::uint32_t dot : tour.dots) {
    const auto found =
        joints_at(reach, tour.station, dots.position_O(dot), joints.empty() ? first : joints.back());
    CHECK(found.has_value());  // unserved dots have been removed
    joints.push_back(*found);
  }
  if (reach.options().order == DotOrder::kImproved) {
    std::vector<PathDot> path;
    path.reserve(joints.size());
    for (std::size_t i = 0; i < joints.size(); ++i) {
      path.push_back({dots.position_O(tour.dots[i]).cast<float>(), arm_of(joints[i]),
                      arm_of(reach.kinematics().per_yaw(joints[i]))});
    }
    const std::vector<std::uint32_t> order = improved_order(reach.cell(), path, costs.kicks);
    const std::vector<Joints> old_joints = joints;
    const std::vector<std::uint32_t> old_dots = tour.dots;
    for (std::size_t i = 0; i < order.size(); ++i) {
      joints[i] = old_joints[order[i]];
      tour.dots[i] = old_dots[order[i]];
    }
  }
  use_yaw_redundancy(dots, costs, tour.station, tour.dots, joints);
  std::vector<PosedDot> posed;
  posed.reserve(joints.size());
  for (std::size_t i = 0; i < joints.size(); ++i) posed.push_back({dots.dot_index(tour.dots[i]), joints[i]});
  return posed;
}

}  // namespace

PosedDots search_poses(const Reach& reach, const DotSequence& dots,
                       std::span<const std::uint32_t> dot_indices, const Progress& progress) {
  const DotsToPose to_pose(reach, dots, dot_indices);
  PoseCosts costs = pose_costs(reach.options());
  // The more dots, the nearer to the shortest possible step all of them are, and the sooner a fast plan is
  // wanted.
  if (reach.options().planning == Planning::kFast)
    costs.kicks = std::min(costs.kicks, kMaxKicksOfFastPlan / std::max<std::size_t>(1, dot_indices.size()));
  PosedDots posed;
  std::vector<std::uint32_t> unserved;
  std::vector<Tour> tours = tours_of(choose_shared_beams(to_pose, costs, progress.part(0, .4)), unserved);
  place_stations(to_pose, tours, unserved);
  remove_unserved_dots(to_pose, tours, unserved);
  progress(.5);
  const std::size_t common = tours.size();
  pose_unserved_dots(to_pose, std::move(unserved), tours, posed.skipped, progress.part(.5, .7));
  if (tours.size() > common) {
    std::vector<std::uint32_t> none;
    place_stations(to_pose, tours, none);
  }
  progress(.7);

  std::vector<Joints> first(tours.size());
  Joints before = home_joints(reach.cell());
  for (std::size_t t = 0; t < tours.size(); ++t) {
    before = unwrap_near(reach, to_pose.position_O(tours[t].dots.front()), before, tours[t].station);
    first[t] = before;
  }
  std::vector<std::vector<PosedDot>> parts(tours.size());
  for_batches(tours.size(), kToursAtOnce, progress.part(.7, 1), [&](std::size_t begin, std::size_t end) {
    tbb::parallel_for(begin, end,
                      [&](std::size_t t) { parts[t] = posed_tour(to_pose, costs, tours[t], first[t]); });
  });
  posed.sequence.reserve(dot_indices.size());
  before = home_joints(reach.cell());
  for (auto& part : parts) {
    if (part.empty()) continue;
    // A tour may be exposed in either direction.
    if (step_s(reach.cell(), before, part.back().joints) < step_s(reach.cell(), before, part.front().joints))
      std::reverse(part.begin(), part.end());
    posed.sequence.insert(posed.sequence.end(), part.begin(), part.end());
    before = part.back().joints;
    part = {};
  }
  progress(1);
  return posed;
}

}  // namespace hilbrush
