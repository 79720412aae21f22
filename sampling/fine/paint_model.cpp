#include "sampling/fine/paint_model.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "sampling/curve/chart.h"
#include "sampling/curve/stream_dots.h"
#include "sampling/curve/surface_place.h"

namespace hilbrush {
namespace {

using Eigen::Vector3f;

constexpr double kNodesAPitch2 = 9;
/// Nodes of one blob; they hang together within one pitch and face about the same way.
constexpr std::uint32_t kBlobNodes = 6;
constexpr float kBlobCosine = .7f;
/// As in the film: light ends here, grazing faces get none, and depth is limited so that a wall shields what is behind
/// it (by half of what the film allows, which is for oblique light).
constexpr float kSpotCutRadii = 1.7f, kGrazingCosine = .02f, kDepthWindow = 1;
/// The error is blurred by one pitch, and its gradient asks for the same blur again: one of sqrt(2) pitches.
constexpr float kBlurSigma2 = 2;
constexpr float kBlurCutSigmas = 2.5f;
constexpr std::size_t kDoseSteps = 4096;
constexpr float kStepsAFullDose = 512;

/// An even gray on all surface: for nodes of equal area.
ToneField even_gray(const TexturedMesh& mesh) {
  ToneOptions options;
  options.untextured = Untextured::kMaterial;
  // Luminance vanishes beside such reflectances, whatever the picture.
  options.reflectance_white = 1e9, options.reflectance_black = -1e9;
  return {mesh, options};
}

}  // namespace

PaintModel::PaintModel(const SurfaceCurve& curve, const ToneField& tone, double pitch_m, const SpotModel& spot)
    : pitch_m_(pitch_m), spot_radius_m_(static_cast<float>(spot.radius_m)) {
  const auto [low, high] = bounds(curve.mesh());
  middle_O_ = .5 * (low + high);
  const double inside = 1 - std::exp(-2 * static_cast<double>(kSpotCutRadii * kSpotCutRadii));
  peak_dose_ = static_cast<float>(2 * pitch_m * pitch_m / (std::numbers::pi * spot.radius_m * spot.radius_m * inside));
  tabulate(spot);
  lay_nodes(curve, tone);
  gather_blobs();
  link_blobs();
  node_grid_ = std::make_unique<CubeGrid>(places_, spot_reach_m());
}

void PaintModel::tabulate(const SpotModel& spot) {
  coverage_.resize(kDoseSteps + 1);
  for (std::size_t i = 0; i <= kDoseSteps; ++i)
    coverage_[i] = static_cast<float>(spot.coverage(static_cast<double>(i) / static_cast<double>(kStepsAFullDose)));
  coverage_slope_.resize(kDoseSteps);
  for (std::size_t i = 0; i < kDoseSteps; ++i) coverage_slope_[i] = (coverage_[i + 1] - coverage_[i]) * kStepsAFullDose;
}

void PaintModel::lay_nodes(const SurfaceCurve& curve, const ToneField& tone) {
  const ToneField gray = even_gray(curve.mesh());
  SampleOptions options;
  options.dot_count =
      std::max<std::uint64_t>(1, std::llround(kNodesAPitch2 * curve.mesh().area_m2() / (pitch_m_ * pitch_m_)));
  options.dot_limit = std::numeric_limits<std::uint32_t>::max();
  const DotSequence nodes = place_dots(CurveMass(curve, gray), options);
  const std::size_t count = nodes.dots.size();
  places_.resize(count), normals_.resize(count), wanted_.resize(count);
  dose_.assign(count, 0), pull_.assign(count, 0);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    const Dot& node = nodes.dots[i];
    places_[i] = place_of(node.position_O);
    normals_[i] = node.normal_O;
    wanted_[i] = static_cast<float>(tone.wanted(surface_point_at(curve.mesh(), node.triangle, node.position_O)));
  });
}

void PaintModel::gather_blobs() {
  const auto pitch2 = static_cast<float>(pitch_m_ * pitch_m_);
  for (std::uint32_t i = 0; i < places_.size(); ++i) {
    const bool goes_on = !blobs_.empty() && i - blobs_.back().begin < kBlobNodes &&
                         (places_[i] - places_[blobs_.back().begin]).squaredNorm() < pitch2 &&
                         normals_[i].dot(normals_[blobs_.back().begin]) > kBlobCosine;
    if (!goes_on) {
      blobs_.emplace_back();
      blobs_.back().begin = i;
    }
    Blob& blob = blobs_.back();
    blob.end = i + 1;
    blob.place += places_[i];
    blob.normal += normals_[i];
  }
  for (Blob& blob : blobs_) {
    blob.place /= static_cast<float>(blob.end - blob.begin);
    blob.normal.normalize();
  }
}

float PaintModel::spot_reach_m() const {
  return std::sqrt(1 + kDepthWindow * kDepthWindow) * kSpotCutRadii * spot_radius_m_;
}

float PaintModel::dose_at(const Exposure& exposure, std::size_t node, Vector3f& way) const {
  way = places_[node] - exposure.place;
  const float cosine = exposure.normal.dot(normals_[node]);
  if (cosine < kGrazingCosine) return 0;
  const float depth = way.dot(exposure.normal), radius2 = spot_radius_m_ * spot_radius_m_;
  way -= depth * exposure.normal;
  const float r2 = way.squaredNorm(), cut2 = kSpotCutRadii * kSpotCutRadii * radius2;
  if (r2 > cut2 || depth * depth > kDepthWindow * kDepthWindow * cut2) return 0;
  return exposure.level * peak_dose_ * cosine * std::exp(-2 * r2 / radius2);
}

