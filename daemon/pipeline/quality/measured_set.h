#pragma once
#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "daemon/pipeline/quality/quality.h"
#include "sampling/dots/dots.h"
#include "sampling/options/sample_options.h"
#include "sampling/parametric/parametric.h"
#include "sampling/quality/quality.h"

/// Where the measured dots come from, and the surface that they are compared with.
namespace hilbrush {

/// The dots of one count. Which of the lists are filled depends on the kind of surface.
struct MeasuredDots {
  std::vector<Dot> dots;                      ///< on a mesh (for a formula: on its triangles)
  std::vector<Eigen::Vector2d> plane_points;  ///< on the unit square
  std::vector<Eigen::Vector3d> directions;    ///< on the unit sphere
};

class MeasuredSet {
 public:
  virtual ~MeasuredSet() = default;

  virtual MeasuredDots place(std::uint64_t count) const = 0;
  /// The surface to compare them with; null if their density varies in a way that the surface does not know.
  virtual const SurfaceQuality* surface() const = 0;
  /// The counts to measure if the request gives none.
  virtual std::vector<std::uint64_t> default_counts() const = 0;

  std::string kind;                ///< "surface", "model" or "dots"
  std::vector<std::string> notes;  ///< what is needed to understand the figures
};

/// @throws InputError with the JSON path of the key that cannot be served.
std::unique_ptr<MeasuredSet> make_measured_set(const QualityRequest& request);

/// The index of `name` in `names`, or `otherwise` if it is empty. @throws InputError at `path`.
std::size_t choice_of(const std::string& name, const std::vector<std::string>& names, std::size_t otherwise,
                      const std::string& path);

/// The value named `name` in a table of names, or `otherwise` if it is empty. @throws InputError at `path`.
template <class Enum, std::size_t kCount>
Enum choice_in(const EnumName<Enum> (&names)[kCount], const std::string& name, Enum otherwise,
               const std::string& path) {
  return name.empty() ? otherwise : names[choice_of(name, all_names(names), 0, path)].value;
}

/// The sampler of `choices` called `name`, or the first if it is empty. @throws InputError at $.sampler.
Sampler sampler_choice(const std::string& name, std::span<const Sampler> choices);
/// The space-filling curve called `name`, or Hilbert's if it is empty. @throws InputError at $.curve.
CurveKind curve_choice(const std::string& name);

std::unique_ptr<MeasuredSet> make_parametric_set(const QualityRequest& request, ParametricShape shape);
std::unique_ptr<MeasuredSet> make_model_set(const QualityRequest& request);
std::unique_ptr<MeasuredSet> make_dots_set(const QualityRequest& request);

}  // namespace hilbrush
