#pragma once
#include <vector>

namespace hilbrush {

/// A picture of which only a part counts: several channels of values, and a weight for each pixel (0:
/// outside).
struct MaskedImage {
  int width = 0, height = 0;
  std::vector<float> weights;
  std::vector<std::vector<float>> channels;

  MaskedImage(int w, int h, int channel_count);
  std::size_t index(int x, int y) const { return static_cast<std::size_t>(y) * width + x; }
};

/// Gaussian means over the weighted pixels (cut at 3 sigma) at every `step`-th pixel of every `step`-th row,
/// from step/2 on. Where the pixel in the middle has no weight the result has none. Separable; all cores.
MaskedImage masked_blur(const MaskedImage& image, double sigma_pixels, int step = 1);

}  // namespace hilbrush
