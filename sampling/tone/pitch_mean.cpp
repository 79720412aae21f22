#include "sampling/tone/pitch_mean.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "sampling/base/check.h"
#include "sampling/base/cross.h"
#include "sampling/tone/tone_polygon.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d;

/// Sigma of the mean, in pitches. Smaller ones ask for too much of textures finer than a pitch, larger ones
/// for too little of lines as wide as one: of .35, .5, .7 and 1 this has the least error of tone over
/// pictures of both kinds.
constexpr double kMeanSigma = .5;
/// Sigma of the detail: what is finer than dots can show only clumps them (2 to 3 dB of F2 on lines of half a
/// pitch).
constexpr double kDetailSigma = .25;
/// Gaussians end here. What is asked for spills over an edge as far as the detail's.
constexpr double kMeanCutSigmas = 3, kDetailCutSigmas = 2;
/// Grid texels a pitch has at least, where the texture has as many.
constexpr double kGridTexelsPerPitch = 4;
/// A pitch of fewer texels has its mean at every place of the (interpolated) texture.
constexpr double kMinTexelsPerPitch = .25;

struct Image {
  int width = 0, height = 0;
  std::vector<float> texels;

  Image(int w, int h)
      : width(w), height(h), texels(static_cast<std::size_t>(w) * static_cast<std::size_t>(h)) {}
  float* row(int y) { return texels.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width); }
  const float* row(int y) const {
    return texels.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width);
  }
};

/// Texels of a row of `from` that a texel of a row of `to` texels covers, in order, with their shares.
template <class Visit>
void visit_covered(int i, int from, int to, Visit visit) {
  const double scale = static_cast<double>(from) / to, begin = i * scale,
               end = std::min((i + 1) * scale, from * 1.);
  for (int k = static_cast<int>(begin); k < end; ++k) {
    const double covered = std::min(end, k + 1.) - std::max(begin, k * 1.);
    if (covered > 0) visit(k, static_cast<float>(covered / scale));
  }
}

/// Each texel the mean over what it covers.
Image reduce(const float* texels, int width, int height, std::array<int, 2> size) {
  Image result(size[0], size[1]);
  tbb::parallel_for(0, size[1], [&](int y) {
    std::vector<float> column_means(static_cast<std::size_t>(width), 0.f);
    visit_covered(y, height, size[1], [&](int k, float share) {
      const float* in = texels + static_cast<std::size_t>(k) * static_cast<std::size_t>(width);
      for (int x = 0; x < width; ++x) column_means[static_cast<std::size_t>(x)] += share * in[x];
    });
    float* out = result.row(y);
    for (int x = 0; x < size[0]; ++x)
      visit_covered(x, width, size[0],
                    [&](int k, float share) { out[x] += share * column_means[static_cast<std::size_t>(k)]; });
  });
  return result;
}

/// The bilinear interpolation of `image` at finer texels.
Image refine(Image image, const AskedGrid& grid, TexelAddressing addressing) {
  if (grid.refinement[0] == 1 && grid.refinement[1] == 1) return image;
  Image result(grid.size[0], grid.size[1]);
  tbb::parallel_for(0, result.height, [&](int y) {
    float* out = result.row(y);
    const double v = (y + .5) / grid.refinement[1] - .5;
    for (int x = 0; x < result.width; ++x)
      out[x] = static_cast<float>(look_up(image.width, image.height, {(x + .5) / grid.refinement[0] - .5, v},
                                          addressing, [&](std::size_t i) { return image.texels[i]; }));
  });
  return result;
}

/// Weights of the neighbors 1, 2, ... to either side; the center has the rest of 1.
std::vector<float> gaussian_taps(double sigma, double cut) {
  std::vector<float> taps;
  if (!(sigma > 0)) return taps;
  const int reach = static_cast<int>(std::floor(cut * sigma));
  double sum = 1;
  for (int k = 1; k <= reach; ++k) sum += 2 * std::exp(-.5 * k * k / (sigma * sigma));
  for (int k = 1; k <= reach; ++k)
    taps.push_back(static_cast<float>(std::exp(-.5 * k * k / (sigma * sigma)) / sum));
  return taps;
}

/// Adds differences to the center, so that a flat tone stays what it is to the last digit.
void blur_rows(Image& image, const std::vector<float>& taps, bool repeats) {
  if (taps.empty()) return;
  const auto reach = static_cast<int>(taps.size());
  tbb::parallel_for(0, image.height, [&](int y) {
    float* row = image.row(y);
    std::vector<float> padded(static_cast<std::size_t>(image.width + 2 * reach));
    for (int x = -reach; x < image.width + reach; ++x)
      padded[static_cast<std::size_t>(x + reach)] = row[texel_index(x, image.width, repeats)];
    const float* center = padded.data() + reach;
    for (int k = 1; k <= reach; ++k) {
      const float tap = taps[static_cast<std::size_t>(k - 1)];
      for (int x = 0; x < image.width; ++x)
        row[x] += tap * ((center[x - k] - center[x]) + (center[x + k] - center[x]));
    }
  });
}

