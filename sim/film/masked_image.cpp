#include "sim/film/masked_image.h"

#include <tbb/parallel_for.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace hilbrush {

namespace {

std::vector<float> gaussian_taps(double sigma) {
  const int radius = static_cast<int>(std::ceil(3 * sigma));
  std::vector<float> taps(2 * radius + 1);
  for (int i = -radius; i <= radius; ++i)
    taps[i + radius] = sigma > 0 ? static_cast<float>(std::exp(-i * i / (2 * sigma * sigma))) : 1;
  return taps;
}

/// One plane, blurred along the rows (at every step-th column), and transposed: twice gives both directions.
std::vector<float> blur_rows(const std::vector<float>& plane, int width, int height,
                             const std::vector<float>& taps, int step) {
  const int out_width = (width + step / 2) / step;
  const int radius = static_cast<int>(taps.size() / 2);
  std::vector<float> out(static_cast<std::size_t>(out_width) * height);
  constexpr int kRows = 16;
  tbb::parallel_for(0, (height + kRows - 1) / kRows, [&](int band) {
    for (int y = band * kRows; y < std::min((band + 1) * kRows, height); ++y) {
      const float* row = &plane[static_cast<std::size_t>(y) * width];
      const auto first_lit = std::find_if(row, row + width, [](float v) { return v != 0; }) - row;
      if (first_lit == width) continue;
      for (int i = 0; i < out_width; ++i) {
        const int x = std::min(i * step + step / 2, width - 1);
        const int begin = std::max(x - radius, static_cast<int>(first_lit));
        const int end = std::min(x + radius, width - 1);
        if (end < begin) continue;
        const Eigen::Index count = end - begin + 1;
        const Eigen::Map<const Eigen::VectorXf> values(row + begin, count),
            weights(&taps[begin - x + radius], count);
        out[static_cast<std::size_t>(i) * height + y] = values.dot(weights);
      }
    }
  });
  return out;
}

}  // namespace

MaskedImage::MaskedImage(int w, int h, int channel_count)
    : width(w),
      height(h),
      weights(static_cast<std::size_t>(w) * h),
      channels(channel_count, std::vector<float>(static_cast<std::size_t>(w) * h)) {}

MaskedImage masked_blur(const MaskedImage& image, double sigma_pixels, int step) {
  const std::vector<float> taps = gaussian_taps(sigma_pixels);
  const int out_width = (image.width + step / 2) / step;
  const int out_height = (image.height + step / 2) / step;
  const auto blur = [&](const std::vector<float>& plane) {
    const std::vector<float> across = blur_rows(plane, image.width, image.height, taps, step);
    return blur_rows(across, image.height, out_width, taps, step);
  };
  MaskedImage out(out_width, out_height, 0);
  std::vector<float> weighted(image.weights.size());
  const std::vector<float> sums = blur(image.weights);
  for (const std::vector<float>& channel : image.channels) {
    for (std::size_t i = 0; i < weighted.size(); ++i) weighted[i] = image.weights[i] * channel[i];
    out.channels.push_back(blur(weighted));
    std::vector<float>& means = out.channels.back();
    for (std::size_t i = 0; i < means.size(); ++i) means[i] = sums[i] > 0 ? means[i] / sums[i] : 0;
  }
  for (int y = 0; y < out_height; ++y)
    for (int x = 0; x < out_width; ++x) {
      const int from_x = std::min(x * step + step / 2, image.width - 1);
      const int from_y = std::min(y * step + step / 2, image.height - 1);
      out.weights[out.index(x, y)] = image.weights[image.index(from_x, from_y)];
    }
  return out;
}

}  // namespace hilbrush
