// Painted pictures: the fidelity F1 and F2 of simulated films.
//
//   painted_bench table MODEL SIZE_MM DPI...                 the fidelity of each method of placing dots
//   painted_bench figures EGGCUP FOLDER                      figures 7.11 and 7.13 to 7.16 of the thesis:
//   laminar
//                                                            slices beside our dots
//   painted_bench run MODEL SIZE_MM DPI [loop|plain]         one run, with its time and memory
//
// Dots are exposed at normal incidence by a perfect cell; RESULTS.md has dry runs with the default cell.
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "config/cell_file.h"
#include "config/job_settings.h"
#include "sampling/base/sha256.h"
#include "sampling/images/image_file.h"
#include "sampling/model/mesh_repair.h"
#include "sampling/model/model_file.h"
#include "sampling/model/placement.h"
#include "sampling/place_picture.h"
#include "sampling/tone/levels.h"
#include "sim/film/fidelity.h"
#include "sim/film/orthographic_view.h"
#include "sim/film/picture_means.h"
#include "tests/bench/process_usage.h"

namespace {

using namespace hilbrush;

/// A method of placing dots, as settings of a job.
struct Way {
  const char* name;
  const char* settings;
};

constexpr std::array kWays{Way{"random", R"({"sampler":"random"})"},
                           Way{"jittered (thesis)", R"({"sampler":"jittered"})"},
                           Way{"centroid", R"({})"},
                           Way{"centroid + loop", R"({"predictive_rounds":2})"},
                           Way{"fine", R"({"sampler":"fine"})"},
                           Way{"three levels", R"({"levels":3})"},
                           Way{"laminar", R"({"curve":"laminar"})"}};

/// A mesh with its curve and cell; `place` does the same as a job's pipeline.
class Workpiece {
 public:
  Workpiece(TexturedMesh mesh, CellDescription cell)
      : mesh_(std::move(mesh)), cell_(std::move(cell)), curve_(mesh_) {}

  struct Painted {
    std::size_t dot_count = 0;
    Fidelity fidelity;
    std::string answer;
    double cpu = 0;
    std::optional<ToneField> tone;
    std::optional<Film> film;
  };

  Painted paint(const Way& way, double dpi) const {
    JobSettings settings = job_settings_from_json(way.settings);
    settings.dpi = dpi;
    const double pitch_m = .0254 / dpi;
    const std::string sampler =
        settings.sampler == Sampler::kFine ? "centroid" : sampler_name(settings.sampler);
    CellTone tone = cell_tone(cell_, {.sampler = sampler,
                                      .curve = curve_name(settings.curve),
                                      .levels = settings.levels,
                                      .spot_pitches = spot_diameter_m(cell_, pitch_m) / pitch_m});
    if (!tone.warning.empty()) std::fprintf(stderr, "painted_bench: %s\n", tone.warning.c_str());
    tone.options.untextured = Untextured::kMaterial;
    tone.options.pitch_m = pitch_m;

    Painted painted;
    painted.tone.emplace(mesh_, tone.options);
    PictureOptions picture;
    picture.sample = sample_options(settings);
    picture.curve = settings.curve;
    picture.levels = energy_levels(settings.levels, cell_.paint.asked_max);
    picture.predictive_rounds = settings.predictive_rounds;
    picture.spot = [this](double pitch) -> SpotModel {
      return {spot_diameter_m(cell_, pitch) / 2,
              [response = cell_.paint.response](double dose) { return painted_coverage(response, dose); }};
    };
    const double begin = cpu_s();
    const DotSequence dots =
        place_picture(curve_, *painted.tone, tone.options, picture, film_predictor(cell_, *painted.tone));
    painted.cpu = cpu_s() - begin;
    painted.dot_count = dots.dots.size();
    Sha256 hash;
    for (const Dot& dot : dots.dots)
      hash.update(
          std::span(reinterpret_cast<const std::uint8_t*>(dot.position_O.data()), 3 * sizeof(double)));
    painted.answer = hash.hex_digest().substr(0, 16);
    painted.film.emplace(mesh_, cell_, dots.pitch_m);
    expose_dots(*painted.film, dots);
    painted.fidelity = measure_fidelity(*painted.film, *painted.tone, {}, 1);
    return painted;
  }

