#include "sampling/tone/tone_field.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "sampling/base/check.h"
#include "sampling/base/cross.h"
#include "sampling/tone/tone_polygon.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d;

/// A triangle that spans more texels than this repeats its texture beyond all sense and is painted in its
/// mean tone.
constexpr double kMaxTexels = 1 << 16;
/// Least height, in texels, that a triangle gets in its texture: one that is collapsed there would have no
/// polygons to integrate over.
constexpr double kMinTexels = 1e-3;
/// Of all layers together, about; and the finest that a texel is cut, along a side.
constexpr double kRefinedTexels = 12e6;
constexpr int kMaxRefinement = 15;
/// With means over a pitch: this many texels for one of the textures', and steps between sizes of a pitch, in
/// octaves.
constexpr double kAveragedTexels = 2;
constexpr double kFinestOctaves = .5, kCoarsestOctaves = 16;
/// What a straight curve may deviate by, as a share of its end.
constexpr double kStraight = 1e-6;

/// Opens a triangle that is a line or a point in its texture, by a thousandth of a texel.
void open_collapsed(std::array<Vector2d, 3>& p) {
  // Most are as high as wide, and no side is longer than the first two together.
  const Vector2d u = p[1] - p[0], v = p[2] - p[0];
  const double area = std::abs(cross(u, v)), reach = u.lpNorm<1>() + v.lpNorm<1>();
  if (area >= kMinTexels * reach && reach >= kMinTexels) return;
  int apex = 0;
  double longest = -1;
  for (int k = 0; k < 3; ++k) {
    const double length = (p[(k + 2) % 3] - p[(k + 1) % 3]).norm();
    if (length > longest) longest = length, apex = k;
  }
  if (longest < kMinTexels) {
    p[1] = p[0] + Vector2d(kMinTexels, 0);
    p[2] = p[0] + Vector2d(0, kMinTexels);
    return;
  }
  const Vector2d a = p[(apex + 1) % 3], along = (p[(apex + 2) % 3] - a) / longest;
  const double height = cross(along, p[apex] - a);
  if (std::abs(height) >= kMinTexels) return;
  const Vector2d across(-along.y(), along.x());
  p[apex] += (std::copysign(kMinTexels, height) - height) * across;
}

bool is_painted_by_untextured_rule(const Material& material, Untextured rule, bool any_colored) {
  if (material.source != ColorSource::kNone && material.source != ColorSource::kMaterial) return true;
  return rule == Untextured::kMaterial || (rule == Untextured::kAuto && !any_colored);
}

}  // namespace

ToneField::ToneField(const TexturedMesh& mesh, const ToneOptions& options) : mesh_(mesh), options_(options) {
  make_layers(choose_sources());
}

ToneField::ToneField(const ToneField& base, AskedAtlas atlas)
    : mesh_(base.mesh_), options_(base.options_), atlas_(std::move(atlas)), sources_(base.sources_) {
  CHECK(&atlas_->layout.mesh() == &mesh_);
}

std::vector<ToneField::Look> ToneField::choose_sources() {
  bool any_colored = false;
  for (const auto m : mesh_.material_index)
    any_colored |= mesh_.materials[m].source == ColorSource::kColors ||
                   mesh_.materials[m].source == ColorSource::kTexture;
  sources_.resize(mesh_.triangle_count());
  std::vector<Look> looks;
  for (std::uint32_t t = 0; t < mesh_.triangle_count(); ++t) {
    const Material& material = mesh_.materials[mesh_.material_index[t]];
    if (material.opacity <= 0 || !is_painted_by_untextured_rule(material, options_.untextured, any_colored))
      continue;
    const bool has_texture = material.source == ColorSource::kTexture && material.texture >= 0;
    sources_[t] = has_texture ? textured_source(t, material, looks) : Source{Source::kColors, 0};
  }
  return looks;
}

