#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "sampling/base/enum_names.h"
#include "sampling/options/sample_options.h"

/// Dots on surfaces given by a formula, as in chapters 4 and 5 of the thesis:
///   surface, density -> adaptive curve over [0, 1]^2 -> area of each leaf -> strata -> dots.
/// Used to measure the method where the exact answer is known. Painted models are sampled through
/// SurfaceCurve (sampling/curve/surface_curve.h). Lengths are in the units of the formula.
namespace hilbrush {

/// First partial derivatives of the position.
struct Tangents {
  Eigen::Vector3d du, dv;
};
/// Second partial derivatives of the position.
struct SecondDerivatives {
  Eigen::Vector3d duu, duv, dvv;
};

/// A surface over the unit square. Thread-safe.
class ParametricSurface {
 public:
  virtual ~ParametricSurface() = default;

  virtual Eigen::Vector3d position(const Eigen::Vector2d& uv) const = 0;
  /// May be infinite where the parameterization is singular.
  virtual Tangents tangents(const Eigen::Vector2d& uv) const = 0;
  virtual SecondDerivatives second_derivatives(const Eigen::Vector2d& uv) const = 0;

  /// Unit; where the tangents do not span a plane (a pole), that of a place next to it.
  Eigen::Vector3d normal(const Eigen::Vector2d& uv) const;
  /// dA / (du dv) = sqrt(EG - F^2); equation 2.22 omits the root.
  double area_element(const Eigen::Vector2d& uv) const;
  /// K = k1 k2 and H = (k1 + k2) / 2 of the shape operator (equation 2.33). Not finite where the surface is
  /// singular.
  double gaussian_curvature(const Eigen::Vector2d& uv) const;
  double mean_curvature(const Eigen::Vector2d& uv) const;
};

enum class ParametricShape {
  kPlane,                          ///< the unit square, z = 0
  kSphere,                         ///< of radius 1, u the longitude, v the polar angle
  kMonkeySaddle,                   ///< table 5.5
  kEightSurface,                   ///< table 5.5
  kWhitneyUmbrella,                ///< table 5.5
  kSuperEllipsoid,                 ///< equations 4.2 to 4.4, all eight octants
  kSuperEllipsoidReparameterized,  ///< the same surface after a power law in u and v (section 4.5)
  kEqualAreaSphere                 ///< the sphere after the reparameterization of equation 5.3
};

inline constexpr EnumName<ParametricShape> kParametricShapeNames[] = {
    {ParametricShape::kPlane, "plane"},
    {ParametricShape::kSphere, "sphere"},
    {ParametricShape::kMonkeySaddle, "monkey_saddle"},
    {ParametricShape::kEightSurface, "eight_surface"},
    {ParametricShape::kWhitneyUmbrella, "whitney_umbrella"},
    {ParametricShape::kSuperEllipsoid, "super_ellipsoid"},
    {ParametricShape::kSuperEllipsoidReparameterized, "super_ellipsoid_reparameterized"},
    {ParametricShape::kEqualAreaSphere, "equal_area_sphere"},
};

std::unique_ptr<ParametricSurface> make_surface(ParametricShape shape);

/// Relative density of dots: only its proportions count.
enum class ParametricDensity {
  kConstant,
  kU,                  ///< proportional to u (figure 5.13, middle)
  kUPlusV,             ///< proportional to u + v (figure 5.13, right)
  kMeanCurvature,      ///< proportional to |H| ...
  kGaussianCurvature,  ///< ... or |K| (figures 5.14 to 5.16), both clipped where 99.5 % of the area has less:
                       ///< the Whitney umbrella's pinch would take all dots otherwise, and the thesis does
                       ///< not say
};

inline constexpr EnumName<ParametricDensity> kParametricDensityNames[] = {
    {ParametricDensity::kConstant, "constant"},
    {ParametricDensity::kU, "u"},
    {ParametricDensity::kUPlusV, "u+v"},
    {ParametricDensity::kMeanCurvature, "mean_curvature"},
    {ParametricDensity::kGaussianCurvature, "gaussian_curvature"},
};

/// How the area of a leaf of the curve is found (section 4.3).
enum class AreaMethod {
  kTriangle,  ///< (a) of the vertex and the two next to it along the curve; zero where the curve runs
              ///< straight
  kSquare,    ///< (b) of the leaf's four corners, as two triangles
  kFirstFundamentalForm,  ///< (c) sqrt(EG - F^2) at the vertex times the leaf's size; (b) where that is not
                          ///< finite
};

inline constexpr EnumName<AreaMethod> kAreaMethodNames[] = {
    {AreaMethod::kTriangle, "triangle"},
    {AreaMethod::kSquare, "square"},
    {AreaMethod::kFirstFundamentalForm, "first_fundamental_form"},
};

struct ParametricOptions {
  std::uint64_t dot_count = 0;
  CurveKind curve = CurveKind::kHilbert;  ///< or kPeano2
  AreaMethod area = AreaMethod::kFirstFundamentalForm;
  ParametricDensity density = ParametricDensity::kConstant;
  Sampler sampler = Sampler::kJittered;  ///< all but kBlue and kFine, which need a mesh
  std::uint64_t seed = 1;
  /// Vertices of the curve for each dot. The thesis finds 10 enough (section 4.2.1), which puts dots on
  /// vertices; here they go anywhere in a leaf.
  double omega = 4;
  /// Depth of the curve: at least (else 5 with hilbert, 3 with peano2) and at most (else 13 and 8).
  std::optional<int> minimum_depth, maximum_depth;
  /// Puts dots on the vertices of the curve, as the thesis does; two may fall on one. Not for kCentroid.
  bool snaps_to_vertices = false;
};

struct ParametricDot {
  Eigen::Vector2d uv;
  Eigen::Vector3d position;
  Eigen::Vector3d normal;  ///< unit
};

struct ParametricSamples {
  std::vector<ParametricDot> dots;  ///< exactly dot_count, in order of the curve
  double area = 0;                  ///< of the surface, by the chosen method
  std::uint64_t vertex_count = 0;   ///< leaves of the adaptive curve
  int deepest = 0;                  ///< its greatest depth
};

/// Places dots along the adaptive curve (figures 4.1 and 4.6): a quad is divided while its depth is below the
/// minimum, or while it is below the maximum and one of its corners or mid-sides is further from its center
/// than half the spacing of omega * dot_count vertices, in space and - where the density is above its mean -
/// by density. Leaves are not stored but walked twice, in parallel: to measure, then to place. The same
/// options give the same bytes.
/// @throws InputError for a sampler, curve, depth or count that it does not support, or a density that is
/// zero everywhere. Cost: about 60 ns a leaf on the sphere. Memory: the dots.
ParametricSamples sample_parametric(const ParametricSurface& surface, const ParametricOptions& options);

/// Area of the surface as each method measures it on the same curve, indexed by AreaMethod.
struct ParametricAreas {
  std::array<double, 3> by_method{};
  std::uint64_t vertex_count = 0;
};
ParametricAreas measure_parametric(const ParametricSurface& surface, const ParametricOptions& options);

/// The vertices of the adaptive curve in order, for pictures: 16 bytes each.
std::vector<Eigen::Vector2d> parametric_curve(const ParametricSurface& surface,
                                              const ParametricOptions& options);

}  // namespace hilbrush
