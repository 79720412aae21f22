#pragma once
#include <cmath>
#include <numbers>

/// Functions of one variable with their first two derivatives: parametric surfaces are composed of them.
namespace hilbrush {

struct Jet {
  double value = 0;
  double first = 0;
  double second = 0;

  /// offset + slope * t
  static Jet linear(double t, double slope, double offset) { return {offset + slope * t, slope, 0}; }
};

inline Jet operator-(const Jet& a) {
  return {-a.value, -a.first, -a.second};
}
inline Jet operator*(const Jet& a, const Jet& b) {
  return {a.value * b.value, a.first * b.value + a.value * b.first,
          a.second * b.value + 2 * a.first * b.first + a.value * b.second};
}
inline Jet operator*(double s, const Jet& a) {
  return {s * a.value, s * a.first, s * a.second};
}

/// f(inner), given f and its derivatives there.
inline Jet compose(double f, double first, double second, const Jet& inner) {
  return {f, first * inner.first, second * inner.first * inner.first + first * inner.second};
}
inline Jet sin(const Jet& a) {
  const double s = std::sin(a.value);
  return compose(s, std::cos(a.value), -s, a);
}
inline Jet cos(const Jet& a) {
  const double c = std::cos(a.value);
  return compose(c, -std::sin(a.value), -c, a);
}
/// Keeps the sign. Its derivatives are infinite at 0.
inline Jet cube_root(const Jet& a) {
  const double root = std::cbrt(a.value);
  const double first = 1 / (3 * root * root);
  return compose(root, first, -2 * first / (3 * root * root * root), a);
}
/// sin(x) / x
inline Jet sinc(const Jet& a) {
  const double x = a.value;
  const double x2 = x * x;
  if (std::abs(x) < .1)  // the series to x^6: errors below 1e-12
    return compose(1 - x2 / 6 * (1 - x2 / 20 * (1 - x2 / 42)), -x / 3 * (1 - x2 / 10 * (1 - x2 / 28)),
                   -1. / 3 + x2 / 10 * (1 - x2 * 5 / 84), a);
  const double s = std::sin(x);
  const double c = std::cos(x);
  return compose(s / x, (c - s / x) / x, (-s - 2 * (c - s / x) / x) / x, a);
}

}  // namespace hilbrush
