#include "planner/mounting_advice.h"

#include <gtest/gtest.h>

#include "planner/poses/posed_dots.h"
#include "planner/reach/reach.h"
#include "tests/planner/workpieces.h"

namespace hilbrush {
namespace {

struct Reached {
  std::vector<SkippedDot> skipped;
  double share = 0;
};

Reached reached(const TexturedMesh& mesh, const CellDescription& cell, const DotSequence& dots) {
  const Reach reach(mesh, cell, {});
  Reached result;
  for (std::uint32_t i = 0; i < dots.dots.size(); ++i) {
    PoseSearchResult found = reach.find_pose(target_of(dots.dots[i]), {});
    if (found.pose) continue;
    found.skipped.dot_index = i;
    result.skipped.push_back(std::move(found.skipped));
  }
  result.share = 1 - static_cast<double>(result.skipped.size()) / static_cast<double>(dots.dots.size());
  return result;
}

TEST(MountingAdvice, AHigherPostReachesTheUnderside) {
  CellDescription cell = default_cell();
  cell.fixture.post_height_m = .002;
  const TexturedMesh mesh = ball(.03);
  const DotSequence dots = scatter(mesh, 1.5e-3);
  const Reached now = reached(mesh, cell, dots);
  const auto advice = advise_mounting(mesh, cell, {}, {}, dots, now.skipped, 1);
  ASSERT_TRUE(advice);
  ASSERT_TRUE(advice->post_height_m);
  EXPECT_NEAR(advice->reached_now, now.share, 1e-12);
  EXPECT_GT(advice->reached_then, advice->reached_now);
  // What was estimated on a sample is what all dots say.
  cell.fixture.post_height_m = *advice->post_height_m;
  EXPECT_NEAR(reached(mesh, cell, dots).share, advice->reached_then, .02);
  const std::string sentence = advice_sentence(*advice);
  EXPECT_NE(sentence.find("--post-height-mm"), std::string::npos) << sentence;
  EXPECT_NE(sentence.find("% of the dots instead of"), std::string::npos) << sentence;
}

/// From above, on a table that hardly tilts, a plate that stands on edge shows nothing but its rim.
TEST(MountingAdvice, AnotherUpAxisReachesWhatLiesTowardsThePlate) {
  CellDescription cell = default_cell();
  cell.axes[kTilt].min = 0;
  cell.axes[kTilt].max = .35;
  cell.arm.beam_depression = 1.45;
  TexturedMesh mesh = revolve({{0, .019}, {.04, .019}, {.04, .02}, {0, .02}});            // a plate, ...
  for (auto& p : mesh.vertices) p = Eigen::Vector3d(p.x(), -p.z() + .0195, p.y() + .04);  // ... on edge
  const DotSequence dots = scatter(mesh, 2e-3);
  const Reached now = reached(mesh, cell, dots);
  Standing standing;
  standing.up = UpAxis::kZ;
  const auto advice = advise_mounting(mesh, cell, standing, {}, dots, now.skipped, 1);
  ASSERT_TRUE(advice) << now.share;
  ASSERT_TRUE(advice->up) << advice_sentence(*advice);
  EXPECT_EQ(*advice->up, UpAxis::kY);
  EXPECT_NE(advice_sentence(*advice).find("--up y"), std::string::npos);
}

TEST(MountingAdvice, NothingIsSaidWhereNothingHelps) {
  const CellDescription cell = default_cell();
  const TexturedMesh mesh = drilled_block();
  const DotSequence dots = scatter(mesh, 2e-3);
  const Reached now = reached(mesh, cell, dots);
  ASSERT_FALSE(now.skipped.empty());  // the walls of the hole, on either axis
  EXPECT_FALSE(advise_mounting(mesh, cell, {}, {}, dots, now.skipped, 1));
  EXPECT_FALSE(advise_mounting(mesh, cell, {}, {}, dots, {}, 1));
  std::vector<SkippedDot> for_energy = now.skipped;
  for (SkippedDot& dot : for_energy) dot.reason = SkipReason::kEnergy;
  EXPECT_FALSE(advise_mounting(mesh, cell, {}, {}, dots, for_energy, 1));
}

/// Five that a higher post would reach, of some thousand: not worth another mounting.
TEST(MountingAdvice, NothingIsSaidOfAHandfulOfDots) {
  CellDescription cell = default_cell();
  cell.fixture.post_height_m = .002;
  const TexturedMesh mesh = ball(.03);
  const DotSequence dots = scatter(mesh, 1.5e-3);
  const Reached now = reached(mesh, cell, dots);
  const auto advice = advise_mounting(mesh, cell, {}, {}, dots, now.skipped, 1);
  ASSERT_TRUE(advice && advice->post_height_m);
  CellDescription higher = cell;
  higher.fixture.post_height_m = *advice->post_height_m;
  std::vector<bool> is_skipped(dots.dots.size(), false);
  std::vector<bool> is_hopeless(dots.dots.size(), false);
  for (const SkippedDot& dot : now.skipped) is_skipped[dot.dot_index] = true;
  for (const SkippedDot& dot : reached(mesh, higher, dots).skipped) is_hopeless[dot.dot_index] = true;
  DotSequence most = dots;
  most.dots.clear();
  std::vector<SkippedDot> handful;
  for (std::uint32_t i = 0; i < dots.dots.size(); ++i) {
    if (is_skipped[i] && (is_hopeless[i] || handful.size() == 5)) continue;
    if (is_skipped[i]) {
      handful.push_back({});
      handful.back().dot_index = static_cast<std::uint32_t>(most.dots.size());
      handful.back().reason = SkipReason::kIncidence;
    }
    most.dots.push_back(dots.dots[i]);
  }
  ASSERT_EQ(handful.size(), 5u);
  ASSERT_GT(most.dots.size(), 1500u);
  EXPECT_FALSE(advise_mounting(mesh, cell, {}, {}, most, handful, 1));
}

TEST(MountingAdvice, SameSeedSameAdvice) {
  CellDescription cell = default_cell();
  cell.fixture.post_height_m = .002;
  const TexturedMesh mesh = ball(.03);
  const DotSequence dots = scatter(mesh, 1.5e-3);
  const Reached now = reached(mesh, cell, dots);
  const auto a = advise_mounting(mesh, cell, {}, {}, dots, now.skipped, 7);
  const auto b = advise_mounting(mesh, cell, {}, {}, dots, now.skipped, 7);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->reached_then, b->reached_then);
}

}  // namespace
}  // namespace hilbrush
