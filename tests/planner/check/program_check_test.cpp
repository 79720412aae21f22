#include "planner/check/program_check.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <string>

#include "planner/cell_model/time_model.h"
#include "planner/reach/kinematics.h"
#include "tests/planner/workpieces.h"

namespace hilbrush {
namespace {

/// A good program, for faults to be added to it one by one.
struct Work {
  CellDescription cell = default_cell();
  PlanOptions options;
  TexturedMesh mesh = ball(.02);
  DotSequence dots = scatter(mesh, 2e-3);
  Plan plan = plan_exposures(Reach(mesh, cell, options), dots);
  Provenance made_from{"model", "settings", "cell", "version"};

  Work() { plan.program.provenance = made_from; }
  std::vector<ProgramFault> check() const {
    return check_program(plan.program, plan.skipped, dots, mesh, cell, options, 1000, {}, &made_from);
  }
  Exposure& exposure(std::size_t i) { return plan.program.exposures[i]; }
  /// An exposure that the one before leads to directly.
  std::size_t direct_one() const {
    std::size_t i = plan.program.exposures.size() / 2;
    while (!plan.program.vias_before(i).empty()) ++i;
    return i;
  }
  ToolPose tool(std::size_t i) { return Kinematics(cell).tool_pose(exposure(i).joints); }
  Eigen::Vector3d flange_O(std::size_t i) {
    return tool(i).focus_O - cell.arm.flange_to_focus_m * tool(i).beam_O;
  }
  /// A triangle of 4 mm across a direction, of which planning knew nothing.
  void add_screen(const Eigen::Vector3d& across_O, const Eigen::Vector3d& center_O) {
    const Eigen::Vector3d u = .004 * across_O.unitOrthogonal();
    const Eigen::Vector3d v = across_O.cross(u);
    const auto n = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), {center_O + u, center_O - u + v, center_O - u - v});
    mesh.triangles.push_back({n, n + 1, n + 2});
  }
  void add_via(std::size_t i, const Joints& joints) {
    const auto before = static_cast<std::uint32_t>(i);
    const auto at = std::lower_bound(plan.program.vias.begin(), plan.program.vias.end(), before,
                                     [](const Via& a, std::uint32_t b) { return a.before_exposure < b; });
    plan.program.vias.insert(at, {before, joints});
  }
  /// Exposes dot `i` with another yaw and the same table, whether that is allowed or not.
  void turn_yaw(std::size_t i, double angle) {
    const Kinematics kinematics(cell);
    Joints& joints = exposure(i).joints;
    const TablePose table = kinematics.table_pose(joints[kTilt], joints[kRotation]);
    const Elbow elbow = joints[kJ2] > 0 ? Elbow::kPositive : Elbow::kNegative;
    ASSERT_TRUE(kinematics.solve_arm(table.to_W(exposure(i).position_O), kinematics.yaw(joints) + angle,
                                     elbow, joints));
  }
  void flip_elbow(std::size_t i) { flip_elbow(i, exposure(i).joints); }
  void flip_elbow(std::size_t i, Joints& joints) const {
    const Kinematics kinematics(cell);
    const TablePose table = kinematics.table_pose(joints[kTilt], joints[kRotation]);
    const Elbow other = joints[kJ2] > 0 ? Elbow::kNegative : Elbow::kPositive;
    const double j4 = joints[kJ4];
    ASSERT_TRUE(kinematics.solve_arm(table.to_W(plan.program.exposures[i].position_O), kinematics.yaw(joints),
                                     other, joints));
    joints[kJ4] = kinematics.unwrap_near(kJ4, joints[kJ4], j4);
  }
};

const Work& good_work() {
  static const Work work;
  return work;
}

TEST(ProgramCheck, AGoodProgramPasses) {
  for (const auto& fault : good_work().check())
    ADD_FAILURE() << "exposure " << fault.exposure << ": " << fault.what;
}

struct Spoiling {
  const char* name;
  const char* expected;  ///< part of one of the faults' sentences
  std::function<void(Work&)> spoil;
};

void PrintTo(const Spoiling& spoiling, std::ostream* out) {
  *out << spoiling.name;
}

class SpoiltProgram : public testing::TestWithParam<Spoiling> {};

TEST_P(SpoiltProgram, IsCaught) {
  Work work = good_work();
  GetParam().spoil(work);
  const auto faults = work.check();
  ASSERT_FALSE(faults.empty());
  bool is_named = false;
  std::string all;
  for (const auto& fault : faults) {
    is_named = is_named || fault.what.find(GetParam().expected) != std::string::npos;
    all += fault.what + "\n";
  }
  EXPECT_TRUE(is_named) << "expected \"" << GetParam().expected << "\" among:\n" << all;
}

