#include "planner/poses/aims.h"

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

constexpr double kUnservedS = .25;  // what a dot costs that no aim serves
constexpr std::size_t kAimsAtMost = 2000;
constexpr std::size_t kAimBlock = 1 << 12;  // dots whose aims are chosen together
constexpr std::size_t kBlocksAtOnce = 16;
constexpr int kExchangeRounds = 2;

/// Facility location: which of the candidate directions become aims.
class AimLocation {
 public:
  AimLocation(const AimedDots& dots, const AimCosts& costs) : dots_(dots), costs_(costs), directions_(costs.spacing) {
    ask_sample();
  }

  std::vector<Eigen::Vector3d> solve(const Progress& progress) {
    // How many there will be is not known; the progress told approaches one all the same.
    const auto tell = [&](double done) { progress(done / (done + 300)); };
    double done = 0;
    for (; open_.size() < kAimsAtMost && open_best(); ++done) tell(done);
    for (int round = 0; round < kExchangeRounds; ++round)
      for (std::size_t k = 0; k < open_.size(); tell(++done)) k += exchange(k) ? 1 : 0;
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

  void ask_sample() {
    const std::size_t asked = std::min(dots_.size(), costs_.sample);
    weight_ = asked > 0 ? static_cast<double>(dots_.size()) / static_cast<double>(asked) : 0;
    served_.resize(asked);
    const double cos_preferred = std::cos(kept_incidence(dots_.reach().options()));
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, asked, 16), [&](const auto& range) {
      for (std::size_t s = range.begin(); s < range.end(); ++s) {
        const Target target = dots_.target(s * dots_.size() / asked);
        for (const std::uint32_t d : directions_.that_hit(dots_.reach(), target, cos_preferred)) {
          const double cosine = -directions_[d].dot(target.smooth_normal_O);
          served_[s].emplace_back(d, static_cast<float>(incidence_cost_s(costs_, cosine)));
        }
      }
    });
    serves_.resize(directions_.size());
    for (std::uint32_t s = 0; s < asked; ++s)
      for (const auto& [d, cost_s] : served_[s]) serves_[d].push_back({s, cost_s});
    cost_s_.assign(asked, static_cast<float>(kUnservedS));
    is_open_.assign(directions_.size(), false);
  }

  double gain_s(std::uint32_t d) const {
    double gain = 0;
    for (const Service& service : serves_[d]) gain += std::max(0.F, cost_s_[service.sample] - service.cost_s);
    return weight_ * gain - costs_.aim_s;
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

  /// Closes an aim and opens whatever then is best, if anything is worth it. False if the aim is gone for good.
  bool exchange(std::size_t k) {
    const std::uint32_t d = open_[k];
    is_open_[d] = false;
    for (const Service& service : serves_[d]) {
      float& cost = cost_s_[service.sample];
      cost = static_cast<float>(kUnservedS);
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

  const AimedDots& dots_;
  const AimCosts& costs_;
  BeamDirections directions_;
  std::vector<std::vector<Service>> serves_;                          ///< by direction
  std::vector<std::vector<std::pair<std::uint32_t, float>>> served_;  ///< by sample
  std::vector<float> cost_s_;                                         ///< of each sample with the open aims
  std::vector<bool> is_open_;
  std::vector<std::uint32_t> open_;
  double weight_ = 0;  ///< dots that a sample stands for
};

/// One block of the curve: each dot's clear aims, then the cheapest way through them, where changing the aim has its
/// price (Viterbi).
class BlockOfAims {
 public:
  BlockOfAims(const AimedDots& dots, const AimCosts& costs, std::span<const Eigen::Vector3d> beams_O)
      : dots_(dots), costs_(costs), beams_O_(beams_O) {}

  void choose(std::size_t begin, std::size_t end, std::uint16_t* of_dot) {
    first_.assign(1, 0);
    for (std::size_t i = begin; i < end; ++i) {
      find_candidates(dots_.target(i));
      first_.push_back(candidates_.size());
    }
    walk_back(walk(), of_dot + begin);
  }

 private:
  struct Candidate {
    std::uint16_t aim = 0;
    float cost_s = 0;
    std::uint32_t from = UINT32_MAX;  ///< the candidate before
  };

  void find_candidates(const Target& target) {
    const double cos_preferred = std::cos(kept_incidence(dots_.reach().options()));
    for (std::size_t k = 0; k < beams_O_.size(); ++k) {
      const double cosine = -beams_O_[k].dot(target.smooth_normal_O);
      if (cosine >= cos_preferred && dots_.reach().is_clear(target, beams_O_[k]))
        candidates_.push_back({static_cast<std::uint16_t>(k), static_cast<float>(incidence_cost_s(costs_, cosine))});
    }
  }

  /// Dots without candidates are passed over. Returns the last candidate of the best way.
  std::uint32_t walk() {
    std::vector<std::uint32_t> latest(beams_O_.size(), UINT32_MAX);  // candidate of the dot before, by aim
    std::uint32_t best_before = UINT32_MAX;
    std::size_t before_begin = 0, before_end = 0;
    for (std::size_t i = 0; i + 1 < first_.size(); ++i) {
      if (first_[i] == first_[i + 1]) continue;
      std::uint32_t best = UINT32_MAX;
      for (std::size_t c = first_[i]; c < first_[i + 1]; ++c) {
        Candidate& candidate = candidates_[c];
        if (best_before != UINT32_MAX) {
          const std::uint32_t same = latest[candidate.aim];
          const float switched = candidates_[best_before].cost_s + static_cast<float>(costs_.switch_s);
          const bool is_kept = same != UINT32_MAX && candidates_[same].cost_s <= switched;
          candidate.from = is_kept ? same : best_before;
          candidate.cost_s += is_kept ? candidates_[same].cost_s : switched;
        }
        if (best == UINT32_MAX || candidate.cost_s < candidates_[best].cost_s) best = static_cast<std::uint32_t>(c);
      }
      for (std::size_t c = before_begin; c < before_end; ++c) latest[candidates_[c].aim] = UINT32_MAX;
      before_begin = first_[i];
      before_end = first_[i + 1];
      const float offset = candidates_[best].cost_s;  // sums stay small, so that single precision keeps its digits
      for (std::size_t c = before_begin; c < before_end; ++c) {
        candidates_[c].cost_s -= offset;
        latest[candidates_[c].aim] = static_cast<std::uint32_t>(c);
      }
      best_before = best;
    }
    return best_before;
  }

  void walk_back(std::uint32_t at, std::uint16_t* of_dot) const {
    for (std::size_t i = first_.size() - 1; i-- > 0;) {
      if (first_[i] == first_[i + 1]) {
        of_dot[i] = kNoAim;
        continue;
      }
      of_dot[i] = candidates_[at].aim;
      at = candidates_[at].from;
    }
  }

  const AimedDots& dots_;
  const AimCosts& costs_;
  std::span<const Eigen::Vector3d> beams_O_;
  std::vector<Candidate> candidates_;
  std::vector<std::size_t> first_;  ///< of each dot, into candidates_
};

}  // namespace

double kept_incidence(const PlanOptions& options) {
  return std::max(options.preferred_incidence, 5 * kDegree);
}

double incidence_cost_s(const AimCosts& costs, double cosine) {
  const double incidence = std::acos(std::clamp(cosine, -1., 1.)) / (20 * kDegree);
  return costs.incidence_s * incidence * incidence;
}

AimCosts aim_costs(const PlanOptions& options) {
  switch (options.planning) {
    case Planning::kFast:
      return {.incidence_s = .001, .aim_s = .6, .switch_s = .02, .spacing = 7 * kDegree, .sample = 1500, .kicks = 2};
    case Planning::kBalanced:
      return {.incidence_s = .0025, .aim_s = .6, .switch_s = .02, .spacing = 6 * kDegree, .sample = 3000, .kicks = 2};
    case Planning::kQuality:
      break;
  }
  return {.incidence_s = .06, .aim_s = .6, .switch_s = .02, .spacing = 4 * kDegree, .sample = 6000, .kicks = 2};
}

Aims choose_aims(const AimedDots& dots, const AimCosts& costs, const Progress& progress) {
  Aims aims;
  aims.beams_O = AimLocation(dots, costs).solve(progress.part(0, .5));
  aims.of_dot.assign(dots.size(), kNoAim);
  const std::size_t block_count = (dots.size() + kAimBlock - 1) / kAimBlock;
  for_batches(block_count, kBlocksAtOnce, progress.part(.5, 1), [&](std::size_t first, std::size_t last) {
    tbb::parallel_for(first, last, [&](std::size_t b) {
      const std::size_t end = std::min(dots.size(), (b + 1) * kAimBlock);
      BlockOfAims(dots, costs, aims.beams_O).choose(b * kAimBlock, end, aims.of_dot.data());
    });
  });
  return aims;
}

}  // namespace hilbrush
