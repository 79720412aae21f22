// How fast poses are solved and tested for clearance, how well the distance field agrees with rays, and
// whether dots that are out of reach really are.
//   reach_bench [--poses N] [--dots N] [--brute N] MODEL SIZE_MM [MODEL SIZE_MM...]
// For each model: solutions of the whole chain per second; poses per second with everything checked (beam,
// lens, joints, quill, links), each by itself, and along directions as `Reach` searches; the distance field
// against a bundle of rays; the share of N dots everywhere on the surface that is reached; and how many of N
// skipped dots a fine grid of poses reaches after all. CPU seconds of one thread. A hash of all counts is
// printed at the end.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <map>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "config/cell_file.h"
#include "planner/reach/reach.h"
#include "sampling/base/input_error.h"
#include "sampling/images/image_file.h"
#include "sampling/model/mesh_repair.h"
#include "sampling/model/model_file.h"
#include "sampling/model/placement.h"
#include "tests/bench/answer_hash.h"
#include "tests/planner/reach/pose_grid.h"
#include "tests/planner/reach/ray_bundle.h"

namespace {

using namespace hilbrush;
using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;

struct Amounts {
  std::size_t poses = 2'000'000, dots = 20'000, brute = 50;
};

double seconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

/// Random places on the surface, by area.
std::vector<Target> scatter_targets(const TexturedMesh& mesh, std::size_t count, std::mt19937& random) {
  std::vector<double> sums;
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t) sums.push_back(sum += mesh.area_vector(t).norm());
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Target> targets;
  for (std::size_t i = 0; i < count; ++i) {
    const double at = sum * (static_cast<double>(i) + uniform(random)) / static_cast<double>(count);
    const auto t = std::min<std::size_t>(
        static_cast<std::size_t>(std::lower_bound(sums.begin(), sums.end(), at) - sums.begin()),
        sums.size() - 1);
    double v = uniform(random), w = uniform(random);
    if (v + w > 1) {
      v = 1 - v;
      w = 1 - w;
    }
    const Vector3d p = (1 - v - w) * mesh.corner(t, 0) + v * mesh.corner(t, 1) + w * mesh.corner(t, 2);
    const Vector3d normal = mesh.area_vector(t).normalized();
    targets.push_back({p, normal, normal});
  }
  return targets;
}

Vector3d beam_in_cone(const Vector3d& normal, double angle_max, std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  const double z = 1 - uniform(random) * (1 - std::cos(angle_max)), turn = 2 * kPi * uniform(random);
  const Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
  const double r = std::sqrt(1 - z * z);
  return -(r * std::cos(turn) * u + r * std::sin(turn) * v + z * normal);
}

void measure_solutions(const Reach& reach, const Amounts& amounts, std::mt19937& random) {
  const auto& kinematics = reach.kinematics();
  std::uniform_real_distribution<double> tilt(kinematics.axis_min(kTilt), kinematics.axis_max(kTilt)),
      turn(-kPi, kPi), side(-.03, .03);
  struct Wish {
    TablePose table;
    Vector3d p_O;
    double yaw;
  };
  std::vector<Wish> wishes(4096);
  for (Wish& wish : wishes)
    wish = {kinematics.table_pose(tilt(random), turn(random)),
            {side(random), side(random), side(random)},
            turn(random)};
  std::size_t solved = 0;
  const double begin = seconds();
  for (std::size_t i = 0; i < amounts.poses; ++i) {
    const Wish& wish = wishes[i % wishes.size()];
    Joints joints;
    solved += kinematics.solve_arm(wish.table.to_W(wish.p_O), wish.yaw,
                                   i & 1 ? Elbow::kPositive : Elbow::kNegative, joints);
  }
  const double spent = seconds() - begin;
  std::printf("inverse kinematics       %8.2f M/s (%.1f %% within the arm's annulus)\n",
              1e-6 * static_cast<double>(amounts.poses) / spent,
              100. * static_cast<double>(solved) / static_cast<double>(amounts.poses));
}

