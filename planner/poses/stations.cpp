#include "planner/poses/stations.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "planner/cell_model/time_model.h"
#include "sampling/base/angles.h"

namespace hilbrush {
namespace {

constexpr std::size_t kRatedDots = 160;  // of a tour, by which a station is rated
constexpr double kUnservedDotS = .3;     // cost of a dot that the station does not serve, s
constexpr int kRounds = 2;

struct Option {
  Station station;
  Joints joints{};    ///< at the middle of the tour
  double work_s = 0;  ///< between the tour's dots
};

/// Moves of table and arm, C and J4 by the shorter turn.
double repose_s(const CellDescription& cell, const Joints& a, const Joints& b) {
  double slowest_s = 0;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    double distance = std::abs(a[i] - b[i]);
    if (i == kRotation || i == kJ4) distance = std::abs(std::remainder(distance, kTurn));
    slowest_s = std::max(slowest_s, cell.axes[i].time_factor * trapezoid_s(distance, cell.axes[i].speed_max,
                                                                           cell.axes[i].acceleration_max));
  }
  const bool is_flip = (a[kJ2] >= 0) != (b[kJ2] >= 0);
  return slowest_s + (is_flip ? 2 * cell.timing.retract_s : 0);
}

class StationChoice {
 public:
  StationChoice(const DotsToPose& dots, std::vector<Tour>& tours)
      : dots_(dots), reach_(dots.reach()), tours_(tours) {}

  void find_options() {
    options_.resize(tours_.size());
    // More tours have less to choose from, so that their distances can be found in bounded time.
    const std::size_t kept = tours_.size() > 400 ? 4 : 12;
    tbb::parallel_for(std::size_t{0}, tours_.size(), [&](std::size_t t) {
      options_[t] = tours_[t].is_placed ? placed_option(tours_[t]) : rated_options(tours_[t], kept);
    });
  }

  /// Removes tours without any option; their dots go to `unserved`.
  void remove_unplaceable(std::vector<std::uint32_t>& unserved) {
    std::size_t kept = 0;
    for (std::size_t t = 0; t < tours_.size(); ++t) {
      if (options_[t].empty()) {
        unserved.insert(unserved.end(), tours_[t].dots.begin(), tours_[t].dots.end());
        continue;
      }
      if (kept != t) {
        tours_[kept] = std::move(tours_[t]);
        options_[kept] = std::move(options_[t]);
      }
      ++kept;
    }
    tours_.resize(kept);
    options_.resize(kept);
  }

  void arrange() {
    if (tours_.empty()) return;
    order_.resize(tours_.size());
    for (std::size_t t = 0; t < order_.size(); ++t) order_[t] = t;
    measure(nullptr);
    start_nearest_first();
    std::vector<std::size_t> chosen;
    for (int round = 0; round < kRounds; ++round) {
      exchange();
      chosen = cheapest_options();
      measure(&chosen);
    }
    std::vector<Tour> arranged;
    arranged.reserve(tours_.size());
    for (const std::size_t t : order_) {
      Tour& tour = tours_[t];
      if (!tour.is_placed) tour.station = options_[t][chosen[t]].station;
      tour.is_placed = true;
      arranged.push_back(std::move(tour));
    }
    tours_ = std::move(arranged);
  }

 private:
  std::vector<Option> placed_option(const Tour& tour) const {
    const Option option{tour.station, {}, 0};
    const Eigen::Vector3d& middle_O = dots_.position_O(tour.dots[tour.dots.size() / 2]);
    const auto joints = joints_at(reach_, tour.station, middle_O, {});
    return {{option.station, joints ? *joints : home_joints(reach_.cell()), 0}};
  }

