#include "sim/film/views.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "sampling/base/input_error.h"
#include "sim/film/canvas.h"
#include "sim/film/masked_image.h"

namespace hilbrush {

namespace {

constexpr Color kBackground{104, 116, 130}, kBackFace{126, 106, 92}, kInk{245, 245, 245},
    kSkipped{230, 20, 30};
constexpr Color kTooLight{30, 90, 200}, kRight{247, 247, 247}, kTooDark{215, 95, 0};
constexpr double kFullError = .2;
constexpr int kPad = 12, kSheetPixels = 320, kViewPixels = 900;

enum Channel {
  kWanted,
  kPainted,
  kError,
  kBack,
  kChannelCount
};  // kBack: share of the pixel that shows a back face
constexpr std::array<const char*, 3> kPanelNames{"wanted", "painted", "error"};

/// One view with everything that its panels show.
struct ViewPicture {
  const char* name;
  MaskedImage image;  ///< weight: the share of the pixel that shows film
  std::vector<Eigen::Vector2i> skipped;
};

/// Means over squares of factor * factor pixels, weighted by the weights.
MaskedImage reduced(const MaskedImage& image, int factor) {
  if (factor == 1) return image;
  MaskedImage out((image.width + factor - 1) / factor, (image.height + factor - 1) / factor, kChannelCount);
  const float share = 1.f / static_cast<float>(factor * factor);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const std::size_t from = image.index(x, y);
      const std::size_t to = out.index(x / factor, y / factor);
      out.weights[to] += share * image.weights[from];
      for (int k = kWanted; k <= kError; ++k)
        out.channels[k][to] += share * image.weights[from] * image.channels[k][from];
      out.channels[kBack][to] += share * image.channels[kBack][from];
    }
  for (std::size_t i = 0; i < out.weights.size(); ++i)
    for (int k = kWanted; k <= kError; ++k)
      if (out.weights[i] > 0) out.channels[k][i] /= out.weights[i];
  return out;
}

ViewPicture reduced(const ViewPicture& view, int factor) {
  ViewPicture out{view.name, reduced(view.image, factor), view.skipped};
  for (Eigen::Vector2i& pixel : out.skipped) pixel /= factor;
  return out;
}

void fill_row(const Film& film, const ToneField& tone, const OrthographicView& view, int y,
              MaskedImage& image) {
  std::vector<OrthographicView::Pixel> pixels;
  view.read_row(y, pixels);
  for (int x = 0; x < view.width(); ++x) {
    const std::size_t i = image.index(x, y);
    if (pixels[x].side == OrthographicView::Side::kBack) image.channels[kBack][i] = 1;
    if (pixels[x].side != OrthographicView::Side::kFront) continue;
    image.weights[i] = 1;
    image.channels[kWanted][i] = static_cast<float>(tone.wanted(pixels[x].point));
    image.channels[kPainted][i] = static_cast<float>(film.painted(pixels[x].point));
  }
}

/// Each pixel of the picture is the mean of `oversampling` pixels of the view in each direction, so that dots
/// finer than a pixel are averaged.
ViewPicture render(const Film& film, const ToneField& tone, std::span<const Eigen::Vector3d> skipped_O,
                   const ViewDirection& direction, double pixel_m, int oversampling) {
  const OrthographicView view(film.mesh(), direction, pixel_m / oversampling, 2 * oversampling);
  MaskedImage fine(view.width(), view.height(), kChannelCount);
  tbb::parallel_for(0, view.height(), [&](int y) { fill_row(film, tone, view, y, fine); });

  ViewPicture picture{direction.name, reduced(fine, oversampling), {}};
  const MaskedImage smooth = masked_blur(picture.image, film.pitch_m() / pixel_m);
  for (std::size_t i = 0; i < smooth.weights.size(); ++i)
    picture.image.channels[kError][i] = smooth.channels[kPainted][i] - smooth.channels[kWanted][i];
  for (const Eigen::Vector3d& p_O : skipped_O)
    if (const auto pixel = view.pixel_of(p_O, 2 * pixel_m)) picture.skipped.push_back(*pixel / oversampling);
  return picture;
}

double srgb_encoded(double linear) {
  linear = std::clamp(linear, 0., 1.);
  return linear <= .0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - .055;
}

Color mixed(const Color& a, const Color& b, double share_of_b) {
  Color color;
  for (int k = 0; k < 3; ++k)
    color[k] = static_cast<std::uint8_t>(std::lround(a[k] + (b[k] - a[k]) * share_of_b));
  return color;
}

Color tone_color(double coverage, const CellDescription::Paint& paint) {
  const double reflectance = 1 - coverage * (1 - paint.reflectance_black / paint.reflectance_white);
  const auto gray = static_cast<std::uint8_t>(std::lround(255 * srgb_encoded(reflectance)));
  return {gray, gray, gray};
}

Color error_color(double error) {
  return mixed(kRight, error > 0 ? kTooDark : kTooLight, std::min(std::abs(error) / kFullError, 1.));
}

void draw_panel(Canvas& canvas, int left, int top, const ViewPicture& view, int channel,
                const CellDescription::Paint& paint) {
  for (int y = 0; y < view.image.height; ++y)
    for (int x = 0; x < view.image.width; ++x) {
      const std::size_t i = view.image.index(x, y);
      const float film_share = view.image.weights[i];
      const float back_share = view.image.channels[kBack][i];
      if (film_share + back_share <= 0) continue;
      const float value = view.image.channels[channel][i];
      const Color film_color = channel == kError ? error_color(value) : tone_color(value, paint);
      const Color object = mixed(kBackFace, film_color, film_share / (film_share + back_share));
      canvas.set(left + x, top + y, mixed(kBackground, object, std::min(film_share + back_share, 1.f)));
    }
  if (channel == kWanted) return;
  for (const Eigen::Vector2i& pixel : view.skipped)
    canvas.mark(left + pixel.x(), top + pixel.y(), 1, kSkipped);
}

std::string caption(const ViewPicture& view, int channel) {
  return std::string(view.name) + ", " + kPanelNames[channel];
}

/// Wanted | painted | error of one view.
Canvas triptych(const ViewPicture& view, const CellDescription::Paint& paint) {
  constexpr int kScale = 2;
  int panel = view.image.width;
  for (int k = kWanted; k <= kError; ++k)
    panel = std::max(panel, Canvas::text_width(caption(view, k), kScale));
  Canvas canvas(3 * panel + 4 * kPad, view.image.height + Canvas::text_height(kScale) + 3 * kPad,
                kBackground);
  for (int k = kWanted; k <= kError; ++k) {
    const int left = kPad + k * (panel + kPad);
    canvas.write(left, kPad, caption(view, k), kScale, kInk);
    draw_panel(canvas, left + (panel - view.image.width) / 2, Canvas::text_height(kScale) + 2 * kPad, view, k,
               paint);
  }
  return canvas;
}

/// All views: a column each, wanted above painted above error.
Canvas contact_sheet(const std::vector<ViewPicture>& views, const CellDescription::Paint& paint,
                     std::size_t skipped_count) {
  constexpr int kScale = 2, kText = 7 * kScale;
  int width = kPad;
  int height = 0;
  for (const ViewPicture& view : views) {
    width += std::max(view.image.width, Canvas::text_width(caption(view, kPainted), kScale)) + kPad;
    height = std::max(height, view.image.height);
  }
  const std::string legend =
      "error: blue too light, orange too dark, full at .2 of coverage" +
      (skipped_count > 0 ? ", red: skipped dots (" + std::to_string(skipped_count) + ")" : std::string());
  width = std::max(width, Canvas::text_width(legend, kScale) + 2 * kPad);
  const int row = height + kText + 2 * kPad;
  Canvas canvas(width, 3 * row + kText + 2 * kPad, kBackground);
  int left = kPad;
  for (const ViewPicture& view : views) {
    const int column = std::max(view.image.width, Canvas::text_width(caption(view, kPainted), kScale));
    for (int k = kWanted; k <= kError; ++k) {
      canvas.write(left, kPad + k * row, caption(view, k), kScale, kInk);
      draw_panel(canvas, left + (column - view.image.width) / 2,
                 kPad + k * row + kText + kPad + (height - view.image.height) / 2, view, k, paint);
    }
    left += column + kPad;
  }
  canvas.write(kPad, 3 * row + kPad, legend, kScale, kInk);
  return canvas;
}

/// Three pixels a pitch, but the longest side has at most kViewPixels and at least kMinViewPixels.
double picture_pixel_m(const Film& film) {
  constexpr int kMinViewPixels = 240;
  const auto [low, high] = bounds(film.mesh());
  const double longest_m = (high - low).maxCoeff();
  return std::min(std::max(film.pitch_m() / 3, longest_m / kViewPixels), longest_m / kMinViewPixels);
}

}  // namespace

