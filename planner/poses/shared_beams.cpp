#include "planner/poses/shared_beams.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "planner/reach/beam_directions.h"
#include "sampling/base/angles.h"
#include "sampling/base/batches.h"

namespace hilbrush {
namespace {

constexpr double kNoBeamS = .25;  // cost of a dot that no direction serves, s
constexpr std::size_t kMaxBeams = 2000;
constexpr std::size_t kBeamBlock = 1 << 12;  // dots that are assigned together
constexpr std::size_t kBlocksAtOnce = 16;
constexpr int kExchangeRounds = 2;

/// Facility location: which of the candidate directions are used.
class BeamLocation {
 public:
  BeamLocation(const DotsToPose& dots, const PoseCosts& costs)
      : dots_(dots), costs_(costs), directions_(costs.spacing) {
    find_services();
  }

  std::vector<Eigen::Vector3d> solve(const Progress& progress) {
    // How many there will be is not known; the reported progress approaches one in any case.
    const auto report = [&](double done) { progress(done / (done + 300)); };
    double done = 0;
    for (; open_.size() < kMaxBeams && open_best(); ++done) report(done);
    for (int round = 0; round < kExchangeRounds; ++round)
      for (std::size_t k = 0; k < open_.size(); report(++done)) k += exchange(k) ? 1 : 0;
    std::vector<Eigen::Vector3d> beams;
    std::sort(open_.begin(), open_.end());
    for (const std::uint32_t d : open_) beams.push_back(directions_[d]);
    return beams;
  }

 private:
  struct Service {
    std::uint32_t sample;
    float cost_s;
  };

  void find_services() {
    const std::size_t sample_count = std::min(dots_.size(), costs_.sample);
    weight_ = sample_count > 0 ? static_cast<double>(dots_.size()) / static_cast<double>(sample_count) : 0;
    served_.resize(sample_count);
    const double cos_preferred = std::cos(kept_incidence(dots_.reach().options()));
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, sample_count, 16), [&](const auto& range) {
      for (std::size_t s = range.begin(); s < range.end(); ++s) {
        const Target target = dots_.target(s * dots_.size() / sample_count);
        for (const std::uint32_t d : directions_.that_hit(dots_.reach(), target, cos_preferred)) {
          const double cosine = -directions_[d].dot(target.smooth_normal_O);
          served_[s].emplace_back(d, static_cast<float>(incidence_cost_s(costs_, cosine)));
        }
      }
    });
    serves_.resize(directions_.size());
    for (std::uint32_t s = 0; s < sample_count; ++s)
      for (const auto& [d, cost_s] : served_[s]) serves_[d].push_back({s, cost_s});
    cost_s_.assign(sample_count, static_cast<float>(kNoBeamS));
    is_open_.assign(directions_.size(), false);
  }

  double gain_s(std::uint32_t d) const {
    double gain = 0;
    for (const Service& service : serves_[d]) gain += std::max(0.F, cost_s_[service.sample] - service.cost_s);
    return weight_ * gain - costs_.repose_s;
  }

  std::pair<double, std::uint32_t> best_gain() const {
    std::pair<double, std::uint32_t> best{0, 0};
    for (std::uint32_t d = 0; d < directions_.size(); ++d) {
      if (is_open_[d]) continue;
      const double gain = gain_s(d);
      if (gain > best.first) best = {gain, d};
    }
    return best;
  }

  void open(std::uint32_t d) {
    is_open_[d] = true;
    open_.push_back(d);
    for (const Service& service : serves_[d])
      cost_s_[service.sample] = std::min(cost_s_[service.sample], service.cost_s);
  }

  bool open_best() {
    const auto [gain, d] = best_gain();
    if (gain <= 0) return false;
    open(d);
    return true;
  }

  /// Closes a direction and opens the best one, if any is worth its cost. False if none was opened.
  bool exchange(std::size_t k) {
    const std::uint32_t d = open_[k];
    is_open_[d] = false;
    for (const Service& service : serves_[d]) {
      float& cost = cost_s_[service.sample];
      cost = static_cast<float>(kNoBeamS);
      for (const auto& [other, cost_s] : served_[service.sample])
        if (is_open_[other]) cost = std::min(cost, cost_s);
    }
    const auto [gain, better] = best_gain();
    if (gain <= 0) {
      open_.erase(open_.begin() + static_cast<std::ptrdiff_t>(k));
      return false;
    }
    open(better);
    open_[k] = better;
    open_.pop_back();
    return true;
  }

  const DotsToPose& dots_;
  const PoseCosts& costs_;
  BeamDirections directions_;
  std::vector<std::vector<Service>> serves_;                          ///< by direction
  std::vector<std::vector<std::pair<std::uint32_t, float>>> served_;  ///< by sample
  std::vector<float> cost_s_;  ///< of each sampled dot with the open directions
  std::vector<bool> is_open_;
  std::vector<std::uint32_t> open_;
  double weight_ = 0;  ///< dots that a sampled dot stands for
};

/// One block of the curve: each dot's clear directions, then the cheapest sequence of them, where a change of
/// direction has its cost (Viterbi).
class BeamAssignment {
 public:
  BeamAssignment(const DotsToPose& dots, const PoseCosts& costs, std::span<const Eigen::Vector3d> beams_O)
      : dots_(dots), costs_(costs), beams_O_(beams_O) {}