  std::vector<Option> rated_options(const Tour& tour, std::size_t kept) const {
    std::vector<Option> options;
    for (const double tilt : reach_.tilts()) {
      for (const TableSolution& solution : solve_table(reach_.kinematics(), tilt, tour.beam_O))
        for (const Elbow elbow : {Elbow::kPositive, Elbow::kNegative})
          if (auto option = rate(tour, {tilt, solution.rotation, solution.yaw, elbow}))
            options.push_back(*option);
    }
    std::stable_sort(options.begin(), options.end(),
                     [](const Option& a, const Option& b) { return a.work_s < b.work_s; });
    if (options.size() > kept) options.resize(kept);
    return options;
  }

  /// By a sample of dots along the tour, each with the one after it.
  std::optional<Option> rate(const Tour& tour, const Station& station) const {
    const std::size_t count = tour.dots.size();
    const std::size_t rated = std::min(count, kRatedDots);
    Option option{station, {}, 0};
    std::size_t served = 0;
    std::size_t steps = 0;
    double step_sum_s = 0;
    for (std::size_t k = 0; k < rated; ++k) {
      const std::size_t i = (2 * k + 1) * count / (2 * rated);
      const auto joints = joints_at(reach_, station, dots_.position_O(tour.dots[i]), option.joints);
      if (!joints) continue;
      ++served;
      if (2 * served <= rated + 1) option.joints = *joints;
      if (i + 1 == count) continue;
      const auto next = joints_at(reach_, station, dots_.position_O(tour.dots[i + 1]), *joints);
      if (!next) continue;
      ++steps;
      step_sum_s += step_s(reach_.cell(), *joints, *next);
    }
    if (served == 0) return std::nullopt;
    const auto n = static_cast<double>(count);
    const double mean_step_s = steps > 0 ? step_sum_s / static_cast<double>(steps) : 0;
    option.work_s =
        n * (mean_step_s + kUnservedDotS * (1 - static_cast<double>(served) / static_cast<double>(rated)));
    return option;
  }

  /// Between all tours and home (the last row), by their best pairs of options or by the chosen ones.
  void measure(const std::vector<std::size_t>* chosen) {
    const std::size_t n = tours_.size();
    distance_s_.assign((n + 1) * (n + 1), 0);
    const std::vector<Option> home{{{}, home_joints(reach_.cell()), 0}};
    const auto options_of = [&](std::size_t t) -> std::span<const Option> {
      if (t == n) return home;
      if (!chosen) return options_[t];
      return std::span<const Option>(options_[t]).subspan((*chosen)[t], 1);
    };
    tbb::parallel_for(std::size_t{0}, n + 1, [&](std::size_t a) {
      for (std::size_t b = 0; b <= n; ++b) {
        if (a == b) continue;
        double least_s = std::numeric_limits<double>::infinity();
        for (const Option& from : options_of(a))
          for (const Option& to : options_of(b))
            least_s = std::min(least_s, repose_s(reach_.cell(), from.joints, to.joints));
        distance_s_[a * (n + 1) + b] = static_cast<float>(least_s);
      }
    });
  }
  double distance_s(std::size_t a, std::size_t b) const {
    return static_cast<double>(distance_s_[a * (tours_.size() + 1) + b]);
  }
  /// The tour at a position of the order, counted from 1; home before the first and after the last.
  std::size_t at(std::size_t position) const {
    return position == 0 || position > order_.size() ? tours_.size() : order_[position - 1];
  }

  void start_nearest_first() {
    std::size_t now = tours_.size();
    for (std::size_t k = 0; k < order_.size(); ++k) {
      std::size_t nearest = k;
      for (std::size_t j = k + 1; j < order_.size(); ++j)
        if (distance_s(now, order_[j]) < distance_s(now, order_[nearest])) nearest = j;
      std::swap(order_[k], order_[nearest]);
      now = order_[k];
    }
  }

