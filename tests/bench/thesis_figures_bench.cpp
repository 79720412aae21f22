// Figures of the thesis as pictures (SVG): 5.13 to 5.20, 6.5 and 7.4; where they hold numbers, those are
// printed too.
//   thesis_figures_bench FOLDER [--powers L] [MESH...]
// Meshes are for figure 6.5, on sets of up to 1.5 * 2^L dots (default L: 17).
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "sampling/gaps/fill_holes.h"
#include "sampling/images/image_file.h"
#include "sampling/model/mesh_repair.h"
#include "sampling/model/model_file.h"
#include "sampling/model/placement.h"
#include "sampling/parametric/parametric.h"
#include "sampling/parametric/point_sets.h"
#include "sampling/place_dots.h"
#include "sampling/quality/plot.h"
#include "sampling/quality/quality.h"
#include "tests/bench/answer_hash.h"

namespace {

using namespace hilbrush;
using Eigen::Vector2d, Eigen::Vector3d;
namespace fs = std::filesystem;

struct Output {
  fs::path folder;
  AnswerHash hash;

  void write(const std::string& name, const std::string& svg) const {
    write_svg(svg, folder / name);
    std::printf("wrote %s, %zu KB\n", name.c_str(), svg.size() / 1024);
  }
};

ParametricOptions options_of(std::uint64_t count, ParametricDensity density,
                             Sampler sampler = Sampler::kJittered) {
  ParametricOptions options;
  options.dot_count = count;
  options.density = density;
  options.sampler = sampler;
  return options;
}

std::vector<Vector2d> plane_points(const ParametricOptions& options) {
  static const auto plane = make_surface(ParametricShape::kPlane);
  std::vector<Vector2d> points;
  for (const ParametricDot& dot : sample_parametric(*plane, options).dots) points.push_back(dot.uv);
  return points;
}

void figure_5_13(const Output& output) {
  constexpr double kRadius = .004;
  const std::array pictures{
      PointPicture{"uniform", plane_points(options_of(3000, ParametricDensity::kConstant)), kRadius, {}},
      PointPicture{"density u", plane_points(options_of(3000, ParametricDensity::kU)), kRadius, {}},
      PointPicture{"density u + v", plane_points(options_of(3000, ParametricDensity::kUPlusV)), kRadius, {}}};
  output.write("figure_5_13.svg", svg_of(pictures, "3,000 points in the unit square"));
}

/// A surface of table 5.5 and the direction of view.
struct View {
  ParametricShape shape;
  const char *name, *file;
  std::uint64_t count;
  double turn_deg, height_deg;
  bool is_closed;  ///< only what faces the reader is drawn
  bool is_half;    ///< only x >= 0 of the parameter u: the thesis's figure 5.16
};

class SurfaceFigure {
 public:
  explicit SurfaceFigure(const View& view) : view_(view), surface_(make_surface(view.shape)) {
    const auto turn = static_cast<double>(view.turn_deg * EIGEN_PI / 180);
    const auto height = static_cast<double>(view.height_deg * EIGEN_PI / 180);
    eye_ = {std::cos(height) * std::cos(turn), std::cos(height) * std::sin(turn), std::sin(height)};
  }

  void write(const Output& output) const {
    const std::array pictures{PointPicture{"parametric mesh", {}, 0, mesh_lines()},
                              PointPicture{"curve by curvature", {}, 0, curve_lines()},
                              dots("uniform", ParametricDensity::kConstant),
                              dots("by Gaussian curvature", ParametricDensity::kGaussianCurvature)};
    output.write(view_.file,
                 svg_of(pictures, std::string(view_.name) + ", " + std::to_string(view_.count) + " points"));
  }

 private:
  double first_u() const { return view_.is_half ? .5 : 0; }
  Vector2d on_page(const Vector3d& place) const { return project(place, view_.turn_deg, view_.height_deg); }

  /// Lines of constant u, then of constant v, in one stroke.
  std::vector<Vector2d> mesh_lines() const {
    constexpr int kLines = 24, kSteps = 96;
    std::vector<Vector2d> path;
    for (const bool along_v : {true, false})
      for (int line = 0; line <= kLines; ++line)
        for (int step = 0; step <= kSteps; ++step) {
          const double a = static_cast<double>(line) / kLines;
          const double b = static_cast<double>(line % 2 == 0 ? step : kSteps - step) / kSteps;
          const Vector2d uv = along_v ? Vector2d(a, b) : Vector2d(b, 1 - a);
          path.push_back(on_page(surface_->position({first_u() + (1 - first_u()) * uv.x(), uv.y()})));
        }
    return path;
  }

  std::vector<Vector2d> curve_lines() const {
    ParametricOptions options = options_of(view_.count / 4, ParametricDensity::kGaussianCurvature);
    options.minimum_depth = 4;
    options.omega = 1;
    std::vector<Vector2d> path;
    for (const Vector2d& uv : parametric_curve(*surface_, options))
      if (uv.x() >= first_u()) path.push_back(on_page(surface_->position(uv)));
    return path;
  }

