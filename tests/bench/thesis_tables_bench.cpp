// The thesis's discrepancy slopes beside our own: tables 5.1, 5.2, 5.3, 5.4 and, with meshes given, 6.1.
//   thesis_tables_bench [--powers L] [--out FOLDER] [MESH...]
// Sets of 2^l and 2^l + 2^(l-1) points, l = 1..L (default 20: up to 1,572,864), 1000 test shapes each, as
// sections 5.1.1 and 6.2.1 say. The thesis's slopes are of the largest error; those of the rms error, which
// are steadier, are printed beside them. Prints a hash of all figures at the end. With --out, plots of all
// sets (figures 5.2 to 5.7, 5.9 to 5.12 and 6.5) are written into the folder.
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

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

constexpr double kNone = 0;  ///< the thesis has no figure

struct Run {
  std::vector<std::uint64_t> sizes;
  std::filesystem::path out;  ///< empty: no plots
  AnswerHash hash;
};

/// One measure of one method at all sizes.
struct Curve {
  std::string name;
  double of_thesis = kNone;  ///< slope
  std::vector<double> counts;
  std::vector<Discrepancy> values;

  void take(std::size_t count, const Discrepancy& value) {
    counts.push_back(static_cast<double>(count));
    values.push_back(value);
  }
  double slope(double Discrepancy::*figure) const {
    std::vector<double> figures;
    for (const Discrepancy& value : values) figures.push_back(value.*figure);
    return log_log_slope(counts, figures);
  }
};

void print_head(const char* title) {
  std::printf("\n%s\n%-38s %8s %8s %8s %8s %12s\n", title, "", "thesis", "here", "off by", "rms",
              "rms at 49152");
}

void print_and_plot(Run& run, const std::string& title, const std::string& file,
                    const std::vector<Curve>& curves) {
  Plot plot{title, "points", "largest error of 1000 test shapes", true, true, {}, {}, {}};
  for (const Curve& curve : curves) {
    const double slope = curve.slope(&Discrepancy::largest);
    run.hash.take(slope);
    double at_48k = 0;
    PlotSeries series{curve.name, {}, PlotSeries::Style::kLine};
    for (std::size_t i = 0; i < curve.values.size(); ++i) {
      run.hash.take(curve.values[i].rms);
      series.points.emplace_back(curve.counts[i], curve.values[i].largest);
      if (at_48k == 0 && curve.counts[i] >= 49152) at_48k = curve.values[i].rms;
    }
    plot.series.push_back(std::move(series));
    if (curve.of_thesis == kNone)
      std::printf("%-38s %8s %8.2f %8s %8.2f %12.2e\n", curve.name.c_str(), "-", slope, "-",
                  curve.slope(&Discrepancy::rms), at_48k);
    else
      std::printf("%-38s %8.2f %8.2f %8.2f %8.2f %12.2e\n", curve.name.c_str(), curve.of_thesis, slope,
                  slope - curve.of_thesis, curve.slope(&Discrepancy::rms), at_48k);
  }
  std::fflush(stdout);
  if (!run.out.empty()) write_svg(svg_of(plot), run.out / file);
}

/// A method of making point sets in the plane, and the thesis's slopes by rectangles, quarter circles,
/// triangles.
struct PlaneMethod {
  std::string name;
  std::function<std::vector<Vector2d>(std::uint64_t count)> make;
  std::array<double, 3> of_thesis{};
};

/// Dots on a surface by one method; the count is also the seed.
std::vector<ParametricDot> dots_on(ParametricShape shape, ParametricOptions options, std::uint64_t count) {
  options.dot_count = options.seed = count;
  return sample_parametric(*make_surface(shape), options).dots;
}

PlaneMethod on_curve(const std::string& name, CurveKind curve, Sampler sampler,
                     std::array<double, 3> of_thesis = {}) {
  return {name,
          [=](std::uint64_t count) {
            ParametricOptions options;
            options.curve = curve;
            options.sampler = sampler;
            std::vector<Vector2d> points;
            for (const auto& dot : dots_on(ParametricShape::kPlane, options, count)) points.push_back(dot.uv);
            return points;
          },
          of_thesis};
}

PlaneMethod plane_rival(const std::string& name, PlaneSet kind, std::array<double, 3> of_thesis) {
  return {name, [kind](std::uint64_t count) { return plane_set(kind, count, count); }, of_thesis};
}

