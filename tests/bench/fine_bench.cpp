// What `fine` gains over `centroid` on the simulated film, at normal incidence and everywhere, for several
// numbers of passes: fidelity, CPU seconds, path and how far dots moved.
//   fine_bench MODEL SIZE_MM DPI [PASSES...]
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "config/cell_file.h"
#include "sampling/fine/fine.h"
#include "sampling/images/image_file.h"
#include "sampling/model/mesh_repair.h"
#include "sampling/model/model_file.h"
#include "sampling/model/placement.h"
#include "sampling/place_dots.h"
#include "sim/film/fidelity.h"
#include "tests/bench/process_usage.h"

namespace {

using namespace hilbrush;

SurfacePoint point_of(const TexturedMesh& mesh, const Dot& dot) {
  const Eigen::Vector3d area = mesh.area_vector(dot.triangle);
  SurfacePoint point{dot.triangle, {}};
  for (int c = 0; c < 3; ++c) {
    const Eigen::Vector3d& from = mesh.corner(dot.triangle, (c + 1) % 3);
    point.barycentric[c] =
        .5 * (mesh.corner(dot.triangle, (c + 2) % 3) - from).cross(dot.position_O - from).dot(area) /
        area.squaredNorm();
  }
  return point;
}

double path_m(const DotSequence& dots) {
  double sum = 0;
  for (std::size_t i = 1; i < dots.dots.size(); ++i)
    sum += (dots.dots[i].position_O - dots.dots[i - 1].position_O).norm();
  return sum;
}

void print_fidelity(const char* name, double seconds, const DotSequence& dots, const DotSequence& from,
                    const TexturedMesh& mesh, const CellDescription& cell, const ToneField& tone) {
  std::vector<SurfacePoint> points;
  std::vector<float> levels;
  std::vector<double> ways;
  for (std::size_t i = 0; i < dots.dots.size(); ++i) {
    points.push_back(point_of(mesh, dots.dots[i]));
    levels.push_back(dots.dots[i].level);
    ways.push_back((dots.dots[i].position_O - from.dots[i].position_O).norm() / dots.pitch_m);
  }
  Film film(mesh, cell, dots.pitch_m);
  film.expose_at(points, levels);
  const FidelityFigures figures = measure_fidelity(film, tone, {}, 1).whole;
  std::sort(ways.begin(), ways.end());
  std::printf(
      "%-10s %7.2f s CPU  F1 %.2f  F2 %.2f dB  S2 %.4f  tone rms %.4f max %.4f  P %.4f  path %.3f m  moved "
      "%.2f "
      "(median) %.2f (most) pitches\n",
      name, seconds, figures.f1_db, figures.f2_db, figures.s2, figures.tone_rms, figures.tone_max,
      figures.p999, path_m(dots), ways[ways.size() / 2], ways.back());
}

void run(const std::string& model_file, double size_mm, double dpi, const std::vector<int>& passes) {
  const CellDescription cell = load_cell(find_cell("default"));
  PlacementOptions placement;
  placement.size_m = size_mm * 1e-3;
  const RepairedMesh repaired =
      repair_mesh(place_on_table(load_model(model_file, load_image_file), placement));
  const ToneField tone(repaired.mesh, cell_tone(cell, {.sampler = "centroid"}).options);
  const SurfaceCurve curve(repaired.mesh);
  SampleOptions options;
  options.pitch_m = 25.4e-3 / dpi;
  double start = cpu_s();
  const DotSequence centroid = place_dots(curve, tone, options);
  std::printf("%zu dots\n", centroid.dots.size());
  print_fidelity("centroid", cpu_s() - start, centroid, centroid, repaired.mesh, cell, tone);
  const SpotModel spot{spot_diameter_m(cell, centroid.pitch_m) / 2,
                       [&](double dose) { return painted_coverage(cell.paint.response, dose); }};
  for (const int count : passes) {
    start = cpu_s();
    const DotSequence fine = refine_dots(curve, tone, centroid, spot, {count});
    print_fidelity(("fine " + std::to_string(count)).c_str(), cpu_s() - start, fine, centroid, repaired.mesh,
                   cell, tone);
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    std::fprintf(stderr, "usage: fine_bench MODEL SIZE_MM DPI [PASSES...]\n");
    return 2;
  }
  std::vector<int> passes;
  for (int i = 4; i < argc; ++i) passes.push_back(std::atoi(argv[i]));
  if (passes.empty()) passes = {6, 12, 24};
  try {
    run(argv[1], std::atof(argv[2]), std::atof(argv[3]), passes);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "fine_bench: %s\n", error.what());
    return 1;
  }
  return 0;
}
