// Times the curve on a subdivided model: base tree, exact masses under a texture, and dots. Prints CPU and
// wall seconds, patches, path constants, the worst mass of a stratum, memory, and an answer hash, which is
// the same for any number of threads.
//   curve_bench MODEL [TRIANGLES=268000] [TEXELS=2048] [MOST_DOTS=10000000] [STREAMED_DOTS FILE]
//   curve_bench --leaves FILE.png     patches on a line drawing, beside all of them at the finest depth
// STREAMED_DOTS are written to FILE as binary PLY. A model without textures gets a picture of waves and lines
// by projection.
#include <tbb/global_control.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string>

#include "sampling/curve/patches.h"
#include "sampling/curve/stream_dots.h"
#include "sampling/dots/dots_file.h"
#include "sampling/images/image_file.h"
#include "sampling/model/mesh_repair.h"
#include "sampling/model/model_file.h"
#include "sampling/model/placement.h"
#include "tests/bench/process_usage.h"
#include "tests/support/meshes.h"
#include "tests/support/subdivide.h"

namespace {

using namespace hilbrush;

constexpr int kRepeats = 3;
/// Up to this many strata are measured again one by one.
constexpr std::uint64_t kMaxChecked = 100'000;

struct Seconds {
  double cpu = 0, wall = 0;
};

/// Best of several.
template <class Work>
Seconds time(int repeats, Work work) {
  Seconds best{1e300, 1e300};
  for (int i = 0; i < repeats; ++i) {
    const auto wall = std::chrono::steady_clock::now();
    const double cpu = cpu_s();
    work();
    best.cpu = std::min(best.cpu, cpu_s() - cpu);
    best.wall =
        std::min(best.wall, std::chrono::duration<double>(std::chrono::steady_clock::now() - wall).count());
  }
  return best;
}

/// Largest resident memory in MB since the start or the last reset_peak().
double peak_mb() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmHWM:")) return std::atof(line.c_str() + 6) / 1024;
  return 0;
}
void reset_peak() {
  std::ofstream("/proc/self/clear_refs") << "5";
}

/// Waves, flat parts, and fine lines.
Texture picture(int texels) {
  Texture texture;
  texture.width = texture.height = texels;
  texture.luminance.reserve(static_cast<std::size_t>(texels) * static_cast<std::size_t>(texels));
  for (int j = 0; j < texels; ++j)
    for (int i = 0; i < texels; ++i) {
      const double x = static_cast<double>(i) / texels, y = static_cast<double>(j) / texels;
      double light = .5 + .3 * std::sin(40 * x) * std::cos(31 * y) + .15 * std::sin(211 * x + 97 * y);
      if ((i / 64 + j / 64) % 7 == 0) light = .2;
      if (i % 128 < 3 || (i + j) % 192 < 2) light = .9;
      texture.luminance.push_back(static_cast<float>(light));
    }
  return texture;
}

/// The picture, projected along z and scaled to the model's bounds.
TexturedMesh with_picture(TexturedMesh mesh, int texels) {
  const auto box = bounds(mesh);
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t)
    for (int c = 0; c < 3; ++c) {
      const Eigen::Vector3d p = (mesh.corner(t, c) - box[0]).cwiseQuotient(box[1] - box[0]);
      mesh.corner_uv[t][static_cast<std::size_t>(c)] = {.5 * p.x() + .5 * p.z(), p.y()};
    }
  mesh.textures = {picture(texels)};
  Material material;
  material.source = ColorSource::kTexture;
  material.texture = 0;
  mesh.materials = {material};
  std::fill(mesh.material_index.begin(), mesh.material_index.end(), 0u);
  return mesh;
}

TexturedMesh load(const std::string& file, std::size_t triangle_count) {
  PlacementOptions placement;
  placement.size_m = .08;
  TexturedMesh mesh = repair_mesh(place_on_table(load_model(file, load_image_file), placement)).mesh;
  for (auto& corners : mesh.corner_luminance) corners.fill(0);
  return test::subdivided(std::move(mesh), triangle_count);
}

/// FNV-1a over positions.
struct Hash {
  std::uint64_t value = 0xcbf29ce484222325u;
  void add(const Dot& dot) {
    std::array<std::uint64_t, 3> bits;
    std::memcpy(bits.data(), dot.position_O.data(), sizeof bits);
    for (const auto b : bits) value = (value ^ b) * 0x100000001b3u;
  }
};

double worst_stratum_error(const CurveMass& mass, const ToneField& tone, const SampleOptions& options) {
  const double dot_mass = mass.total_m2() / static_cast<double>(*options.dot_count);
  std::vector<double> masses(*options.dot_count);
  visit_stretches(mass, options, [&](std::uint64_t stratum, const Patch& patch, double from, double to) {
    for (const PatchPiece& piece : patch.pieces)
      masses[stratum] += (to - from) * tone.integrate(piece.triangle, piece.corners_b).mass;
  });
  double worst = 0;
  for (const double stratum : masses) worst = std::max(worst, std::abs(stratum / dot_mass - 1));
  return worst;
}