void plane_table(Run& run, const char* title, const std::string& file,
                 const std::vector<PlaneMethod>& methods) {
  constexpr std::array<const char*, 3> kShapes{"rectangles", "quarter circles", "triangles"};
  std::array<std::vector<Curve>, 3> curves;
  for (const PlaneMethod& method : methods) {
    for (std::size_t s = 0; s < 3; ++s)
      curves[s].push_back({method.name + ", " + kShapes[s], method.of_thesis[s], {}, {}});
    for (const std::uint64_t size : run.sizes) {
      const std::vector<Vector2d> points = method.make(size);
      const auto found = plane_discrepancies(points, {1000, size});
      for (std::size_t s = 0; s < 3; ++s) curves[s].back().take(points.size(), found[s]);
    }
  }
  print_head(title);
  for (std::size_t s = 0; s < 3; ++s)
    print_and_plot(run, std::string(title) + ", " + kShapes[s], file + "_" + std::to_string(s) + ".svg",
                   curves[s]);
}

void table_of_curve(Run& run, CurveKind curve, const char* title, const std::string& file,
                    const std::array<std::array<double, 3>, 4>& of_thesis) {
  plane_table(run, title, file,
              {on_curve("random", curve, Sampler::kRandom, of_thesis[0]),
               on_curve("even", curve, Sampler::kEven, of_thesis[1]),
               on_curve("low (halton)", curve, Sampler::kHalton, of_thesis[2]),
               on_curve("low (hammersley)", curve, Sampler::kHammersley, of_thesis[2]),
               on_curve("low (sobol)", curve, Sampler::kSobol, of_thesis[2]),
               on_curve("low (niederreiter)", curve, Sampler::kNiederreiter, of_thesis[2]),
               on_curve("jittered", curve, Sampler::kJittered, of_thesis[3]),
               on_curve("centroid", curve, Sampler::kCentroid)});
}

void table_of_rivals(Run& run) {
  plane_table(run, "Table 5.3: in the plane", "table_5_3",
              {plane_rival("2D random", PlaneSet::kRandom, {-.49, -.50, -.49}),
               plane_rival("Sobol", PlaneSet::kSobol, {-.90, -.70, -.58}),
               plane_rival("Niederreiter", PlaneSet::kNiederreiter, {-.90, -.69, -.57}),
               plane_rival("Hammersley", PlaneSet::kHammersley, {-.89, -.71, -.57}),
               plane_rival("Halton", PlaneSet::kHalton, {-.89, -.72, -.59}),
               plane_rival("2D jittered", PlaneSet::kJittered, {-.75, -.74, -.72}),
               on_curve("Hilbert jittered", CurveKind::kHilbert, Sampler::kJittered, {-.73, -.73, -.72})});
}

struct SphereMethod {
  std::string name;
  std::function<std::vector<Vector3d>(std::uint64_t count)> make;
  double of_thesis;
};

SphereMethod sphere_rival(const std::string& name, PlaneSet kind, double of_thesis) {
  return {name, [kind](std::uint64_t count) { return sphere_set(kind, count, count); }, of_thesis};
}

SphereMethod sphere_curve(const std::string& name, AreaMethod area, Sampler sampler, double of_thesis) {
  return {name,
          [=](std::uint64_t count) {
            ParametricOptions options;
            options.area = area;
            options.sampler = sampler;
            std::vector<Vector3d> points;
            for (const auto& dot : dots_on(ParametricShape::kSphere, options, count))
              points.push_back(dot.position);
            return points;
          },
          of_thesis};
}

void table_of_sphere(Run& run) {
  const std::vector<SphereMethod> methods{
      sphere_rival("random", PlaneSet::kRandom, -.49),
      sphere_rival("Niederreiter", PlaneSet::kNiederreiter, -.74),
      sphere_rival("Hammersley", PlaneSet::kHammersley, -.75),
      sphere_curve("Hilbert jittered, (c) fff", AreaMethod::kFirstFundamentalForm, Sampler::kJittered, -.73),
      sphere_curve("Hilbert jittered, (a) triangle", AreaMethod::kTriangle, Sampler::kJittered, -.71),
      sphere_curve("Hilbert jittered, (b) square", AreaMethod::kSquare, Sampler::kJittered, kNone),
      sphere_curve("Hilbert centroid, (c) fff", AreaMethod::kFirstFundamentalForm, Sampler::kCentroid,
                   kNone)};
  std::vector<Curve> curves;
  for (const SphereMethod& method : methods) {
    curves.push_back({method.name, method.of_thesis, {}, {}});
    for (const std::uint64_t size : run.sizes) {
      const std::vector<Vector3d> points = method.make(size);
      curves.back().take(points.size(), sphere_discrepancy(points, {1000, size}));
    }
  }
  print_head("Table 5.4: on the sphere, spherical triangles");
  print_and_plot(run, "Table 5.4: on the sphere", "table_5_4.svg", curves);
}

