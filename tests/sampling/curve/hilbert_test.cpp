#include "sampling/curve/hilbert.h"

#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "sampling/curve/curve_moment.h"

namespace hilbrush {
namespace {

using Place = std::array<int, 3>;

/// A child's step along an axis from its parent's low corner.
template <class Curve>
int step_of(unsigned place, unsigned axis) {
  for (unsigned k = 0; k < axis; ++k) place /= Curve::kSide;
  return static_cast<int>(place % Curve::kSide);
}

template <class Curve>
void walk(Curve curve, int depth, const Place& place, std::vector<Place>& out) {
  if (depth == 0) return out.push_back(place);
  for (unsigned i = 0; i < Curve::kChildCount; ++i) {
    Place child;
    for (unsigned k = 0; k < 3; ++k)
      child[k] = static_cast<int>(Curve::kSide) * place[k] + step_of<Curve>(curve.slot(i), k);
    walk(curve.child(i), depth - 1, child, out);
  }
}

template <class Curve>
std::vector<Place> whole_walk(int depth) {
  std::vector<Place> places;
  walk(Curve{}, depth, {0, 0, 0}, places);
  return places;
}

template <class Curve>
std::vector<Place> expect_curve(int depth) {
  const auto places = whole_walk<Curve>(depth);
  EXPECT_EQ(std::set<Place>(places.begin(), places.end()).size(), places.size()) << "every quad once";
  for (std::size_t i = 1; i < places.size(); ++i) {
    int steps = 0;
    for (std::size_t k = 0; k < 3; ++k) steps += std::abs(places[i][k] - places[i - 1][k]);
    EXPECT_EQ(steps, 1) << "neighbors along the curve are neighbors in space, at " << i << " depth " << depth;
  }
  EXPECT_EQ(places.front(), (Place{0, 0, 0}));
  return places;
}

TEST(Hilbert, EachQuadOnceAndNeighborsAdjacent) {
  for (int depth = 1; depth <= 6; ++depth)
    EXPECT_EQ(expect_curve<HilbertQuad>(depth).back(), (Place{(1 << depth) - 1, 0, 0}))
        << "squares in a row join";
}

TEST(Hilbert, EachCubeOnceAndNeighborsAdjacent) {
  for (int depth = 1; depth <= 4; ++depth)
    EXPECT_EQ(expect_curve<HilbertCube>(depth).back(), (Place{(1 << depth) - 1, 0, 0}));
}

TEST(Peano, EachQuadOnceAndNeighborsAdjacent) {
  int side = 1;
  for (int depth = 1; depth <= 4; ++depth) {
    side *= 3;
    EXPECT_EQ(expect_curve<PeanoQuad>(depth).back(), (Place{side - 1, side - 1, 0}));
  }
}

TEST(Peano, SquaresInARowJoin) {
  std::vector<Place> places;
  PeanoQuad curve;
  for (int square = 0; square < 4; ++square, curve = curve.next_square()) {
    std::vector<Place> here;
    walk(curve, 2, {0, 0, 0}, here);
    for (Place& place : here) place[0] += 9 * square;
    if (!places.empty()) {
      EXPECT_EQ(here.front()[0], places.back()[0] + 1);
      EXPECT_EQ(here.front()[1], places.back()[1]);
    }
    places = here;
  }
}

template <class Curve>
void expect_moments(int depth, double side) {
  const auto places = whole_walk<Curve>(depth);
  const double n = static_cast<double>(places.size());
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double share = static_cast<double>(i) / n;
    EXPECT_NEAR((curve_moment(Curve{}, share) - sum).norm(), 0, 1e-14) << i;
    const Eigen::Vector2d low(places[i][0] / side, places[i][1] / side);
    const Eigen::Vector2d place = curve_place(Curve{}, share + .5 / n) - low;
    EXPECT_GE(place.minCoeff(), -1e-12);
    EXPECT_LE(place.maxCoeff(), 1 / side + 1e-12);
    sum += (low + Eigen::Vector2d::Constant(.5 / side)) / n;
  }
  EXPECT_NEAR((curve_moment(Curve{}, 1) - Eigen::Vector2d(.5, .5)).norm(), 0, 1e-14);
}

TEST(CurveMoment, IsTheSumOverTheWalk) {
  expect_moments<HilbertQuad>(5, 32);
  expect_moments<PeanoQuad>(3, 27);
}

}  // namespace
}  // namespace hilbrush
