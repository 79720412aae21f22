// Dithering in the plane at equal dot count: a picture on a flat rectangle through the real engine, against
// Floyd-Steinberg and rows. Dots and picture are both blurred by one pitch (a dot blackens a pitch squared),
// edges left out; PSNR in dB against black = 1.
//   dither_bench [DOTS] [IMAGE...]
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "sampling/fine/fine.h"
#include "sampling/place_dots.h"
#include "tests/bench/dither_pictures.h"
#include "tests/support/meshes.h"

namespace {

using namespace hilbrush;
using bench::Original;
using Eigen::Vector2d;

/// A picture on a rectangle one meter wide.
class Print {
 public:
  Print(const Original& picture, std::uint64_t count)
      : width_(1),
        height_(static_cast<double>(picture.height) / picture.width),
        mesh_(textured_rectangle(picture)),
        tone_(mesh_, {}),
        curve_(mesh_) {
    SampleOptions options;
    options.dot_count = count;
    pitch_ = place_dots(curve_, tone_, options).pitch_m;
    blur_wanted();
  }

  double width() const { return width_; }
  double height() const { return height_; }
  double pitch() const { return pitch_; }

  double wanted(const Vector2d& p) const {
    const double u = p.x() / width_, v = p.y() / height_;
    return tone_.wanted(u >= v ? SurfacePoint{0, {1 - u, u - v, v}} : SurfacePoint{1, {1 - v, u, v - u}});
  }

  DotSequence sequence(Sampler sampler, std::uint64_t count) const {
    SampleOptions options;
    options.dot_count = count;
    options.sampler = sampler;
    return place_dots(curve_, tone_, options);
  }
  std::vector<Vector2d> placed(Sampler sampler, std::uint64_t count) const {
    return points_of(sequence(sampler, count));
  }
  /// `fine` for paint that adds up without end, in spots as the shipped cell's.
  std::vector<Vector2d> fine(std::uint64_t count) const {
    return points_of(refine_dots(curve_, tone_, sequence(Sampler::kCentroid, count),
                                 {.705 * pitch_, [](double dose) { return dose; }}));
  }

  double psnr(const std::vector<Vector2d>& points) const {
    std::vector<double> painted(wanted_blurred_.size(), 0);
    const double step = step_m(), peak = pitch_ * pitch_ / (2 * std::numbers::pi * pitch_ * pitch_);
    for (const Vector2d& p : points) {
      const int x0 = std::max(0, static_cast<int>((p.x() - kCut * pitch_) / step));
      const int x1 = std::min(columns_ - 1, static_cast<int>((p.x() + kCut * pitch_) / step));
      const int y0 = std::max(0, static_cast<int>((p.y() - kCut * pitch_) / step));
      const int y1 = std::min(rows_ - 1, static_cast<int>((p.y() + kCut * pitch_) / step));
      for (int y = y0; y <= y1; ++y)
        for (int x = x0; x <= x1; ++x)
          painted[static_cast<std::size_t>(y) * columns_ + x] +=
              peak * std::exp(-((p - place(x, y)).squaredNorm()) / (2 * pitch_ * pitch_));
    }
    double square = 0;
    long number = 0;
    const int border = static_cast<int>(kCut * pitch_ / step) + 1;
    for (int y = border; y < rows_ - border; ++y)
      for (int x = border; x < columns_ - border; ++x, ++number) {
        const std::size_t i = static_cast<std::size_t>(y) * columns_ + x;
        square += std::pow(painted[i] - wanted_blurred_[i], 2);
      }
    return -10 * std::log10(square / static_cast<double>(number));
  }

 private:
  static constexpr double kCut = 4;  ///< of the blur, in pitches

  static TexturedMesh textured_rectangle(const Original& picture) {
    TexturedMesh mesh = test::rectangle(1, static_cast<double>(picture.height) / picture.width, 1, 1);
    Texture texture;
    texture.width = picture.width;
    texture.height = picture.height;
    for (const float coverage : picture.coverage) texture.luminance.push_back(1 - coverage);
    texture.name = picture.name;
    mesh.textures.push_back(texture);
    Material material;
    material.name = "picture";
    material.source = ColorSource::kTexture;
    material.texture = 0;
    material.repeat_u = material.repeat_v = false;
    mesh.materials = {material};
    return mesh;
  }
  static std::vector<Vector2d> points_of(const DotSequence& dots) {
    std::vector<Vector2d> points;
    for (const Dot& dot : dots.dots) points.emplace_back(dot.position_O.head<2>());
    return points;
  }

  double step_m() const { return pitch_ / 2; }
  Vector2d place(int x, int y) const { return {(x + .5) * step_m(), (y + .5) * step_m()}; }

