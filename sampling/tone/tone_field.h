#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sampling/model/textured_mesh.h"
#include "sampling/options/tone_options.h"
#include "sampling/tone/asked_atlas.h"
#include "sampling/tone/pitch_mean.h"
#include "sampling/tone/triangle_tone.h"

/// The picture on the surface: coverage at every surface point, as wanted (before the tone curve: what
/// fidelity is measured against) and as asked (after it: the density of dots). Bilinear between texels,
/// linear between vertex colors. What the curve asks for below a pitch is in pitch_mean.h.
namespace hilbrush {

class ToneField {
 public:
  /// Keeps a reference to `mesh`, which must outlive it. Cost: one pass over texels and triangles; four to
  /// six bytes a texel of the textures, refined where they are small (see refinement_of). With a pitch, one
  /// such pass and a blur for each size that a pitch has in a texture, up to three times the texels.
  ToneField(const TexturedMesh& mesh, const ToneOptions& options);

  /// The same picture, asked for otherwise: wanted and blank as `base`, asked by the atlas (0 where base is
  /// blank).
  ToneField(const ToneField& base, AskedAtlas atlas);

  double wanted(const SurfacePoint& point) const;  ///< 0..1
  double asked(const SurfacePoint& point) const;   ///< 0..the curve's largest value

  const TexturedMesh& mesh() const { return mesh_; }
  /// True if the triangle gets no dots whatever its uv: blank by `untextured`, or transparent.
  bool is_blank(std::uint32_t triangle) const;

  /// The asked tone on one triangle, for many look-ups and integrals. Thread-safe.
  TriangleTone on(std::uint32_t triangle) const;
  /// on(triangle).integrate(polygon).
  ToneIntegral integrate(std::uint32_t triangle, std::span<const Eigen::Vector2d> polygon) const {
    return on(triangle).integrate(polygon);
  }

 private:
  friend class TriangleTone;  // for the integrals of colors

  /// What one triangle's tone comes from.
  struct Source {
    enum Kind : std::uint8_t { kBlank, kColors, kTexture, kMean } kind = kBlank;
    std::uint32_t layer = 0;  ///< index into layers_, of kTexture and kMean
  };

  /// A texture as some material shows it.
  struct Look {
    int texture = 0;
    float luminance_factor = 1;  ///< below 0: the texture replaces the surface's color
    double opacity = 1;
    TexelAddressing addressing;

    bool operator==(const Look&) const = default;
  };

  std::vector<Look> choose_sources();
  Source textured_source(std::uint32_t triangle, const Material& material, std::vector<Look>& looks);
  bool is_averaged() const;
  void make_layers(const std::vector<Look>& looks);
  Eigen::Vector2d texels_per_pitch_on(std::uint32_t triangle) const;
  std::vector<float> wanted_texels(const Look& look) const;
  int refinement_of(const Texture& texture) const;
  double coverage(double luminance) const;
  double asked_for(double wanted) const { return wanted <= 0 ? 0 : options_.curve(wanted); }

  std::array<Eigen::Vector2d, 3> texel_corners(std::uint32_t triangle) const;
  Eigen::Vector2d texel_at(const SurfacePoint& point) const;
  TexelAddressing addressing(std::uint32_t triangle) const;
  double interpolated_luminance(const SurfacePoint& point) const;
  double wanted_of_texture(const SurfacePoint& point) const;

  ToneIntegral integrate_colors(std::uint32_t triangle, std::span<const Eigen::Vector2d> polygon) const;

  /// The asked tones of a texture.
  struct Layer {
    float luminance_factor = 1;   ///< as Look
    Eigen::Vector2d scale{1, 1};  ///< texels of `tones` for one of the texture's, along its sides
    ToneLayer tones;

    /// From the texture's texels to those of `tones`.
    Eigen::Vector2d scaled(const Eigen::Vector2d& texel) const {
      return scale.cwiseProduct(texel + Eigen::Vector2d::Constant(.5)) - Eigen::Vector2d::Constant(.5);
    }
  };
  Layer make_layer(const Look& look) const;
  Layer make_layer(const Look& look, const std::vector<float>& wanted, const AskedGrid& grid) const;

  /// Where a triangle's asked tones are, with its corners in their texels.
  struct AskedTexels {
    const ToneLayer& tones;
    TexelAddressing addressing;
    std::array<Eigen::Vector2d, 3> corners;
  };
  AskedTexels asked_texels(std::uint32_t triangle) const;
  bool is_wanted_asked(std::uint32_t triangle) const;

  const TexturedMesh& mesh_;
  ToneOptions options_;
  std::optional<AskedAtlas> atlas_;
  std::vector<Source> sources_;  ///< per triangle
  std::vector<Layer> layers_;
};

/// Asked coverage times area, of the whole mesh.
double asked_mass_m2(const ToneField& tone);

}  // namespace hilbrush
