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

/// Nodes for each pitch squared of surface. With six, the nodes themselves limited pictures above 32 dB
/// (tests/bench).
constexpr double kNodesPerPitch2 = 9;
/// At most this many nodes form a blob: consecutive nodes within one pitch of its first, whose normals are
/// within about 45 degrees of its first one's.
constexpr std::uint32_t kMaxBlobNodes = 6;
constexpr float kMinBlobCosine = .7f;
/// As in the film (sim/film/film_lattice.h): the light of a spot ends at this many of its radii, and faces
/// that it meets at a smaller cosine of incidence get none.
constexpr float kSpotCutRadii = 1.7f;
constexpr float kGrazingCosine = .02f;
/// Light reaches this far along the beam, in cut radii, so that a wall shields what is behind it. Half of
/// what the film allows, which must also hold for oblique light.
constexpr float kDepthWindow = 1;
/// Variance of the blur in pitches squared. The error is blurred by a Gaussian of one pitch, and its gradient
/// needs the same blur again: together one Gaussian of sqrt(2) pitches.
constexpr float kBlurVariancePitches2 = 2;
/// The blur ends at this many of its standard deviations.
constexpr float kBlurCutSigmas = 2.5f;
/// The coverage is tabulated for doses up to kDoseSteps / kStepsPerFullDose = 8 times the dose of an even
/// full tone.
constexpr std::size_t kDoseSteps = 4096;
constexpr float kStepsPerFullDose = 512;

/// An even gray on all of the surface, which gives nodes of equal area.
ToneField even_gray(const TexturedMesh& mesh) {
  ToneOptions options;
  options.untextured = Untextured::kMaterial;
  // Beside such reflectances the luminance of any picture, 0 to 1, makes no difference.
  options.reflectance_white = 1e9;
  options.reflectance_black = -1e9;
  return {mesh, options};
}

}  // namespace

PaintModel::PaintModel(const SurfaceCurve& curve, const ToneField& tone, double pitch_m,
                       const SpotModel& spot)
    : pitch_m_(pitch_m), spot_radius_m_(static_cast<float>(spot.radius_m)) {
  const auto [low, high] = bounds(curve.mesh());
  middle_O_ = .5 * (low + high);
  const double inside = 1 - std::exp(-2 * static_cast<double>(kSpotCutRadii * kSpotCutRadii));
  peak_dose_ =
      static_cast<float>(2 * pitch_m * pitch_m / (std::numbers::pi * spot.radius_m * spot.radius_m * inside));
  tabulate(spot);
  place_nodes(curve, tone);
  gather_blobs();
  link_blobs();
  node_grid_ = std::make_unique<CubeGrid>(places_, spot_reach_m());
}

void PaintModel::tabulate(const SpotModel& spot) {
  coverage_.resize(kDoseSteps + 1);
  for (std::size_t i = 0; i <= kDoseSteps; ++i)
    coverage_[i] =
        static_cast<float>(spot.coverage(static_cast<double>(i) / static_cast<double>(kStepsPerFullDose)));
  coverage_slope_.resize(kDoseSteps);
  for (std::size_t i = 0; i < kDoseSteps; ++i)
    coverage_slope_[i] = (coverage_[i + 1] - coverage_[i]) * kStepsPerFullDose;
}

void PaintModel::place_nodes(const SurfaceCurve& curve, const ToneField& tone) {
  const ToneField gray = even_gray(curve.mesh());
  SampleOptions options;
  options.dot_count = std::max<std::uint64_t>(
      1, std::llround(kNodesPerPitch2 * curve.mesh().area_m2() / (pitch_m_ * pitch_m_)));
  options.dot_limit = std::numeric_limits<std::uint32_t>::max();
  const DotSequence nodes = place_dots(CurveMass(curve, gray), options);
  const std::size_t count = nodes.dots.size();
  places_.resize(count);
  normals_.resize(count);
  wanted_.resize(count);
  dose_.assign(count, 0);
  pull_.assign(count, 0);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    const Dot& node = nodes.dots[i];
    places_[i] = place_of(node.position_O);
    normals_[i] = node.normal_O;
    wanted_[i] =
        static_cast<float>(tone.wanted(surface_point_at(curve.mesh(), node.triangle, node.position_O)));
  });
}

