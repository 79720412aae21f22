#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sampling/base/input_error.h"
#include "sampling/base/random.h"
#include "sampling/images/image_file.h"

/// Pictures for dithering: wanted coverage, 0 white to 1 black, in linear light.
namespace hilbrush::bench {

struct Original {
  std::string name;
  int width = 0, height = 0;
  std::vector<float> coverage;  ///< row 0 at the bottom

  float& at(int x, int y) { return coverage[static_cast<std::size_t>(y) * width + x]; }
};

template <class Tone>
Original picture_of(std::string name, int width, int height, Tone tone) {
  Original picture{std::move(name), width, height,
                   std::vector<float>(static_cast<std::size_t>(width) * height)};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      picture.at(x, y) = static_cast<float>(std::clamp(tone((x + .5) / width, (y + .5) / height), 0., 1.));
  return picture;
}

inline Original ramp() {
  return picture_of("ramp", 512, 384, [](double u, double) { return u; });
}

/// Rings that get finer outwards, down to 12 pixels a period.
inline Original zone_plate() {
  return picture_of("zone plate", 512, 384, [](double u, double v) {
    const double x = 512 * u, y = 384 * v, r2 = x * x + y * y;
    return .5 + .45 * std::cos(std::numbers::pi * r2 / (12 * 640));
  });
}

/// A pseudo-random number of a lattice point, 0..1.
inline double lattice_number(int x, int y) {
  return unit_interval(mix_bits(static_cast<std::uint32_t>(x) * kGoldenGamma +
                                static_cast<std::uint32_t>(y) * 0xBF58476D1CE4E5B9u));
}

inline double smooth_noise(double x, double y) {
  const int i = static_cast<int>(std::floor(x)), j = static_cast<int>(std::floor(y));
  const auto ease = [](double t) { return t * t * (3 - 2 * t); };
  const double f = ease(x - i), g = ease(y - j);
  return (1 - g) * ((1 - f) * lattice_number(i, j) + f * lattice_number(i + 1, j)) +
         g * ((1 - f) * lattice_number(i, j + 1) + f * lattice_number(i + 1, j + 1));
}

/// Like a photograph: 1/f texture everywhere, and lit balls with highlights and sharp outlines in front of
/// it.
inline Original still_life() {
  return picture_of("still life", 640, 480, [](double u, double v) {
    const double x = 4 * u, y = 3 * v;
    double tone = .25;
    for (int octave = 0; octave < 6; ++octave)
      tone += .5 * std::ldexp(1., -octave) *
              (smooth_noise(2 * std::ldexp(x, octave), 2 * std::ldexp(y, octave)) - .3);
    constexpr std::array<std::array<double, 3>, 3> kBalls{{{1.1, 1.2, .75}, {2.5, 1.7, .9}, {3.3, .7, .45}}};
    for (const auto& [cx, cy, r] : kBalls) {
      const double dx = (x - cx) / r, dy = (y - cy) / r, d2 = dx * dx + dy * dy;
      if (d2 >= 1) continue;
      const double light = std::max(0., (-.5 * dx + .6 * dy + .62 * std::sqrt(1 - d2)));
      tone = .92 - .75 * light - .6 * std::pow(light, 30) + .05 * (smooth_noise(60 * x, 60 * y) - .5);
    }
    return tone;
  });
}

/// Lines of capitals of three sizes, black on white, of 5 x 7 squares each.
inline Original text() {
  constexpr std::array<std::pair<char, std::array<std::uint8_t, 7>>, 8> kLetters{
      {{'H', {17, 17, 17, 31, 17, 17, 17}},
       {'I', {14, 4, 4, 4, 4, 4, 14}},
       {'L', {16, 16, 16, 16, 16, 16, 31}},
       {'B', {30, 17, 17, 30, 17, 17, 30}},
       {'R', {30, 17, 17, 30, 20, 18, 17}},
       {'U', {17, 17, 17, 17, 17, 17, 14}},
       {'S', {15, 16, 16, 14, 1, 1, 30}},
       {' ', {0, 0, 0, 0, 0, 0, 0}}}};
  constexpr std::string_view kWords = "HILBRUSH BRUSHIL RUSH ";
  Original picture{"text", 640, 480, std::vector<float>(640 * 480, 0)};
  int top = 470;
  for (int line = 0; top > 80; ++line) {
    const int size = std::array{8, 5, 3}[static_cast<std::size_t>(line) % 3];
    for (int k = 0; 10 + (k + 1) * 6 * size < picture.width; ++k) {
      const char letter = kWords[static_cast<std::size_t>(k + line) % kWords.size()];
      const auto found =
          std::find_if(kLetters.begin(), kLetters.end(), [&](const auto& l) { return l.first == letter; });
      for (int j = 0; j < 7 * size; ++j)
        for (int i = 0; i < 5 * size; ++i)
          if (found->second[static_cast<std::size_t>(j / size)] >> (4 - i / size) & 1)
            picture.at(10 + k * 6 * size + i, top - j) = 1;
    }
    top -= 9 * size;
  }
  return picture;
}

/// From an image file: coverage = 1 - luminance.
inline Original from_file(const std::string& file) {
  const auto loaded = load_image_file(file, std::size_t{1} << 26);
  if (!loaded) throw InputError(file, loaded.reason());
  const Texture& texture = *loaded;
  Original picture{file.substr(file.find_last_of('/') + 1), texture.width, texture.height, {}};
  for (const float luminance : texture.luminance) picture.coverage.push_back(1 - luminance);
  return picture;
}

}  // namespace hilbrush::bench
