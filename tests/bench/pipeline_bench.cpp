// Times the stages from a model to a checked program and prints a hash of the answer, which is the same for
// any number of threads.
//   pipeline_bench MODEL SIZE_MM DPI [REPEATS]
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "config/cell_file.h"
#include "config/job_settings.h"
#include "planner/check/program_check.h"
#include "planner/plan.h"
#include "sampling/base/sha256.h"
#include "sampling/images/image_file.h"
#include "sampling/model/mesh_repair.h"
#include "sampling/model/model_file.h"
#include "sampling/model/placement.h"
#include "sampling/place_dots.h"

namespace {

using namespace hilbrush;

class Stopwatch {
 public:
  template <class Work>
  auto time(const char* stage, Work work) {
    const auto wall = std::chrono::steady_clock::now();
    const std::clock_t cpu = std::clock();
    auto result = work();
    Seconds& best = best_[stage];
    const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - wall).count();
    if (best.wall == 0 || wall_s < best.wall)
      best = {wall_s, static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC};
    return result;
  }
  void print() const {
    for (const char* stage : {"load", "repair", "curve", "dots", "reach", "plan", "check"})
      std::printf("%-8s %8.3f s wall %8.3f s CPU\n", stage, best_.at(stage).wall, best_.at(stage).cpu);
  }

 private:
  struct Seconds {
    double wall = 0, cpu = 0;
  };
  std::map<std::string, Seconds> best_;
};

std::string answer_hash(const ExposureProgram& program) {
  Sha256 hash;
  for (const Exposure& exposure : program.exposures) {
    hash.update(
        std::span(reinterpret_cast<const std::uint8_t*>(exposure.joints.data()), sizeof exposure.joints));
    hash.update(
        std::span(reinterpret_cast<const std::uint8_t*>(exposure.position_O.data()), 3 * sizeof(double)));
  }
  return hash.hex_digest().substr(0, 16);
}

void run(const std::string& model_file, double size_mm, double dpi, Stopwatch& watch, bool is_last) {
  const CellDescription cell = load_cell(find_cell("default"));
  JobSettings settings;
  settings.dpi = dpi;
  const PlanOptions options = plan_options(settings);
  PlacementOptions placement;
  placement.size_m = size_mm * 1e-3;

  const Model model = watch.time("load", [&] { return load_model(model_file, load_image_file); });
  const RepairedMesh repaired =
      watch.time("repair", [&] { return repair_mesh(place_on_table(model, placement)); });
  const ToneField tone(repaired.mesh, cell_tone(cell, {.sampler = sampler_name(settings.sampler)}).options);
  const SurfaceCurve curve = watch.time("curve", [&] { return SurfaceCurve(repaired.mesh); });
  SampleReport report;
  const DotSequence dots =
      watch.time("dots", [&] { return place_dots(curve, tone, sample_options(settings), &report); });
  const auto reach =
      watch.time("reach", [&] { return std::make_unique<Reach>(repaired.mesh, cell, options); });
  const Plan plan = watch.time("plan", [&] { return plan_exposures(*reach, dots); });
  const auto faults = watch.time(
      "check", [&] { return check_program(plan.program, plan.skipped, dots, repaired.mesh, cell, options); });
  if (!is_last) return;

  watch.print();
  std::printf(
      "triangles %zu, dots %zu, exposed %zu, patches %zu, path constant %.3f, painting time %.0f s, faults "
      "%zu\n",
      repaired.mesh.triangle_count(), dots.dots.size(), plan.program.exposures.size(), report.patch_count,
      report.path_constant, plan.time.total_s(), faults.size());
  std::printf("answer %s\n", answer_hash(plan.program).c_str());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    std::fprintf(stderr, "usage: pipeline_bench MODEL SIZE_MM DPI [REPEATS]\n");
    return 2;
  }
  const int repeats = std::max(1, argc > 4 ? std::atoi(argv[4]) : 3);
  Stopwatch watch;
  try {
    for (int i = 0; i < repeats; ++i)
      run(argv[1], std::atof(argv[2]), std::atof(argv[3]), watch, i + 1 == repeats);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "pipeline_bench: %s\n", error.what());
    return 1;
  }
  return 0;
}
