// Blue noise in the plane and on a mesh: power at low frequencies, anisotropy, spacing, largest hole,
// discrepancy, path and CPU seconds of `jittered`, `centroid` and `blue`, by the library's own measures
// (sampling/quality/quality.h).
//   blue_bench [MODEL] [DOTS] [TRIANGLES]     MODEL is subdivided to that many triangles
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>
#include <vector>

#include "sampling/images/image_file.h"
#include "sampling/model/mesh_repair.h"
#include "sampling/model/model_file.h"
#include "sampling/model/placement.h"
#include "sampling/place_dots.h"
#include "sampling/quality/quality.h"
#include "tests/support/meshes.h"
#include "tests/support/subdivide.h"

namespace {

using namespace hilbrush;

constexpr int kRepeats = 3;

struct Choice {
  const char* name;
  Sampler sampler;
};
constexpr Choice kChoices[] = {
    {"jittered", Sampler::kJittered}, {"centroid", Sampler::kCentroid}, {"blue", Sampler::kBlue}};

DotSequence place(const SurfaceCurve& curve, const ToneField& tone, Sampler sampler, std::uint64_t count,
                  double& seconds) {
  SampleOptions options;
  options.sampler = sampler;
  options.dot_count = count;
  DotSequence dots;
  seconds = 1e300;
  for (int i = 0; i < kRepeats; ++i) {
    const std::clock_t start = std::clock();
    dots = place_dots(curve, tone, options);
    seconds = std::min(seconds, static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
  }
  return dots;
}

void run_in_plane(std::uint64_t count) {
  const TexturedMesh mesh = test::rectangle(1, 1, 2, 2);
  const ToneField tone(mesh, {});
  const SurfaceCurve curve(mesh);
  std::printf("unit square, %llu dots\n", static_cast<unsigned long long>(count));
  for (const Choice& choice : kChoices) {
    double seconds = 0;
    const DotSequence dots = place(curve, tone, choice.sampler, count, seconds);
    std::vector<Eigen::Vector2d> points;
    for (const Dot& dot : dots.dots) points.emplace_back(dot.position_O.head<2>());
    const Spectrum spectrum = plane_spectrum(points);
    const auto discrepancy = plane_discrepancies(points);
    std::printf(
        "%-9s %6.3f s CPU  power %.4f (<fp/2) %.4f (<fp/4)  peak %.2f  anisotropy %.3f  spacing %.3f  hole "
        "%.3f  "
        "rms discrepancy %.2e %.2e %.2e  path %.3f\n",
        choice.name, seconds, spectrum.below_half, spectrum.below_quarter, spectrum.peak, spectrum.anisotropy,
        plane_spacing(points).smallest, plane_largest_hole(points), discrepancy[0].rms, discrepancy[1].rms,
        discrepancy[2].rms, path_constant(points));
  }
}

void run_on_mesh(const std::string& file, std::uint64_t count, std::size_t triangles) {
  PlacementOptions placement;
  placement.size_m = .08;
  const RepairedMesh repaired = repair_mesh(place_on_table(load_model(file, load_image_file), placement));
  // Its colors are left out: constant tone.
  TexturedMesh mesh = test::subdivided(repaired.mesh, triangles);
  for (Material& material : mesh.materials) material = {"black", ColorSource::kColors};
  for (auto& corners : mesh.corner_luminance) corners = {0, 0, 0};
  const ToneField tone(mesh, {});
  const SurfaceCurve curve(mesh);
  const SurfaceQuality quality(mesh);
  std::printf("%s, %zu triangles, %llu dots\n", file.c_str(), mesh.triangle_count(),
              static_cast<unsigned long long>(count));
  for (const Choice& choice : kChoices) {
    double seconds = 0;
    const DotSequence dots = place(curve, tone, choice.sampler, count, seconds);
    const std::span<const Dot> set(dots.dots);
    const Spectrum spectrum = quality.spectrum(set);
    std::printf(
        "%-9s %6.3f s CPU  power %.4f (<fp/2)  peak %.2f  spacing %.3f  hole %.3f  rms discrepancy of balls "
        "%.2e  "
        "path %.3f\n",
        choice.name, seconds, spectrum.below_half, spectrum.peak, quality.spacing(set).smallest,
        quality.largest_hole(set), quality.balls({&set, 1}).front().rms, quality.path_constant(set));
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const std::uint64_t count = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 50'000;
    run_in_plane(count);
    if (argc > 1) run_on_mesh(argv[1], count, argc > 3 ? std::strtoull(argv[3], nullptr, 10) : 0);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "blue_bench: %s\n", error.what());
    return 1;
  }
  return 0;
}
