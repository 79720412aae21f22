#include "planner/mounting_advice.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

#include "planner/mounting.h"
#include "planner/reach/reach.h"

namespace hilbrush {
namespace {

constexpr std::size_t kSkippedSample = 150, kReachedSample = 150;
/// A trial must reach this share of the skipped dots, and gain this share of all dots: single missing dots
/// are lost in the picture's own grain, and are not worth another mounting.
constexpr double kMinHelped = .2;
constexpr double kMinGain = .005;
constexpr double kHeightFactors[] = {.5};
constexpr double kHeightStepsM[] = {.02, .04, .08};

bool depends_on_mounting(const SkippedDot& skipped) {
  return skipped.reason != SkipReason::kEnergy && skipped.reason != SkipReason::kNoPath;
}

/// `count` of `all`, evenly with a random start.
std::vector<std::uint32_t> sample(const std::vector<std::uint32_t>& all, std::size_t count,
                                  std::mt19937_64& random) {
  if (all.size() <= count) return all;
  const double stride = static_cast<double>(all.size()) / static_cast<double>(count);
  double at = stride * std::uniform_real_distribution<double>(0, 1)(random);
  std::vector<std::uint32_t> chosen;
  for (; chosen.size() < count; at += stride)
    chosen.push_back(all[std::min(static_cast<std::size_t>(at), all.size() - 1)]);
  return chosen;
}

struct Sample {
  std::vector<std::uint32_t> skipped, reached;
  std::size_t skipped_count = 0;
};

Sample choose_sample(const DotSequence& dots, const std::vector<SkippedDot>& skipped, std::uint64_t seed) {
  std::vector<bool> is_skipped(dots.dots.size(), false);
  std::vector<std::uint32_t> helpable, reached;
  for (const SkippedDot& dot : skipped) {
    is_skipped[dot.dot_index] = true;
    if (depends_on_mounting(dot)) helpable.push_back(dot.dot_index);
  }
  for (std::uint32_t i = 0; i < dots.dots.size(); ++i)
    if (!is_skipped[i]) reached.push_back(i);
  std::mt19937_64 random(seed);
  return {sample(helpable, kSkippedSample, random), sample(reached, kReachedSample, random), helpable.size()};
}

/// From the present position of the object to that on the other axis: taken off the fixture, turned over,
/// centered, and mounted as before.
Eigen::Isometry3d lay_over(const TexturedMesh& mesh, const Standing& standing) {
  using Eigen::AngleAxisd, Eigen::Translation3d, Eigen::Vector3d;
  const auto& offset = standing.mounting.offset_m;
  const Eigen::Isometry3d mount =
      Translation3d(offset[0], offset[1], offset[2]) * AngleAxisd(standing.mounting.turn, Vector3d::UnitZ());
  const double quarter = std::acos(0.);
  const Eigen::Isometry3d over =
      AngleAxisd(standing.up == UpAxis::kY ? -quarter : quarter, Vector3d::UnitX()) * mount.inverse();
  Eigen::AlignedBox3d box;
  for (const Vector3d& p_O : mesh.vertices) box.extend(over * p_O);
  return mount * Translation3d(-box.center().x(), -box.center().y(), -box.min().z()) * over;
}

double share_reached(const Reach& reach, const DotSequence& dots, const std::vector<std::uint32_t>& indices,
                     const Eigen::Isometry3d& moved) {
  if (indices.empty()) return 1;
  const Joints reference{};
  std::vector<std::uint8_t> is_reached(indices.size());
  tbb::parallel_for(std::size_t{0}, indices.size(), [&](std::size_t i) {
    const Dot& dot = dots.dots[indices[i]];
    const Eigen::Vector3d normal = moved.linear() * dot.normal_O.cast<double>().normalized();
    is_reached[i] = reach.find_pose_quickly({moved * dot.position_O, normal, normal}, reference).has_value();
  });
  return static_cast<double>(std::count(is_reached.begin(), is_reached.end(), 1)) /
         static_cast<double>(indices.size());
}

}  // namespace

std::optional<MountingAdvice> advise_mounting(const TexturedMesh& mesh, const CellDescription& cell,
                                              const Standing& standing, const PlanOptions& options,
                                              const DotSequence& dots, const std::vector<SkippedDot>& skipped,
                                              std::uint64_t seed) {
  const Sample chosen = choose_sample(dots, skipped, seed);
  const auto count = static_cast<double>(dots.dots.size());
  if (static_cast<double>(chosen.skipped_count) < kMinGain * count || chosen.skipped.empty())
    return std::nullopt;

  const double now = 1 - static_cast<double>(skipped.size()) / count;
  std::optional<MountingAdvice> best;
  const auto consider = [&](MountingAdvice advice, const TexturedMesh& trial_mesh,
                            const CellDescription& trial_cell, const Eigen::Isometry3d& moved) {
    const Reach reach(trial_mesh, trial_cell, options);
    const double helped = share_reached(reach, dots, chosen.skipped, moved);
    if (helped < kMinHelped) return;
    const double lost = 1 - share_reached(reach, dots, chosen.reached, moved);
    advice.reached_now = now;
    advice.reached_then = now * (1 - lost) + helped * static_cast<double>(chosen.skipped_count) / count;
    if (advice.reached_then < (best ? best->reached_then : now) + kMinGain) return;
    best = advice;
  };

  const double height_m = cell.fixture.post_height_m;
  std::vector<double> heights_m;
  for (const double factor : kHeightFactors) heights_m.push_back(1e-3 * std::round(1e3 * factor * height_m));
  for (const double step_m : kHeightStepsM) heights_m.push_back(1e-3 * std::round(1e3 * (height_m + step_m)));
  for (const double trial_m : heights_m) {
    CellDescription trial = cell;
    trial.fixture.post_height_m = trial_m;
    MountingAdvice advice;
    advice.post_height_m = trial_m;
    consider(advice, mesh, trial, Eigen::Isometry3d::Identity());
  }
  const Eigen::Isometry3d over = lay_over(mesh, standing);
  TexturedMesh laid = mesh;
  for (Eigen::Vector3d& p_O : laid.vertices) p_O = over * p_O;
  MountingAdvice advice;
  advice.up = standing.up == UpAxis::kY ? UpAxis::kZ : UpAxis::kY;
  consider(advice, laid, cell, over);
  return best;
}

std::string advice_sentence(const MountingAdvice& advice) {
  std::string change;
  if (advice.post_height_m) {
    change = fmt::format("a post of {0:.0f} mm (--post-height-mm {0:.0f})", *advice.post_height_m * 1e3);
  } else {
    const char* const axis = advice.up == UpAxis::kY ? "y" : "z";
    change = fmt::format("the object standing on its {0} axis (--up {0})", axis);
  }
  return fmt::format("{} would reach about {:.1f} % of the dots instead of {:.1f} %", change,
                     100 * advice.reached_then, 100 * advice.reached_now);
}

}  // namespace hilbrush