  /// The wanted picture at half a pitch, each value the mean of 4 x 4 samples, blurred along rows and then
  /// columns.
  void blur_wanted() {
    columns_ = static_cast<int>(width_ / step_m());
    rows_ = static_cast<int>(height_ / step_m());
    std::vector<double> image(static_cast<std::size_t>(columns_) * rows_);
    for (int y = 0; y < rows_; ++y)
      for (int x = 0; x < columns_; ++x)
        for (int k = 0; k < 16; ++k)
          image[static_cast<std::size_t>(y) * columns_ + x] +=
              wanted(place(x, y) + step_m() * Vector2d((k % 4 - 1.5) / 4, (k / 4 - 1.5) / 4)) / 16;
    // The mean over a step has blurred it by step^2/12 already.
    const double sigma2 = pitch_ * pitch_ / (step_m() * step_m()) - 1. / 12;
    wanted_blurred_ = blurred(blurred(image, 1, sigma2), columns_, sigma2);
  }
  std::vector<double> blurred(const std::vector<double>& image, int stride, double sigma2) const {
    const int reach = static_cast<int>(kCut * std::sqrt(sigma2)) + 1;
    std::vector<double> result(image.size(), 0);
    for (int y = 0; y < rows_; ++y)
      for (int x = 0; x < columns_; ++x) {
        const int at = stride == 1 ? x : y, end = stride == 1 ? columns_ : rows_;
        const std::size_t i = static_cast<std::size_t>(y) * columns_ + x;
        double weights = 0;
        for (int k = std::max(-reach, -at); k <= std::min(reach, end - 1 - at); ++k) {
          const double weight = std::exp(-k * k / (2 * sigma2));
          weights += weight;
          result[i] += weight * image[i + static_cast<std::size_t>(static_cast<std::ptrdiff_t>(k) * stride)];
        }
        result[i] /= weights;
      }
    return result;
  }

  double width_, height_, pitch_ = 0;
  TexturedMesh mesh_;
  ToneField tone_;
  SurfaceCurve curve_;
  int columns_ = 0, rows_ = 0;
  std::vector<double> wanted_blurred_;
};

/// Mean wanted coverage of squares of one pitch.
struct Pixels {
  int columns = 0, rows = 0;
  std::vector<double> tones;
};

Pixels pixels_of(const Print& print) {
  Pixels pixels;
  pixels.columns = static_cast<int>(std::lround(print.width() / print.pitch()));
  pixels.rows = static_cast<int>(std::lround(print.height() / print.pitch()));
  for (int y = 0; y < pixels.rows; ++y)
    for (int x = 0; x < pixels.columns; ++x) {
      double tone = 0;
      for (int k = 0; k < 64; ++k)
        tone += print.wanted({(x + (k % 8 + .5) / 8) * print.width() / pixels.columns,
                              (y + (k / 8 + .5) / 8) * print.height() / pixels.rows}) /
                64;
      pixels.tones.push_back(tone);
    }
  return pixels;
}

Vector2d middle_of(const Print& print, const Pixels& pixels, double x, int y) {
  return {(x + .5) * print.width() / pixels.columns, (y + .5) * print.height() / pixels.rows};
}

/// Error diffusion, left to right and back (Floyd and Steinberg 1976).
std::vector<Vector2d> floyd_steinberg(const Print& print) {
  Pixels pixels = pixels_of(print);
  std::vector<Vector2d> points;
  const auto add = [&](int x, int y, double error) {
    if (x >= 0 && x < pixels.columns && y < pixels.rows)
      pixels.tones[static_cast<std::size_t>(y) * pixels.columns + x] += error;
  };
  for (int y = 0; y < pixels.rows; ++y)
    for (int k = 0; k < pixels.columns; ++k) {
      const int way = y % 2 == 0 ? 1 : -1, x = way > 0 ? k : pixels.columns - 1 - k;
      const double tone = pixels.tones[static_cast<std::size_t>(y) * pixels.columns + x];
      const bool is_dot = tone >= .5;
      if (is_dot) points.push_back(middle_of(print, pixels, x, y));
      const double error = tone - is_dot;
      add(x + way, y, error * 7 / 16), add(x - way, y + 1, error * 3 / 16), add(x, y + 1, error * 5 / 16),
          add(x + way, y + 1, error / 16);
    }
  return points;
}

/// Rows one pitch apart, walked to and fro; a dot wherever the mass of another dot has gathered.
std::vector<Vector2d> raster(const Print& print) {
  const Pixels pixels = pixels_of(print);
  std::vector<Vector2d> points;
  double mass = .5;
  for (int y = 0; y < pixels.rows; ++y)
    for (int k = 0; k < pixels.columns; ++k) {
      const int way = y % 2 == 0 ? 1 : -1, x = way > 0 ? k : pixels.columns - 1 - k;
      const double tone = pixels.tones[static_cast<std::size_t>(y) * pixels.columns + x];
      if (tone > 0 && mass + tone >= 1)
        points.push_back(middle_of(print, pixels, x + way * ((1 - mass) / tone - .5), y));
      mass = mass + tone >= 1 ? mass + tone - 1 : mass + tone;
    }
  return points;
}

void run(const Original& picture, std::uint64_t count) {
  const Print print(picture, count);
  const std::vector<Vector2d> diffused = floyd_steinberg(print), rows = raster(print);
  std::printf(
      "%-16s random %5.1f  jittered %5.1f  rows %5.1f  Floyd-Steinberg %5.1f  centroid %5.1f  blue %5.1f  "
      "fine "
      "%5.1f dB   (%llu dots; rows %zu, Floyd-Steinberg %zu)\n",
      picture.name.c_str(), print.psnr(print.placed(Sampler::kRandom, count)),
      print.psnr(print.placed(Sampler::kJittered, count)), print.psnr(rows), print.psnr(diffused),
      print.psnr(print.placed(Sampler::kCentroid, count)), print.psnr(print.placed(Sampler::kBlue, count)),
      print.psnr(print.fine(count)), static_cast<unsigned long long>(count), rows.size(), diffused.size());
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const std::uint64_t count = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 60'000;
    std::vector<Original> pictures{bench::ramp(), bench::zone_plate(), bench::still_life(), bench::text()};
    for (int i = 2; i < argc; ++i) pictures.push_back(bench::from_file(argv[i]));
    for (const Original& picture : pictures) run(picture, count);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "dither_bench: %s\n", error.what());
    return 1;
  }
  return 0;
}
