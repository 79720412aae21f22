#include "planner/poses/yaw_redundancy.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "planner/poses/step_cost.h"
#include "sampling/base/angles.h"

namespace hilbrush {
namespace {

constexpr double kMaxTurn = 8 * kDegree;  // of the tool away from the station's yaw
constexpr int kFinePerCoarse = 4;
constexpr int kMaxToOneSide = 127;    // so that back-pointers fit into a byte
constexpr std::size_t kBlock = 8192;  // dots whose yaws are chosen together
constexpr float kNever = std::numeric_limits<float>::infinity();

/// The yaws that a dot may have: `half` to either side of a middle one.
struct YawGrid {
  double step;  ///< rad
  int half;
  int max_turn;  ///< between two dots, in steps

  int count() const { return 2 * half + 1; }
};

class YawPath {
 public:
  YawPath(const DotsToPose& dots, const PoseCosts& costs, const Station& station,
          std::span<const std::uint32_t> tour, std::span<Joints> joints)
      : dots_(dots),
        costs_(costs),
        reach_(dots.reach()),
        station_(station),
        table_(reach_.kinematics().table_pose(station.tilt, station.rotation)),
        tour_(tour),
        joints_(joints),
        cost_(reach_.cell()),
        steps_away_(tour.size(), 0) {}

  /// First roughly, as far as the tool may turn; then in small steps around that.
  void improve() {
    const double coarse = one_tick_turn();
    const double fine = coarse / kFinePerCoarse;
    const YawGrid coarse_grid{coarse, std::min(kMaxToOneSide, static_cast<int>(kMaxTurn / coarse)), 4};
    const YawGrid fine_grid{fine, 12, 8};
    for (std::size_t i = 0; i < tour_.size(); ++i) clear_.push_back({clear_turn(i, -1), clear_turn(i, 1)});
    choose(coarse_grid);
    for (int& steps : steps_away_) steps *= kFinePerCoarse;
    choose(fine_grid);
    for (std::size_t i = 0; i < tour_.size(); ++i)
      if (steps_away_[i] != 0) turn(i, steps_away_[i] * fine);
  }

 private:
  /// A dot at all its yaws.
  struct Row {
    std::vector<float> cost_s;
    std::vector<ArmJoints> arm;
    int middle = 0;  ///< in steps away from the station's yaw
  };

  /// What J4 turns by in one control tick: longer turns make steps longer.
  double one_tick_turn() const {
    const double half_tick_s = reach_.cell().timing.tick_s / 2;
    return std::clamp(reach_.cell().axes[kJ4].acceleration_max * half_tick_s * half_tick_s, .04 * kDegree,
                      .4 * kDegree);
  }

  /// How far the tool may turn to one side with beam and lens still clear.
  float clear_turn(std::size_t i, int side) const {
    constexpr int kTried = 5;
    const Eigen::Vector3d& position_O = dots_.position_O(tour_[i]);
    for (int k = kTried; k > 0; --k) {
      const double turn = kMaxTurn * k / kTried;
      const Eigen::Vector3d beam_O =
          table_.R_WO.transpose() * reach_.kinematics().beam_W(station_.yaw + side * turn);
      if (reach_.clearance().lens_obstruction(position_O, beam_O) == Obstruction::kNone &&
          reach_.clearance().beam_obstruction(position_O, beam_O) == Obstruction::kNone)
        return static_cast<float>(turn);
    }
    return 0;
  }

  /// The cheapest path through the grid around each dot's present yaw.
  void choose(const YawGrid& grid) {
    for (std::size_t begin = 0; begin < tour_.size(); begin += kBlock)
      choose(grid, begin, std::min(tour_.size(), begin + kBlock));
  }

  void choose(const YawGrid& grid, std::size_t begin, std::size_t end) {
    const auto count = static_cast<std::size_t>(grid.count());
    from_.assign((end - begin) * count, 0);
    Row before, now;
    fill(grid, begin, before);
    if (begin > 0) {  // continues from the yaw chosen for the dot before
      Row chosen;
      fill(grid, begin - 1, chosen);
      for (std::size_t y = 0; y < count; ++y)
        if (static_cast<int>(y) != grid.half) chosen.cost_s[y] = kNever;
      connect(grid, chosen, before, from_.data());
    }
    for (std::size_t i = begin + 1; i < end; ++i) {
      fill(grid, i, now);
      connect(grid, before, now, &from_[(i - begin) * count]);
      std::swap(before, now);
    }
    auto best = static_cast<std::size_t>(std::min_element(before.cost_s.begin(), before.cost_s.end()) -
                                         before.cost_s.begin());
    for (std::size_t i = end; i-- > begin;) {
      steps_away_[i] += static_cast<int>(best) - grid.half;
      best = from_[(i - begin) * count + best];
    }
  }

