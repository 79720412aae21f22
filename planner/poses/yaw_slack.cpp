#include "planner/poses/yaw_slack.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "planner/poses/step_cost.h"

namespace hilbrush {
namespace {

constexpr int kYaws = 25;           // that a dot may have, the station's in the middle
constexpr int kLongestTurn = 8;     // between two dots, in steps
constexpr double kStepShare = .25;  // of the typical distance between dots, that one step of yaw moves the focus by
constexpr double kStepMin = .05 * std::numbers::pi / 180, kStepMax = std::numbers::pi / 180;
constexpr float kNever = std::numeric_limits<float>::infinity();

class YawPath {
 public:
  YawPath(const AimedDots& dots, const AimCosts& costs, const Station& station, std::span<const std::uint32_t> tour,
          std::span<Joints> joints)
      : dots_(dots),
        costs_(costs),
        reach_(dots.reach()),
        station_(station),
        table_(reach_.kinematics.table_pose(station.tilt, station.rotation)),
        tour_(tour),
        joints_(joints),
        cost_(reach_.cell) {
    const double focus_m = reach_.cell.arm.flange_to_focus_m * reach_.kinematics.cos_depression();
    step_ = focus_m > 0 ? std::clamp(kStepShare * typical_distance_m() / focus_m, kStepMin, kStepMax) : kStepMin;
  }

  void improve() {
    from_.assign(tour_.size() * kYaws, 0);
    Row before = row(0), now;
    for (std::size_t i = 1; i < tour_.size(); ++i) {
      now = row(i);
      connect(before, now, &from_[i * kYaws]);
      before = now;
    }
    int best = kYaws / 2;
    for (int y = 0; y < kYaws; ++y)
      if (before.cost_s[y] < before.cost_s[best]) best = y;
    for (std::size_t i = tour_.size(); i-- > 0;) {
      const int y = best;
      best = from_[i * kYaws + static_cast<std::size_t>(y)];
      if (y != kYaws / 2) turn(i, offset(y));
    }
  }

 private:
  /// A dot at all its yaws.
  struct Row {
    std::array<float, kYaws> cost_s;
    std::array<ArmJoints, kYaws> arm;
  };

  double offset(int y) const { return (y - kYaws / 2) * step_; }

  double typical_distance_m() const {
    std::vector<double> distances;
    for (std::size_t i = 1; i < tour_.size(); i += 1 + tour_.size() / 200)
      distances.push_back((dots_.position_O(tour_[i]) - dots_.position_O(tour_[i - 1])).norm());
    if (distances.empty()) return 0;
    const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    return *middle;
  }

  bool solve(std::size_t i, double yaw, Joints& joints) const {
    joints = joints_[i];
    if (!reach_.kinematics.solve_arm(table_.to_W(dots_.position_O(tour_[i])), yaw, station_.elbow, joints))
      return false;
    joints[kJ4] = reach_.kinematics.wind(kJ4, joints[kJ4], joints_[i][kJ4]);
    return true;
  }

  Row row(std::size_t i) const {
    const Target target = dots_.target(tour_[i]);
    const Eigen::Vector3d smooth_W = table_.R_WO * target.smooth_normal_O, face_W = table_.R_WO * target.face_normal_O;
    const double nominal = -reach_.kinematics.beam_W(station_.yaw).dot(smooth_W);
    const double cos_least = std::min(nominal, std::cos(kept_incidence(reach_.options))) - 1e-9;
    Row row;
    for (int y = 0; y < kYaws; ++y) {
      const Eigen::Vector3d beam_W = reach_.kinematics.beam_W(station_.yaw + offset(y));
      const double cosine = -beam_W.dot(smooth_W);
      Joints joints{};
      const bool is_possible = cosine >= cos_least && -beam_W.dot(face_W) >= reach_.cos_max_incidence() &&
                               solve(i, station_.yaw + offset(y), joints);
      const auto k = static_cast<std::size_t>(y);
      row.cost_s[k] = is_possible ? static_cast<float>(incidence_cost_s(costs_, cosine)) : kNever;
      for (std::size_t axis = 0; axis < 4; ++axis) row.arm[k][axis] = static_cast<float>(joints[axis]);
    }
    const std::size_t middle = kYaws / 2;
    row.cost_s[middle] = static_cast<float>(incidence_cost_s(costs_, nominal));
    for (std::size_t axis = 0; axis < 4; ++axis) row.arm[middle][axis] = static_cast<float>(joints_[i][axis]);
    return row;
  }

  void connect(const Row& before, Row& now, std::uint8_t* from) const {
    const float offset_s = *std::min_element(before.cost_s.begin(), before.cost_s.end());
    for (int y = 0; y < kYaws; ++y) {
      const auto k = static_cast<std::size_t>(y);
      if (now.cost_s[k] == kNever) continue;
      float least_s = kNever;
      for (int x = std::max(0, y - kLongestTurn); x <= std::min(kYaws - 1, y + kLongestTurn); ++x) {
        const auto j = static_cast<std::size_t>(x);
        if (before.cost_s[j] >= least_s) continue;
        const float cost_s = before.cost_s[j] - offset_s + cost_(before.arm[j], now.arm[k]);
        if (cost_s >= least_s) continue;
        least_s = cost_s;
        from[y] = static_cast<std::uint8_t>(x);
      }
      now.cost_s[k] = least_s == kNever ? kNever : now.cost_s[k] + least_s;
    }
    if (*std::min_element(now.cost_s.begin(), now.cost_s.end()) != kNever) return;
    // Too far a turn away from everything before: begin again from the station's own yaw.
    now.cost_s[kYaws / 2] = 0;
    from[kYaws / 2] =
        static_cast<std::uint8_t>(std::min_element(before.cost_s.begin(), before.cost_s.end()) - before.cost_s.begin());
  }

  void turn(std::size_t i, double offset) {
    const Target target = dots_.target(tour_[i]);
    Joints joints{};
    const double yaw = station_.yaw + offset;
    if (!reach_.arm_fits(table_, target.position_O, yaw, station_.elbow, joints_[i], joints, nullptr)) return;
    if (std::abs(joints[kJ4] - joints_[i][kJ4]) > 1) return;  // it would unwind
    if (dots_.is_clear(target, table_.R_WO.transpose() * reach_.kinematics.beam_W(yaw))) joints_[i] = joints;
  }

  const AimedDots& dots_;
  const AimCosts& costs_;
  const Reach::Implementation& reach_;
  const Station& station_;
  const TablePose table_;
  std::span<const std::uint32_t> tour_;
  std::span<Joints> joints_;
  StepCost cost_;
  double step_ = 0;
  std::vector<std::uint8_t> from_;
};

}  // namespace

void use_yaw_slack(const AimedDots& dots, const AimCosts& costs, const Station& station,
                   std::span<const std::uint32_t> tour, std::span<Joints> joints) {
  if (tour.empty()) return;
  YawPath(dots, costs, station, tour, joints).improve();
}

}  // namespace hilbrush
