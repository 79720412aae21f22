#include "sampling/model/placement.h"

#include <cmath>

#include "sampling/base/input_error.h"
#include "sampling/base/text.h"

namespace hilbrush {
namespace {

constexpr double kMaxSideM = 2;     ///< larger than any cell's workspace: a wrong unit
constexpr double kMinSideM = 1e-6;  ///< below the resolution of axes and beam: a wrong unit

std::string millimeters(double length_m) {
  return number(length_m * 1e3) + " mm";
}

/// Meters of one unit of the file.
double scale_of(const Model& model, const PlacementOptions& options, double longest_side) {
  if (options.size_m) {
    if (!std::isfinite(*options.size_m) || *options.size_m <= 0)
      throw InputError("", "the size must be more than 0 mm");
    const double scale = *options.size_m / longest_side;
    // Both may be given as long as they agree.
    if (options.unit_m && std::abs(*options.unit_m / scale - 1) > 1e-6)
      throw InputError("", "--size-mm and --units-mm contradict each other: in units of " +
                               millimeters(*options.unit_m) + " the longest side is " +
                               millimeters(*options.unit_m * longest_side) + ", not " +
                               millimeters(*options.size_m) + "; give one of them");
    return scale;
  }
  const std::optional<double> unit_m = options.unit_m ? options.unit_m : model.unit_m;
  if (!unit_m)
    throw InputError(
        "",
        "the model's file does not say how large the object is: give --size-mm (its longest side) or "
        "--units-mm (one unit of the file)");
  if (!std::isfinite(*unit_m) || *unit_m <= 0) throw InputError("", "the unit must be more than 0 mm");
  return *unit_m;
}

}  // namespace

TexturedMesh place_on_table(const Model& model, const PlacementOptions& options) {
  TexturedMesh mesh = model.mesh;
  if (mesh.triangles.empty()) throw InputError("", "the model has no triangles");
  if (options.up.value_or(model.up) == UpAxis::kY)
    for (Eigen::Vector3d& p : mesh.vertices) p = {p.x(), -p.z(), p.y()};

  const auto [low, high] = bounds(mesh);
  const double longest_side = (high - low).maxCoeff();
  if (!std::isfinite(longest_side) || longest_side <= 0) throw InputError("", "the model has no extent");
  const double scale = scale_of(model, options, longest_side);
  const double size_m = scale * longest_side;
  if (!std::isfinite(size_m) || size_m > kMaxSideM)
    throw InputError("", "the object would be " + millimeters(size_m) + " long, more than " +
                             millimeters(kMaxSideM) +
                             "; give --size-mm (its longest side) or --units-mm (one unit of the file)");
  if (size_m < kMinSideM) throw InputError("", "the object would be only " + millimeters(size_m) + " long");
  const Eigen::Vector3d foot((low.x() + high.x()) / 2, (low.y() + high.y()) / 2, low.z());
  for (Eigen::Vector3d& p : mesh.vertices) p = scale * (p - foot);
  return mesh;
}

}  // namespace hilbrush
