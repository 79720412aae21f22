#pragma once
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "sampling/base/progress.h"
#include "sampling/dots/dots.h"
#include "sampling/model/textured_mesh.h"
#include "sampling/options/sample_options.h"
#include "sampling/tone/tone_field.h"

/// Mesh to dots, the entry of sampling/:
///   repair_mesh -> components -> flatten (cut_to_disk, map_to_square) -> SurfaceCurve (base tree of the adaptive
///   curve)
///   -> CurveMass (its exact masses under a tone) -> strata -> dots, one after another along the curve.
/// A component that can't be mapped validly is divided; what still can't is ordered along a 3D Hilbert curve, and the
/// report says why.
namespace hilbrush {

struct ComponentReport {
  std::size_t triangle_count = 0;
  int genus = -1;  ///< -1: not a manifold of known genus
  int boundary_loops = 0;
  double area_m2 = 0;
  bool is_mapped = false;       ///< on the square; else in 3D Hilbert order
  std::string order_reason;     ///< why not mapped, or not in one piece
  std::size_t piece_count = 1;  ///< more where no map of the whole is valid: each has a curve of its own
  double cut_length_m = 0;      ///< of the cuts that open it
  double map_shear = 1;         ///< mean over the surface of the map's larger stretch over the smaller one
};

/// The dots of one component, within it.
struct ComponentPath {
  std::uint64_t dot_count = 0;
  double painted_area_m2 = 0;
  double path_length_m = 0;
  double path_constant = 0;  ///< path_length / sqrt(dot_count * painted_area); 0 with fewer than two dots
};

struct SampleReport {
  double painted_area_m2 = 0;                 ///< of the pieces of triangles that ask for dots
  double path_length_m = 0;                   ///< along the dots, in order, jumps between components included
  double path_constant = 0;                   ///< path_length / sqrt(count * painted area)
  std::size_t patch_count = 0;                ///< leaves of the quadtree that were visited
  std::vector<std::size_t> patches_at_depth;  ///< the same by depth below the square
  std::vector<ComponentPath> components;      ///< as SurfaceCurve::components()
};

/// The curve over one repaired mesh. Independent of tone, count and sampler.
class SurfaceCurve {
 public:
  /// Keeps a reference to `mesh`, which must outlive it. `kind` is kHilbert or kPeano2; what can't be mapped follows a
  /// 3D Hilbert curve either way. @throws InputError if the mesh has no area.
  explicit SurfaceCurve(const TexturedMesh& mesh, CurveKind kind = CurveKind::kHilbert, const Progress& progress = {});
  ~SurfaceCurve();
  SurfaceCurve(SurfaceCurve&&) noexcept;

  const TexturedMesh& mesh() const;
  const std::vector<ComponentReport>& components() const;

  struct Implementation;
  const Implementation& implementation() const { return *implementation_; }

 private:
  std::unique_ptr<Implementation> implementation_;
};

/// What a tone weighs along a curve: exact integrals over every piece of every quad of the base tree. Another count or
/// sampler on the same tone needs nothing of it again.
class CurveMass {
 public:
  /// Keeps references to both, which must outlive it. Cost: one integral for each triangle in each quad, in parallel;
  /// 24 bytes for each.
  CurveMass(const SurfaceCurve& curve, const ToneField& tone);
  ~CurveMass();
  CurveMass(CurveMass&&) noexcept;

  double total_m2() const;  ///< asked coverage times area

  struct Implementation;
  const Implementation& implementation() const { return *implementation_; }

 private:
  std::unique_ptr<Implementation> implementation_;
};

/// How many dots the options ask for; 0 if nothing asks for dots and a pitch is given.
/// @throws InputError if neither or both of pitch and count are given, dot_limit is exceeded, or a count is given and
/// everything is white, blank or transparent.
std::uint64_t count_dots(const CurveMass& mass, const SampleOptions& options);

/// The pitch of so many dots.
double pitch_of(const CurveMass& mass, const SampleOptions& options, std::uint64_t count);

/// Told the dots, block by block, in order of the curve.
using DotVisitor = std::function<void(std::span<const Dot>)>;

/// Spreads dots along the curve so that every stretch of equal mass (asked coverage times area) gets one, and hands
/// them on in order. Nothing is kept: memory is bounded whatever their number. Same input and seed: same bytes,
/// whatever the number of threads. `visit` and `progress` are called from this thread and may throw to end it.
/// Samplers: all but kBlue, which needs all dots at once. Errors as count_dots().
void stream_dots(const CurveMass& mass, const SampleOptions& options, const DotVisitor& visit,
                 SampleReport* report = nullptr, const Progress& progress = {});

/// The same, collected. kFine: as kCentroid, for refine_dots() to begin with.
DotSequence place_dots(const CurveMass& mass, const SampleOptions& options, SampleReport* report = nullptr,
                       const Progress& progress = {});
/// All in one, for a tone that is sampled once; also kBlue, by place_blue().
DotSequence place_dots(const SurfaceCurve& curve, const ToneField& tone, const SampleOptions& options,
                       SampleReport* report = nullptr, const Progress& progress = {});

}  // namespace hilbrush