void measure(const char* title, const SurfaceCurve& curve, const ToneOptions& tone_options,
             std::uint64_t most_dots, std::size_t threads) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  const TexturedMesh& mesh = curve.mesh();
  const ToneField tone(mesh, tone_options);
  const Seconds mass_s = time(kRepeats, [&] { CurveMass(curve, tone); });
  const CurveMass mass(curve, tone);
  std::printf("\n%s, %zu thread(s): exact masses %.3f s CPU %.3f s wall\n", title, threads, mass_s.cpu,
              mass_s.wall);
  std::printf("      dots   CPU s  wall s  M dots/CPU s  patches/dot  path  worst mass  answer\n");
  for (std::uint64_t count = 10'000; count <= most_dots; count *= 10) {
    SampleOptions options;
    options.dot_count = count;
    SampleReport report;
    const Seconds s = time(kRepeats, [&] {
      stream_dots(
          mass, options, [](std::span<const Dot>) {}, &report);
    });
    Hash hash;
    stream_dots(mass, options, [&](std::span<const Dot> dots) {
      for (const Dot& dot : dots) hash.add(dot);
    });
    const bool is_checked = count <= kMaxChecked && threads == 1;
    std::printf(
        "%10llu %7.4f %7.4f %13.2f %12.2f %5.3f  %-10s  %016llx\n", static_cast<unsigned long long>(count),
        s.cpu, s.wall, static_cast<double>(count) / s.cpu * 1e-6,
        static_cast<double>(report.patch_count) / static_cast<double>(count), report.path_constant,
        is_checked ? (std::to_string(1e6 * worst_stratum_error(mass, tone, options)) + "e-6").c_str() : "-",
        static_cast<unsigned long long>(hash.value));
  }
}

/// Builds the base trees again, and prints the times of map and trees and their sizes.
void print_tree(const TexturedMesh& mesh, const SurfaceCurve& curve, const Seconds& map, double mesh_mb) {
  std::size_t quads = 0;
  std::size_t listed = 0;
  Seconds tree;
  for (const Chart& chart : curve.charts()) {
    Chart again = chart;
    tree.cpu += time(kRepeats, [&] {
                  again.base_quads.clear();
                  again.face_lists.clear();
                  build_base_tree(again, mesh, mesh.area_m2());
                }).cpu;
    quads += chart.base_quads.size();
    listed += chart.face_lists.size();
  }
  std::printf(
      "%zu triangles, %zu components; mapped and divided in %.2f s CPU, %.2f s wall; of it the base tree "
      "%.3f s CPU\n",
      mesh.triangle_count(), curve.components().size(), map.cpu, map.wall, tree.cpu);
  std::printf(
      "base tree: %zu quads, %.2f quads a triangle; memory %.0f MB for the mesh, %.0f MB at most so far\n",
      quads, static_cast<double>(listed) / static_cast<double>(mesh.triangle_count()), mesh_mb, peak_mb());
}

/// Streams dots into a file and prints the time and the memory that it takes.
void stream_to_file(const CurveMass& mass, std::uint64_t count, const char* file_name) {
  reset_peak();
  const double before_mb = peak_mb();
  SampleOptions options;
  options.dot_count = count;
  options.dot_limit = count;
  const Seconds s = time(1, [&] {
    DotsFile file(file_name, pitch_of(mass, options, count), count, {});
    stream_dots(mass, options, [&](std::span<const Dot> dots) { file.add(dots); });
    file.close();
  });
  std::printf("\n%llu dots streamed to %s: %.2f s CPU, %.2f s wall; %.0f MB before, %.0f MB at most\n",
              static_cast<unsigned long long>(count), file_name, s.cpu, s.wall, before_mb, peak_mb());
}

void run(int argc, char** argv) {
  const std::size_t triangles = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 268'000;
  const int texels = argc > 3 ? std::atoi(argv[3]) : 2048;
  const std::uint64_t most_dots = argc > 4 ? std::strtoull(argv[4], nullptr, 10) : 10'000'000;
  const TexturedMesh mesh = load(argv[1], triangles);
  const double mesh_mb = peak_mb();
  const Seconds map = time(1, [&] { SurfaceCurve{mesh}; });
  const SurfaceCurve curve(mesh);
  print_tree(mesh, curve, map, mesh_mb);
  ToneOptions material;
  material.untextured = Untextured::kMaterial;
  for (const std::size_t threads : {1, 2}) measure("constant tone", curve, material, most_dots, threads);
  const TexturedMesh painted = with_picture(mesh, texels);
  const SurfaceCurve painted_curve(painted);
  for (const std::size_t threads : {1, 2}) measure("texture", painted_curve, {}, most_dots, threads);
  if (argc <= 6) return;

  const ToneField tone(painted, {});
  const CurveMass mass(painted_curve, tone);
  stream_to_file(mass, std::strtoull(argv[5], nullptr, 10), argv[6]);
}