 private:
  TexturedMesh mesh_;
  CellDescription cell_;
  SurfaceCurve curve_;
};

void print_header() {
  std::printf("%-28s %6s %9s %6s %6s %6s %8s %8s %7s %7s  %s\n", "what", "dpi", "dots", "F1", "F2", "S2",
              "tone rms", "tone max", "CPU s", "MB", "answer");
}

void print(const std::string& what, double dpi, const Workpiece::Painted& painted) {
  const FidelityFigures& f = painted.fidelity.whole;
  std::printf("%-28s %6.0f %9zu %6.2f %6.2f %6.3f %8.4f %8.4f %7.1f %7.0f  %s\n", what.c_str(), dpi,
              painted.dot_count, f.f1_db, f.f2_db, f.s2, f.tone_rms, f.tone_max, painted.cpu, peak_mb(),
              painted.answer.c_str());
  std::fflush(stdout);
}

TexturedMesh load(const std::string& file, double size_mm) {
  PlacementOptions placement;
  placement.size_m = size_mm * 1e-3;
  return repair_mesh(place_on_table(load_model(file, load_image_file), placement)).mesh;
}

/// An upright card with a texture over all of it: what stood before the laser in figure 7.15.
TexturedMesh card(double width_m, double height_m, Texture texture) {
  TexturedMesh mesh;
  mesh.vertices = {{0, 0, 0}, {width_m, 0, 0}, {width_m, 0, height_m}, {0, 0, height_m}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.corner_uv = {{Eigen::Vector2d(0, 0), {1, 0}, {1, 1}}, {Eigen::Vector2d(0, 0), {1, 1}, {0, 1}}};
  mesh.corner_luminance.resize(2, {0.f, 0.f, 0.f});
  mesh.material_index = {0, 0};
  mesh.materials = {
      {.name = "card", .source = ColorSource::kTexture, .texture = 0, .repeat_u = false, .repeat_v = false}};
  mesh.textures.push_back(std::move(texture));
  return mesh;
}

Texture texture_of(int width, int height, const std::function<double(double, double)>& coverage) {
  Texture texture{.width = width, .height = height, .luminance = {}, .opacity = {}, .name = "drawn"};
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i)
      texture.luminance.push_back(static_cast<float>(1 - coverage((i + .5) / width, (j + .5) / height)));
  return texture;
}

/// Ten fields from light to dark (figure 7.15).
TexturedMesh gray_wedge() {
  return card(.100, .020,
              texture_of(1000, 200, [](double u, double) { return std::floor(u * 10) / 10 + .05; }));
}

/// A slight gradient with a picture in the middle (figure 7.13): here rings.
TexturedMesh gradient_with_rings() {
  return card(.040, .040, texture_of(512, 512, [](double u, double v) {
                const double r = std::hypot(u - .5, v - .5);
                return r < .3 ? .5 + .5 * std::cos(r * 80) : .45 - .3 * u;
              }));
}

/// The cup's own surface under another tone: even (figures 7.11 and 7.14), or horizontal bands as wide as the
/// gaps between them (figure 7.16).
TexturedMesh cup_with(const TexturedMesh& cup, const std::function<double(double)>& coverage_of_height) {
  TexturedMesh mesh = cup;
  double low = 1, high = -1;
  for (const auto& vertex : mesh.vertices) low = std::min(low, vertex.z()), high = std::max(high, vertex.z());
  mesh.textures = {
      texture_of(4, 2048, [&](double, double v) { return coverage_of_height(low + v * (high - low)); })};
  mesh.materials = {
      {.name = "bands", .source = ColorSource::kTexture, .texture = 0, .repeat_u = false, .repeat_v = false}};
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
    mesh.material_index[t] = 0;
    for (int c = 0; c < 3; ++c)
      mesh.corner_uv[t][static_cast<std::size_t>(c)] = {.5, (mesh.corner(t, c).z() - low) / (high - low)};
  }
  return mesh;
}

/// What the paint shows, as one view from the front sees it.
Picture photograph(const Film& film, double pixel_m) {
  const OrthographicView view(film.mesh(), {"front", Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitZ()},
                              pixel_m);
  Picture picture{view.width(), view.height(), 1, {}};
  std::vector<OrthographicView::Pixel> row;
  for (int y = 0; y < view.height(); ++y) {
    view.read_row(y, row);
    for (int x = 0; x < view.width(); ++x) {
      double reflectance = .8;  // behind the object
      if (row[static_cast<std::size_t>(x)].side == OrthographicView::Side::kFront)
        reflectance = 1 - film.painted(row[static_cast<std::size_t>(x)].point);
      picture.pixels.push_back(static_cast<std::uint8_t>(std::lround(255 * std::pow(reflectance, 1 / 2.2))));
    }
  }
  return picture;
}