  PointPicture dots(const char* title, ParametricDensity density) const {
    PointPicture picture{title, {}, 0, {}};
    Vector2d low = Vector2d::Constant(1e9), high = -low;
    for (const ParametricDot& dot : sample_parametric(*surface_, options_of(view_.count, density)).dots) {
      if (dot.uv.x() < first_u() || (view_.is_closed && dot.normal.dot(eye_) < 0)) continue;
      picture.points.push_back(on_page(dot.position));
      low = low.cwiseMin(picture.points.back());
      high = high.cwiseMax(picture.points.back());
    }
    picture.radius = .0035 * (high - low).maxCoeff();
    return picture;
  }

  View view_;
  std::unique_ptr<ParametricSurface> surface_;
  Vector3d eye_;
};

/// Figures 5.17 to 5.20: 50,000 points; ten sets where they are random.
void figure_of_spectrum(Output& output, const std::string& file, const std::string& title, int set_count,
                        const std::function<std::vector<Vector2d>(std::uint64_t seed)>& make) {
  std::vector<Spectrum> spectra;
  for (int seed = 1; seed <= set_count; ++seed)
    spectra.push_back(plane_spectrum(make(static_cast<std::uint64_t>(seed))));
  const Spectrum mean = average(spectra);
  std::printf("%-28s below half %.4f, below a quarter %.4f, highest %.2f, anisotropy %.2f\n", title.c_str(),
              mean.below_half, mean.below_quarter, mean.peak, mean.anisotropy);
  for (const double figure : {mean.below_half, mean.below_quarter, mean.peak, mean.anisotropy})
    output.hash.take(figure);
  Plot plot{"Radially averaged power spectrum: " + title,
            "frequency over the principal frequency sqrt(N)",
            "power",
            false,
            false,
            0.,
            std::max(2., std::min(mean.peak * 1.05, 6.)),
            {{"", {}, PlotSeries::Style::kLine}}};
  for (const Spectrum::Ring& ring : mean.rings)
    plot.series[0].points.emplace_back(ring.frequency, ring.power);
  output.write(file, svg_of(plot));
}

void figures_of_spectra(Output& output) {
  constexpr std::uint64_t kCount = 50'000;
  const auto on_curve = [](Sampler sampler) {
    return [sampler](std::uint64_t seed) {
      ParametricOptions options = options_of(kCount, ParametricDensity::kConstant, sampler);
      options.seed = seed;
      return plane_points(options);
    };
  };
  const auto rival = [](PlaneSet set) {
    return [set](std::uint64_t seed) { return plane_set(set, kCount, seed); };
  };
  figure_of_spectrum(output, "figure_5_17.svg", "random", 10, rival(PlaneSet::kRandom));
  figure_of_spectrum(output, "figure_5_18.svg", "Hilbert, jittered", 10, on_curve(Sampler::kJittered));
  figure_of_spectrum(output, "figure_5_19.svg", "Niederreiter", 1, rival(PlaneSet::kNiederreiter));
  figure_of_spectrum(output, "figure_5_20.svg", "Hammersley", 1, rival(PlaneSet::kHammersley));
  figure_of_spectrum(output, "figure_5_18_centroid.svg", "Hilbert, centroid", 1,
                     on_curve(Sampler::kCentroid));
}

/// A black surface and its curve, which keep references to each other and never move.
struct BlackSurface {
  explicit BlackSurface(TexturedMesh surface) : mesh(std::move(surface)), tone(mesh, {}), curve(mesh) {}
  TexturedMesh mesh;
  ToneField tone;
  SurfaceCurve curve;

