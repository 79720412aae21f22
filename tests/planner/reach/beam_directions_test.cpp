#include "planner/reach/beam_directions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "planner/check/check_cell.h"
#include "sampling/base/angles.h"
#include "tests/planner/reach/ray_bundle.h"
#include "tests/planner/workpieces.h"

namespace hilbrush {
namespace {

TEST(BeamDirections, LieEvenlyOverTheSphere) {
  const double spacing = 6 * kDegree;
  const BeamDirections directions(spacing);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < directions.size(); ++i) {
    EXPECT_NEAR(directions[i].norm(), 1, 1e-12);
    sum += directions[i];
    double nearest = -1;
    for (std::size_t j = 0; j < directions.size(); ++j)
      if (i != j) nearest = std::max(nearest, directions[i].dot(directions[j]));
    EXPECT_GT(std::acos(nearest), .7 * spacing) << i;
    EXPECT_LT(std::acos(nearest), 1.2 * spacing) << i;
  }
  EXPECT_LT(sum.norm() / static_cast<double>(directions.size()), .002);
}

/// Rays of Embree, the independent check and a fine grid of tilts, apart from whatever reach does to be fast.
class Reference {
 public:
  Reference(const TexturedMesh& mesh, const Reach& reach)
      : reach_(reach), bundle_(mesh, reach.cell()), check_(mesh, reach.cell()) {}

  /// Whether the direction hits the target, everything wider by `wider_m`.
  bool hits(const Target& target, const Eigen::Vector3d& beam_O, double wider_m) const {
    if (-beam_O.dot(target.face_normal_O) < reach_.cos_max_incidence()) return false;
    if (bundle_.lens_touches(target.position_O, beam_O, wider_m)) return false;
    const auto& kinematics = reach_.kinematics();
    const double low = kinematics.axis_min(kTilt);
    const double high = kinematics.axis_max(kTilt);
    constexpr int kTilts = 110;
    for (int a = 0; a <= kTilts; ++a) {
      const double tilt = low + (high - low) * a / kTilts;
      for (const TableSolution& solution : solve_table(kinematics, tilt, beam_O))
        for (const Elbow elbow : {Elbow::kPositive, Elbow::kNegative})
          if (is_good(target, kinematics.table_pose(tilt, solution.rotation), solution.yaw, elbow, wider_m))
            return true;
    }
    return false;
  }

 private:
  bool is_good(const Target& target, const TablePose& table, double yaw, Elbow elbow, double wider_m) const {
    const auto& kinematics = reach_.kinematics();
    Joints joints{};
    if (!kinematics.solve_arm(table.to_W(target.position_O), yaw, elbow, joints)) return false;
    joints[kTilt] = table.tilt;
    joints[kRotation] = table.rotation;
    return kinematics.limit_excess(joints).is_inside() &&
           !bundle_.quill_touches(kinematics.tool_pose(joints), wider_m) &&
           check_.body_fault(joints).empty() && check_.beam_fault(check_.X_OF(joints), 1e-5).empty();
  }

  const Reach& reach_;
  RayBundle bundle_;
  CheckCell check_;
};

TEST(BeamDirections, AreAllThatHitADotAndNoOthers) {
  constexpr unsigned kSeed = 44;
  const BeamDirections directions(9 * kDegree);
  std::size_t looks = 0;
  std::size_t hitting = 0;
  std::size_t misses = 0;
  std::size_t cautious = 0;
  for (const TexturedMesh& mesh : {small_cup(), drilled_block(), ball(.03)}) {
    const Reach reach(mesh, default_cell(), {});
    const Reference reference(mesh, reach);
    const DotSequence dots = scatter(mesh, 2e-3, kSeed);
    for (std::size_t i = 0; i < dots.dots.size(); i += dots.dots.size() / 40) {
      const Eigen::Vector3d normal = dots.dots[i].normal_O.cast<double>().normalized();
      const Target target{dots.dots[i].position_O, normal, normal};
      const auto set = directions.that_hit(reach, target, -1);
      ASSERT_TRUE(std::is_sorted(set.begin(), set.end()));
      for (std::uint32_t d = 0; d < directions.size(); ++d) {
        if (-directions[d].dot(normal) < reach.cos_max_incidence()) continue;
        ++looks;
        const bool is_in_set = std::binary_search(set.begin(), set.end(), d);
        hitting += is_in_set;
        misses += is_in_set && !reference.hits(target, directions[d], 0);
        cautious += !is_in_set && reference.hits(target, directions[d], Clearance::kMarginM);
      }
    }
  }
  EXPECT_LT(static_cast<double>(misses), 5e-4 * static_cast<double>(looks)) << "seed " << kSeed;
  EXPECT_LT(static_cast<double>(cautious), .03 * static_cast<double>(looks)) << "seed " << kSeed;
  EXPECT_GT(hitting, looks / 3);
  EXPECT_LT(hitting, looks * 19 / 20);
}

}  // namespace
}  // namespace hilbrush
