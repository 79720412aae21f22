#include <array>

#include "config/cell_file.h"
#include "config/job_settings.h"
#include "daemon/pipeline/job_sampling.h"
#include "daemon/pipeline/quality/measured_set.h"
#include "sampling/base/input_error.h"
#include "sampling/curve/curvature.h"
#include "sampling/dots/read_dots.h"
#include "sampling/images/image_file.h"
#include "sampling/model/mesh_repair.h"
#include "sampling/model/model_file.h"
#include "sampling/model/placement.h"
#include "sampling/place_dots.h"

namespace hilbrush {
namespace {

/// All figures are relative, so any size is right.
constexpr double kSizeM = .1;

/// What the density of dots on a model follows.
const std::vector<std::string> kDensities{"constant", "texture", "mean_curvature", "gaussian_curvature"};
constexpr std::size_t kConstant = 0;

DensitySource source_of(std::size_t density) {
  return density == 2   ? DensitySource::kMeanCurvature
         : density == 3 ? DensitySource::kGaussianCurvature
                        : DensitySource::kTexture;
}

/// All but "fine", which places the dots of a picture, not of a density.
constexpr std::array kModelSamplers{Sampler::kCentroid, Sampler::kJittered,     Sampler::kEven,
                                    Sampler::kRandom,   Sampler::kHalton,       Sampler::kHammersley,
                                    Sampler::kSobol,    Sampler::kNiederreiter, Sampler::kBlue};

/// The same surface, black all over.
TexturedMesh blackened(TexturedMesh mesh) {
  for (auto& luminance : mesh.corner_luminance) luminance = {0, 0, 0};
  for (Material& material : mesh.materials)
    material = {material.name, ColorSource::kColors, -1, true, true, 1};
  mesh.textures.clear();
  return mesh;
}

/// A model, with dots placed on it here.
class ModelSet : public MeasuredSet {
 public:
  explicit ModelSet(const QualityRequest& request)
      : density_(choice_of(request.density, kDensities, kConstant, "$.density")),
        mesh_(load(request.set, density_)),
        tone_(mesh_, {}),
        curve_(mesh_, curve_choice(request.curve)),
        surface_(mesh_, density_ == kConstant ? nullptr : &tone_) {
    kind = "model";
    if (!request.area.empty()) throw InputError("$.area", "is for formulas only: a mesh's areas are exact");
    if (!request.points.empty()) throw InputError("$.points", "is for the plane and the sphere only");
    options_.sampler = sampler_choice(request.sampler, kModelSamplers);
    options_.seed = request.seed;
    if (density_ != kConstant)
      notes.emplace_back(
          "dots are compared with the tone that asks for them: shares by asked tone times area, lengths over "
          "the local "
          "pitch");
  }

  MeasuredDots place(std::uint64_t count) const override {
    SampleOptions options = options_;
    options.dot_count = count;
    return {place_dots(curve_, tone_, options).dots, {}, {}};
  }
  const SurfaceQuality* surface() const override { return &surface_; }
  std::vector<std::uint64_t> default_counts() const override { return {10'000}; }

 private:
  static TexturedMesh load(const std::string& file, std::size_t density) {
    PlacementOptions placement;
    placement.size_m = kSizeM;
    TexturedMesh mesh = place_on_table(load_model(file, load_image_file), placement);
    if (density == kConstant) return repair_mesh(blackened(std::move(mesh))).mesh;
    return with_curvature_density(repair_mesh(std::move(mesh)).mesh, source_of(density));
  }

  std::size_t density_;
  TexturedMesh mesh_;
  ToneField tone_;
  SurfaceCurve curve_;
  SurfaceQuality surface_;
  SampleOptions options_;
};

/// The dots of a dry run, read from its file, on its model.
class DotsSet : public MeasuredSet {
 public:
  explicit DotsSet(const QualityRequest& request)
      : settings_(job_settings_from_json(request.settings_json.empty() ? "{}" : request.settings_json,
                                         "$.settings")),
        sequence_(read_dots(request.set)),
        mesh_(load(request.model, settings_)),
        tone_(mesh_, tone_of(settings_, mesh_)),
        surface_(mesh_, &tone_) {
    kind = "dots";
    if (sequence_.dots.empty()) throw InputError(request.set, "holds no dots");
    for (const auto& [value, path] :
         {std::pair{request.sampler, "$.sampler"}, std::pair{request.curve, "$.curve"},
          std::pair{request.area, "$.area"}, std::pair{request.density, "$.density"},
          std::pair{request.points, "$.points"}})
      if (!value.empty()) throw InputError(path, "has no effect on dots that are placed already");
    if (!request.counts.empty()) throw InputError("$.count", "has no effect on dots that are placed already");
    project_to_surface();
    notes.emplace_back(
        "dots are compared with the wanted tone after the tone curve: shares by asked tone times area, "
        "lengths over the local pitch");
  }

  MeasuredDots place(std::uint64_t) const override { return {sequence_.dots, {}, {}}; }
  const SurfaceQuality* surface() const override { return &surface_; }
  std::vector<std::uint64_t> default_counts() const override { return {sequence_.dots.size()}; }

 private:
  static TexturedMesh load(const std::string& file, const JobSettings& settings) {
    const RepairedMesh repaired =
        repair_mesh(place_on_table(load_model(file, load_image_file), placement_options(settings)));
    return with_curvature_density(repaired.mesh, settings.density);
  }
  static ToneOptions tone_of(const JobSettings& settings, const TexturedMesh& mesh) {
    return job_tone(load_cell(find_cell(settings.cell)), settings, mesh)
        .options;  // it warned when it was planned
  }

  /// Finds the triangles of the dots, and refuses a model that they do not lie on.
  void project_to_surface() {
    const auto box = bounds(mesh_);
    const double tolerance_m = 1e-3 * (box[1] - box[0]).norm();
    std::size_t astray = 0;
    for (Dot& dot : sequence_.dots) {
      const SurfacePoint point = surface_.nearest(dot.position_O);
      dot.triangle = point.triangle;
      dot.normal_O = face_normal(mesh_, point).cast<float>();
      if ((position(mesh_, point) - dot.position_O).norm() > tolerance_m) ++astray;
    }
    if (astray > 0)
      throw InputError("$.model",
                       std::to_string(astray) + " of " + std::to_string(sequence_.dots.size()) +
                           " dots do not lie on it: is it the model that was painted, at the same size?");
  }

  JobSettings settings_;
  DotSequence sequence_;
  TexturedMesh mesh_;
  ToneField tone_;
  SurfaceQuality surface_;
};

}  // namespace

std::unique_ptr<MeasuredSet> make_model_set(const QualityRequest& request) {
  return std::make_unique<ModelSet>(request);
}
std::unique_ptr<MeasuredSet> make_dots_set(const QualityRequest& request) {
  return std::make_unique<DotsSet>(request);
}

}  // namespace hilbrush