  DotSequence place(std::uint64_t count, Sampler sampler) const {
    SampleOptions options;
    options.dot_count = count;
    options.sampler = sampler;
    options.seed = count;
    return place_dots(curve, tone, options);
  }
};

TexturedMesh black(TexturedMesh mesh) {
  for (auto& luminance : mesh.corner_luminance) luminance = {0, 0, 0};
  for (Material& material : mesh.materials)
    material = {material.name, ColorSource::kColors, -1, true, true, 1};
  return mesh;
}

void figure_6_5(Output& output, const std::vector<std::string>& files, int powers) {
  Plot plot{"Discrepancy by sets of whole triangles", "dots", "largest error", true, true, {}, {}, {}};
  PlotSeries control{"random", {}, PlotSeries::Style::kLine};
  for (const std::string& file : files) {
    PlacementOptions placement;
    placement.size_m = .1;
    const BlackSurface surface(
        black(repair_mesh(place_on_table(load_model(file, load_image_file), placement)).mesh));
    const SurfaceQuality quality(surface.mesh);
    for (const Sampler sampler : {Sampler::kJittered, Sampler::kRandom}) {
      if (sampler == Sampler::kRandom && !control.points.empty())
        continue;  // alike on every mesh: shown once
      std::vector<DotSequence> sequences;
      for (int l = 1; l <= powers; ++l)
        for (const std::uint64_t count : {std::uint64_t{2} << (l - 1), std::uint64_t{3} << (l - 1)})
          sequences.push_back(surface.place(count, sampler));
      std::vector<std::span<const Dot>> sets;
      for (const DotSequence& sequence : sequences) sets.emplace_back(sequence.dots);
      PlotSeries series{fs::path(file).stem().string(), {}, PlotSeries::Style::kLine};
      const auto found = quality.triangle_sets(sets);
      for (std::size_t i = 0; i < sets.size(); ++i) {
        series.points.emplace_back(static_cast<double>(sets[i].size()), found[i].largest);
        output.hash.take(found[i].largest);
      }
      (sampler == Sampler::kRandom ? control.points : plot.series.emplace_back(series).points) =
          series.points;
    }
  }
  plot.series.push_back(control);
  output.write("figure_6_5.svg", svg_of(plot));
}

TexturedMesh unit_square() {
  TexturedMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.corner_uv.resize(2, {Vector2d::Zero(), Vector2d::Zero(), Vector2d::Zero()});
  mesh.corner_luminance.resize(2, {0, 0, 0});
  mesh.material_index.resize(2, 0);
  mesh.materials.resize(1);
  return mesh;
}

std::vector<Vector2d> flat(const DotSequence& sequence) {
  std::vector<Vector2d> points;
  for (const Dot& dot : sequence.dots) points.emplace_back(dot.position_O.head<2>());
  return points;
}

/// Share of the square that no splat covers, on a grid of a million places.
double uncovered(const std::vector<Vector2d>& points, double radius) {
  constexpr int kSide = 1000;
  std::vector<bool> covered(static_cast<std::size_t>(kSide) * kSide, false);
  for (const Vector2d& p : points) {
    const auto low = [&](double x) { return std::max(0, static_cast<int>((x - radius) * kSide)); };
    const auto high = [&](double x) { return std::min(kSide - 1, static_cast<int>((x + radius) * kSide)); };
    for (int j = low(p.y()); j <= high(p.y()); ++j)
      for (int i = low(p.x()); i <= high(p.x()); ++i)
        if ((Vector2d(i + .5, j + .5) / kSide - p).norm() <= radius)
          covered[static_cast<std::size_t>(j) * kSide + static_cast<std::size_t>(i)] = true;
  }
  return static_cast<double>(std::count(covered.begin(), covered.end(), false)) / (double{kSide} * kSide);
}

/// 3,000 splats by three methods, and 2,000 with holes filled that a splat would not cover.
void figure_7_4(Output& output) {
  constexpr double kRadius = .02;
  const BlackSurface square(unit_square());
  DotSequence filled = square.place(2000, Sampler::kJittered);
  filled = fill_holes(square.curve, square.tone, std::move(filled), kRadius / filled.pitch_m);
  const std::array pictures{
      PointPicture{"(a) 3,000 random", plane_set(PlaneSet::kRandom, 3000, 1), kRadius, {}},
      PointPicture{"(b) 3,000 Niederreiter", plane_set(PlaneSet::kNiederreiter, 3000, 1), kRadius, {}},
      PointPicture{"(c) 3,000 Hilbert, jittered", flat(square.place(3000, Sampler::kJittered)), kRadius, {}},
      PointPicture{
          "(d) " + std::to_string(filled.dots.size()) + " with holes filled", flat(filled), kRadius, {}}};
  for (const PointPicture& picture : pictures) {
    const double bare = uncovered(picture.points, kRadius);
    std::printf("figure 7.4 %-32s %5zu dots leave %.3f %% bare\n", picture.title.c_str(),
                picture.points.size(), 100 * bare);
    output.hash.take(bare);
  }
  output.write("figure_7_4.svg", svg_of(pictures, "Splats of radius 0.02"));
}

void run(Output& output, const std::vector<std::string>& meshes, int powers) {
  fs::create_directories(output.folder);
  figure_5_13(output);
  for (const View& view :
       {View{ParametricShape::kMonkeySaddle, "Monkey saddle", "figure_5_14.svg", 3000, 30, 40, false, false},
        View{ParametricShape::kEightSurface, "Eight surface", "figure_5_15.svg", 10'000, 20, 15, true, false},
        View{ParametricShape::kWhitneyUmbrella, "Whitney umbrella", "figure_5_16.svg", 6000, 60, 25, false,
             true}})
    SurfaceFigure(view).write(output);
  figures_of_spectra(output);
  figure_7_4(output);
  if (!meshes.empty()) figure_6_5(output, meshes, powers);
  std::printf("answer %016llx\n", output.hash.value());
}

}  // namespace

int main(int argc, char** argv) {
  Output output;
  int powers = 17;
  std::vector<std::string> meshes;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "--powers" && i + 1 < argc)
      powers = std::atoi(argv[++i]);
    else if (output.folder.empty())
      output.folder = argument;
    else
      meshes.push_back(argument);
  }
  if (output.folder.empty() || powers < 1 || powers > 22) {
    std::fprintf(stderr, "usage: thesis_figures_bench FOLDER [--powers 1..22] [MESH...]\n");
    return 2;
  }
  try {
    run(output, meshes, powers);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "thesis_figures_bench: %s\n", error.what());
    return 1;
  }
  return 0;
}