  void choose(std::size_t begin, std::size_t end, std::uint16_t* of_dot) {
    first_.assign(1, 0);
    for (std::size_t i = begin; i < end; ++i) {
      find_candidates(dots_.target(i));
      first_.push_back(candidates_.size());
    }
    trace_back(find_cheapest(), of_dot + begin);
  }

 private:
  struct Candidate {
    std::uint16_t beam = 0;
    float cost_s = 0;
    std::uint32_t from = UINT32_MAX;  ///< the candidate before
  };

  void find_candidates(const Target& target) {
    const double cos_preferred = std::cos(kept_incidence(dots_.reach().options()));
    for (std::size_t k = 0; k < beams_O_.size(); ++k) {
      const double cosine = -beams_O_[k].dot(target.smooth_normal_O);
      if (cosine >= cos_preferred && dots_.reach().is_clear(target, beams_O_[k]))
        candidates_.push_back(
            {static_cast<std::uint16_t>(k), static_cast<float>(incidence_cost_s(costs_, cosine))});
    }
  }

  /// Dots without candidates are skipped. Returns the last candidate of the cheapest sequence.
  std::uint32_t find_cheapest() {
    std::vector<std::uint32_t> latest(beams_O_.size(),
                                      UINT32_MAX);  // candidate of the dot before, by direction
    std::uint32_t best_before = UINT32_MAX;
    std::size_t before_begin = 0;
    std::size_t before_end = 0;
    for (std::size_t i = 0; i + 1 < first_.size(); ++i) {
      if (first_[i] == first_[i + 1]) continue;
      std::uint32_t best = UINT32_MAX;
      for (std::size_t c = first_[i]; c < first_[i + 1]; ++c) {
        Candidate& candidate = candidates_[c];
        if (best_before != UINT32_MAX) {
          const std::uint32_t same = latest[candidate.beam];
          const float switched = candidates_[best_before].cost_s + static_cast<float>(costs_.switch_s);
          const bool is_kept = same != UINT32_MAX && candidates_[same].cost_s <= switched;
          candidate.from = is_kept ? same : best_before;
          candidate.cost_s += is_kept ? candidates_[same].cost_s : switched;
        }
        if (best == UINT32_MAX || candidate.cost_s < candidates_[best].cost_s)
          best = static_cast<std::uint32_t>(c);
      }
      for (std::size_t c = before_begin; c < before_end; ++c) latest[candidates_[c].beam] = UINT32_MAX;
      before_begin = first_[i];
      before_end = first_[i + 1];
      const float offset =
          candidates_[best].cost_s;  // sums stay small, so that single precision keeps its digits
      for (std::size_t c = before_begin; c < before_end; ++c) {
        candidates_[c].cost_s -= offset;
        latest[candidates_[c].beam] = static_cast<std::uint32_t>(c);
      }
      best_before = best;
    }
    return best_before;
  }

  void trace_back(std::uint32_t at, std::uint16_t* of_dot) const {
    for (std::size_t i = first_.size() - 1; i-- > 0;) {
      if (first_[i] == first_[i + 1]) {
        of_dot[i] = kNoBeam;
        continue;
      }
      of_dot[i] = candidates_[at].beam;
      at = candidates_[at].from;
    }
  }

  const DotsToPose& dots_;
  const PoseCosts& costs_;
  std::span<const Eigen::Vector3d> beams_O_;
  std::vector<Candidate> candidates_;
  std::vector<std::size_t> first_;  ///< of each dot, into candidates_
};

}  // namespace

double kept_incidence(const PlanOptions& options) {
  return std::max(options.preferred_incidence, 5 * kDegree);
}

double incidence_cost_s(const PoseCosts& costs, double cosine) {
  const double incidence = std::acos(std::clamp(cosine, -1., 1.)) / (20 * kDegree);
  return costs.incidence_s * incidence * incidence;
}

PoseCosts pose_costs(const PlanOptions& options) {
  switch (options.planning) {
    case Planning::kFast:
      return {.incidence_s = .001,
              .repose_s = .6,
              .switch_s = .02,
              .spacing = 7 * kDegree,
              .sample = 1500,
              .kicks = 2};
    case Planning::kBalanced:
      return {.incidence_s = .0025,
              .repose_s = .6,
              .switch_s = .02,
              .spacing = 6 * kDegree,
              .sample = 3000,
              .kicks = 2};
    case Planning::kQuality:
      break;
  }
  return {.incidence_s = .06,
          .repose_s = .6,
          .switch_s = .02,
          .spacing = 4 * kDegree,
          .sample = 6000,
          .kicks = 2};
}

SharedBeams choose_shared_beams(const DotsToPose& dots, const PoseCosts& costs, const Progress& progress) {
  SharedBeams shared;
  shared.beams_O = BeamLocation(dots, costs).solve(progress.part(0, .5));
  shared.of_dot.assign(dots.size(), kNoBeam);
  const std::size_t block_count = (dots.size() + kBeamBlock - 1) / kBeamBlock;
  for_batches(block_count, kBlocksAtOnce, progress.part(.5, 1), [&](std::size_t first, std::size_t last) {
    tbb::parallel_for(first, last, [&](std::size_t b) {
      const std::size_t end = std::min(dots.size(), (b + 1) * kBeamBlock);
      BeamAssignment(dots, costs, shared.beams_O).choose(b * kBeamBlock, end, shared.of_dot.data());
    });
  });
  return shared;
}

}  // namespace hilbrush
