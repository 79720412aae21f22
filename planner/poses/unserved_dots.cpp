#include "planner/poses/unserved_dots.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "sampling/base/angles.h"
#include "sampling/base/batches.h"

namespace hilbrush {
namespace {

/// Where a dot cannot be exposed within the preferred incidence, its pose may deviate so much more than the best one
/// found.
constexpr double kIncidenceSlack = 4 * kDegree;
constexpr std::size_t kAtOnce = 512;  // between two words of progress
constexpr std::size_t kMaxAskedPoses = 48, kMaxAskedDots = 1500;
/// A station that serves fewer of the dots asked is not looked for among their poses any more.
constexpr std::size_t kFewServed = 2;

struct Leftover {
  std::uint32_t dot = 0;
  bool is_reachable = false;
  Station station;
  double cos_allowed = 1;  ///< of the incidence against the smooth normal
};

class Leftovers {
 public:
  Leftovers(const AimedDots& dots, std::vector<Tour>& tours) : dots_(dots), reach_(dots.reach()), tours_(tours) {}

  void find_poses(const std::vector<std::uint32_t>& left, std::vector<SkippedDot>& skipped, const Progress& progress) {
    left_.resize(left.size());
    std::vector<SkippedDot> refused(left.size());
    const Joints home = home_joints(reach_.cell());
    for_batches(left.size(), kAtOnce, progress, [&](std::size_t begin, std::size_t end) {
      tbb::parallel_for(tbb::blocked_range<std::size_t>(begin, end, 16), [&](const auto& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) find_pose(left[i], home, left_[i], refused[i]);
      });
    });
    for (std::size_t i = 0; i < left.size(); ++i)
      if (!left_[i].is_reachable) skipped.push_back(std::move(refused[i]));
    std::erase_if(left_, [](const Leftover& leftover) { return !leftover.is_reachable; });
  }

  void join_tours() {
    std::vector<std::size_t> joined(left_.size(), tours_.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, left_.size(), 64), [&](const auto& range) {
      for (std::size_t i = range.begin(); i < range.end(); ++i) joined[i] = best_tour(left_[i]);
    });
    for (std::size_t i = 0; i < left_.size(); ++i)
      if (joined[i] < tours_.size()) tours_[joined[i]].dots.push_back(left_[i].dot);
    remove([&](std::size_t i) { return joined[i] < tours_.size(); });
  }

  void open_stations(const Progress& progress) {
    const auto all = static_cast<double>(left_.size());
    while (!left_.empty()) {
      const auto [pose, served] = most_serving();
      if (served < kFewServed) break;
      open_station(pose);
      progress(1 - static_cast<double>(left_.size()) / all);
    }
    while (!left_.empty()) open_station(0);
  }

 private:
  void find_pose(std::uint32_t dot, const Joints& home, Leftover& leftover, SkippedDot& refused) const {
    leftover.dot = dot;
    PoseSearchResult found = reach_.find_pose(dots_.target(dot), home);
    refused = std::move(found.skipped);
    refused.dot_index = dots_.dot_index(dot);
    const auto& pose = found.pose;
    if (!pose) return;
    leftover.is_reachable = true;
    leftover.station = {pose->table.tilt, pose->table.rotation, pose->yaw, pose->elbow};
    leftover.cos_allowed = std::cos(std::max(kept_incidence(reach_.options()), pose->from_smooth + kIncidenceSlack));
  }

  bool serves(const Station& station, const Eigen::Vector3d& beam_O, const Leftover& leftover) const {
    const Target target = dots_.target(leftover.dot);
    return -beam_O.dot(target.smooth_normal_O) >= leftover.cos_allowed &&
           joints_at(reach_, station, target.position_O, {}) && reach_.is_clear(target, beam_O);
  }
  Eigen::Vector3d beam_of(const Station& station) const {
    return reach_.kinematics().table_pose(station.tilt, station.rotation).R_WO.transpose() *
           reach_.kinematics().beam_W(station.yaw);
  }

  std::size_t best_tour(const Leftover& leftover) const {
    const Target target = dots_.target(leftover.dot);
    std::vector<std::pair<double, std::size_t>> tours;
    for (std::size_t t = 0; t < tours_.size(); ++t) {
      const double cosine = -tours_[t].beam_O.dot(target.smooth_normal_O);
      if (cosine >= leftover.cos_allowed) tours.emplace_back(-cosine, t);
    }
    std::sort(tours.begin(), tours.end());
    for (const auto& [cosine, t] : tours)
      if (serves(tours_[t].station, tours_[t].beam_O, leftover)) return t;
    return tours_.size();
  }

  /// Of the poses of some dots all along the curve, the one that serves most of some dots all along it.
  std::pair<std::size_t, std::size_t> most_serving() const {
    const std::size_t n = left_.size(), poses = std::min(n, kMaxAskedPoses), asked = std::min(n, kMaxAskedDots);
    std::vector<std::size_t> served(poses, 0);
    tbb::parallel_for(std::size_t{0}, poses, [&](std::size_t p) {
      const Station& station = left_[p * n / poses].station;
      const Eigen::Vector3d beam_O = beam_of(station);
      for (std::size_t k = 0; k < asked; ++k) served[p] += serves(station, beam_O, left_[k * n / asked]) ? 1 : 0;
    });
    const auto best = std::max_element(served.begin(), served.end());
    return {static_cast<std::size_t>(best - served.begin()) * n / poses, *best};
  }

  void open_station(std::size_t pose) {
    Tour tour{left_[pose].station, true, beam_of(left_[pose].station), {}};
    std::vector<std::uint8_t> is_served(left_.size(), 0);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, left_.size(), 256), [&](const auto& range) {
      for (std::size_t i = range.begin(); i < range.end(); ++i)
        is_served[i] = i == pose || serves(tour.station, tour.beam_O, left_[i]) ? 1 : 0;
    });
    for (std::size_t i = 0; i < left_.size(); ++i)
      if (is_served[i]) tour.dots.push_back(left_[i].dot);
    tours_.push_back(std::move(tour));
    remove([&](std::size_t i) { return is_served[i] != 0; });
  }

  template <class Test>
  void remove(Test test) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < left_.size(); ++i)
      if (!test(i)) left_[kept++] = left_[i];
    left_.resize(kept);
  }

  const AimedDots& dots_;
  const Reach& reach_;
  std::vector<Tour>& tours_;
  std::vector<Leftover> left_;
};

}  // namespace

void serve_leftovers(const AimedDots& dots, std::vector<std::uint32_t> left, std::vector<Tour>& tours,
                     std::vector<SkippedDot>& skipped, const Progress& progress) {
  std::sort(left.begin(), left.end());
  Leftovers leftovers(dots, tours);
  leftovers.find_poses(left, skipped, progress.part(0, .5));
  leftovers.join_tours();
  leftovers.open_stations(progress.part(.5, 1));
  for (Tour& tour : tours) std::sort(tour.dots.begin(), tour.dots.end());
}

}  // namespace hilbrush