  bool solve(std::size_t i, double yaw, Joints& joints) const {
    joints = joints_[i];
    if (!reach_.kinematics().solve_arm(table_.to_W(dots_.position_O(tour_[i])), yaw, station_.elbow, joints))
      return false;
    joints[kJ4] = reach_.kinematics().unwrap_near(kJ4, joints[kJ4], joints_[i][kJ4]);
    return true;
  }

  void fill(const YawGrid& grid, std::size_t i, Row& row) const {
    const Target target = dots_.target(tour_[i]);
    const Eigen::Vector3d smooth_W = table_.R_WO * target.smooth_normal_O;
    const Eigen::Vector3d face_W = table_.R_WO * target.face_normal_O;
    const double nominal = -reach_.kinematics().beam_W(station_.yaw).dot(smooth_W);
    const double cos_least = std::min(nominal, std::cos(kept_incidence(reach_.options()))) - 1e-9;
    row.middle = steps_away_[i];
    row.cost_s.assign(static_cast<std::size_t>(grid.count()), kNever);
    row.arm.assign(row.cost_s.size(), arm_of(joints_[i]));
    for (int y = 0; y < grid.count(); ++y) {
      const int steps = row.middle + y - grid.half;
      const double turn = steps * grid.step;
      const double yaw = station_.yaw + turn;
      if (turn < -static_cast<double>(clear_[i][0]) || turn > static_cast<double>(clear_[i][1])) continue;
      const Eigen::Vector3d beam_W = reach_.kinematics().beam_W(yaw);
      const double cosine = -beam_W.dot(smooth_W);
      if (steps != 0 && (cosine < cos_least || -beam_W.dot(face_W) < reach_.cos_max_incidence())) continue;
      Joints joints = joints_[i];
      if (steps != 0 && !solve(i, yaw, joints)) continue;
      row.cost_s[static_cast<std::size_t>(y)] = static_cast<float>(incidence_cost_s(costs_, cosine));
      row.arm[static_cast<std::size_t>(y)] = arm_of(joints);
    }
  }

  void connect(const YawGrid& grid, const Row& before, Row& now, std::uint8_t* from) const {
    const auto best_before = std::min_element(before.cost_s.begin(), before.cost_s.end());
    const int shift = now.middle - before.middle;
    for (int y = 0; y < grid.count(); ++y) {
      const auto k = static_cast<std::size_t>(y);
      if (now.cost_s[k] == kNever) continue;
      float least_s = kNever;
      const int low = std::max(0, y + shift - grid.max_turn);
      const int high = std::min(grid.count() - 1, y + shift + grid.max_turn);
      for (int x = low; x <= high; ++x) {
        const auto j = static_cast<std::size_t>(x);
        if (before.cost_s[j] >= least_s) continue;
        const float cost_s = before.cost_s[j] - *best_before + cost_(before.arm[j], now.arm[k]);
        if (cost_s >= least_s) continue;
        least_s = cost_s;
        from[y] = static_cast<std::uint8_t>(x);
      }
      now.cost_s[k] = least_s == kNever ? kNever : now.cost_s[k] + least_s;
    }
    if (*std::min_element(now.cost_s.begin(), now.cost_s.end()) != kNever) return;
    // Every yaw needs too long a turn from the dot before: start again from the middle.
    now.cost_s[static_cast<std::size_t>(grid.half)] = 0;
    from[grid.half] = static_cast<std::uint8_t>(best_before - before.cost_s.begin());
  }

  void turn(std::size_t i, double offset) {
    const Target target = dots_.target(tour_[i]);
    const double yaw = station_.yaw + offset;
    const auto joints = reach_.arm_joints(table_, target.position_O, yaw, station_.elbow, joints_[i]);
    if (!joints) return;
    if (std::abs((*joints)[kJ4] - joints_[i][kJ4]) > 1) return;  // it would unwind
    if (reach_.is_clear(target, table_.R_WO.transpose() * reach_.kinematics().beam_W(yaw)))
      joints_[i] = *joints;
  }

  const DotsToPose& dots_;
  const PoseCosts& costs_;
  const Reach& reach_;
  const Station& station_;
  const TablePose table_;
  std::span<const std::uint32_t> tour_;
  std::span<Joints> joints_;
  StepCost cost_;
  std::vector<int> steps_away_;              ///< of each dot, from the station's yaw, in steps of the grid
  std::vector<std::array<float, 2>> clear_;  ///< of each dot, how far the tool may turn either way, rad
  std::vector<std::uint8_t> from_;           ///< of each yaw of each dot of a block, the yaw before
};

}  // namespace

void use_yaw_redundancy(const DotsToPose& dots, const PoseCosts& costs, const Station& station,
                        std::span<const std::uint32_t> tour, std::span<Joints> joints) {
  if (tour.empty()) return;
  YawPath(dots, costs, station, tour, joints).improve();
}

}  // namespace hilbrush
