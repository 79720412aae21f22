#include "sampling/curve/hilbert.h"

#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "sampling/curve/strata.h"

namespace hilbrush {
namespace {

using Place = std::array<int, 3>;

template <class Hilbert>
void walk(Hilbert hilbert, int depth, const Place& place, std::vector<Place>& out) {
  if (depth == 0) return out.push_back(place);
  for (unsigned i = 0; i < Hilbert::kChildCount; ++i) {
    Place child;
    for (unsigned k = 0; k < 3; ++k) child[k] = 2 * place[k] + static_cast<int>(hilbert.place(i) >> k & 1u);
    walk(hilbert.child(i), depth - 1, child, out);
  }
}

template <class Hilbert>
std::vector<Place> whole_walk(int depth) {
  std::vector<Place> places;
  walk(Hilbert{}, depth, {0, 0, 0}, places);
  return places;
}

template <class Hilbert>
void expect_curve(int depth) {
  const auto places = whole_walk<Hilbert>(depth);
  EXPECT_EQ(std::set<Place>(places.begin(), places.end()).size(), places.size()) << "every quad once";
  for (std::size_t i = 1; i < places.size(); ++i) {
    int steps = 0;
    for (std::size_t k = 0; k < 3; ++k) steps += std::abs(places[i][k] - places[i - 1][k]);
    ASSERT_EQ(steps, 1) << "neighbours along the curve are neighbours in space, at " << i << " depth " << depth;
  }
  EXPECT_EQ(places.front(), (Place{0, 0, 0}));
  EXPECT_EQ(places.back(), (Place{(1 << depth) - 1, 0, 0})) << "squares in a row join";
}

TEST(Hilbert, EachQuadOnceAndNeighboursAdjacent) {
  for (int depth = 1; depth <= 6; ++depth) expect_curve<HilbertQuad>(depth);
}

TEST(Hilbert, EachCubeOnceAndNeighboursAdjacent) {
  for (int depth = 1; depth <= 4; ++depth) expect_curve<HilbertCube>(depth);
}

TEST(Hilbert, MomentIsTheSumOverTheWalk) {
  const int depth = 5;
  const auto places = whole_walk<HilbertQuad>(depth);
  const double n = static_cast<double>(places.size()), size = 1. / (1 << depth);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < places.size(); ++i) {
    EXPECT_NEAR((hilbert_moment({}, static_cast<double>(i) / n) - sum).norm(), 0, 1e-14) << i;
    sum += Eigen::Vector3d(places[i][0] + .5, places[i][1] + .5, 0) * size / n;
  }
  EXPECT_NEAR((hilbert_moment({}, 1) - Eigen::Vector3d(.5, .5, 0)).norm(), 0, 1e-14);
}

}  // namespace
}  // namespace hilbrush
