#include "sampling/predictive/predictive_loop.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

#include "sampling/base/check.h"
#include "sampling/tone/asked_atlas.h"
#include "sampling/tone/levels.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d;

/// Distance between texels of what is asked for, in pitches.
constexpr double kTexelPitches = .5;
/// Distance between the places where the error is measured, in pitches: it has been blurred by one pitch.
constexpr double kErrorPitches = 1;
/// Largest correction of a wanted tone, in either direction; tones are from 0 to 1.
constexpr double kMaxCorrection = 1;
/// Largest factor by which a triangle's texels are scaled to keep its mass; a larger one would only amplify
/// rounding.
constexpr double kMaxRescaling = 2;

/// Visits the nodes of a triangle's rectangle whose box, `reach` steps to each side, meets the triangle.
template <class Visit>
void visit_nodes(const AtlasLayout& layout, std::uint32_t triangle, double reach, Visit visit) {
  const TriangleFrame frame(layout.mesh(), triangle);
  if (!(frame.height_m() > 0)) return;
  const AtlasLayout::Rectangle& r = layout.rectangle(triangle);
  const Vector2d step = layout.step_m(frame, triangle);
  for (int row = 0; row < r.rows; ++row)
    for (int column = 0; column < r.columns; ++column) {
      const Vector2d node(column * step.x(), row * step.y());
      const BoxedPolygon box = frame.clip_box(node - reach * step, node + reach * step);
      if (box.count > 0) visit(frame, layout.texel_index(r, column, row), node, box);
    }
}

/// How much the wanted tone is changed at each place, because of the errors measured so far.
class Correction {
 public:
  Correction(const ToneField& asked, double pitch_m, double texel_limit)
      : layout_(asked.mesh(), kErrorPitches * pitch_m, texel_limit), values_(layout_.texel_count(), 0.f) {
    for (std::uint32_t t = 0; t < asked.mesh().triangle_count(); ++t) {
      if (asked.is_blank(t)) continue;
      visit_nodes(
          layout_, t, 1,
          [&](const TriangleFrame& frame, std::size_t texel, const Vector2d& node, const BoxedPolygon&) {
            points_.push_back(frame.point_inside(node));
            texels_.push_back(texel);
          });
    }
  }

  const std::vector<SurfacePoint>& points() const { return points_; }

  /// Subtracts `share` of the error; returns the error's root mean square.
  double subtract(std::span<const float> painted, std::span<const float> wanted, double share) {
    CHECK_EQ(painted.size(), points_.size());
    CHECK_EQ(wanted.size(), points_.size());
    double square = 0;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const double error = static_cast<double>(painted[i]) - wanted[i];
      square += error * error;
      float& value = values_[texels_[i]];
      value = static_cast<float>(std::clamp(value - share * error, -kMaxCorrection, kMaxCorrection));
    }
    return points_.empty() ? 0 : std::sqrt(square / static_cast<double>(points_.size()));
  }

  /// What to add to the wanted tone at a place of a triangle's frame.
  double at(const TriangleFrame& frame, std::uint32_t triangle, const Vector2d& place) const {
    const AtlasLayout::Rectangle& r = layout_.rectangle(triangle);
    const Vector2d step = layout_.step_m(frame, triangle);
    const double x = std::clamp(place.x() / step.x(), 0., r.columns - 1.);
    const double y = std::clamp(place.y() / step.y(), 0., r.rows - 1.);
    const int column = std::min(static_cast<int>(x), r.columns - 2);
    const int row = std::min(static_cast<int>(y), r.rows - 2);
    const auto value = [&](int i, int j) { return values_[layout_.texel_index(r, column + i, row + j)]; };
    const double right = x - column;
    const double up = y - row;
    return (1 - up) * ((1 - right) * value(0, 0) + right * value(1, 0)) +
           up * ((1 - right) * value(0, 1) + right * value(1, 1));
  }

 private:
  AtlasLayout layout_;
  std::vector<float> values_;
  std::vector<SurfacePoint> points_;
  std::vector<std::size_t> texels_;  ///< of each point
};

/// The coverage originally asked for, texel by texel, and the same with a correction.
class AskedTexels {
 public:
  AskedTexels(const ToneField& asked, const ToneCurve& curve, double pitch_m, double texel_limit)
      : layout_(asked.mesh(), kTexelPitches * pitch_m, texel_limit), asked_(asked), curve_(curve) {
    bake();
    keep_masses();
  }

  const AtlasLayout& layout() const { return layout_; }

  std::vector<float> corrected(const Correction& correction) const {
    std::vector<float> tones = texels_;
    visit_triangles([&](std::uint32_t t) {
      visit_nodes(
          layout_, t, 1,
          [&](const TriangleFrame& frame, std::size_t texel, const Vector2d& node, const BoxedPolygon&) {
            if (!(tones[texel] > 0)) return;
            const double wanted = curve_.inverse(tones[texel]) + correction.at(frame, t, node);
            tones[texel] = static_cast<float>(curve_(std::clamp(wanted, 0., 1.)));
          });
    });
    return tones;
  }

 private:
  template <class Work>
  void visit_triangles(Work work) const {
    tbb::parallel_for(std::uint32_t{0}, static_cast<std::uint32_t>(asked_.mesh().triangle_count()),
                      [&](std::uint32_t t) {
                        if (!asked_.is_blank(t)) work(t);
                      });
  }

