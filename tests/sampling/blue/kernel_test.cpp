#include "sampling/blue/kernel.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace hilbrush {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

struct Source {
  Vector3d position_O;
  PairKernel kernel;
  double factor;
};

/// The sum of kernels, written down once more in doubles.
double energy(const std::vector<Source>& sources, const Vector3d& place_O) {
  double sum = 0;
  for (const Source& source : sources) {
    const double u =
        1 - (place_O - source.position_O).squaredNorm() / static_cast<double>(source.kernel.support2);
    if (u > 0) sum += source.factor * static_cast<double>(source.kernel.weight) * std::pow(u, 6);
  }
  return sum;
}

/// The step by differences of energy, and eigenvectors.
Vector2d step_by_differences(const std::vector<Source>& sources, double least) {
  constexpr double kStep = 1e-3;
  const auto at = [&](double x, double y) { return energy(sources, kStep * Vector3d(x, y, 0)); };
  const Vector2d gradient(at(1, 0) - at(-1, 0), at(0, 1) - at(0, -1));
  const double xy = (at(1, 1) - at(1, -1) - at(-1, 1) + at(-1, -1)) / 4;
  Eigen::Matrix2d hessian;
  hessian << at(1, 0) - 2 * at(0, 0) + at(-1, 0), xy, xy, at(0, 1) - 2 * at(0, 0) + at(0, -1);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(hessian / (kStep * kStep));
  Vector2d step = Vector2d::Zero();
  for (Eigen::Index k = 0; k < 2; ++k) {
    const Vector2d axis = axes.eigenvectors().col(k);
    step -= axis.dot(gradient / (2 * kStep)) / std::max(std::abs(axes.eigenvalues()[k]), least) * axis;
  }
  return step;
}

TEST(TangentSlopeTest, NewtonStepIsThatOfTheEnergy) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> spacing(.7, 1.4), along(-1.5, 1.5), up(-.2, .2);
  for (int round = 0; round < 200; ++round) {
    const double least = round % 2 == 0 ? .5 : 1e-2;
    std::vector<Source> sources;
    TangentSlope slope(Vector3d::Zero(), Vector3d::UnitX(), Vector3d::UnitY());
    // Any number of them, so that some are left over when the last four are full.
    for (int i = 0; i < 1 + round % 9; ++i) {
      const PairKernel kernel(spacing(random), spacing(random));
      const Vector3d position_O(along(random), along(random), up(random));
      sources.push_back({position_O, kernel, 1});
      slope.add(kernel, position_O);
      const Vector3d middle_O(along(random), along(random), up(random));
      FourPulls pulls;
      for (Eigen::Index k = 0; k < 4; ++k) {
        pulls.x[k] = static_cast<float>(.3 * along(random));
        pulls.y[k] = static_cast<float>(.3 * along(random));
        pulls.share[k] = static_cast<float>(k) / 6;
        sources.push_back({middle_O + pulls.place(k), kernel, -static_cast<double>(pulls.share[k])});
      }
      slope.subtract(kernel, middle_O, pulls);
    }
    const Vector2d expected = step_by_differences(sources, least);
    const Vector2d step = slope.newton_step(static_cast<float>(least)).cast<double>();
    EXPECT_NEAR((step - expected).norm(), 0, 2e-3 * std::max(1., expected.norm())) << round;
  }
}

TEST(TangentSlopeTest, NothingNearMeansNoStep) {
  TangentSlope slope(Vector3d::Zero(), Vector3d::UnitX(), Vector3d::UnitY());
  slope.add(PairKernel(1., 1.), Vector3d(9, 0, 0));
  EXPECT_EQ(slope.newton_step(.1f), Eigen::Vector2f(0, 0));
}

}  // namespace
}  // namespace hilbrush
