#include "sim/film/film.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>

#include "sampling/base/batches.h"
#include "sampling/base/check.h"
#include "sim/film/beam.h"
#include "sim/film/surface_index.h"

namespace hilbrush {

namespace {

/// Emissions between two reports of progress; fixed, so that sums come in the same order whatever the number
/// of threads.
constexpr std::size_t kBatch = 1 << 16;
constexpr std::size_t kChunk = 1 << 10;
/// m: a beam that lands this far before its focus was blocked by something.
constexpr double kShadowM = 1e-4;

/// A spot touches a tile: ordered by tile, then by spot.
using Touch = std::uint64_t;
Touch touch(std::uint32_t tile, std::size_t spot) {
  return static_cast<Touch>(tile) << 32 | spot;
}

}  // namespace

/// The paint's response at fixed steps up to a few full doses, for pictures and measurements that ask
/// millions of times. Between steps linear: wrong by less than 2e-6. The kink of the linear response lies on
/// a step.
class ResponseTable {
 public:
  explicit ResponseTable(PaintResponse response) : response_(response) {
    for (std::size_t i = 0; i < coverages_.size(); ++i)
      coverages_[i] = painted_coverage(response, static_cast<double>(i) / kStepsAFullDose);
  }
  double operator()(double x) const {
    const double place = x * kStepsAFullDose;
    if (!(place < static_cast<double>(coverages_.size() - 1))) return painted_coverage(response_, x);
    if (place <= 0) return coverages_.front();
    const auto i = static_cast<std::size_t>(place);
    return coverages_[i] + (place - static_cast<double>(i)) * (coverages_[i + 1] - coverages_[i]);
  }

 private:
  static constexpr double kStepsAFullDose = 1024;
  PaintResponse response_;
  std::array<double, 4097> coverages_;
};

struct Film::Implementation {
  Implementation(const TexturedMesh& m, const CellDescription& c, double pitch)
      : mesh(m),
        cell(c),
        pitch_m(pitch),
        waist_m(spot_diameter_m(c, pitch) / 2),
        index(m),
        lattice(m, pitch / 2),
        response(c.paint.response) {}

  Hit land(const Emission& emission, Spot& spot) const;
  std::vector<Touch> touches(std::span<const Spot> spots) const;
  void expose(std::span<const Spot> spots);

