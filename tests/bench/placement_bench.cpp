// The quality of `centroid` and `blue` beside the thesis's `jittered`, in the plane and on meshes, and the
// limits set for them.
//   placement_bench [--count N] [--shapes L] [--seeds S] [MESH...]
// On a plate (the unit square), on a sphere of 8,000 triangles, and on each mesh, all black. Lengths are over
// sqrt(A / N); power is the mean below half the principal frequency. Ratios are to jittered on the same
// surface with the same test shapes. One set's anisotropy scatters, so its mean over S seeds is given too. A
// hash of all figures is printed at the end.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <numbers>
#include <string>
#include <vector>

#include "config/job_settings.h"
#include "sampling/base/input_error.h"
#include "sampling/images/image_file.h"
#include "sampling/model/mesh_repair.h"
#include "sampling/model/model_file.h"
#include "sampling/model/placement.h"
#include "sampling/place_dots.h"
#include "sampling/quality/quality.h"
#include "tests/bench/answer_hash.h"

namespace {

using namespace hilbrush;
using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;

/// nu by nv quads over place(u, v), black, then welded and cleaned.
template <class Place>
TexturedMesh grid_mesh(int nu, int nv, const Place& place) {
  TexturedMesh mesh;
  for (int j = 0; j <= nv; ++j)
    for (int i = 0; i <= nu; ++i)
      mesh.vertices.push_back(place(static_cast<double>(i) / nu, static_cast<double>(j) / nv));
  const auto index = [nu](int i, int j) { return static_cast<std::uint32_t>(j * (nu + 1) + i); };
  for (int j = 0; j < nv; ++j)
    for (int i = 0; i < nu; ++i) {
      mesh.triangles.push_back({index(i, j), index(i + 1, j), index(i + 1, j + 1)});
      mesh.triangles.push_back({index(i, j), index(i + 1, j + 1), index(i, j + 1)});
    }
  const std::size_t n = mesh.triangle_count();
  mesh.corner_uv.resize(n, {Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()});
  mesh.corner_luminance.resize(n, {0, 0, 0});
  mesh.material_index.resize(n, 0);
  mesh.materials.resize(1);
  return repair_mesh(std::move(mesh)).mesh;
}

TexturedMesh plate() {
  return grid_mesh(1, 1, [](double u, double v) { return Vector3d(u, v, 0); });
}
TexturedMesh sphere() {
  return grid_mesh(90, 45, [](double u, double v) {
    const double turn = u == 1 ? 0 : 2 * kPi * u,
                 polar = kPi * v;  // the seam's two sides are the same to the last bit
    const double r = v == 0 || v == 1 ? 0 : std::sin(polar);
    return Vector3d(r * std::cos(turn), r * std::sin(turn), -std::cos(polar));
  });
}
TexturedMesh black_model(const std::string& file) {
  PlacementOptions placement;
  placement.size_m = .1;
  TexturedMesh mesh = repair_mesh(place_on_table(load_model(file, load_image_file), placement)).mesh;
  for (auto& luminance : mesh.corner_luminance) luminance = {0, 0, 0};
  for (Material& material : mesh.materials)
    material = {material.name, ColorSource::kColors, -1, true, true, 1};
  return mesh;
}

struct Row {
  double balls = 0, sets = 0, power = 0, spacing = 0, spread = 0, hole = 0, path = 0, anisotropy = 0,
         cpu_s = 0;
};

class Bench {
 public:
  Bench(std::uint64_t count, std::uint64_t shapes) : count_(count), shapes_{shapes, 1} {}

