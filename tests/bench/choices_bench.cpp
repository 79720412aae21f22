// The thesis's other choices, timed: curves and area methods on parametric surfaces, laminar slices and hole
// filling on a model. Prints CPU seconds, what was measured, and an answer hash.
//   choices_bench [MODEL] [DOTS=1500000]

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <numbers>

#include "sampling/gaps/fill_holes.h"
#include "sampling/laminar/laminar.h"
#include "sampling/model/mesh_repair.h"
#include "sampling/model/model_file.h"
#include "sampling/model/placement.h"
#include "sampling/parametric/parametric.h"
#include "sampling/place_dots.h"
#include "tests/bench/answer_hash.h"
#include "tests/bench/process_usage.h"

namespace {

using namespace hilbrush;

template <class Dots>
double path_length(const Dots& dots, auto place) {
  double length = 0;
  for (std::size_t i = 1; i < dots.size(); ++i) length += (place(dots[i]) - place(dots[i - 1])).norm();
  return length;
}

void time_sphere(std::uint64_t count, AnswerHash& hash) {
  const auto sphere = make_surface(ParametricShape::kSphere);
  std::printf("sphere, %llu dots\ncurve    area method             leaves     area/4pi    path  CPU s\n",
              static_cast<unsigned long long>(count));
  for (const CurveKind curve : {CurveKind::kHilbert, CurveKind::kPeano2})
    for (const AreaMethod method :
         {AreaMethod::kTriangle, AreaMethod::kSquare, AreaMethod::kFirstFundamentalForm})
      for (const Sampler sampler : {Sampler::kJittered, Sampler::kCentroid}) {
        ParametricOptions options;
        options.dot_count = count;
        options.curve = curve;
        options.area = method;
        options.sampler = sampler;
        options.minimum_depth = options.maximum_depth = curve == CurveKind::kHilbert ? 12 : 8;
        const double start = cpu_s();
        const ParametricSamples samples = sample_parametric(*sphere, options);
        const double seconds = cpu_s() - start;
        const double path = path_length(samples.dots, [](const ParametricDot& dot) { return dot.position; }) /
                            std::sqrt(static_cast<double>(count) * 4 * std::numbers::pi);
        hash.take(path);
        std::printf("%-8s %-22s %10llu %.9f %7.4f %6.2f  %s\n",
                    curve == CurveKind::kHilbert ? "hilbert" : "peano2", name_of(kAreaMethodNames, method),
                    static_cast<unsigned long long>(samples.vertex_count),
                    samples.area / (4 * std::numbers::pi), path, seconds,
                    sampler == Sampler::kCentroid ? "centroid" : "jittered");
      }
}

void time_model(const char* file, std::uint64_t count, AnswerHash& hash) {
  const ImageReader no_images = [](const std::filesystem::path&, std::size_t) {
    return Failure{"not read here"};
  };
  PlacementOptions placement;
  placement.size_m = .08;
  const TexturedMesh mesh = repair_mesh(place_on_table(load_model(file, no_images), placement)).mesh;
  const ToneField tone(mesh, {});
  const SurfaceCurve curve(mesh);
  SampleOptions options;
  options.dot_count = count;

  double start = cpu_s();
  SampleReport report;
  const DotSequence laminar = place_laminar(mesh, tone, options, &report);
  std::printf("laminar: %zu dots, pitch %.6f mm, path constant %.4f, %.2f CPU s\n", laminar.dots.size(),
              1e3 * laminar.pitch_m, report.path_constant, cpu_s() - start);
  hash.take(report.path_length_m);

  for (const Sampler sampler : {Sampler::kJittered, Sampler::kCentroid})
    for (const double gap : {1.2, 1.}) {
      options.sampler = sampler;
      const DotSequence dots = place_dots(curve, tone, options);
      const auto place = [](const Dot& dot) { return dot.position_O; };
      const double before = path_length(dots.dots, place);
      FillReport filled;
      start = cpu_s();
      const DotSequence all = fill_holes(curve, tone, dots, gap, &filled);
      const double after = path_length(all.dots, place);
      std::printf("%s, largest gap %.1f: %llu dots added (%llu by the sweep), path x %.4f, %.2f CPU s\n",
                  sampler == Sampler::kCentroid ? "centroid" : "jittered", gap,
                  static_cast<unsigned long long>(filled.added),
                  static_cast<unsigned long long>(filled.added_by_sweep), after / before, cpu_s() - start);
      hash.take(after);
    }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const std::uint64_t count = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1'500'000;
    AnswerHash hash;
    time_sphere(count, hash);
    if (argc > 1) time_model(argv[1], count, hash);
    std::printf("answer %016llx\n", hash.value());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