  const TexturedMesh& mesh;
  const CellDescription& cell;
  const double pitch_m, waist_m;
  const SurfaceIndex index;
  FilmLattice lattice;
  const ResponseTable response;
};

/// Where the emission's beam meets the mesh; `spot` keeps no energy if it meets nothing.
Hit Film::Implementation::land(const Emission& emission, Spot& spot) const {
  Hit hit;
  spot = {};
  const Beam beam = beam_from_joints(cell, emission.joints);
  const double lens_m = cell.lens.near_m;
  const auto ray_hit = index.cast(beam.focus_O - lens_m * beam.direction_O, beam.direction_O);
  if (!ray_hit) return hit;

  hit.is_hit = true;
  hit.point = ray_hit->point;
  hit.defocus_m = ray_hit->distance_m - lens_m;
  hit.is_shadowed = hit.defocus_m < -kShadowM;
  hit.position_O = beam.focus_O + hit.defocus_m * beam.direction_O;
  hit.incidence = std::acos(std::clamp(-beam.direction_O.dot(face_normal(mesh, hit.point)), -1., 1.));
  spot = {hit.position_O, beam.direction_O, emission.power_w * emission.length_s,
          beam_radius_m(waist_m, hit.defocus_m)};
  return hit;
}

std::vector<Touch> Film::Implementation::touches(std::span<const Spot> spots) const {
  const std::size_t chunk_count = (spots.size() + kChunk - 1) / kChunk;
  std::vector<std::vector<Touch>> chunks(chunk_count);
  tbb::parallel_for(std::size_t{0}, chunk_count, [&](std::size_t chunk) {
    std::vector<std::uint32_t> triangles, tiles;
    for (std::size_t i = chunk * kChunk; i < std::min((chunk + 1) * kChunk, spots.size()); ++i) {
      if (!(spots[i].energy_j > 0)) continue;
      // The cylinder that the light is followed in: one cut radius around, two before and behind.
      index.triangles_near(spots[i].center_O, std::sqrt(5.) * kSpotCutRadii * spots[i].radius_m, triangles);
      tiles.clear();
      for (const std::uint32_t triangle : triangles) lattice.append_tiles(triangle, spots[i], tiles);
      for (const std::uint32_t tile : tiles) chunks[chunk].push_back(touch(tile, i));
    }
  });
  std::vector<Touch> all;
  for (const auto& chunk : chunks) all.insert(all.end(), chunk.begin(), chunk.end());
  tbb::parallel_sort(all);
  return all;
}

void Film::Implementation::expose(std::span<const Spot> spots) {
  const std::vector<Touch> all = touches(spots);
  std::vector<std::size_t> tile_begins;
  for (std::size_t k = 0; k < all.size(); ++k)
    if (k == 0 || all[k] >> 32 != all[k - 1] >> 32) tile_begins.push_back(k);
  tile_begins.push_back(all.size());
  tbb::parallel_for(std::size_t{0}, tile_begins.size() - 1, [&](std::size_t k) {
    std::vector<const Spot*> on_tile;
    for (std::size_t j = tile_begins[k]; j < tile_begins[k + 1]; ++j)
      on_tile.push_back(&spots[all[j] & 0xffffffffu]);
    lattice.expose(static_cast<std::uint32_t>(all[tile_begins[k]] >> 32), on_tile);
  });
}

Film::Film(const TexturedMesh& mesh, const CellDescription& cell, double pitch_m)
    : implementation_(std::make_unique<Implementation>(mesh, cell, pitch_m)) {}
Film::~Film() = default;
Film::Film(Film&&) noexcept = default;

std::vector<Hit> Film::expose(std::span<const Emission> emissions, const Progress& progress) {
  std::vector<Hit> hits(emissions.size());
  std::vector<Spot> spots;
  for_batches(emissions.size(), kBatch, progress, [&](std::size_t begin, std::size_t end) {
    spots.resize(end - begin);
    tbb::parallel_for(
        begin, end, [&](std::size_t i) { hits[i] = implementation_->land(emissions[i], spots[i - begin]); });
    implementation_->expose(spots);
  });
  return hits;
}

void Film::expose_at(std::span<const SurfacePoint> points, std::span<const float> levels) {
  CHECK_EQ(points.size(), levels.size());
  const double energy_j = full_energy_j(implementation_->cell, implementation_->pitch_m);
  std::vector<Spot> spots;
  for (std::size_t begin = 0; begin < points.size(); begin += kBatch) {
    spots.clear();
    for (std::size_t i = begin; i < std::min(begin + kBatch, points.size()); ++i)
      spots.push_back({position(mesh(), points[i]), -face_normal(mesh(), points[i]), levels[i] * energy_j,
                       implementation_->waist_m});
    implementation_->expose(spots);
  }
}

double Film::dose_j_m2(const SurfacePoint& point) const {
  const FilmLattice::Neighbors around = implementation_->lattice.neighbors(point);
  double dose = 0;
  for (std::size_t k = 0; k < around.weights.size(); ++k) dose += around.weights[k] * around.doses_j_m2[k];
  return dose;
}

double Film::painted(const SurfacePoint& point) const {
  const FilmLattice::Neighbors around = implementation_->lattice.neighbors(point);
  double coverage = 0;
  for (std::size_t k = 0; k < around.weights.size(); ++k)
    coverage += around.weights[k] * painted(around.doses_j_m2[k]);
  return coverage;
}

double Film::painted(double dose_j_m2) const {
  return implementation_->response(dose_j_m2 / implementation_->cell.paint.dose_full_j_m2);
}

void Film::points_near(const SurfacePoint& center, double radius_m, std::vector<FilmPoint>& points) const {
  thread_local std::vector<std::uint32_t> triangles;
  points.clear();
  const Eigen::Vector3d center_O = position(mesh(), center);
  const Eigen::Vector3d normal_O = face_normal(mesh(), center);
  implementation_->index.triangles_near(center_O, std::sqrt(2.) * radius_m, triangles);
  for (const std::uint32_t triangle : triangles)
    if (mesh().area_vector(triangle).dot(normal_O) > 0)
      implementation_->lattice.append_points(triangle, center_O, normal_O, radius_m, points);
}

const TexturedMesh& Film::mesh() const {
  return implementation_->mesh;
}
const CellDescription& Film::cell() const {
  return implementation_->cell;
}
double Film::pitch_m() const {
  return implementation_->pitch_m;
}

}  // namespace hilbrush