/// Each pose by itself: a dot, a table pose and a yaw that put the beam within the cone.
void measure_single_poses(const Reach& reach, const std::vector<Target>& targets, const Amounts& amounts,
                          std::mt19937& random, AnswerHash& hash) {
  struct Wish {
    const Target* target;
    TablePose table;
    double yaw;
    Vector3d beam_O;
  };
  std::vector<Wish> wishes;
  std::uniform_real_distribution<double> tilt(reach.kinematics().axis_min(kTilt),
                                              reach.kinematics().axis_max(kTilt));
  while (wishes.size() < 200'000) {
    const Target& target = targets[wishes.size() % targets.size()];
    const Vector3d beam_O = beam_in_cone(target.face_normal_O, kPi / 4, random);
    if (solve_table(reach.kinematics(), tilt(random), beam_O).empty()) continue;
    const double a = tilt(random);
    const TableSolutions solutions = solve_table(reach.kinematics(), a, beam_O);
    if (solutions.empty()) continue;
    wishes.push_back(
        {&target, reach.kinematics().table_pose(a, solutions[0].rotation), solutions[0].yaw, beam_O});
  }
  const Joints home{};
  std::size_t clear = 0;
  const double begin = seconds();
  for (std::size_t i = 0; i < amounts.poses; ++i) {
    const Wish& wish = wishes[i % wishes.size()];
    const Elbow elbow = i & 1 ? Elbow::kPositive : Elbow::kNegative;
    clear += reach.arm_joints(wish.table, wish.target->position_O, wish.yaw, elbow, home).has_value() &&
             reach.clearance().lens_obstruction(wish.target->position_O, wish.beam_O) == Obstruction::kNone &&
             reach.clearance().beam_obstruction(wish.target->position_O, wish.beam_O) == Obstruction::kNone;
  }
  const double spent = seconds() - begin;
  std::printf("poses, each by itself    %8.2f M/s (%.1f %% clear)\n",
              1e-6 * static_cast<double>(amounts.poses) / spent,
              100. * static_cast<double>(clear) / static_cast<double>(amounts.poses));
  hash.take(static_cast<double>(clear));
}

/// As reach goes: beam and lens once for a direction, then all tilts, yaws and elbows that give it.
void measure_directions(const Reach& reach, const std::vector<Target>& targets, const Amounts& amounts,
                        std::mt19937& random, AnswerHash& hash) {
  const Joints home{};
  std::size_t poses = 0, clear = 0;
  const double begin = seconds();
  for (std::size_t d = 0; poses < amounts.poses; ++d) {
    const Target& target = targets[d % targets.size()];
    const Vector3d beam_O = beam_in_cone(target.face_normal_O, kPi / 4, random);
    const bool is_free =
        reach.clearance().beam_obstruction(target.position_O, beam_O) == Obstruction::kNone &&
        reach.clearance().lens_obstruction(target.position_O, beam_O) == Obstruction::kNone;
    for (const double tilt : reach.tilts()) {
      const TableSolutions solutions = solve_table(reach.kinematics(), tilt, beam_O);
      poses += 2 * solutions.size();
      if (!is_free) continue;
      for (const TableSolution& solution : solutions) {
        const TablePose table = reach.kinematics().table_pose(tilt, solution.rotation);
        for (const Elbow elbow : {Elbow::kPositive, Elbow::kNegative})
          clear += reach.arm_joints(table, target.position_O, solution.yaw, elbow, home).has_value();
      }
    }
  }
  const double spent = seconds() - begin;
  std::printf("poses, by directions     %8.2f M/s (%.1f %% clear)\n",
              1e-6 * static_cast<double>(poses) / spent,
              100. * static_cast<double>(clear) / static_cast<double>(poses));
  hash.take(static_cast<double>(clear));
}

void compare_with_rays(const Reach& reach, const TexturedMesh& mesh, const std::vector<Target>& targets,
                       std::mt19937& random, AnswerHash& hash) {
  const RayBundle reference(mesh, reach.cell());
  const std::size_t count = 20'000;
  std::size_t misses = 0, cautious = 0, touching = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Target& target = targets[i % targets.size()];
    const Vector3d beam_O = beam_in_cone(target.face_normal_O, kPi / 2, random);
    const bool is_clear = reach.clearance().lens_obstruction(target.position_O, beam_O) == Obstruction::kNone;
    const bool touches = reference.lens_touches(target.position_O, beam_O);
    misses += is_clear && touches;
    touching += touches;
    cautious += !is_clear && !reference.lens_touches(target.position_O, beam_O, Clearance::kMarginM);
  }
  const double share = 100. / static_cast<double>(count);
  std::printf(
      "field against rays       misses %.3f %%, over-cautious beyond the margin %.2f %% (%.1f %% touch)\n",
      share * static_cast<double>(misses), share * static_cast<double>(cautious),
      share * static_cast<double>(touching));
  hash.take(static_cast<double>(misses));
  hash.take(static_cast<double>(cautious));
}