  /// 2-opt and moving single tours, until nothing improves.
  void exchange() {
    constexpr double kMinStationGainS = 1e-5;
    constexpr int kMaxPasses = 60;
    const std::size_t n = order_.size();
    bool is_improved = true;
    for (int pass = 0; pass < kMaxPasses && is_improved; ++pass) {
      is_improved = false;
      for (std::size_t i = 1; i <= n; ++i)
        for (std::size_t j = i + 1; j <= n; ++j) {
          const double gain = distance_s(at(i - 1), at(i)) + distance_s(at(j), at(j + 1)) -
                              distance_s(at(i - 1), at(j)) - distance_s(at(i), at(j + 1));
          if (gain <= kMinStationGainS) continue;
          std::reverse(order_.begin() + static_cast<std::ptrdiff_t>(i - 1),
                       order_.begin() + static_cast<std::ptrdiff_t>(j));
          is_improved = true;
        }
      for (std::size_t i = 1; i <= n; ++i) is_improved |= move_tour(i, kMinStationGainS);
    }
  }

  bool move_tour(std::size_t i, double min_gain_s) {
    const std::size_t tour = at(i);
    const double removed =
        distance_s(at(i - 1), tour) + distance_s(tour, at(i + 1)) - distance_s(at(i - 1), at(i + 1));
    for (std::size_t j = 0; j <= order_.size(); ++j) {  // between positions j and j + 1
      if (j == i || j + 1 == i) continue;
      const double added =
          distance_s(at(j), tour) + distance_s(tour, at(j + 1)) - distance_s(at(j), at(j + 1));
      if (removed - added <= min_gain_s) continue;
      const auto first = order_.begin();
      const auto from = static_cast<std::ptrdiff_t>(i - 1);
      const auto to = static_cast<std::ptrdiff_t>(j);
      if (from < to)
        std::rotate(first + from, first + from + 1, first + to);
      else
        std::rotate(first + to, first + from, first + from + 1);
      return true;
    }
    return false;
  }

  /// Viterbi along the order, from home to home. Returns the option of each tour.
  std::vector<std::size_t> cheapest_options() const {
    const std::size_t n = order_.size();
    std::vector<std::vector<std::uint16_t>> from(n);
    std::vector<double> cost_s{0};
    std::vector<Joints> joints{home_joints(reach_.cell())};
    for (std::size_t k = 0; k < n; ++k) {
      const std::vector<Option>& options = options_[order_[k]];
      std::vector<double> next_cost_s(options.size(), std::numeric_limits<double>::infinity());
      std::vector<Joints> next_joints(options.size());
      from[k].resize(options.size());
      for (std::size_t o = 0; o < options.size(); ++o)
        for (std::size_t p = 0; p < cost_s.size(); ++p) {
          const double cost =
              cost_s[p] + options[o].work_s + repose_s(reach_.cell(), joints[p], options[o].joints);
          if (cost >= next_cost_s[o]) continue;
          next_cost_s[o] = cost;
          next_joints[o] = options[o].joints;
          from[k][o] = static_cast<std::uint16_t>(p);
        }
      cost_s = std::move(next_cost_s);
      joints = std::move(next_joints);
    }
    std::vector<std::size_t> chosen(tours_.size());
    auto o = static_cast<std::size_t>(std::min_element(cost_s.begin(), cost_s.end()) - cost_s.begin());
    for (std::size_t k = n; k-- > 0;) {
      chosen[order_[k]] = o;
      o = from[k][o];
    }
    return chosen;
  }

  const DotsToPose& dots_;
  const Reach& reach_;
  std::vector<Tour>& tours_;
  std::vector<std::vector<Option>> options_;  ///< by tour, best first
  std::vector<float> distance_s_;
  std::vector<std::size_t> order_;
};

}  // namespace

std::optional<Joints> joints_at(const Reach& reach, const Station& station, const Eigen::Vector3d& position_O,
                                const Joints& reference) {
  const TablePose table = reach.kinematics().table_pose(station.tilt, station.rotation);
  return reach.arm_joints(table, position_O, station.yaw, station.elbow, reference);
}

void place_stations(const DotsToPose& dots, std::vector<Tour>& tours, std::vector<std::uint32_t>& unserved) {
  StationChoice choice(dots, tours);
  choice.find_options();
  choice.remove_unplaceable(unserved);
  choice.arrange();
}

}  // namespace hilbrush