/// Its layer is the index of its look, until there are layers.
ToneField::Source ToneField::textured_source(std::uint32_t t, const Material& material,
                                             std::vector<Look>& looks) {
  float factor = -1;
  if (mesh_.textures[static_cast<std::size_t>(material.texture)].channels <= 2) {
    const auto& l = mesh_.corner_luminance[t];
    factor = l[0] == l[1] && l[1] == l[2] ? l[0] : (l[0] + l[1] + l[2]) / 3;
  }
  const Look look{material.texture, factor, material.opacity, {material.repeat_u, material.repeat_v}};
  const auto found = std::find(looks.begin(), looks.end(), look);
  const auto index = static_cast<std::uint32_t>(found - looks.begin());
  if (found == looks.end()) looks.push_back(look);
  const auto p = texel_corners(t);
  for (int k = 0; k < 3; ++k)
    if (!((p[static_cast<std::size_t>((k + 1) % 3)] - p[static_cast<std::size_t>(k)])
              .lpNorm<Eigen::Infinity>() <= kMaxTexels))
      return {Source::kMean, index};
  return {Source::kTexture, index};
}

/// A straight curve asks for the same, wherever it is applied.
bool ToneField::is_averaged() const {
  const ToneCurve& curve = options_.curve;
  if (!(options_.pitch_m > 0) || curve.wanted.empty()) return false;
  for (std::size_t k = 0; k < curve.wanted.size(); ++k)
    if (std::abs(curve.asked[k] - curve.wanted[k] * curve.asked.back()) > kStraight * curve.asked.back())
      return true;
  return false;
}

Vector2d ToneField::texels_per_pitch_on(std::uint32_t triangle) const {
  const auto p = texel_corners(triangle);
  const Eigen::Vector3d a = mesh_.corner(triangle, 1) - mesh_.corner(triangle, 0),
                        b = mesh_.corner(triangle, 2) - mesh_.corner(triangle, 0);
  const double length = a.norm();
  return texels_per_pitch({p[1] - p[0], p[2] - p[0]},
                          {Vector2d(length, 0), Vector2d(a.dot(b) / length, a.cross(b).norm() / length)},
                          options_.pitch_m);
}

void ToneField::make_layers(const std::vector<Look>& looks) {
  if (!is_averaged()) {
    for (const Look& look : looks) layers_.push_back(make_layer(look));
    return;
  }
  double most_texels = kRefinedTexels;
  for (const Look& look : looks) {
    const Texture& texture = mesh_.textures[static_cast<std::size_t>(look.texture)];
    most_texels += kAveragedTexels * texture.width * texture.height;
  }
  std::vector<Vector2d> pitches(mesh_.triangle_count());
  const auto is_textured = [&](std::size_t t) {
    return sources_[t].kind == Source::kTexture || sources_[t].kind == Source::kMean;
  };
  tbb::parallel_for(std::size_t{0}, pitches.size(), [&](std::size_t t) {
    if (is_textured(t)) pitches[t] = texels_per_pitch_on(static_cast<std::uint32_t>(t));
  });
  const auto layer_of = [&](std::size_t t, double octaves) {
    const Texture& texture = mesh_.textures[static_cast<std::size_t>(looks[sources_[t].layer].texture)];
    return std::pair(sources_[t].layer,
                     round_to_steps(pitches[t], octaves, texture.width, texture.height).steps);
  };
  const auto grid_of = [&](const Look& look, const std::array<int, 2>& steps, double octaves) {
    const Texture& texture = mesh_.textures[static_cast<std::size_t>(look.texture)];
    return asked_grid(texture.width, texture.height, {steps}, octaves, refinement_of(texture));
  };
  // Pitches of differing sizes share a layer where memory is short.
  std::map<std::pair<std::uint32_t, std::array<int, 2>>, std::uint32_t> layers;
  double octaves = kFinestOctaves;
  for (;; octaves *= 2) {
    layers.clear();
    double texels = 0;
    for (std::size_t t = 0; t < sources_.size(); ++t) {
      if (!is_textured(t)) continue;
      const auto layer = layer_of(t, octaves);
      if (layers.emplace(layer, 0).second)
        texels += grid_of(looks[layer.first], layer.second, octaves).texels();
    }
    if (texels <= most_texels || octaves >= kCoarsestOctaves) break;
  }
  std::uint32_t made_for = 0;
  std::vector<float> wanted;
  for (auto& [layer, index] : layers) {
    const Look& look = looks[layer.first];
    if (wanted.empty() || made_for != layer.first) wanted = wanted_texels(look);
    made_for = layer.first;
    index = static_cast<std::uint32_t>(layers_.size());
    layers_.push_back(make_layer(look, wanted, grid_of(look, layer.second, octaves)));
  }
  for (std::size_t t = 0; t < sources_.size(); ++t)
    if (is_textured(t)) sources_[t].layer = layers.at(layer_of(t, octaves));
}

