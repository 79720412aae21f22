#include "sampling/quality/point_transform.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <unsupported/Eigen/FFT>

namespace hilbrush {
namespace {

using Complex = std::complex<double>;
using Fft = Eigen::FFT<double>;
using Indices = tbb::blocked_range<std::size_t>;

/// I0(beta sqrt(1 - (2x / width)^2)), x in knots of the grid.
struct KaiserBessel {
  static constexpr int kWidth = 8;
  static constexpr double kBeta = std::numbers::pi * kWidth * .75;  ///< for a grid of twice the resolution

  static double value(double x) {
    const double z = 1 - std::pow(2 * x / kWidth, 2);
    return z <= 0 ? 0 : std::cyl_bessel_i(0, kBeta * std::sqrt(z));
  }
  /// Its Fourier transform at `frequency` periods a knot.
  static double transform(double frequency) {
    const double s = std::sqrt(kBeta * kBeta - std::pow(std::numbers::pi * kWidth * frequency, 2));
    return kWidth * std::sinh(s) / s;
  }
};

/// First knot under the kernel, and its values there.
struct Footprint {
  std::size_t first;
  std::array<double, KaiserBessel::kWidth> values;

  Footprint(double place, std::size_t size) {
    const double knots = (place - std::floor(place)) * static_cast<double>(size);
    const double low = std::ceil(knots - KaiserBessel::kWidth / 2.);
    for (std::size_t k = 0; k < values.size(); ++k)
      values[k] = KaiserBessel::value(low + static_cast<double>(k) - knots);
    first = (static_cast<std::size_t>(low + static_cast<double>(size))) % size;
  }
};

std::vector<double> spread(std::span<const Eigen::Vector2d> points, std::size_t size) {
  std::vector<double> grid(size * size, 0.);
  for (const auto& point : points) {
    const Footprint x(point.x(), size), y(point.y(), size);
    for (std::size_t j = 0; j < y.values.size(); ++j) {
      double* row = grid.data() + (y.first + j) % size * size;
      for (std::size_t i = 0; i < x.values.size(); ++i)
        row[(x.first + i) % size] += x.values[i] * y.values[j];
    }
  }
  return grid;
}

}  // namespace

PointTransform::PointTransform(std::span<const Eigen::Vector2d> points, int highest) : highest_(highest) {
  const auto column_count = static_cast<std::size_t>(highest) + 1;
  const auto row_count = 2 * column_count - 1;
  const std::size_t size = std::bit_ceil(std::max<std::size_t>(2 * row_count, 16));
  const std::vector<double> grid = spread(points, size);

  std::vector<Complex> columns(column_count * size);  // by kx, then the row
  tbb::parallel_for(Indices(0, size, 64), [&](const Indices& rows) {
    Fft fft;
    fft.SetFlag(Fft::HalfSpectrum);
    std::vector<Complex> transformed(size / 2 + 1);
    for (std::size_t j = rows.begin(); j < rows.end(); ++j) {
      fft.fwd(transformed.data(), grid.data() + j * size, static_cast<Eigen::Index>(size));
      for (std::size_t kx = 0; kx < column_count; ++kx) columns[kx * size + j] = transformed[kx];
    }
  });

  values_.resize(column_count * row_count);
  tbb::parallel_for(Indices(0, column_count, 16), [&](const Indices& range) {
    Fft fft;
    std::vector<Complex> transformed(size);
    for (std::size_t kx = range.begin(); kx < range.end(); ++kx) {
      fft.fwd(transformed.data(), columns.data() + kx * size, static_cast<Eigen::Index>(size));
      const double of_x = KaiserBessel::transform(static_cast<double>(kx) / static_cast<double>(size));
      for (int ky = -highest; ky <= highest; ++ky) {
        const double of_y = KaiserBessel::transform(static_cast<double>(ky) / static_cast<double>(size));
        const std::size_t row = ky >= 0 ? static_cast<std::size_t>(ky) : size - static_cast<std::size_t>(-ky);
        values_[kx * row_count + static_cast<std::size_t>(ky + highest)] = transformed[row] / (of_x * of_y);
      }
    }
  });
}

}  // namespace hilbrush