  /// Each texel is the mean over its box, so that a line thinner than a texel is not lost; a node whose own
  /// box lies outside of the triangle takes the mean over a box twice as wide.
  void bake() {
    texels_.assign(layout_.texel_count(), 0.f);
    visit_triangles([&](std::uint32_t t) {
      visit_nodes(
          layout_, t, 1,
          [&](const TriangleFrame& frame, std::size_t texel, const Vector2d& node, const BoxedPolygon& wide) {
            const Vector2d half = .5 * layout_.step_m(frame, t);
            const BoxedPolygon box = frame.clip_box(node - half, node + half);
            const ToneIntegral integral = asked_.integrate(t, (box.count > 0 ? box : wide).corners());
            if (integral.area_m2 > 0) texels_[texel] = static_cast<float>(integral.mass / integral.area_m2);
          });
    });
  }

  /// Scales each triangle's texels so that the interpolated triangle asks for exactly as much as before.
  void keep_masses() {
    const ToneField baked(asked_, {layout_, ToneLayer(layout_.width(), layout_.height(), texels_)});
    visit_triangles([&](std::uint32_t t) {
      const std::array<Vector2d, 3> whole{Vector2d(0, 0), Vector2d(1, 0), Vector2d(0, 1)};
      const double mass = asked_.integrate(t, whole).mass;
      const double own = baked.integrate(t, whole).mass;
      if (!(own > 0)) return;
      const double scale = std::clamp(mass / own, 1 / kMaxRescaling, kMaxRescaling);
      visit_nodes(layout_, t, 1,
                  [&](const TriangleFrame&, std::size_t texel, const Vector2d&, const BoxedPolygon&) {
                    texels_[texel] = static_cast<float>(texels_[texel] * scale);
                  });
    });
  }

  AtlasLayout layout_;
  const ToneField& asked_;
  const ToneCurve& curve_;
  std::vector<float> texels_;
};

/// A point in a box of the triangle that asks for dots, by halving the box towards the larger mass; none if
/// the box is blank.
std::optional<SurfacePoint> heaviest_point(const ToneField& asked, const TriangleFrame& frame,
                                           std::uint32_t triangle, Vector2d low, Vector2d high) {
  constexpr int kMaxHalvings = 40;  // each side is halved 20 times: a millionth of the box
  ToneIntegral integral = asked.integrate(triangle, frame.clip_box(low, high).corners());
  for (int halving = 0; halving < kMaxHalvings && integral.mass > 0; ++halving) {
    const Vector2d b = integral.first / integral.mass;
    const SurfacePoint center{triangle, {1 - b.x() - b.y(), b.x(), b.y()}};
    if (asked.asked(center) > 0) return center;
    const int axis = halving % 2;
    const double middle = .5 * (low[axis] + high[axis]);
    Vector2d lower_high = high;
    Vector2d upper_low = low;
    lower_high[axis] = upper_low[axis] = middle;
    const ToneIntegral lower = asked.integrate(triangle, frame.clip_box(low, lower_high).corners());
    const ToneIntegral upper = asked.integrate(triangle, frame.clip_box(upper_low, high).corners());
    (lower.mass > upper.mass ? high : low) = lower.mass > upper.mass ? lower_high : upper_low;
    integral = lower.mass > upper.mass ? lower : upper;
  }
  return std::nullopt;
}

/// Between texels the atlas is interpolated, so a dot may lie up to a texel outside of what is asked for: it
/// is moved back.
void return_strays(DotSequence& dots, const ToneField& asked) {
  const TexturedMesh& mesh = asked.mesh();
  tbb::parallel_for(std::size_t{0}, dots.dots.size(), [&](std::size_t i) {
    Dot& dot = dots.dots[i];
    const SurfacePoint point = foot_of_perpendicular(mesh, dot.triangle, dot.position_O);
    if (asked.asked(point) > 0) return;
    const TriangleFrame frame(mesh, dot.triangle);
    const Vector2d place = frame.place(point.barycentric);
    for (double reach_m = kTexelPitches * dots.pitch_m; reach_m < 8 * dots.pitch_m; reach_m *= 2) {
      const Vector2d reach = Vector2d::Constant(reach_m);
      const auto toned = heaviest_point(asked, frame, dot.triangle, place - reach, place + reach);
      if (!toned) continue;
      dot.position_O = position(mesh, *toned);
      dot.tone = static_cast<float>(asked.wanted(*toned));
      return;
    }
  });
}

ToneField field_of(const ToneField& base, const AtlasLayout& layout, std::vector<float> tones) {
  return {base, {layout, ToneLayer(layout.width(), layout.height(), std::move(tones))}};
}

}  // namespace

DotSequence place_predictively(const ToneField& asked, const ToneField& density, const ToneCurve& curve,
                               const PredictiveOptions& options, const PlaceByDensity& place,
                               const PicturePredictor& predict, PredictiveReport* report,
                               const Progress& progress) {
  DotSequence dots = place(density);
  assign_levels(dots, asked, density, options.levels);
  if (dots.dots.empty() || options.rounds == 0) return dots;

  const double pitch_m = dots.pitch_m;
  const AskedTexels texels(asked, curve, pitch_m, options.texel_limit);
  Correction correction(asked, pitch_m, options.texel_limit);
  if (report) report->texel_count = texels.layout().texel_count();
  const std::vector<float> wanted = predict.wanted(pitch_m, correction.points());
  for (int round = 0; round < options.rounds; ++round) {
    progress(static_cast<double>(round) / options.rounds);
    const double rms = correction.subtract(predict.painted(dots, correction.points()), wanted, options.share);
    if (report) report->error_rms.push_back(rms);
    std::vector<float> tones = texels.corrected(correction);
    const ToneField corrected = field_of(asked, texels.layout(), tones);
    for (float& tone : tones) tone = static_cast<float>(dots_for(options.levels, tone));
    const ToneField corrected_density = field_of(asked, texels.layout(), std::move(tones));
    dots = place(corrected_density);
    return_strays(dots, asked);
    assign_levels(dots, corrected, corrected_density, options.levels);
  }
  return dots;
}

}  // namespace hilbrush