/// The curve bends between texels too: black beside white asks for much less in the middle than the mean of
/// both. So the curve is applied to texels finer by a whole odd factor, whose centers fall on the texture's
/// own and which repeat its interpolation exactly; as fine as a fair share of memory allows.
int ToneField::refinement_of(const Texture& texture) const {
  if (options_.curve.wanted.empty()) return 1;
  const double share = kRefinedTexels / static_cast<double>(mesh_.textures.size());
  const double texels = static_cast<double>(texture.width) * texture.height;
  int refinement = 1;
  while (refinement < kMaxRefinement && texels * (refinement + 2) * (refinement + 2) <= share)
    refinement += 2;
  return refinement;
}

ToneField::Layer ToneField::make_layer(const Look& look) const {
  const Texture& texture = mesh_.textures[static_cast<std::size_t>(look.texture)];
  const int refinement = refinement_of(texture);
  const int width = texture.width * refinement, height = texture.height * refinement;
  std::vector<float> tones(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const double factor = look.luminance_factor < 0 ? 1 : look.luminance_factor;
  const auto wanted_of_texel = [&](std::size_t i) {
    return coverage(factor * texture.luminance[i]) * (texture.opacity.empty() ? 1 : texture.opacity[i]);
  };
  tbb::parallel_for(0, height, [&](int row) {
    float* out = tones.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(width);
    for (int column = 0; column < width; ++column) {
      const Vector2d texel((column + .5) / refinement - .5, (row + .5) / refinement - .5);
      const double wanted = look_up(texture.width, texture.height, texel, look.addressing, wanted_of_texel);
      out[column] = static_cast<float>(asked_for(wanted * look.opacity));
    }
  });
  return {look.luminance_factor, Vector2d::Constant(refinement), ToneLayer(width, height, std::move(tones))};
}

std::vector<float> ToneField::wanted_texels(const Look& look) const {
  const Texture& texture = mesh_.textures[static_cast<std::size_t>(look.texture)];
  const double factor = look.luminance_factor < 0 ? 1 : look.luminance_factor;
  std::vector<float> wanted(texture.luminance.size());
  tbb::parallel_for(std::size_t{0}, wanted.size(), [&](std::size_t i) {
    wanted[i] = static_cast<float>(coverage(factor * texture.luminance[i]) *
                                   (texture.opacity.empty() ? 1 : texture.opacity[i]) * look.opacity);
  });
  return wanted;
}

ToneField::Layer ToneField::make_layer(const Look& look, const std::vector<float>& wanted,
                                       const AskedGrid& grid) const {
  const Texture& texture = mesh_.textures[static_cast<std::size_t>(look.texture)];
  return {look.luminance_factor,
          Vector2d(static_cast<double>(grid.size[0]) / texture.width,
                   static_cast<double>(grid.size[1]) / texture.height),
          asked_over_pitch(wanted, texture.width, texture.height, look.addressing, grid, options_.curve)};
}

double ToneField::coverage(double luminance) const {
  return std::clamp(
      (options_.reflectance_white - luminance) / (options_.reflectance_white - options_.reflectance_black),
      0., 1.);
}

bool ToneField::is_blank(std::uint32_t triangle) const {
  return sources_[triangle].kind == Source::kBlank;
}

TexelAddressing ToneField::addressing(std::uint32_t triangle) const {
  const Material& material = mesh_.materials[mesh_.material_index[triangle]];
  return {material.repeat_u, material.repeat_v};
}

std::array<Vector2d, 3> ToneField::texel_corners(std::uint32_t triangle) const {
  const Material& material = mesh_.materials[mesh_.material_index[triangle]];
  const Texture& texture = mesh_.textures[static_cast<std::size_t>(material.texture)];
  auto uv = mesh_.corner_uv[triangle];
  // Whole repeats taken off keep digits for the texels.
  const Vector2d shift(material.repeat_u ? std::floor(uv[0].x()) : 0,
                       material.repeat_v ? std::floor(uv[0].y()) : 0);
  for (Vector2d& p : uv) {
    p -= shift;
    if (!p.allFinite()) p.setZero();
    p = Vector2d(p.x() * texture.width - .5, p.y() * texture.height - .5);
  }
  open_collapsed(uv);
  return uv;
}

Vector2d ToneField::texel_at(const SurfacePoint& point) const {
  const auto p = texel_corners(point.triangle);
  return point.barycentric[0] * p[0] + point.barycentric[1] * p[1] + point.barycentric[2] * p[2];
}

double ToneField::interpolated_luminance(const SurfacePoint& point) const {
  const auto& l = mesh_.corner_luminance[point.triangle];
  return point.barycentric[0] * l[0] + point.barycentric[1] * l[1] + point.barycentric[2] * l[2];
}

double ToneField::wanted_of_texture(const SurfacePoint& point) const {
  const Material& material = mesh_.materials[mesh_.material_index[point.triangle]];
  const Texture& texture = mesh_.textures[static_cast<std::size_t>(material.texture)];
  const double factor = texture.channels <= 2 ? interpolated_luminance(point) : 1;
  // The coverage of four texels, divided once.
  const double white = options_.reflectance_white, range = white - options_.reflectance_black;
  return material.opacity / range *
         look_up(texture.width, texture.height, texel_at(point), addressing(point.triangle),
                 [&](std::size_t i) {
                   return std::clamp(white - factor * texture.luminance[i], 0., range) *
                          (texture.opacity.empty() ? 1 : texture.opacity[i]);
                 });
}

double ToneField::wanted(const SurfacePoint& point) const {
  const Source source = sources_[point.triangle];
  if (source.kind == Source::kBlank) return 0;
  if (source.kind == Source::kColors)
    return coverage(interpolated_luminance(point)) *
           mesh_.materials[mesh_.material_index[point.triangle]].opacity;
  return wanted_of_texture(point);
}

ToneField::AskedTexels ToneField::asked_texels(std::uint32_t triangle) const {
  if (atlas_) return {atlas_->tones, {false, false}, atlas_->layout.texel_corners(triangle)};
  const Layer& layer = layers_[sources_[triangle].layer];
  auto corners = texel_corners(triangle);
  for (Vector2d& corner : corners) corner = layer.scaled(corner);
  return {layer.tones, addressing(triangle), corners};
}

double ToneField::asked(const SurfacePoint& point) const {
  const Source source = sources_[point.triangle];
  if (source.kind == Source::kBlank) return 0;
  if (!atlas_ && source.kind == Source::kColors) return asked_for(wanted(point));
  if (!atlas_ && source.kind == Source::kMean) return layers_[source.layer].tones.mean();
  const AskedTexels texels = asked_texels(point.triangle);
  const auto& p = texels.corners;
  return texels.tones.at(
      point.barycentric[0] * p[0] + point.barycentric[1] * p[1] + point.barycentric[2] * p[2],
      texels.addressing);
}

/// Without a tone curve or an atlas the asked tone is the wanted one, but for what a layer cannot follow.
bool ToneField::is_wanted_asked(std::uint32_t triangle) const {
  switch (sources_[triangle].kind) {
    case Source::kBlank:
      return true;
    case Source::kColors:
      return !atlas_ && options_.curve.wanted.empty();
    case Source::kTexture:
      break;
    case Source::kMean:
      return false;
  }
  if (atlas_) return false;  // and there are no layers
  const bool is_replacing = layers_[sources_[triangle].layer].luminance_factor < 0;
  const auto& l = mesh_.corner_luminance[triangle];
  return options_.curve.wanted.empty() && (is_replacing || (l[0] == l[1] && l[1] == l[2]));
}

TriangleTone ToneField::on(std::uint32_t triangle) const {
  TriangleTone result;
  result.field_ = this;
  result.triangle_ = triangle;
  result.space_ = 2 * mesh_.area_vector(triangle).norm();
  const Source source = sources_[triangle];
  result.is_wanted_asked_ = is_wanted_asked(triangle);
  if (source.kind == Source::kBlank) return result;
  if (atlas_ || source.kind == Source::kTexture) {
    const AskedTexels texels = asked_texels(triangle);
    result.kind_ = TriangleTone::kTexels;
    result.layer_ = &texels.tones;
    result.addressing_ = texels.addressing;
    result.origin_ = texels.corners[0];
    result.e1_ = texels.corners[1] - texels.corners[0];
    result.e2_ = texels.corners[2] - texels.corners[0];
    result.per_determinant_ = 1 / cross(result.e1_, result.e2_);
  } else if (source.kind == Source::kMean) {
    result.tone_ = layers_[source.layer].tones.mean();
  } else {
    const auto& l = mesh_.corner_luminance[triangle];
    if (l[0] == l[1] && l[1] == l[2])
      result.tone_ = asked_for(coverage(l[0]) * mesh_.materials[mesh_.material_index[triangle]].opacity);
    else
      result.kind_ = TriangleTone::kColors;
  }
  return result;
}

ToneIntegral ToneField::integrate_colors(std::uint32_t triangle, std::span<const Vector2d> polygon) const {
  const double scale = 2 * mesh_.area_vector(triangle).norm();
  const auto& l = mesh_.corner_luminance[triangle];
  const double opacity = mesh_.materials[mesh_.material_index[triangle]].opacity;
  const auto luminance = [&](const Vector2d& b) {
    return l[0] + b.x() * (l[1] - l[0]) + b.y() * (l[2] - l[0]);
  };
  const auto tone = [&](const Vector2d& b) { return asked_for(coverage(luminance(b)) * opacity); };
  // The tone bends where the coverage leaves 0 or 1 and at the curve's knots; between two bends it is linear.
  const double white = options_.reflectance_white, black = options_.reflectance_black;
  std::vector<double> bends{white, black};
  for (const double knot : options_.curve.wanted)
    if (knot > 0 && knot / opacity < 1) bends.push_back(white - knot / opacity * (white - black));
  ToneIntegral sum;
  split_at_levels(polygon, luminance, std::move(bends), [&](std::span<const Vector2d> part) {
    const ToneIntegral integral = integrate_linear(part, tone, scale);
    sum.area_m2 += integral.area_m2;
    sum.mass += integral.mass;
    sum.first += integral.first;
    sum.square += integral.square;
  });
  return sum;
}

double asked_mass_m2(const ToneField& tone) {
  const std::array<Vector2d, 3> whole{Vector2d(0, 0), Vector2d(1, 0), Vector2d(0, 1)};
  double mass = 0;
  for (std::uint32_t t = 0; t < tone.mesh().triangle_count(); ++t) mass += tone.integrate(t, whole).mass;
  return mass;
}

}  // namespace hilbrush