constexpr std::size_t kVictim = 200;

/// The move whose joints at its middle differ most between two motions, and the joints there in the other
/// one.
template <class Middle>
Joints most_apart(const Work& w, const Middle& usual, const Middle& other) {
  const Kinematics kinematics(w.cell);
  const auto lens_O = [&](const Joints& joints) {
    const ToolPose tool = kinematics.tool_pose(joints);
    return Eigen::Vector3d(tool.focus_O - .5 * (w.cell.lens.near_m + w.cell.lens.far_m) * tool.beam_O);
  };
  Joints at{};
  double most_m = 0;
  Joints from = home_joints(w.cell);
  for (std::size_t i = 0; i < w.plan.program.exposures.size(); ++i) {
    std::vector<Joints> path{from};
    for (const Via& via : w.plan.program.vias_before(i)) path.push_back(via.joints);
    path.push_back(w.plan.program.exposures[i].joints);
    for (std::size_t leg = 1; leg < path.size(); ++leg) {
      const Joints there = other(path[leg - 1], path[leg]);
      const double apart_m = (lens_O(there) - lens_O(usual(path[leg - 1], path[leg]))).norm();
      if (apart_m <= most_m) continue;
      most_m = apart_m;
      at = there;
    }
    from = path.back();
  }
  EXPECT_GT(most_m, .003);
  return at;
}

/// The middle of a move by these interpolations, the table late by this.
std::function<Joints(const Joints&, const Joints&)> middle_of(const CellDescription& cell,
                                                              Interpolation interpolation,
                                                              double table_late_s) {
  return [&cell, interpolation, table_late_s](const Joints& from, const Joints& to) {
    Joints now = to;
    const double time_s = .5 * chain_move_s(cell, kRobotChain, interpolation, from, to);
    put_chain(cell, kRobotChain, interpolation, from, to, time_s, now);
    put_chain(cell, kTableChain, interpolation, from, to, time_s - table_late_s, now);
    return now;
  };
}

void put_screen_at_lens(Work& w, const Joints& joints) {
  const ToolPose tool = Kinematics(w.cell).tool_pose(joints);
  w.add_screen(tool.beam_O, tool.focus_O - .5 * (w.cell.lens.near_m + w.cell.lens.far_m) * tool.beam_O);
}

void screen_on_the_straight_path(Work& w) {
  w.cell.motion = {Interpolation::kCoordinated, Interpolation::kCoordinated, 0};
  put_screen_at_lens(w, most_apart(w, middle_of(w.cell, Interpolation::kIndependent, 0),
                                   middle_of(w.cell, Interpolation::kCoordinated, 0)));
}

void screen_on_the_path_of_a_late_table(Work& w) {
  put_screen_at_lens(w, most_apart(w, middle_of(w.cell, Interpolation::kIndependent, 0),
                                   middle_of(w.cell, Interpolation::kIndependent, .02)));
}