void survey(const Reach& reach, const std::vector<Target>& targets, const Amounts& amounts,
            AnswerHash& hash) {
  std::vector<std::size_t> skipped;
  std::map<std::string, std::size_t> reasons;
  const Joints home{};
  const double begin = seconds();
  for (std::size_t i = 0; i < targets.size(); ++i) {
    const PoseSearchResult found = reach.find_pose(targets[i], home);
    if (found.pose) continue;
    skipped.push_back(i);
    ++reasons[std::string(found.skipped.what)];
  }
  const double spent = seconds() - begin;
  const auto count = static_cast<double>(targets.size());
  std::printf("reached                  %8.3f %% of %zu dots, %.1f us a dot\n",
              100 * (1 - static_cast<double>(skipped.size()) / count), targets.size(), 1e6 * spent / count);
  for (const auto& [what, times] : reasons) std::printf("  %6zu %s\n", times, what.c_str());
  hash.take(static_cast<double>(skipped.size()));

  std::size_t confirmed = 0, looked = 0, poses = 0;
  const std::size_t stride =
      std::max<std::size_t>(1, skipped.size() / std::max<std::size_t>(1, amounts.brute));
  for (std::size_t s = 0; s < skipped.size() && looked < amounts.brute; s += stride, ++looked) {
    const PoseGridAnswer answer = search_pose_grid(reach, targets[skipped[s]], 2 * kPi / 180);
    poses += answer.poses;
    confirmed += !answer.is_reached;
    if (answer.is_reached) {
      const SkippedDot why = reach.find_pose(targets[skipped[s]], home).skipped;
      std::printf("  reached after all: %s\n", why.detail.c_str());
    }
  }
  std::printf("brute force              %zu of %zu skipped dots confirmed, %.0f poses each\n", confirmed,
              looked, looked > 0 ? static_cast<double>(poses) / static_cast<double>(looked) : 0.);
  hash.take(static_cast<double>(confirmed));
}

void run(const std::string& file, double size_mm, const Amounts& amounts, AnswerHash& hash) {
  PlacementOptions placement;
  placement.size_m = size_mm * 1e-3;
  const TexturedMesh mesh = repair_mesh(place_on_table(load_model(file, load_image_file), placement)).mesh;
  const CellDescription cell = load_cell(find_cell("default"));
  const double begin = seconds();
  const Reach reach(mesh, cell, {});
  std::printf("%s, %.0f mm: %zu triangles, set up in %.2f s\n", file.c_str(), size_mm, mesh.triangle_count(),
              seconds() - begin);
  std::mt19937 random(11);
  const std::vector<Target> targets = scatter_targets(mesh, amounts.dots, random);
  measure_solutions(reach, amounts, random);
  measure_single_poses(reach, targets, amounts, random, hash);
  measure_directions(reach, targets, amounts, random, hash);
  compare_with_rays(reach, mesh, targets, random, hash);
  survey(reach, targets, amounts, hash);
}

}  // namespace

int main(int argc, char** argv) {
  Amounts amounts;
  AnswerHash hash;
  int i = 1;
  for (; i + 1 < argc && argv[i][0] == '-'; i += 2) {
    const std::string flag = argv[i];
    const auto amount = static_cast<std::size_t>(std::strtoull(argv[i + 1], nullptr, 10));
    (flag == "--poses" ? amounts.poses : flag == "--dots" ? amounts.dots : amounts.brute) = amount;
  }
  if (i + 1 >= argc) {
    std::fprintf(stderr,
                 "usage: reach_bench [--poses N] [--dots N] [--brute N] MODEL SIZE_MM [MODEL SIZE_MM...]\n");
    return 2;
  }
  try {
    for (; i + 1 < argc; i += 2) run(argv[i], std::atof(argv[i + 1]), amounts, hash);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "reach_bench: %s\n", error.what());
    return 1;
  }
  std::printf("answer %016llx\n", hash.value());
  return 0;
}
