#include "sampling/tone/triangle_tone.h"

#include <algorithm>

#include "sampling/base/check.h"
#include "sampling/base/cross.h"
#include "sampling/tone/tone_field.h"
#include "sampling/tone/tone_polygon.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d;

}  // namespace

double TriangleTone::asked(const Vector2d& b) const {
  if (kind_ == kConstant) return tone_;
  if (kind_ == kTexels) return layer_->at(origin_ + b.x() * e1_ + b.y() * e2_, addressing_);
  return field_->asked({triangle_, {1 - b.x() - b.y(), b.x(), b.y()}});
}

double TriangleTone::wanted(const Vector2d& b) const {
  if (is_wanted_asked_) return asked(b);
  return field_->wanted({triangle_, {1 - b.x() - b.y(), b.x(), b.y()}});
}

ToneIntegral TriangleTone::integrate(std::span<const Vector2d> polygon) const {
  switch (kind_) {
    case kTexels:
      return integrate_texels(polygon);
    case kColors:
      return field_->integrate_colors(triangle_, polygon);
    case kConstant:
      break;
  }
  return integrate_constant(polygon, tone_, space_);
}

ToneIntegral TriangleTone::integrate_texels(std::span<const Vector2d> polygon) const {
  std::array<Vector2d, kMaxPolygonCorners> texels;
  CHECK_LE(polygon.size(), texels.size());
  double twice_area_b = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    texels[i] = origin_ + polygon[i].x() * e1_ + polygon[i].y() * e2_;
    if (i >= 2) twice_area_b += cross(polygon[i - 1] - polygon[0], polygon[i] - polygon[0]);
  }
  ToneIntegral result;
  result.area_m2 = .5 * std::abs(twice_area_b) * space_;
  if (twice_area_b == 0) return result;
  const TexelIntegral t = layer_->integrate({texels.data(), polygon.size()}, addressing_);
  // From texels to space; the sign takes care of clockwise polygons and mirrored textures.
  const double scale = (twice_area_b > 0 ? space_ : -space_) * per_determinant_;
  const Vector2d first = t.first - t.mass * origin_;
  result.mass = std::max(0., scale * t.mass);
  result.first = scale * per_determinant_ * Vector2d(cross(first, e2_), cross(e1_, first));
  result.square = std::max(0., scale * t.square);
  return result;
}

}  // namespace hilbrush
