#include <array>
#include <numbers>
#include <utility>

#include "sampling/base/check.h"
#include "sampling/parametric/jet.h"
#include "sampling/parametric/parametric.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;

/// A coordinate that is a function of u times a function of v.
struct Factors {
  Jet u, v;
};
/// x, y and z of a surface.
using Product = std::array<Factors, 3>;

/// A surface whose coordinates are such products: all of the thesis's except the monkey saddle.
template <class Shape>
class ProductSurface final : public ParametricSurface {
 public:
  Vector3d position(const Vector2d& uv) const override {
    return gather(Shape::at(uv), [](const Factors& f) { return f.u.value * f.v.value; });
  }
  Tangents tangents(const Vector2d& uv) const override {
    const Product product = Shape::at(uv);
    return {gather(product, [](const Factors& f) { return f.u.first * f.v.value; }),
            gather(product, [](const Factors& f) { return f.u.value * f.v.first; })};
  }
  SecondDerivatives second_derivatives(const Vector2d& uv) const override {
    const Product product = Shape::at(uv);
    return {gather(product, [](const Factors& f) { return f.u.second * f.v.value; }),
            gather(product, [](const Factors& f) { return f.u.first * f.v.first; }),
            gather(product, [](const Factors& f) { return f.u.value * f.v.second; })};
  }

 private:
  template <class Part>
  static Vector3d gather(const Product& product, Part part) {
    return {part(product[0]), part(product[1]), part(product[2])};
  }
};

constexpr Jet kOne{1, 0, 0};

struct Plane {
  static Product at(const Vector2d& uv) {
    return {{{Jet::linear(uv.x(), 1, 0), kOne}, {kOne, Jet::linear(uv.y(), 1, 0)}, {Jet(), kOne}}};
  }
};

struct Sphere {
  static Product at(const Vector2d& uv) {
    const Jet longitude = Jet::linear(uv.x(), 2 * kPi, 0);
    const Jet polar = Jet::linear(uv.y(), kPi, 0);
    const Jet radius = sin(polar);
    return {{{cos(longitude), radius}, {sin(longitude), radius}, {kOne, cos(polar)}}};
  }
};

/// z = 2 v - 1 and the circle's radius follows.
struct EqualAreaSphere {
  static Product at(const Vector2d& uv) {
    const Jet longitude = Jet::linear(uv.x(), 2 * kPi, 0);
    const Jet z = Jet::linear(uv.y(), 2, -1);
    const double r = std::sqrt(std::max(0., 1 - z.value * z.value));
    const Jet radius = compose(r, -z.value / r, -1 / (r * r * r), z);
    return {{{cos(longitude), radius}, {sin(longitude), radius}, {kOne, z}}};
  }
};

struct EightSurface {
  static Product at(const Vector2d& uv) {
    const Jet turn = Jet::linear(uv.x(), 2 * kPi, 0);
    const Jet v = Jet::linear(uv.y(), kPi, -kPi / 2);
    const Jet radius = sin(2 * v);
    return {{{cos(turn), radius}, {sin(turn), radius}, {kOne, sin(v)}}};
  }
};

struct WhitneyUmbrella {
  static Product at(const Vector2d& uv) {
    const Jet u = Jet::linear(uv.x(), 2, -1);
    const Jet v = Jet::linear(uv.y(), 2, -1);
    return {{{u, v}, {u, kOne}, {kOne, v * v}}};
  }
};

/// Cube roots, with sign, of the cosine and the sine of an angle.
struct RoundRoots {
  Jet cosine, sine;
};

template <RoundRoots (*kRoots)(double quarters, double quarters_a_unit)>
struct SuperEllipsoidOf {
  static Product at(const Vector2d& uv) {
    const RoundRoots latitude = kRoots(2 * uv.x() - 1, 2);
    const RoundRoots longitude = kRoots(4 * uv.y() - 2, 4);
    return {{{latitude.cosine, longitude.cosine}, {latitude.cosine, longitude.sine}, {latitude.sine, kOne}}};
  }
};

/// The angle itself, in quarter turns, is the parameter: derivatives are infinite at each quarter.
RoundRoots plain_roots(double quarters, double slope) {
  const Jet angle{kPi / 2 * quarters, kPi / 2 * slope, 0};
  return {cube_root(cos(angle)), cube_root(sin(angle))};
}

/// In the eighths on either side of a quarter turn the angle from it grows as 2 pi r^3, so that the cube root
/// of its sine, (2 pi)^(1/3) r sinc^(1/3), is smooth.
RoundRoots smooth_roots(double quarters, double slope) {
  const double nearest = std::round(quarters);
  const Jet r{quarters - nearest, slope, 0};
  const Jet angle = 2 * kPi * (r * r * r);
  const Jet sine = std::cbrt(2 * kPi) * (r * cube_root(sinc(angle)));
  const Jet cosine = cube_root(cos(angle));
  switch (((static_cast<int>(nearest) % 4) + 4) % 4) {
    case 0:
      return {cosine, sine};
    case 1:
      return {-sine, cosine};
    case 2:
      return {-cosine, -sine};
    default:
      return {sine, -cosine};
  }
}

class MonkeySaddle final : public ParametricSurface {
 public:
  Vector3d position(const Vector2d& uv) const override {
    const auto [u, v] = wide(uv);
    return {u, v, u * u * u - 3 * u * v * v};
  }
  Tangents tangents(const Vector2d& uv) const override {
    const auto [u, v] = wide(uv);
    return {2 * Vector3d(1, 0, 3 * (u * u - v * v)), 2 * Vector3d(0, 1, -6 * u * v)};
  }
  SecondDerivatives second_derivatives(const Vector2d& uv) const override {
    const auto [u, v] = wide(uv);
    return {4 * Vector3d(0, 0, 6 * u), 4 * Vector3d(0, 0, -6 * v), 4 * Vector3d(0, 0, -6 * u)};
  }

 private:
  static std::pair<double, double> wide(const Vector2d& uv) { return {2 * uv.x() - 1, 2 * uv.y() - 1}; }
};

}  // namespace

std::unique_ptr<ParametricSurface> make_surface(ParametricShape shape) {
  switch (shape) {
    case ParametricShape::kPlane:
      return std::make_unique<ProductSurface<Plane>>();
    case ParametricShape::kSphere:
      return std::make_unique<ProductSurface<Sphere>>();
    case ParametricShape::kMonkeySaddle:
      return std::make_unique<MonkeySaddle>();
    case ParametricShape::kEightSurface:
      return std::make_unique<ProductSurface<EightSurface>>();
    case ParametricShape::kWhitneyUmbrella:
      return std::make_unique<ProductSurface<WhitneyUmbrella>>();
    case ParametricShape::kSuperEllipsoid:
      return std::make_unique<ProductSurface<SuperEllipsoidOf<plain_roots>>>();
    case ParametricShape::kSuperEllipsoidReparameterized:
      return std::make_unique<ProductSurface<SuperEllipsoidOf<smooth_roots>>>();
    case ParametricShape::kEqualAreaSphere:
      return std::make_unique<ProductSurface<EqualAreaSphere>>();
  }
  CHECK(!"a shape without a surface");
  return nullptr;
}

}  // namespace hilbrush