const Spoiling kSpoilings[] = {
    {"DotTwice", "more than once",
     [](Work& w) { w.exposure(kVictim).dot_index = w.exposure(kVictim + 1).dot_index; }},
    {"DotMissing", "neither exposed nor skipped",
     [](Work& w) {
       w.plan.program.exposures.pop_back();
       w.plan.program.vias.back().before_exposure =
           static_cast<std::uint32_t>(w.plan.program.exposures.size());
       for (auto& via : w.plan.program.vias)
         via.before_exposure = std::min(via.before_exposure, w.plan.program.vias.back().before_exposure);
     }},
    {"DotUnknown", "is not one of the", [](Work& w) { w.exposure(kVictim).dot_index = 1u << 30; }},
    {"ExposedAndSkipped", "more than once",
     [](Work& w) {
       w.plan.skipped.push_back({w.exposure(kVictim).dot_index, SkipReason::kOccluded, "a reason"});
     }},
    {"SkippedWithoutReason", "without a reason",
     [](Work& w) {
       if (w.plan.skipped.empty()) w.plan.skipped.push_back({0, SkipReason::kOccluded, ""});
       w.plan.skipped.front().detail.clear();
     }},
    {"OtherPitch", "pitch", [](Work& w) { w.plan.program.pitch_m *= 1.01; }},
    {"NotFromHome", "start at home", [](Work& w) { w.plan.program.vias.front().joints[kJ1] += .01; }},
    {"NotToHome", "end at home", [](Work& w) { w.plan.program.vias.pop_back(); }},
    {"ViaOutOfOrder", "out of order", [](Work& w) { w.plan.program.vias.front().before_exposure = 300; }},
    {"ViaOutOfLimits", "is outside", [](Work& w) { w.plan.program.vias.front().joints[kJ3] = .31; }},
    {"JointOutOfLimits", "is outside", [](Work& w) { w.exposure(kVictim).joints[kJ1] = 2.5; }},
    {"JointNotANumber", "is outside", [](Work& w) { w.exposure(kVictim).joints[kTilt] = std::nan(""); }},
    {"FocusOff", "off the dot", [](Work& w) { w.exposure(kVictim).joints[kJ3] += 1e-8; }},
    {"PlaceChanged", "differs from that of dot", [](Work& w) { w.exposure(kVictim).position_O.x() += 1e-9; }},
    {"ToneChanged", "differs from that of dot", [](Work& w) { w.exposure(kVictim).tone = .5F; }},
    {"TooOblique", "more than 45", [](Work& w) { w.turn_yaw(kVictim, 1.5); }},
    {"IncidenceMisstated", "is stated as", [](Work& w) { w.exposure(kVictim).incidence += .05F; }},
    {"PowerTooHigh", "W is outside", [](Work& w) { w.exposure(kVictim).power_w = 1; }},
    {"PowerNotANumber", "W is outside", [](Work& w) { w.exposure(kVictim).power_w = std::nanf(""); }},
    {"PulseTooLong", "pulse", [](Work& w) { w.exposure(kVictim).pulse_s = .2F; }},
    {"EnergyWrong", "J is not", [](Work& w) { w.exposure(kVictim).energy_j *= 1.1F; }},
    {"WrongDose", "level needs",
     [](Work& w) {
       w.exposure(kVictim).energy_j *= 2;
       w.exposure(kVictim).power_w *= 2;
     }},
    {"ElbowFlips", "elbow flips", [](Work& w) { w.flip_elbow(w.direct_one()); }},
    {"ElbowFlipsToAWayPoint", "elbow flips",
     [](Work& w) {
       // A way-point in between is not a retract.
       const std::size_t i = w.direct_one();
       Joints there = w.exposure(i - 1).joints;
       w.flip_elbow(i - 1, there);
       w.add_via(i, there);
     }},
    {"J4Winds", "without a retract",
     [](Work& w) {
       const std::size_t i = w.direct_one();
       double& j4 = w.exposure(i).joints[kJ4];
       j4 += j4 > 0 ? -2 * std::numbers::pi : 2 * std::numbers::pi;
     }},
    {"CWinds", "without a retract",
     [](Work& w) { w.exposure(w.direct_one()).joints[kRotation] += 2 * std::numbers::pi; }},
    {"ViaThroughTheObject", "touches",
     [](Work& w) {
       // A way-point that puts the focus 75 mm beyond the dot, so that the lens reaches into the ball.
       const Kinematics kinematics(w.cell);
       const std::size_t i = w.direct_one();
       Via via{static_cast<std::uint32_t>(i), w.exposure(i).joints};
       const TablePose table = kinematics.table_pose(via.joints[kTilt], via.joints[kRotation]);
       const double yaw = kinematics.yaw(via.joints);
       const Eigen::Vector3d focus_W = table.to_W(w.exposure(i).position_O) + .075 * kinematics.beam_W(yaw);
       const Elbow elbow = via.joints[kJ2] > 0 ? Elbow::kPositive : Elbow::kNegative;
       ASSERT_TRUE(kinematics.solve_arm(focus_W, yaw, elbow, via.joints));
       via.joints[kJ3] = std::max(via.joints[kJ3], 0.);
       w.add_via(i, via.joints);
     }},
    {"ScreenOnThePath", "on the path there, the lens body touches",
     [](Work& w) {
       // Where the lens is half way from home to the next way-point or dot.
       const auto vias = w.plan.program.vias_before(0);
       const Joints from = vias[0].joints;
       const Joints to = vias.size() > 1 ? vias[1].joints : w.exposure(0).joints;
       const Joints there = joints_during(w.cell, from, to, .5 * move_s(w.cell, from, to));
       const ToolPose tool = Kinematics(w.cell).tool_pose(there);
       w.add_screen(tool.beam_O, tool.focus_O - .5 * (w.cell.lens.near_m + w.cell.lens.far_m) * tool.beam_O);
     }},
    {"ScreenOnAStraightPath", "on the path there, the lens body touches", &screen_on_the_straight_path},
    {"ScreenOnThePathOfALateTable", "on the path there, the lens body touches",
     &screen_on_the_path_of_a_late_table},
    {"RetractsRemoved", "without a retract",
     [](Work& w) {
       // Every re-pose goes straight there.
       std::erase_if(w.plan.program.vias, [&](const Via& via) {
         return via.before_exposure > 0 && via.before_exposure < w.plan.program.exposures.size();
       });
       w.plan.program.vias = {w.plan.program.vias.front(), w.plan.program.vias.back()};
       // Two dots on opposite sides, one after the other, with the arm on the other side of the object.
       std::size_t a = 0;
       std::size_t b = 0;
       for (std::size_t i = 0; i < w.plan.program.exposures.size(); ++i) {
         if (w.exposure(i).position_O.x() > w.exposure(a).position_O.x()) a = i;
         if (w.exposure(i).position_O.x() < w.exposure(b).position_O.x()) b = i;
       }
       std::swap(w.plan.program.exposures[a],
                 w.plan.program.exposures[b + 1 < w.plan.program.exposures.size() ? b + 1 : b - 1]);
     }},
    {"ScreenInTheBeam", "before the dot",
     [](Work& w) {
       w.add_screen(w.tool(kVictim).beam_O, w.exposure(kVictim).position_O - .02 * w.tool(kVictim).beam_O);
     }},
    {"SmallerMesh", "misses the object",
     [](Work& w) {
       for (auto& p : w.mesh.vertices) p *= .5;
     }},
    {"FartherCell", "off the dot", [](Work& w) { w.cell.table.tilt_axis_W.x() += 1e-6; }},
    {"OtherModel", "another model", [](Work& w) { w.plan.program.provenance.model_sha256 = "other"; }},
    {"OtherSettings", "another job's settings", [](Work& w) { w.made_from.settings_sha256 = "other"; }},
    {"OtherCell", "another cell", [](Work& w) { w.plan.program.provenance.cell_sha256.clear(); }},
    {"OtherVersion", "another version", [](Work& w) { w.plan.program.provenance.version = "0"; }},
    {"ExposuresSwapped", "without a retract",
     [](Work& w) {
       // Each is fine by itself; the ways between them are not.
       auto& exposures = w.plan.program.exposures;
       for (std::size_t i = 0; i < exposures.size() / 2; i += 2)
         std::swap(exposures[i], exposures[exposures.size() - 1 - i]);
     }},
    {"LowerForearm", "arm touches", [](Work& w) { w.cell.arm.fore_link.height_m = .23; }},
    {"LowerUpperArm", "the upper arm touches",
     [](Work& w) { w.cell.arm.upper_link = {.height_m = .15, .radius_m = .2}; }},
    {"WiderColumn", "the robot's column", [](Work& w) { w.cell.arm.column.radius_m = .2; }},
    {"ColumnUnderTheTable", "the robot's column touches the",
     [](Work& w) {
       // The table stands in it; the arm passes above.
       w.cell.arm.column = {.height_m = .12, .radius_m = .3};
     }},
    {"ScreenInTheQuill", "the quill touches",
     [](Work& w) { w.add_screen(w.tool(kVictim).up_O, w.flange_O(kVictim) + .05 * w.tool(kVictim).up_O); }},
    {"WiderPlate", "the table",
     [](Work& w) {
       w.cell.table.plate_radius_m = .2;
       w.cell.table.plate_thickness_m = .001;
     }},
    {"ThickerPost", "the table blocks the beam", [](Work& w) { w.cell.fixture.post_radius_m = .019; }},
    {"FatterLens", "lens body", [](Work& w) { w.cell.lens.radius_m = .05; }},
};

INSTANTIATE_TEST_SUITE_P(Each, SpoiltProgram, testing::ValuesIn(kSpoilings),
                         [](const auto& parameter) { return std::string(parameter.param.name); });

TEST(ProgramCheck, StopsAtItsLimitWithTheFirstFaults) {
  Work work = good_work();
  for (auto& exposure : work.plan.program.exposures) exposure.tone = .25F;
  const auto faults =
      check_program(work.plan.program, work.plan.skipped, work.dots, work.mesh, work.cell, work.options, 3);
  ASSERT_EQ(faults.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(faults[i].exposure, i);
}

}  // namespace
}  // namespace hilbrush