/// Large flat areas and fine lines on a plate.
TexturedMesh line_drawing(int texels) {
  TexturedMesh mesh = test::with_texture(
      test::rectangle(.05, .05, 4, 4), texels, texels,
      [texels](int i, int j) {
        const bool is_line = std::abs(i - texels / 6) < 2 || std::abs(j - texels / 2) < 1 ||
                             std::abs(i - j) < 2 ||
                             std::abs(std::hypot(i - .6 * texels, j - .4 * texels) - .25 * texels) < 1.5;
        return is_line ? .05 : .6;
      },
      false, false);
  return mesh;
}

/// The drawing with the outline of each patch, as wide as the plate is.
Picture leaf_picture(const CurveMass& mass, const TexturedMesh& mesh, const PatchRule& rule) {
  const Texture& texture = mesh.textures[0];
  Picture picture{texture.width, texture.height, 3, {}};
  const auto n = static_cast<double>(texture.width);
  for (int row = texture.height; row-- > 0;)
    for (int i = 0; i < texture.width; ++i)
      for (int c = 0; c < 3; ++c)
        picture.pixels.push_back(static_cast<std::uint8_t>(
            120 + 130 * texture.luminance[static_cast<std::size_t>(row * texture.width + i)]));
  const auto mark = [&](double x, double y) {
    const auto i = static_cast<std::size_t>(std::clamp(x / .05 * n, 0., n - 1));
    const auto j = static_cast<std::size_t>(std::clamp((1 - y / .05) * n, 0., n - 1));
    std::uint8_t* pixel = &picture.pixels[3 * (j * static_cast<std::size_t>(texture.width) + i)];
    pixel[0] = 200;
    pixel[1] = 30;
    pixel[2] = 30;
  };
  visit_patches(mass, rule, [&](const Patch& patch) {
    Eigen::Vector3d low = Eigen::Vector3d::Constant(1), high = -low;
    for (const PatchPiece& piece : patch.pieces)
      for (const Eigen::Vector2d& b : piece.corners_b) {
        const Eigen::Vector3d p = position(mesh, {piece.triangle, {1 - b.sum(), b.x(), b.y()}});
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
      }
    for (double x = low.x(); x < high.x(); x += .05 / n) mark(x, low.y());
    for (double y = low.y(); y < high.y(); y += .05 / n) mark(low.x(), y);
  });
  return picture;
}

void compare_leaves(const char* file) {
  constexpr std::uint64_t kDots = 200'000;
  const TexturedMesh mesh = line_drawing(1024);
  const SurfaceCurve curve(mesh);
  const ToneField tone(mesh, {});
  const CurveMass mass(curve, tone);
  SampleOptions options;
  options.dot_count = kDots;
  SampleReport adaptive, uniform;
  const DotSequence dots = place_dots(mass, options, &adaptive);
  options.uniform_depth = static_cast<int>(adaptive.patches_at_depth.size()) - 1;
  const DotSequence same = place_dots(mass, options, &uniform);
  double apart = 0;
  for (std::size_t i = 0; i < kDots; ++i)
    apart += (dots.dots[i].position_O - same.dots[i].position_O).norm() / dots.pitch_m /
             static_cast<double>(kDots);
  std::printf(
      "%zu patches where the tone asks for them, %zu at depth %d all over (%.1f times): dots %.4f pitches "
      "apart\n",
      adaptive.patch_count, uniform.patch_count, *options.uniform_depth,
      static_cast<double>(uniform.patch_count) / static_cast<double>(adaptive.patch_count), apart);
  for (std::size_t depth = 0; depth < adaptive.patches_at_depth.size(); ++depth)
    if (adaptive.patches_at_depth[depth] > 0)
      std::printf("  depth %2zu: %zu patches\n", depth, adaptive.patches_at_depth[depth]);
  save_png(leaf_picture(mass, mesh, {mass.total_m2() / kDots, options.omega}), file);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr,
                 "usage: curve_bench MODEL [TRIANGLES] [TEXELS] [MOST_DOTS] [STREAMED_DOTS FILE]\n"
                 "       curve_bench --leaves FILE.png\n");
    return 2;
  }
  try {
    if (argc == 3 && std::string(argv[1]) == "--leaves")
      compare_leaves(argv[2]);
    else
      run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "curve_bench: %s\n", error.what());
    return 1;
  }
  return 0;
}