/// The thesis's control: as many dots on each triangle as its share of the area rounds to, anywhere on it;
/// and plain random dots on the same surface.
void mesh_table(Run& run, const std::string& file, double of_thesis) {
  PlacementOptions placement;
  placement.size_m = .08;
  const RepairedMesh repaired = repair_mesh(place_on_table(load_model(file, load_image_file), placement));
  TexturedMesh mesh = repaired.mesh;  // all black: constant density
  for (auto& luminance : mesh.corner_luminance) luminance = {0, 0, 0};
  for (auto& material : mesh.materials) material = {"", ColorSource::kColors, -1, true, true, 1};
  const ToneField tone(mesh, {});
  const SurfaceCurve curve(mesh);
  const SurfaceQuality quality(mesh);
  const std::string name = std::filesystem::path(file).stem().string();
  std::vector<Curve> sets, balls;
  for (const auto& [sampler, label] :
       {std::pair{Sampler::kJittered, "jittered"}, std::pair{Sampler::kCentroid, "centroid"},
        std::pair{Sampler::kRandom, "random"}}) {
    const double thesis = sampler == Sampler::kJittered ? of_thesis
                          : sampler == Sampler::kRandom ? -.50
                                                        : kNone;
    sets.push_back({std::string(label) + ", triangle sets", thesis, {}, {}});
    balls.push_back({std::string(label) + ", balls", thesis, {}, {}});
    std::vector<DotSequence> sequences;
    for (const std::uint64_t size : run.sizes) {
      SampleOptions options;
      options.dot_count = size;
      options.sampler = sampler;
      options.seed = size;
      sequences.push_back(place_dots(curve, tone, options));
    }
    std::vector<std::span<const Dot>> spans;
    for (const DotSequence& sequence : sequences) spans.emplace_back(sequence.dots);
    const auto by_sets = quality.triangle_sets(spans), by_balls = quality.balls(spans);
    for (std::size_t i = 0; i < spans.size(); ++i) {
      sets.back().take(spans[i].size(), by_sets[i]);
      balls.back().take(spans[i].size(), by_balls[i]);
    }
  }
  print_head(("Table 6.1: " + name + ", " + std::to_string(mesh.triangle_count()) + " triangles").c_str());
  print_and_plot(run, "Triangle sets on " + name, "table_6_1_" + name + ".svg", sets);
  print_and_plot(run, "Balls on " + name, "table_6_1_" + name + "_balls.svg", balls);
}

void run_all(Run& run, const std::vector<std::string>& meshes) {
  table_of_curve(run, CurveKind::kHilbert, "Table 5.1: Hilbert curve", "table_5_1",
                 {{{-.51, -.49, -.51}, {-.51, -.70, -.57}, {-.51, -.71, -.57}, {-.73, -.73, -.72}}});
  table_of_curve(run, CurveKind::kPeano2, "Table 5.2: Peano II curve", "table_5_2",
                 {{{-.50, -.49, -.50}, {-.71, -.71, -.70}, {-.72, -.70, -.69}, {-.70, -.70, -.70}}});
  table_of_rivals(run);
  table_of_sphere(run);
  // The thesis's four meshes are not ours; its slopes stand beside ours in its order.
  constexpr std::array kOfThesis{-.70, -.74, -.73, -.73};
  for (std::size_t i = 0; i < meshes.size(); ++i) mesh_table(run, meshes[i], kOfThesis[i % kOfThesis.size()]);
}

}  // namespace

int main(int argc, char** argv) {
  Run run;
  int powers = 20;
  std::vector<std::string> meshes;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "--powers" && i + 1 < argc)
      powers = std::atoi(argv[++i]);
    else if (argument == "--out" && i + 1 < argc)
      run.out = argv[++i];
    else
      meshes.push_back(argument);
  }
  if (powers < 2 || powers > 24) {
    std::fprintf(stderr, "usage: thesis_tables_bench [--powers 2..24] [--out FOLDER] [MESH...]\n");
    return 2;
  }
  for (int l = 1; l <= powers; ++l)
    for (const std::uint64_t size :
         {std::uint64_t{1} << l, (std::uint64_t{1} << l) + (std::uint64_t{1} << (l - 1))})
      run.sizes.push_back(size);
  try {
    if (!run.out.empty()) std::filesystem::create_directories(run.out);
    const std::clock_t begin = std::clock();
    run_all(run, meshes);
    std::printf("\nCPU %.1f s, answer %016llx\n", static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC,
                run.hash.value());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "thesis_tables_bench: %s\n", error.what());
    return 1;
  }
  return 0;
}
