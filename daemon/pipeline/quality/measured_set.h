#pragma once
#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/pipeline/quality/quality.h"
#include "sampling/curve/stream_dots.h"
#include "sampling/dots/dots.h"
#include "sampling/parametric/parametric.h"
#include "sampling/quality/quality.h"

/// Where the dots to be measured come from, and what they are held against.
namespace hilbrush {

/// The dots of one count. Which of the lists are filled depends on the kind of surface.
struct MeasuredDots {
  std::vector<Dot> dots;                      ///< on a mesh (of a formula: its triangles)
  std::vector<Eigen::Vector2d> plane_points;  ///< on the unit square
  std::vector<Eigen::Vector3d> directions;    ///< on the unit sphere
};

class MeasuredSet {
 public:
  virtual ~MeasuredSet() = default;

  virtual MeasuredDots place(std::uint64_t count) const = 0;
  /// The surface to hold them against; null if their density varies in a way that it can't be told.
  virtual const SurfaceQuality* surface() const = 0;
  /// Counts to measure if the request names none.
  virtual std::vector<std::uint64_t> default_counts() const = 0;

  std::string kind;                ///< "surface", "model" or "dots"
  std::vector<std::string> notes;  ///< what a reader of the figures must know
};

/// @throws InputError with the JSON path of what can't be done.
std::unique_ptr<MeasuredSet> make_measured_set(const QualityRequest& request);

/// The enumerator of `names` called `name`, or `otherwise` if that is empty. @throws InputError at `path`.
std::size_t choice_of(const std::string& name, const std::vector<std::string>& names, std::size_t otherwise,
                      const std::string& path);

std::unique_ptr<MeasuredSet> make_parametric_set(const QualityRequest& request, ParametricShape shape);
std::unique_ptr<MeasuredSet> make_model_set(const QualityRequest& request);
std::unique_ptr<MeasuredSet> make_dots_set(const QualityRequest& request);

}  // namespace hilbrush
