#pragma once
#include "sampling/curve/strata.h"
#include "sampling/curve/surface_curve.h"

/// From a stratum to its dot.
namespace hilbrush {

/// The surface point nearest to `target_O` near `start`: a short walk from triangle to triangle.
SurfacePoint walk_towards(const TexturedMesh& mesh, const Neighbours& neighbours, const SurfacePoint& start,
                          const Eigen::Vector3d& target_O);

/// The stratum's centre of mass, put back on the surface; where that is blank, the centre of the stratum's heaviest
/// crumb.
SurfacePoint centre_on_surface(const SurfaceCurve::Implementation& curve, const ToneField& tone,
                               const Stratum& stratum);

/// The dot at a surface point.
Dot make_dot(const SurfaceCurve::Implementation& curve, const ToneField& tone, const SurfacePoint& point,
             std::uint32_t component);

}  // namespace hilbrush
