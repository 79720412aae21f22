// Textures finer than a pitch: a 40 mm square under a picture that is repeated, and objects under a picture
// of 4096 texels a side, as a job paints them, with the tone curve alone.
//
//   fine_texture_bench square DPI SETTINGS [texels]              three pictures, repeated 1, 3, 6 and 12
//   times fine_texture_bench object MODEL SIZE_MM DPI SETTINGS [texels]  and the same picture blurred by a
//   pitch beforehand
//
// SETTINGS are a job file's, such as {} or {"sampler":"blue"}. With `texels` the curve is applied to every
// texel, as it was before it held for the mean over a pitch.

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "config/cell_file.h"
#include "config/job_settings.h"
#include "daemon/pipeline/job_sampling.h"
#include "sampling/base/sha256.h"
#include "sampling/images/image_file.h"
#include "sampling/model/mesh_repair.h"
#include "sampling/model/model_file.h"
#include "sampling/model/placement.h"
#include "sim/film/fidelity.h"
#include "sim/film/picture_means.h"
#include "tests/bench/dither_pictures.h"
#include "tests/bench/process_usage.h"

namespace {

using namespace hilbrush;
using bench::Original;

constexpr double kSideM = .040;
constexpr int kFineTexels = 4096, kRepeatsInFine = 32;
constexpr std::array kRepeats{1, 3, 6, 12};

Texture texture_of(const Original& picture) {
  Texture texture{
      .width = picture.width, .height = picture.height, .luminance = {}, .opacity = {}, .name = ""};
  for (const float coverage : picture.coverage) texture.luminance.push_back(1 - coverage);
  return texture;
}

/// Bricks with black joints: mean coverage .18.
Original bricks() {
  return bench::picture_of("bricks", 128, 128, [](double u, double v) {
    constexpr double kJoint = 1 / 16., kCourses = 4, kBricks = 2;
    const double course = std::floor(v * kCourses), y = v * kCourses - course;
    const double along = u * kBricks + (std::fmod(course, 2) == 0 ? 0 : .5), x = along - std::floor(along);
    return y < 2 * kJoint || x < kJoint ? 1. : 0.;
  });
}

TexturedMesh square(const Original& picture, int repeats) {
  TexturedMesh mesh;
  mesh.vertices = {{0, 0, 0}, {kSideM, 0, 0}, {kSideM, 0, kSideM}, {0, 0, kSideM}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  const double n = repeats;
  mesh.corner_uv = {{Eigen::Vector2d(0, 0), {n, 0}, {n, n}}, {Eigen::Vector2d(0, 0), {n, n}, {0, n}}};
  mesh.corner_luminance.resize(2, {0.f, 0.f, 0.f});
  mesh.material_index = {0, 0};
  mesh.materials = {{.name = "square", .source = ColorSource::kTexture, .texture = 0}};
  mesh.textures.push_back(texture_of(picture));
  return mesh;
}

/// Painted less wanted coverage, on the mean over the surface: by points on a lattice of each triangle.
double mean_error(const Film& film, const ToneField& tone) {
  constexpr double kPoints = 4e5;
  const TexturedMesh& mesh = tone.mesh();
  const double area_m2 = mesh.area_m2();
  double sum = 0;
  for (std::uint32_t t = 0; t < mesh.triangle_count(); ++t) {
    const double own_m2 = mesh.area_vector(t).norm();
    const int n = std::max(1, static_cast<int>(std::sqrt(own_m2 / area_m2 * kPoints)));
    double of_triangle = 0;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        double u = (i + .5) / n, v = (j + .5) / n;
        if (u + v > 1) u = 1 - u, v = 1 - v;
        const SurfacePoint point{t, {1 - u - v, u, v}};
        of_triangle += film.painted(point) - tone.wanted(point);
      }
    sum += own_m2 * of_triangle / (static_cast<double>(n) * n);
  }
  return sum / area_m2;
}

void print_header() {
  std::printf("%-22s %3s %5s %8s %6s %6s %8s %8s %7s %7s %7s %6s  %s\n", "picture", "n", "dpi", "dots", "F1",
              "F2", "tone rms", "tone max", "error", "field s", "dots s", "MB", "answer");
}

void paint(const std::string& name, int repeats, const TexturedMesh& mesh, const JobSettings& settings,
           bool is_by_texel) {
  static const CellDescription cell = load_cell(find_cell("default"));
  ToneOptions options = job_tone(cell, settings, mesh).options;
  options.untextured = Untextured::kMaterial;
  if (is_by_texel) options.pitch_m = 0;
  const double begin = cpu_s();
  const ToneField tone(mesh, options);
  const double made = cpu_s();
  const SurfaceCurve curve(mesh);
  const double walked = cpu_s();
  const DotSequence dots =
      place_picture(curve, tone, options, picture_options(cell, settings), film_predictor(cell, tone));
  const double placed = cpu_s();
  Sha256 hash;
  for (const Dot& dot : dots.dots)
    hash.update(std::span(reinterpret_cast<const std::uint8_t*>(dot.position_O.data()), 3 * sizeof(double)));
  Film film(mesh, cell, dots.pitch_m);
  expose_dots(film, dots);
  const FidelityFigures f = measure_fidelity(film, tone, {}, 1).whole;
  std::printf("%-22s %3d %5.0f %8zu %6.2f %6.2f %8.4f %8.4f %7.4f %7.2f %7.2f %6.0f  %s\n", name.c_str(),
              repeats, .0254 / dots.pitch_m, dots.dots.size(), f.f1_db, f.f2_db, f.tone_rms, f.tone_max,
              mean_error(film, tone), made - begin, placed - walked, peak_mb(),
              hash.hex_digest().substr(0, 16).c_str());
  std::fflush(stdout);
}

void paint_squares(const JobSettings& settings, bool is_by_texel) {
  print_header();
  for (const Original& picture : {bricks(), bench::still_life(), bench::text()})
    for (const int repeats : kRepeats)
      paint(picture.name, repeats, square(picture, repeats), settings, is_by_texel);
}

/// The picture over and over, kFineTexels a side.
Original fine_picture(const Original& picture) {
  return bench::picture_of(picture.name, kFineTexels, kFineTexels, [&](double u, double v) {
    const double x = u * kRepeatsInFine, y = v * kRepeatsInFine;
    const auto column = static_cast<std::size_t>((x - std::floor(x)) * picture.width),
               row = static_cast<std::size_t>((y - std::floor(y)) * picture.height);
    return static_cast<double>(picture.coverage[row * static_cast<std::size_t>(picture.width) + column]);
  });
}

/// Means over squares of this many texels a side, twice: nearly a Gaussian of sigma .4 sides.
Original blurred(const Original& picture, double side) {
  Original result = picture;
  const int n = picture.width, reach = std::max(0, static_cast<int>(std::lround((side - 1) / 2)));
  for (int pass = 0; pass < 4; ++pass) {
    const Original from = result;
    const bool is_row = pass % 2 == 0;
    for (int line = 0; line < n; ++line) {
      const auto value = [&](int i) {
        const int k = ((i % n) + n) % n;
        return static_cast<double>(is_row ? from.coverage[static_cast<std::size_t>(line) * n + k]
                                          : from.coverage[static_cast<std::size_t>(k) * n + line]);
      };
      double sum = 0;
      for (int i = -reach; i <= reach; ++i) sum += value(i);
      for (int i = 0; i < n; ++i) {
        (is_row ? result.at(i, line) : result.at(line, i)) = static_cast<float>(sum / (2 * reach + 1));
        sum += value(i + reach + 1) - value(i - reach);
      }
    }
  }
  return result;
}

void give_texture(TexturedMesh& mesh, const Original& picture) {
  mesh.textures = {texture_of(picture)};
  mesh.materials = {{.name = "picture", .source = ColorSource::kTexture, .texture = 0}};
  std::fill(mesh.material_index.begin(), mesh.material_index.end(), 0);
}

/// Texels along a pitch, on the mean over the surface.
double texels_per_pitch(const TexturedMesh& mesh, double pitch_m) {
  double uv = 0;
  for (const auto& c : mesh.corner_uv) {
    const Eigen::Vector2d a = c[1] - c[0], b = c[2] - c[0];
    uv += .5 * std::abs(a.x() * b.y() - a.y() * b.x());
  }
  return pitch_m * kFineTexels * std::sqrt(uv / mesh.area_m2());
}

void paint_object(const std::string& file, double size_mm, const JobSettings& settings, bool is_by_texel) {
  PlacementOptions placement;
  placement.size_m = size_mm * 1e-3;
  TexturedMesh mesh = repair_mesh(place_on_table(load_model(file, load_image_file), placement)).mesh;
  print_header();
  paint("its own", 1, mesh, settings, is_by_texel);
  for (const Original& picture : {bricks(), bench::still_life()}) {
    const Original fine = fine_picture(picture);
    give_texture(mesh, fine);
    paint(picture.name, kRepeatsInFine, mesh, settings, is_by_texel);
    const double texels = texels_per_pitch(mesh, .0254 / *settings.dpi);
    give_texture(mesh, blurred(fine, texels));
    paint(picture.name + " blurred", kRepeatsInFine, mesh, settings, is_by_texel);
  }
}

int run(const std::vector<std::string>& arguments) {
  const auto settings_of = [](const std::string& json, const std::string& dpi) {
    JobSettings settings = job_settings_from_json(json);
    settings.dpi = std::atof(dpi.c_str());
    return settings;
  };
  const bool is_by_texel = !arguments.empty() && arguments.back() == "texels";
  if (arguments.size() >= 3 && arguments[0] == "square") {
    paint_squares(settings_of(arguments[2], arguments[1]), is_by_texel);
    return 0;
  }
  if (arguments.size() >= 5 && arguments[0] == "object") {
    paint_object(arguments[1], std::atof(arguments[2].c_str()), settings_of(arguments[4], arguments[3]),
                 is_by_texel);
    return 0;
  }
  std::fprintf(stderr,
               "usage: fine_texture_bench square DPI SETTINGS [texels]\n"
               "       fine_texture_bench object MODEL SIZE_MM DPI SETTINGS [texels]\n");
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "fine_texture_bench: %s\n", error.what());
    return 1;
  }
}
