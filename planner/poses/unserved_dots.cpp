#include "planner/poses/unserved_dots.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "sampling/base/angles.h"
#include "sampling/base/batches.h"

namespace hilbrush {
namespace {

/// Where a dot cannot be exposed within the preferred incidence, its pose may deviate from the normal by this
/// much more than the best one found, rad.
constexpr double kIncidenceAllowance = 4 * kDegree;
constexpr std::size_t kAtOnce = 512;  // dots between two reports of progress
/// Samples by which the next station is chosen.
constexpr std::size_t kMaxPoses = 48;
constexpr std::size_t kMaxDots = 1500;
/// If the best station serves fewer of the sampled dots, each dot left gets its own pose as station.
constexpr std::size_t kMinServed = 2;

struct UnservedDot {
  std::uint32_t dot = 0;
  bool is_reachable = false;
  Station station;
  double cos_allowed = 1;  ///< of the incidence against the smooth normal
};

class UnservedDots {
 public:
  UnservedDots(const DotsToPose& dots, std::vector<Tour>& tours)
      : dots_(dots), reach_(dots.reach()), tours_(tours) {}

  void find_poses(const std::vector<std::uint32_t>& dots, std::vector<SkippedDot>& skipped,
                  const Progress& progress) {
    unserved_.resize(dots.size());
    std::vector<SkippedDot> refused(dots.size());
    const Joints home = home_joints(reach_.cell());
    for_batches(dots.size(), kAtOnce, progress, [&](std::size_t begin, std::size_t end) {
      tbb::parallel_for(tbb::blocked_range<std::size_t>(begin, end, 16), [&](const auto& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i)
          find_pose(dots[i], home, unserved_[i], refused[i]);
      });
    });
    for (std::size_t i = 0; i < dots.size(); ++i)
      if (!unserved_[i].is_reachable) skipped.push_back(std::move(refused[i]));
    std::erase_if(unserved_, [](const UnservedDot& unserved) { return !unserved.is_reachable; });
  }

  void join_tours() {
    std::vector<std::size_t> joined(unserved_.size(), tours_.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, unserved_.size(), 64), [&](const auto& range) {
      for (std::size_t i = range.begin(); i < range.end(); ++i) joined[i] = best_tour(unserved_[i]);
    });
    for (std::size_t i = 0; i < unserved_.size(); ++i)
      if (joined[i] < tours_.size()) tours_[joined[i]].dots.push_back(unserved_[i].dot);
    remove([&](std::size_t i) { return joined[i] < tours_.size(); });
  }

  void open_stations(const Progress& progress) {
    const auto all = static_cast<double>(unserved_.size());
    while (!unserved_.empty()) {
      const auto [pose, served] = most_serving();
      if (served < kMinServed) break;
      open_station(pose);
      progress(1 - static_cast<double>(unserved_.size()) / all);
    }
    while (!unserved_.empty()) open_station(0);
  }

 private:
  void find_pose(std::uint32_t dot, const Joints& home, UnservedDot& unserved, SkippedDot& refused) const {
    unserved.dot = dot;
    PoseSearchResult found = reach_.find_pose(dots_.target(dot), home);
    refused = std::move(found.skipped);
    refused.dot_index = dots_.dot_index(dot);
    const auto& pose = found.pose;
    if (!pose) return;
    unserved.is_reachable = true;
    unserved.station = {pose->table.tilt, pose->table.rotation, pose->yaw, pose->elbow};
    unserved.cos_allowed =
        std::cos(std::max(kept_incidence(reach_.options()), pose->from_smooth + kIncidenceAllowance));
  }

  bool serves(const Station& station, const Eigen::Vector3d& beam_O, const UnservedDot& unserved) const {
    const Target target = dots_.target(unserved.dot);
    return -beam_O.dot(target.smooth_normal_O) >= unserved.cos_allowed &&
           joints_at(reach_, station, target.position_O, {}) && reach_.is_clear(target, beam_O);
  }
  Eigen::Vector3d beam_of(const Station& station) const {
    return reach_.kinematics().table_pose(station.tilt, station.rotation).R_WO.transpose() *
           reach_.kinematics().beam_W(station.yaw);
  }

  std::size_t best_tour(const UnservedDot& unserved) const {
    const Target target = dots_.target(unserved.dot);
    std::vector<std::pair<double, std::size_t>> tours;
    for (std::size_t t = 0; t < tours_.size(); ++t) {
      const double cosine = -tours_[t].beam_O.dot(target.smooth_normal_O);
      if (cosine >= unserved.cos_allowed) tours.emplace_back(-cosine, t);
    }
    std::sort(tours.begin(), tours.end());
    for (const auto& [cosine, t] : tours)
      if (serves(tours_[t].station, tours_[t].beam_O, unserved)) return t;
    return tours_.size();
  }

  /// Of the poses of a sample of dots along the curve, the one that serves most of a larger sample.
  std::pair<std::size_t, std::size_t> most_serving() const {
    const std::size_t n = unserved_.size();
    const std::size_t poses = std::min(n, kMaxPoses);
    const std::size_t dots = std::min(n, kMaxDots);
    std::vector<std::size_t> served(poses, 0);
    tbb::parallel_for(std::size_t{0}, poses, [&](std::size_t p) {
      const Station& station = unserved_[p * n / poses].station;
      const Eigen::Vector3d beam_O = beam_of(station);
      for (std::size_t k = 0; k < dots; ++k)
        served[p] += serves(station, beam_O, unserved_[k * n / dots]) ? 1 : 0;
    });
    const auto best = std::max_element(served.begin(), served.end());
    return {static_cast<std::size_t>(best - served.begin()) * n / poses, *best};
  }

  void open_station(std::size_t pose) {
    Tour tour{unserved_[pose].station, true, beam_of(unserved_[pose].station), {}};
    std::vector<std::uint8_t> is_served(unserved_.size(), 0);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, unserved_.size(), 256), [&](const auto& range) {
      for (std::size_t i = range.begin(); i < range.end(); ++i)
        is_served[i] = i == pose || serves(tour.station, tour.beam_O, unserved_[i]) ? 1 : 0;
    });
    for (std::size_t i = 0; i < unserved_.size(); ++i)
      if (is_served[i]) tour.dots.push_back(unserved_[i].dot);
    tours_.push_back(std::move(tour));
    remove([&](std::size_t i) { return is_served[i] != 0; });
  }

  template <class Test>
  void remove(Test test) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < unserved_.size(); ++i)
      if (!test(i)) unserved_[kept++] = unserved_[i];
    unserved_.resize(kept);
  }

  const DotsToPose& dots_;
  const Reach& reach_;
  std::vector<Tour>& tours_;
  std::vector<UnservedDot> unserved_;
};

}  // namespace

void pose_unserved_dots(const DotsToPose& dots, std::vector<std::uint32_t> unserved, std::vector<Tour>& tours,
                        std::vector<SkippedDot>& skipped, const Progress& progress) {
  std::sort(unserved.begin(), unserved.end());
  UnservedDots placement(dots, tours);
  placement.find_poses(unserved, skipped, progress.part(0, .5));
  placement.join_tours();
  placement.open_stations(progress.part(.5, 1));
  for (Tour& tour : tours) std::sort(tour.dots.begin(), tour.dots.end());
}

}  // namespace hilbrush