Image blur_columns(const Image& image, const std::vector<float>& taps, bool repeats) {
  Image result = image;
  const auto reach = static_cast<int>(taps.size());
  tbb::parallel_for(0, image.height, [&](int y) {
    float* out = result.row(y);
    const float* center = image.row(y);
    for (int k = 1; k <= reach; ++k) {
      const float tap = taps[static_cast<std::size_t>(k - 1)];
      const float* below = image.row(static_cast<int>(texel_index(y - k, image.height, repeats)));
      const float* above = image.row(static_cast<int>(texel_index(y + k, image.height, repeats)));
      for (int x = 0; x < image.width; ++x) out[x] += tap * ((below[x] - center[x]) + (above[x] - center[x]));
    }
  });
  return result;
}

/// Sigma in pitches.
Image blur(Image image, const AskedGrid& grid, double sigma, double cut, TexelAddressing addressing) {
  blur_rows(image, gaussian_taps(sigma * grid.pitch.x(), cut), addressing.repeat_x);
  return blur_columns(image, gaussian_taps(sigma * grid.pitch.y(), cut), addressing.repeat_y);
}

}  // namespace

Vector2d texels_per_pitch(const std::array<Vector2d, 2>& texels, const std::array<Vector2d, 2>& space_m,
                          double pitch_m) {
  // Rows of the map from space to texels.
  const double per_area = 1 / cross(space_m[0], space_m[1]);
  const Vector2d dx = (texels[0] * space_m[1].y() - texels[1] * space_m[0].y()) * per_area,
                 dy = (texels[1] * space_m[0].x() - texels[0] * space_m[1].x()) * per_area;
  return pitch_m * Vector2d(std::hypot(dx.x(), dy.x()), std::hypot(dx.y(), dy.y()));
}

PitchInTexture round_to_steps(const Vector2d& texels_per_pitch, double octaves, int width, int height) {
  PitchInTexture result;
  for (int axis = 0; axis < 2; ++axis) {
    const double most = kGridTexelsPerPitch * (axis == 0 ? width : height);
    const double texels = texels_per_pitch[axis] < most ? texels_per_pitch[axis] : most;
    if (texels >= kMinTexelsPerPitch)
      result.steps[static_cast<std::size_t>(axis)] =
          static_cast<int>(std::lround(std::log2(texels) / octaves));
  }
  return result;
}

AskedGrid asked_grid(int width, int height, const PitchInTexture& pitch, double octaves, int max_refinement) {
  AskedGrid grid;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const int size = axis == 0 ? width : height;
    grid.reduced[axis] = size;
    grid.refinement[axis] = max_refinement;
    if (pitch.steps[axis] != PitchInTexture::kFlat) {
      const double texels = std::exp2(pitch.steps[axis] * octaves);
      const int halvings = std::max(0, static_cast<int>(std::floor(std::log2(texels / kGridTexelsPerPitch))));
      grid.reduced[axis] = std::max(1, static_cast<int>(std::ceil(std::ldexp(size, -halvings))));
      int refinement = 1;
      while (refinement < max_refinement && refinement * texels < kGridTexelsPerPitch) refinement += 2;
      grid.refinement[axis] = refinement;
      grid.pitch[static_cast<int>(axis)] = texels * grid.reduced[axis] / size * refinement;
    }
    grid.size[axis] = grid.reduced[axis] * grid.refinement[axis];
  }
  return grid;
}

ToneLayer asked_over_pitch(const std::vector<float>& wanted, int width, int height,
                           TexelAddressing addressing, const AskedGrid& grid, const ToneCurve& curve) {
  CHECK_EQ(wanted.size(), static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const Image tones = refine(reduce(wanted.data(), width, height, grid.reduced), grid, addressing);
  Image details = blur(tones, grid, kDetailSigma, kDetailCutSigmas, addressing);
  const Image means = blur(tones, grid, kMeanSigma, kMeanCutSigmas, addressing);
  tbb::parallel_for(0, details.height, [&](int y) {
    float* detail = details.row(y);
    const float* mean = means.row(y);
    for (int x = 0; x < details.width; ++x) {
      const double m = mean[x];
      detail[x] = static_cast<float>(m > 0 ? curve(m) * (detail[x] / m) : 0);
    }
  });
  return {details.width, details.height, std::move(details.texels)};
}

}  // namespace hilbrush
