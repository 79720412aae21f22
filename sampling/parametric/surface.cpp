#include <Eigen/Geometry>
#include <cmath>

#include "sampling/parametric/parametric.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Coefficients of the first and second fundamental form (equations 2.19 and 2.28).
struct Forms {
  double e, f, g, l, m, n;

  double determinant() const { return e * g - f * f; }
};

Forms forms_at(const ParametricSurface& surface, const Vector2d& uv) {
  const Tangents t = surface.tangents(uv);
  const SecondDerivatives s = surface.second_derivatives(uv);
  const Vector3d normal = t.du.cross(t.dv).normalized();
  return {t.du.squaredNorm(), t.du.dot(t.dv),    t.dv.squaredNorm(),
          s.duu.dot(normal),  s.duv.dot(normal), s.dvv.dot(normal)};
}

}  // namespace

Vector3d ParametricSurface::normal(const Vector2d& uv) const {
  const Vector2d middle(.5, .5);
  for (double towards_middle = 0; towards_middle < .1; towards_middle = 10 * towards_middle + 1e-7) {
    const Vector2d beside =
        uv + towards_middle * (middle - uv) + Vector2d(towards_middle, 2 * towards_middle) / 16;
    const Tangents t = tangents(beside);
    const Vector3d normal = t.du.cross(t.dv);
    const double length = normal.norm();
    if (std::isfinite(length) && length > 1e-12 * t.du.norm() * t.dv.norm() && length > 1e-30)
      return normal / length;
  }
  return Vector3d::UnitZ();
}

double ParametricSurface::area_element(const Vector2d& uv) const {
  const Tangents t = tangents(uv);
  return t.du.cross(t.dv).norm();
}

double ParametricSurface::gaussian_curvature(const Vector2d& uv) const {
  const Forms forms = forms_at(*this, uv);
  return (forms.l * forms.n - forms.m * forms.m) / forms.determinant();
}

double ParametricSurface::mean_curvature(const Vector2d& uv) const {
  const Forms forms = forms_at(*this, uv);
  return (forms.e * forms.n - 2 * forms.f * forms.m + forms.g * forms.l) / (2 * forms.determinant());
}

}  // namespace hilbrush