void PaintModel::collect_dose(std::span<const Exposure> exposures) {
  std::vector<Vector3f> places(exposures.size());
  for (std::size_t i = 0; i < exposures.size(); ++i) places[i] = exposures[i].place;
  const float reach_m = spot_reach_m() + static_cast<float>(pitch_m_);  // of a blob's nodes, from its middle
  const CubeGrid dots(places, reach_m);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blobs_.size(), 64),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      std::vector<std::uint32_t> near;
                      for (std::size_t b = range.begin(); b < range.end(); ++b) {
                        near.clear();
                        dots.visit_around(blobs_[b].place, [&](std::uint32_t dot) {
                          if ((places[dot] - blobs_[b].place).squaredNorm() < reach_m * reach_m) near.push_back(dot);
                        });
                        for (std::uint32_t node = blobs_[b].begin; node < blobs_[b].end; ++node) {
                          dose_[node] = 0;
                          Vector3f way;
                          for (const std::uint32_t dot : near) dose_[node] += dose_at(exposures[dot], node, way);
                        }
                      }
                    });
}

void PaintModel::link_blobs() {
  const auto pitch = static_cast<float>(pitch_m_);
  const float sigma2 = kBlurSigma2 * pitch * pitch, cut2 = kBlurCutSigmas * kBlurCutSigmas * sigma2;
  // A node is 1/kNodesAPitch2 of a pitch squared: the kernel's sum over nodes is 1.
  const auto scale = static_cast<float>(1 / (2 * std::numbers::pi * static_cast<double>(kBlurSigma2) * kNodesAPitch2));
  std::vector<Vector3f> places;
  for (const Blob& blob : blobs_) places.push_back(blob.place);
  const CubeGrid grid(places, kBlurCutSigmas * std::sqrt(sigma2));
  const auto visit_links = [&](std::size_t b, auto visit) {
    grid.visit_around(places[b], [&](std::uint32_t other) {
      const float r2 = (places[other] - places[b]).squaredNorm();
      if (r2 > cut2 || blobs_[b].normal.dot(blobs_[other].normal) <= 0) return;
      visit(Link{other, scale * std::exp(-r2 / (2 * sigma2))});
    });
  };
  link_begins_.assign(blobs_.size() + 1, 0);
  tbb::parallel_for(std::size_t{0}, blobs_.size(),
                    [&](std::size_t b) { visit_links(b, [&](const Link&) { ++link_begins_[b + 1]; }); });
  std::partial_sum(link_begins_.begin(), link_begins_.end(), link_begins_.begin());
  links_.resize(link_begins_.back());
  tbb::parallel_for(std::size_t{0}, blobs_.size(), [&](std::size_t b) {
    std::size_t at = link_begins_[b];
    visit_links(b, [&](const Link& link) { links_[at++] = link; });
  });
}

void PaintModel::blur() {
  const auto pitch = static_cast<float>(pitch_m_);
  const float per_sigma2 = 1 / (kBlurSigma2 * pitch * pitch);
  tbb::parallel_for(std::size_t{0}, blobs_.size(), [&](std::size_t b) {
    Blob& blob = blobs_[b];
    float blurred = 0;
    Vector3f slope = Vector3f::Zero();
    for (std::size_t k = link_begins_[b]; k < link_begins_[b + 1]; ++k) {
      const Blob& other = blobs_[links_[k].blob];
      const float share = links_[k].weight * other.error;
      blurred += share;
      slope += share * (other.place - blob.place);
    }
    blob.blurred = blurred;
    blob.slope = per_sigma2 * slope;
  });
}

double PaintModel::expose(std::span<const Exposure> exposures) {
  collect_dose(exposures);
  const auto step_of = [&](float dose) {
    return std::min(static_cast<std::size_t>(dose * kStepsAFullDose), kDoseSteps - 1);
  };
  tbb::parallel_for(std::size_t{0}, blobs_.size(), [&](std::size_t b) {
    blobs_[b].error = 0;
    for (std::uint32_t node = blobs_[b].begin; node < blobs_[b].end; ++node) {
      const std::size_t step = step_of(dose_[node]);
      const float beyond = std::min(dose_[node], static_cast<float>(kDoseSteps) / kStepsAFullDose) -
                           static_cast<float>(step) / kStepsAFullDose;
      blobs_[b].error += coverage_[step] + beyond * coverage_slope_[step] - wanted_[node];
    }
  });
  blur();
  tbb::parallel_for(std::size_t{0}, blobs_.size(), [&](std::size_t b) {
    const Blob& blob = blobs_[b];
    for (std::uint32_t node = blob.begin; node < blob.end; ++node)
      pull_[node] =
          2 * (blob.blurred + blob.slope.dot(places_[node] - blob.place)) * coverage_slope_[step_of(dose_[node])];
  });
  // |G e|^2 = e . GG e
  double sum = 0;
  for (const Blob& blob : blobs_) sum += static_cast<double>(blob.error * blob.blurred);
  return sum / static_cast<double>(places_.size());
}

Vector3f PaintModel::gradient(const Exposure& exposure) const {
  Vector3f sum = Vector3f::Zero();
  const float per_radius2 = 4 / (spot_radius_m_ * spot_radius_m_);
  node_grid_->visit_around(exposure.place, [&](std::uint32_t node) {
    Vector3f way;
    const float dose = dose_at(exposure, node, way);
    if (dose > 0) sum += pull_[node] * dose * per_radius2 * way;
  });
  return sum;
}

}  // namespace hilbrush