void PaintModel::gather_blobs() {
  const auto pitch2 = static_cast<float>(pitch_m_ * pitch_m_);
  for (std::uint32_t i = 0; i < places_.size(); ++i) {
    const bool goes_on = !blobs_.empty() && i - blobs_.back().begin < kMaxBlobNodes &&
                         (places_[i] - places_[blobs_.back().begin]).squaredNorm() < pitch2 &&
                         normals_[i].dot(normals_[blobs_.back().begin]) > kMinBlobCosine;
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

PaintModel::NodeDose PaintModel::dose_at(const Exposure& exposure, std::size_t node) const {
  Vector3f across = places_[node] - exposure.place;
  const float cosine = exposure.normal.dot(normals_[node]);
  if (cosine < kGrazingCosine) return {};
  const float depth = across.dot(exposure.normal);
  const float radius2 = spot_radius_m_ * spot_radius_m_;
  across -= depth * exposure.normal;
  const float r2 = across.squaredNorm();
  const float cut2 = kSpotCutRadii * kSpotCutRadii * radius2;
  if (r2 > cut2 || depth * depth > kDepthWindow * kDepthWindow * cut2) return {};
  return {exposure.level * peak_dose_ * cosine * std::exp(-2 * r2 / radius2), across};
}

void PaintModel::collect_dose(std::span<const Exposure> exposures) {
  std::vector<Vector3f> places(exposures.size());
  for (std::size_t i = 0; i < exposures.size(); ++i) places[i] = exposures[i].place;
  // A blob's nodes are less than one pitch from its middle.
  const float reach_m = spot_reach_m() + static_cast<float>(pitch_m_);
  const CubeGrid dots(places, reach_m);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blobs_.size(), 64),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      std::vector<std::uint32_t> near;
                      for (std::size_t b = range.begin(); b < range.end(); ++b) {
                        near.clear();
                        dots.visit_around(blobs_[b].place, [&](std::uint32_t dot) {
                          if ((places[dot] - blobs_[b].place).squaredNorm() < reach_m * reach_m)
                            near.push_back(dot);
                        });
                        for (std::uint32_t node = blobs_[b].begin; node < blobs_[b].end; ++node) {
                          dose_[node] = 0;
                          for (const std::uint32_t dot : near)
                            dose_[node] += dose_at(exposures[dot], node).dose;
                        }
                      }
                    });
}

void PaintModel::link_blobs() {
  const auto pitch = static_cast<float>(pitch_m_);
  const float sigma2 = kBlurVariancePitches2 * pitch * pitch;
  const float cut2 = kBlurCutSigmas * kBlurCutSigmas * sigma2;
  // A node stands for 1 / kNodesPerPitch2 of a pitch squared, so the kernel's weights sum to 1 over the
  // nodes.
  const auto scale = static_cast<float>(
      1 / (2 * std::numbers::pi * static_cast<double>(kBlurVariancePitches2) * kNodesPerPitch2));
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
  const float per_sigma2 = 1 / (kBlurVariancePitches2 * pitch * pitch);
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
    return std::min(static_cast<std::size_t>(dose * kStepsPerFullDose), kDoseSteps - 1);
  };
  tbb::parallel_for(std::size_t{0}, blobs_.size(), [&](std::size_t b) {
    blobs_[b].error = 0;
    for (std::uint32_t node = blobs_[b].begin; node < blobs_[b].end; ++node) {
      const std::size_t step = step_of(dose_[node]);
      const float beyond = std::min(dose_[node], static_cast<float>(kDoseSteps) / kStepsPerFullDose) -
                           static_cast<float>(step) / kStepsPerFullDose;
      blobs_[b].error += coverage_[step] + beyond * coverage_slope_[step] - wanted_[node];
    }
  });
  blur();
  tbb::parallel_for(std::size_t{0}, blobs_.size(), [&](std::size_t b) {
    const Blob& blob = blobs_[b];
    for (std::uint32_t node = blob.begin; node < blob.end; ++node)
      pull_[node] = 2 * (blob.blurred + blob.slope.dot(places_[node] - blob.place)) *
                    coverage_slope_[step_of(dose_[node])];
  });
  // With G the blur by one pitch and e the error: |G e|^2 = e . (G G e), as G is symmetric.
  double sum = 0;
  for (const Blob& blob : blobs_) sum += static_cast<double>(blob.error * blob.blurred);
  return sum / static_cast<double>(places_.size());
}

Vector3f PaintModel::gradient(const Exposure& exposure) const {
  Vector3f sum = Vector3f::Zero();
  const float per_radius2 = 4 / (spot_radius_m_ * spot_radius_m_);
  node_grid_->visit_around(exposure.place, [&](std::uint32_t node) {
    const auto [dose, across] = dose_at(exposure, node);
    if (dose > 0) sum += pull_[node] * dose * per_radius2 * across;
  });
  return sum;
}

}  // namespace hilbrush
