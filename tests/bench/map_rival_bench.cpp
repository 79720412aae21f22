// Our square map against CGAL's mean-value square map (GPL: only here), on the same cut mesh, best of several
// in the same run, CPU seconds.
//   map_rival_bench MODEL [TRIANGLES [REPEATS]]
#include <CGAL/Polygon_mesh_processing/measure.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_parameterization/Mean_value_coordinates_parameterizer_3.h>
#include <CGAL/Surface_mesh_parameterization/Square_border_parameterizer_3.h>
#include <CGAL/Surface_mesh_parameterization/parameterize.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <stdexcept>

#include "sampling/disk/cut_to_disk.h"
#include "sampling/disk/square_map.h"
#include "sampling/model/mesh_repair.h"
#include "sampling/model/model_file.h"
#include "sampling/model/placement.h"
#include "tests/bench/process_usage.h"
#include "tests/support/subdivide.h"

namespace {

using namespace hilbrush;
namespace parameterization = CGAL::Surface_mesh_parameterization;
using RivalMesh = CGAL::Surface_mesh<CGAL::Simple_cartesian<double>::Point_3>;

TexturedMesh read(const char* file, std::size_t triangles) {
  const auto no_image = [](const std::filesystem::path&, std::size_t) -> Result<Texture> {
    return Failure{"not needed"};
  };
  PlacementOptions placement;
  placement.size_m = .08;
  TexturedMesh mesh = repair_mesh(place_on_table(load_model(file, no_image), placement)).mesh;
  return triangles > mesh.triangle_count() ? test::subdivided(std::move(mesh), triangles) : mesh;
}

RivalMesh rival_mesh(const Disk& disk) {
  RivalMesh mesh;
  for (const auto& p : disk.positions()) mesh.add_vertex({p.x(), p.y(), p.z()});
  for (const Triangle& f : disk.faces())
    mesh.add_face(RivalMesh::Vertex_index(f[0]), RivalMesh::Vertex_index(f[1]),
                  RivalMesh::Vertex_index(f[2]));
  return mesh;
}

double rival_seconds(RivalMesh mesh) {
  const double begin = cpu_s();
  using Border = parameterization::Square_border_arc_length_parameterizer_3<RivalMesh>;
  auto uv =
      mesh.add_property_map<RivalMesh::Vertex_index, CGAL::Simple_cartesian<double>::Point_2>("v:uv").first;
  const auto halfedge = CGAL::Polygon_mesh_processing::longest_border(mesh).first;
  const auto result = parameterization::parameterize(
      mesh, parameterization::Mean_value_coordinates_parameterizer_3<RivalMesh, Border>(), halfedge, uv);
  if (result != parameterization::OK)
    std::fprintf(stderr, "CGAL: %s\n", parameterization::get_error_message(result));
  return cpu_s() - begin;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: map_rival_bench MODEL [TRIANGLES [REPEATS]]\n");
    return 2;
  }
  try {
    const TexturedMesh mesh = read(argv[1], argc > 2 ? static_cast<std::size_t>(std::atol(argv[2])) : 0);
    const long repeats = argc > 3 ? std::max(1L, std::atol(argv[3])) : 5;
    double ours = std::numeric_limits<double>::infinity(), ours_cut = ours, rival = ours;
    std::size_t faces = 0;
    double shear = 0;
    for (long i = 0; i < repeats; ++i) {
      const double begin = cpu_s();
      const Neighbors neighbors = find_neighbors(mesh.triangles);
      const auto components = find_components(mesh, neighbors);
      auto cut = cut_to_disk(mesh, neighbors, components.at(0));
      if (!cut) throw std::runtime_error(cut.reason());
      const double cut_s = cpu_s() - begin;
      const RivalMesh same = rival_mesh(cut->disk);
      const double before_map = cpu_s();
      const auto map = map_to_square(*cut);
      if (!map) throw std::runtime_error("no valid map");
      ours = std::min(ours, cut_s + cpu_s() - before_map);
      ours_cut = std::min(ours_cut, cut_s);
      rival = std::min(rival, rival_seconds(same));
      faces = cut->disk.faces().size();
      shear = map->shear;
    }
    std::printf("%zu triangles, %zu faces of the cut disk, shear %.3f\n", mesh.triangle_count(), faces,
                shear);
    std::printf(
        "ours, cut and map %.3f CPU s (cut %.3f); CGAL, map of the same disk %.3f CPU s; ratio %.3f\n", ours,
        ours_cut, rival, ours / rival);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "map_rival_bench: %s\n", error.what());
    return 1;
  }
  return 0;
}
