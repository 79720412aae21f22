#pragma once
#include <Eigen/Core>
#include <array>
#include <vector>

#include "sampling/options/tone_options.h"
#include "sampling/tone/tone_layer.h"

/// What a tone curve means below a pitch.
///
/// A tone curve is measured on flat fields: it says what to ask for so that a coverage comes out on the mean
/// over about a pitch. Nothing finer can be painted, so nothing finer has a curve: spots overlap their
/// neighbors whatever the picture does between two dots. Applied to the texels of a finer texture, a bent
/// curve asks for the mean of its values where the value at the mean would do: up to twice too much. So what
/// is asked for is
///
///   asked = curve(mean) * detail / mean
///
/// where `mean` and `detail` are Gaussian means of the wanted coverage around the place, sigma half and a
/// quarter of a pitch. Over a pitch this amounts to curve(mean), while the picture in it stays as sharp as
/// dots can show it. On flat tone, and wherever the tone hardly changes within a pitch, it is curve(wanted).
///
/// The means are taken in the texture, by the size that a pitch has there. That differs from triangle to
/// triangle, so a texture has asked tones for several sizes, each on a grid that is just fine enough for it.
/// Where a texture is mapped with a shear, they are as wide as the sheared pitch along x and y.
namespace hilbrush {

/// How large a pitch is in a texture, along its rows (x) and columns (y), rounded to steps; what a pitch is
/// in it differs by less than half a step on the triangles that share it.
struct PitchInTexture {
  static constexpr int kFlat = -1000;  ///< a pitch is so small beside a texel that nothing is averaged
  std::array<int, 2> steps{kFlat, kFlat};

  bool operator==(const PitchInTexture&) const = default;
};

/// Texels a pitch along x and y: `texels` and `space_m` are a triangle's edges from its first corner.
Eigen::Vector2d texels_per_pitch(const std::array<Eigen::Vector2d, 2>& texels,
                                 const std::array<Eigen::Vector2d, 2>& space_m, double pitch_m);

/// Rounds to steps of this many octaves. No step is beyond a grid of one texel.
PitchInTexture round_to_steps(const Eigen::Vector2d& texels_per_pitch, double octaves, int width, int height);

/// The grid of asked tones for a texture.
struct AskedGrid {
  std::array<int, 2> size{};  ///< grid texels
  std::array<int, 2>
      refinement{};  ///< grid texels for one texel of the reduced texture; odd, so that centers stay
  std::array<int, 2> reduced{};  ///< texels of the reduced texture
  Eigen::Vector2d pitch =
      Eigen::Vector2d::Zero();  ///< in grid texels; 0: nothing is averaged along this axis

  double texels() const { return static_cast<double>(size[0]) * size[1]; }
};

/// The grid for a pitch of this size: about four to eight texels a pitch, but never more than
/// `max_refinement` for one of the texture's.
AskedGrid asked_grid(int width, int height, const PitchInTexture& pitch, double octaves, int max_refinement);

/// Asked tones on `grid` of a texture with these wanted tones, row by row.
ToneLayer asked_over_pitch(const std::vector<float>& wanted, int width, int height,
                           TexelAddressing addressing, const AskedGrid& grid, const ToneCurve& curve);

}  // namespace hilbrush