/// Laminar slices left, ours right.
Picture beside(const Picture& left, const Picture& right) {
  constexpr int kGap = 8;
  Picture both{left.width + kGap + right.width, std::max(left.height, right.height), 1, {}};
  both.pixels.assign(static_cast<std::size_t>(both.width) * static_cast<std::size_t>(both.height), 255);
  const auto put = [&](const Picture& picture, int at) {
    for (int y = 0; y < picture.height; ++y)
      std::copy_n(picture.pixels.begin() + static_cast<std::ptrdiff_t>(y) * picture.width, picture.width,
                  both.pixels.begin() + static_cast<std::ptrdiff_t>(y) * both.width + at);
  };
  put(left, 0), put(right, left.width + kGap);
  return both;
}

void paint_figure(const std::string& name, const TexturedMesh& mesh, double dpi, const CellDescription& cell,
                  const std::filesystem::path& folder) {
  const Workpiece piece(mesh, cell);
  const double pixel_m = std::max(.0254 / dpi / 4, .1e-3);
  std::vector<Picture> pictures;
  for (const Way& way : {Way{"laminar", R"({"curve":"laminar"})"}, Way{"ours", "{}"}}) {
    const Workpiece::Painted painted = piece.paint(way, dpi);
    print(name + " " + way.name, dpi, painted);
    pictures.push_back(photograph(*painted.film, pixel_m));
  }
  save_png(beside(pictures[0], pictures[1]), folder / (name + ".png"));
}

void paint_figures(const std::string& eggcup, const std::filesystem::path& folder,
                   const CellDescription& cell) {
  std::filesystem::create_directories(folder);
  const TexturedMesh cup = load(eggcup, 60);
  const auto stripes = [](double z) { return std::fmod(z, .004) < .002 ? .9 : .0; };
  print_header();
  paint_figure("7.11_even_cup", cup_with(cup, [](double) { return .3; }), 50, cell, folder);
  paint_figure("7.13_gradient", gradient_with_rings(), 100, cell, folder);
  paint_figure("7.14_picture_cup", cup, 100, cell, folder);
  paint_figure("7.15_gray_wedge", gray_wedge(), 50, cell, folder);
  paint_figure("7.16_striped_cup_50", cup_with(cup, stripes), 50, cell, folder);
  paint_figure("7.16_striped_cup_100", cup_with(cup, stripes), 100, cell, folder);
}

void print_table(const std::string& model, double size_mm, const std::vector<double>& dpis,
                 const CellDescription& cell) {
  const Workpiece piece(load(model, size_mm), cell);
  print_header();
  for (const double dpi : dpis)
    for (const Way& way : kWays) print(way.name, dpi, piece.paint(way, dpi));
}

int run(const std::vector<std::string>& arguments) {
  const CellDescription cell = load_cell(find_cell("default"));
  if (arguments.size() >= 4 && arguments[0] == "table") {
    std::vector<double> dpis;
    for (std::size_t i = 3; i < arguments.size(); ++i) dpis.push_back(std::atof(arguments[i].c_str()));
    print_table(arguments[1], std::atof(arguments[2].c_str()), dpis, cell);
    return 0;
  }
  if (arguments.size() == 3 && arguments[0] == "figures") {
    paint_figures(arguments[1], arguments[2], cell);
    return 0;
  }
  if (arguments.size() >= 4 && arguments[0] == "run") {
    const Workpiece piece(load(arguments[1], std::atof(arguments[2].c_str())), cell);
    const bool has_loop = arguments.size() < 5 || arguments[4] == "loop";
    const double dpi = std::atof(arguments[3].c_str());
    print_header();
    print(kWays[has_loop ? 3 : 2].name, dpi, piece.paint(kWays[has_loop ? 3 : 2], dpi));
    return 0;
  }
  std::fprintf(stderr,
               "usage: painted_bench table MODEL SIZE_MM DPI...\n       painted_bench figures EGGCUP FOLDER\n"
               "       painted_bench run MODEL SIZE_MM DPI [loop|plain]\n");
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "painted_bench: %s\n", error.what());
    return 1;
  }
}