  void surface(const std::string& name, const TexturedMesh& mesh, bool is_plane) {
    const ToneField tone(mesh, {});
    const SurfaceCurve curve(mesh);
    const SurfaceQuality quality(mesh);
    std::printf("\n%s: %zu triangles, %llu dots\n%-12s %8s %6s %8s %6s %8s %8s %8s %8s %8s %8s %8s\n",
                name.c_str(), mesh.triangle_count(), static_cast<unsigned long long>(count_), "", "balls",
                "ratio", "sets", "ratio", "power", "aniso", "spacing", "spread", "hole", "path", "CPU s");
    Row jittered;
    for (const Sampler sampler : {Sampler::kJittered, Sampler::kCentroid, Sampler::kBlue}) {
      const Row row = measure(curve, tone, quality, sampler, is_plane);
      if (sampler == Sampler::kJittered) jittered = row;
      std::printf("%-12s %8.2e %6.3f %8.2e %6.3f %8.4f %8.3f %8.3f %8.3f %8.3f %8.3f %8.3f\n",
                  sampler_name(sampler), row.balls, row.balls / jittered.balls, row.sets,
                  row.sets / jittered.sets, row.power, row.anisotropy, row.spacing, row.spread, row.hole,
                  row.path, row.cpu_s);
      for (const double figure :
           {row.balls, row.sets, row.power, row.anisotropy, row.spacing, row.hole, row.path})
        hash_.take(figure);
      std::fflush(stdout);
    }
  }
  /// One set's anisotropy scatters: mean and standard deviation over seeds 1 to `seed_count`, in the plane.
  void anisotropy_over_seeds(const TexturedMesh& mesh, std::uint64_t seed_count) {
    const ToneField tone(mesh, {});
    const SurfaceCurve curve(mesh);
    std::printf("\nanisotropy in the plane over %llu seeds, mean and standard deviation:",
                static_cast<unsigned long long>(seed_count));
    for (const Sampler sampler : {Sampler::kJittered, Sampler::kBlue}) {
      double sum = 0, square_sum = 0;
      for (std::uint64_t seed = 1; seed <= seed_count; ++seed) {
        SampleOptions options;
        options.dot_count = count_;
        options.sampler = sampler;
        options.seed = seed;
        std::vector<Eigen::Vector2d> points;
        for (const Dot& dot : place_dots(curve, tone, options).dots)
          points.emplace_back(dot.position_O.head<2>());
        const double anisotropy = plane_spectrum(points).anisotropy;
        hash_.take(anisotropy);
        sum += anisotropy;
        square_sum += anisotropy * anisotropy;
      }
      const double n = static_cast<double>(seed_count), mean = sum / n;
      std::printf("  %s %.3f %.3f", sampler_name(sampler), mean,
                  std::sqrt(std::max(0., square_sum / n - mean * mean)));
      std::fflush(stdout);
    }
    std::printf("\n");
  }
  unsigned long long hash() const { return hash_.value(); }

 private:
  Row measure(const SurfaceCurve& curve, const ToneField& tone, const SurfaceQuality& quality,
              Sampler sampler, bool is_plane) const {
    SampleOptions options;
    options.dot_count = count_;
    options.sampler = sampler;
    Row row;
    const std::clock_t begin = std::clock();
    const std::vector<Dot> dots = place_dots(curve, tone, options).dots;
    row.cpu_s = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    const std::vector<std::span<const Dot>> sets{dots};
    row.balls = quality.balls(sets, shapes_).front().rms;
    row.sets = quality.triangle_sets(sets, shapes_).front().rms;
    const Spacing spacing = quality.spacing(dots);
    row.spacing = spacing.smallest;
    row.spread = spacing.spread;
    row.hole = quality.largest_hole(dots);
    row.path = quality.path_constant(dots);
    if (is_plane) {
      std::vector<Eigen::Vector2d> points;
      for (const Dot& dot : dots) points.emplace_back(dot.position_O.head<2>());
      const Spectrum spectrum = plane_spectrum(points);
      row.power = spectrum.below_half;
      row.anisotropy = spectrum.anisotropy;
      row.balls = plane_discrepancy(points, PlaneShape::kQuarterCircle, shapes_).rms;
      row.sets = plane_discrepancy(points, PlaneShape::kTriangle, shapes_).rms;
    } else {
      try {
        row.power = quality.spectrum(dots).below_half;
      } catch (const InputError& error) {
        std::printf("(%s)\n", error.what());
      }
    }
    return row;
  }

  std::uint64_t count_;
  TestShapes shapes_;
  AnswerHash hash_;
};

}  // namespace

int main(int argc, char** argv) {
  std::uint64_t count = 50'000, shapes = 2000, seeds = 10;
  std::vector<std::string> meshes;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "--count" && i + 1 < argc)
      count = std::strtoull(argv[++i], nullptr, 10);
    else if (argument == "--shapes" && i + 1 < argc)
      shapes = std::strtoull(argv[++i], nullptr, 10);
    else if (argument == "--seeds" && i + 1 < argc)
      seeds = std::strtoull(argv[++i], nullptr, 10);
    else
      meshes.push_back(argument);
  }
  try {
    Bench bench(count, shapes);
    std::printf(
        "Limits: centroid: balls ratio <= .75 on meshes, power <= .06, path <= 1.0, hole <= 1.08; blue: "
        "power <= "
        ".02, spacing >= .5,\nhole <= 1.0, anisotropy not above jittered's. In the plane `balls` are quarter "
        "circles and `sets` triangles.\n");
    bench.surface("plane", plate(), true);
    bench.anisotropy_over_seeds(plate(), seeds);
    bench.surface("sphere", sphere(), false);
    for (const std::string& mesh : meshes)
      bench.surface(std::filesystem::path(mesh).stem().string(), black_model(mesh), false);
    std::printf("\nanswer %016llx\n", bench.hash());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "placement_bench: %s\n", error.what());
    return 1;
  }
  return 0;
}