std::array<ViewDirection, 6> picture_views() {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  return {{{"front", y, z},
           {"right", -x, z},
           {"back", -y, z},
           {"left", x, z},
           {"top", -z, y},
           {"bottom", z, -y}}};
}

std::vector<std::filesystem::path> write_pictures(const Film& film, const ToneField& tone,
                                                  std::span<const Eigen::Vector3d> skipped_O,
                                                  const std::filesystem::path& folder,
                                                  const Progress& progress) {
  const std::filesystem::path views_folder = folder / "views";
  std::error_code error;
  std::filesystem::create_directories(views_folder, error);
  if (error) throw InputError(views_folder.string(), "the folder cannot be created: " + error.message());

  const double pixel_m = picture_pixel_m(film);
  constexpr double kPixelsPerPitch = 1.5;
  const int oversampling =
      std::clamp(static_cast<int>(std::ceil(kPixelsPerPitch * pixel_m / film.pitch_m())), 1, 4);
  const CellDescription::Paint& paint = film.cell().paint;
  std::vector<std::filesystem::path> files;
  std::vector<ViewPicture> small_views;
  for (const ViewDirection& direction : picture_views()) {
    const ViewPicture view = render(film, tone, skipped_O, direction, pixel_m, oversampling);
    files.push_back(views_folder / (std::string(direction.name) + ".png"));
    save_png(triptych(view, paint).picture(), files.back());
    const auto [low, high] = bounds(film.mesh());
    const int factor =
        std::max(1, static_cast<int>(std::ceil((high - low).maxCoeff() / pixel_m / kSheetPixels)));
    small_views.push_back(reduced(view, factor));
    progress.step(files.size(), 7);
  }
  files.push_back(folder / "exposure.png");
  save_png(contact_sheet(small_views, paint, skipped_O.size()).picture(), files.back());
  progress(1);
  return files;
}

}  // namespace hilbrush
