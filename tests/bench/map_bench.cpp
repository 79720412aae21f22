// Times the stages from a mesh to its maps on the square, and measures the maps.
//   map_bench MODEL [TRIANGLES [DOTS [REPEATS]]]
// TRIANGLES: the mesh is first subdivided to this many (0: unchanged). DOTS: dots of constant tone for the
// path constant and the longest jumps (0: none).
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "sampling/disk/cut_to_disk.h"
#include "sampling/disk/square_map.h"
#include "sampling/model/mesh_repair.h"
#include "sampling/model/model_file.h"
#include "sampling/model/placement.h"
#include "sampling/place_dots.h"
#include "tests/bench/process_usage.h"
#include "tests/support/subdivide.h"

namespace {

using namespace hilbrush;

/// CPU seconds by stage; the best of all repeats.
class Stages {
 public:
  template <class Work>
  auto time(const char* stage, Work work) {
    const double begin = cpu_s();
    auto result = work();
    now_[stage] += cpu_s() - begin;
    return result;
  }
  void finish_repeat() {
    for (const auto& [stage, s] : now_) best_[stage] = best_.contains(stage) ? std::min(best_[stage], s) : s;
    now_.clear();
  }
  void print() const {
    for (const auto& [stage, s] : best_) std::printf("%-12s %8.3f CPU s\n", stage.c_str(), s);
  }

 private:
  std::map<std::string, double> now_, best_;
};

Result<Texture> no_image(const std::filesystem::path&, std::size_t) {
  return Failure{"not needed"};
}

TexturedMesh read(const char* file, std::size_t triangles) {
  PlacementOptions placement;
  placement.size_m = .08;
  TexturedMesh mesh = repair_mesh(place_on_table(load_model(file, no_image), placement)).mesh;
  for (auto& corners : mesh.corner_luminance) corners.fill(0);
  return triangles > mesh.triangle_count() ? test::subdivided(std::move(mesh), triangles) : mesh;
}

/// The path within one component.
struct Part {
  std::size_t count = 0;  ///< of dots
  double path = 0;        ///< in meters
  double jump = 0;        ///< the longest, in meters
  std::size_t long_jumps = 0;
};

void print_part(const Part& part, std::size_t index, const ComponentReport& component, double pitch_m) {
  std::printf(
      "  component %zu: %zu triangles, genus %d, %d loops, %s%s; %zu dots, path %.3f, longest jump %.1f, "
      "over 5: "
      "%zu\n",
      index, component.triangle_count, component.genus, component.boundary_loops,
      component.is_mapped ? "mapped" : "in space: ", component.order_reason.c_str(), part.count,
      part.path / std::sqrt(static_cast<double>(part.count) * component.area_m2), part.jump / pitch_m,
      part.long_jumps);
}

void print_dots(const TexturedMesh& mesh, const SurfaceCurve& curve, std::size_t count) {
  ToneOptions tone_options;
  tone_options.untextured = Untextured::kMaterial;
  const ToneField tone(mesh, tone_options);
  SampleOptions options;
  options.dot_count = count;
  SampleReport report;
  const DotSequence dots = place_dots(curve, tone, options, &report);
  std::vector<Part> parts(curve.components().size());
  double between = 0;
  for (std::size_t i = 0; i < dots.dots.size(); ++i) {
    Part& part = parts[dots.dots[i].component];
    ++part.count;
    if (i == 0) continue;
    const double step = (dots.dots[i].position_O - dots.dots[i - 1].position_O).norm();
    if (dots.dots[i].component != dots.dots[i - 1].component) {
      between += step;
      continue;
    }
    part.path += step;
    part.jump = std::max(part.jump, step);
    part.long_jumps += step > 5 * dots.pitch_m;
  }
  std::printf("%zu dots: path constant %.3f, of which between components %.3f\n", dots.dots.size(),
              report.path_constant, between / report.path_length_m);
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < parts.size(); ++i) order.push_back(i);
  std::stable_sort(order.begin(), order.end(),
                   [&](auto a, auto b) { return parts[a].count > parts[b].count; });
  for (std::size_t k = 0; k < std::min<std::size_t>(order.size(), 6); ++k) {
    const Part& part = parts[order[k]];
    if (part.count < 10) break;
    print_part(part, order[k], curve.components()[order[k]], dots.pitch_m);
  }
}

void run(const TexturedMesh& mesh, std::size_t dots, Stages& stages, bool is_last) {
  const Neighbors neighbors = stages.time("1 neighbors", [&] { return find_neighbors(mesh.triangles); });
  const auto components = stages.time("2 components", [&] { return find_components(mesh, neighbors); });
  for (const Component& component : components) {
    auto cut = stages.time("3 cut", [&] { return cut_to_disk(mesh, neighbors, component); });
    if (cut) stages.time("4 map", [&] { return map_to_square(*cut); });
  }
  stages.finish_repeat();
  if (!is_last) return;
  stages.print();
  std::printf("%zu triangles, %zu components\n", mesh.triangle_count(), components.size());
  const double begin = cpu_s();
  const SurfaceCurve curve(mesh);
  std::printf("curve %.3f CPU s\n", cpu_s() - begin);
  if (dots > 0) print_dots(mesh, curve, dots);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: map_bench MODEL [TRIANGLES [DOTS [REPEATS]]]\n");
    return 2;
  }
  const auto number = [&](int i, long otherwise) {
    return i < argc ? std::max(0L, std::atol(argv[i])) : otherwise;
  };
  try {
    const TexturedMesh mesh = read(argv[1], static_cast<std::size_t>(number(2, 0)));
    const long repeats = std::max(1L, number(4, 1));
    Stages stages;
    for (long i = 0; i < repeats; ++i)
      run(mesh, static_cast<std::size_t>(number(3, 0)), stages, i + 1 == repeats);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "map_bench: %s\n", error.what());
    return 1;
  }
  return 0;
}
