#include <algorithm>
#include <array>

#include "config/job_settings.h"
#include "daemon/pipeline/quality/measured_set.h"
#include "sampling/base/input_error.h"
#include "sampling/model/mesh_repair.h"
#include "sampling/parametric/point_sets.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d, Eigen::Vector3d;

/// Those that place dots along a curve on their own; "blue" and "fine" need a mesh.
constexpr std::array kParametricSamplers{Sampler::kCentroid, Sampler::kJittered,    Sampler::kEven,
                                         Sampler::kRandom,   Sampler::kHalton,      Sampler::kHammersley,
                                         Sampler::kSobol,    Sampler::kNiederreiter};

/// The surface as triangles, `side` by `side` quads.
TexturedMesh triangles_of(const ParametricSurface& surface, int side) {
  TexturedMesh mesh;
  for (int j = 0; j <= side; ++j)
    for (int i = 0; i <= side; ++i)
      mesh.vertices.push_back(surface.position(Vector2d(i, j) / static_cast<double>(side)));
  const auto index = [side](int i, int j) { return static_cast<std::uint32_t>(j * (side + 1) + i); };
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i) {
      mesh.triangles.push_back({index(i, j), index(i + 1, j), index(i + 1, j + 1)});
      mesh.triangles.push_back({index(i, j), index(i + 1, j + 1), index(i, j + 1)});
    }
  const std::size_t count = mesh.triangle_count();
  mesh.corner_uv.resize(count, {Vector2d::Zero(), Vector2d::Zero(), Vector2d::Zero()});
  mesh.corner_luminance.resize(count, {0, 0, 0});
  mesh.material_index.resize(count, 0);
  mesh.materials.resize(1);
  return repair_mesh(std::move(mesh)).mesh;
}

class ParametricSet : public MeasuredSet {
 public:
  ParametricSet(const QualityRequest& request, ParametricShape shape)
      : shape_(shape), formula_(make_surface(shape)) {
    kind = "surface";
    options_.sampler = sampler_choice(request.sampler, kParametricSamplers);
    options_.curve = curve_choice(request.curve);
    options_.area = choice_in(kAreaMethodNames, request.area, AreaMethod::kFirstFundamentalForm, "$.area");
    options_.density =
        choice_in(kParametricDensityNames, request.density, ParametricDensity::kConstant, "$.density");
    options_.seed = request.seed;
    if (!request.points.empty()) use_point_set(request);
    // 128 by 128 quads: the triangles of a sphere are off by 1.5e-4 of its radius. The plane needs only two
    // triangles.
    mesh_ = triangles_of(*formula_, shape == ParametricShape::kPlane ? 1 : 128);
    if (options_.density == ParametricDensity::kConstant)
      surface_.emplace(mesh_);
    else
      notes.emplace_back("the density varies over the surface: the dots are shown, but not compared with it");
    if (shape != ParametricShape::kPlane && surface_)
      notes.push_back("balls, spectrum and spacing are measured on the formula's " +
                      std::to_string(mesh_.triangle_count()) + " triangles");
  }

  MeasuredDots place(std::uint64_t count) const override {
    MeasuredDots placed;
    if (point_set_) {
      if (shape_ == ParametricShape::kPlane)
        placed.plane_points = plane_set(*point_set_, count, options_.seed);
      else
        placed.directions = sphere_set(*point_set_, count, options_.seed);
      for (const Vector2d& p : placed.plane_points) placed.dots.push_back(dot_at({p.x(), p.y(), 0}));
      for (const Vector3d& p : placed.directions) placed.dots.push_back(dot_at(p));
      return placed;
    }
    ParametricOptions options = options_;
    options.dot_count = count;
    for (const ParametricDot& dot : sample_parametric(*formula_, options).dots) {
      if (shape_ == ParametricShape::kPlane) placed.plane_points.push_back(dot.uv);
      if (is_sphere()) placed.directions.push_back(dot.position);
      placed.dots.push_back(dot_at(dot.position));
    }
    return placed;
  }

  const SurfaceQuality* surface() const override { return surface_ ? &*surface_ : nullptr; }
  std::vector<std::uint64_t> default_counts() const override { return {10'000}; }

 private:
  bool is_sphere() const {
    return shape_ == ParametricShape::kSphere || shape_ == ParametricShape::kEqualAreaSphere;
  }

  void use_point_set(const QualityRequest& request) {
    if (shape_ != ParametricShape::kPlane && !is_sphere())
      throw InputError("$.points", "is for the plane and the sphere only");
    for (const auto& [name, path] :
         {std::pair{request.sampler, "$.sampler"}, std::pair{request.curve, "$.curve"},
          std::pair{request.area, "$.area"}, std::pair{request.density, "$.density"}})
      if (!name.empty())
        throw InputError(path, "has no effect on points, which are not placed along a curve");
    point_set_ = choice_in(kPlaneSetNames, request.points, PlaneSet::kRandom, "$.points");
  }

  Dot dot_at(const Vector3d& position) const {
    Dot dot;
    dot.position_O = position;
    dot.normal_O = dot.smooth_normal_O = Eigen::Vector3f::Zero();
    if (!surface_) return dot;
    const SurfacePoint point = surface_->nearest(position);
    dot.triangle = point.triangle;
    dot.normal_O = dot.smooth_normal_O = face_normal(mesh_, point).cast<float>();
    return dot;
  }

  ParametricShape shape_;
  std::unique_ptr<ParametricSurface> formula_;
  TexturedMesh mesh_;
  ParametricOptions options_;
  std::optional<PlaneSet> point_set_;
  std::optional<SurfaceQuality> surface_;
};

}  // namespace

std::unique_ptr<MeasuredSet> make_parametric_set(const QualityRequest& request, ParametricShape shape) {
  return std::make_unique<ParametricSet>(request, shape);
}

}  // namespace hilbrush
