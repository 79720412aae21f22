#include "tests/pipeline/random_cells.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "config/cell_file.h"
#include "sampling/base/angles.h"
#include "tests/support/meshes.h"

namespace hilbrush::testing_pipeline {
namespace {

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : random_(seed) {}
  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  int upto(int most) { return std::uniform_int_distribution<int>(0, most)(random_); }
  bool once_in(int times) { return upto(times - 1) == 0; }
  Eigen::Vector3d in_box(double half) {
    return {between(-half, half), between(-half, half), between(-half, half)};
  }

 private:
  std::mt19937_64 random_;
};

void shake_arm(CellDescription& cell, Dice& dice) {
  auto& arm = cell.arm;
  arm.upper_arm_m = dice.between(.12, .35);
  arm.forearm_m = dice.between(.1, .3);
  arm.beam_depression = dice.between(0, 85) * kDegree;
  arm.flange_to_focus_m = dice.between(.05, .2);
  arm.quill_radius_m = dice.between(.004, .03);
  cell.lens.radius_m = dice.between(.004, .025);
  cell.lens.near_m = dice.between(.01, .1);
  cell.lens.far_m = cell.lens.near_m + dice.between(.02, .12);
  // Mostly above everything, sometimes an obstacle.
  const double top_m = cell.axes[kJ3].max + (dice.once_in(3) ? dice.between(0, .1) : dice.between(.1, .25));
  arm.fore_link = {.height_m = top_m, .radius_m = dice.between(.01, .06)};
  arm.upper_link = {.height_m = top_m + dice.between(-.05, .05), .radius_m = dice.between(.01, .06)};
  arm.quill_length_m = std::max(.01, top_m - cell.axes[kJ3].min);
  arm.column = {};
  if (dice.once_in(2))
    arm.column = {.height_m = dice.between(.05, top_m), .radius_m = dice.between(.02, .15)};
}

void shake_axes(CellDescription& cell, Dice& dice) {
  const auto symmetric = [](AxisDescription& axis, double half) { axis.min = -half, axis.max = half; };
  symmetric(cell.axes[kJ1], dice.between(60, 170) * kDegree);
  symmetric(cell.axes[kJ2], dice.between(70, 165) * kDegree);
  symmetric(cell.axes[kJ4], dice.between(120, 720) * kDegree);
  symmetric(cell.axes[kRotation], dice.between(150, 3600) * kDegree);
  cell.axes[kJ3].min = dice.between(-.05, .05);
  cell.axes[kJ3].max = cell.axes[kJ3].min + dice.between(.2, .5);
  cell.axes[kTilt].min = -dice.between(0, 60) * kDegree;
  cell.axes[kTilt].max = dice.between(10, 110) * kDegree;
  for (AxisDescription& axis : cell.axes) {
    axis.speed_max *= dice.between(.2, 2);
    axis.acceleration_max *= dice.between(.2, 2);
  }
  cell.limit_margin = dice.between(0, .03);
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    AxisDescription& axis = cell.axes[i];
    const double margin = (cell.limit_margin + .01) * (axis.max - axis.min);
    axis.home = std::clamp(axis.home, axis.min + margin, axis.max - margin);
  }
  cell.axes[kJ3].home =
      cell.axes[kJ3].max - (cell.limit_margin + .01) * (cell.axes[kJ3].max - cell.axes[kJ3].min);
}

void shake_table(CellDescription& cell, Dice& dice) {
  const double reach_m = cell.arm.upper_arm_m + cell.arm.forearm_m;
  cell.table.tilt_axis_W = {dice.between(.4, .9) * reach_m, dice.between(-.08, .08), dice.between(0, .15)};
  cell.table.plate_height_m = dice.between(-.08, .02);
  cell.table.plate_radius_m = dice.between(.005, .08);
  cell.table.plate_thickness_m = dice.between(.002, .03);
  cell.fixture.post_height_m = dice.once_in(5) ? 0 : dice.between(.01, .1);
  cell.fixture.post_radius_m = std::min(dice.between(.001, .012), cell.table.plate_radius_m);
}

void shake_process(CellDescription& cell, Dice& dice) {
  cell.timing.tick_s = dice.between(.001, .01);
  cell.timing.settle_min_s = dice.between(0, .03);
  cell.timing.settle_max_s = cell.timing.settle_min_s + dice.between(0, .1);
  cell.laser.pulse_min_s = .001;
  cell.laser.pulse_max_s = dice.between(.01, .1);
  cell.laser.pulse_s = dice.between(.002, cell.laser.pulse_max_s);
  // The dots of these small pictures are large: most lasers are strong enough for them, some are not.
  cell.laser.power_min_w = 1e-6;
  cell.laser.power_max_w = dice.once_in(8) ? dice.between(.1, 20) : 1e4;
  cell.simulation.time_scale = 0;
}

TexturedMesh blob(Dice& dice) {
  TexturedMesh mesh = test::sphere(.5, 8 + dice.upto(12), 5 + dice.upto(8));
  const Eigen::Vector3d a = dice.in_box(6);
  const Eigen::Vector3d b = dice.in_box(6);
  const double bumps = dice.between(0, .35);
  for (auto& p : mesh.vertices) p *= 1 + bumps * std::sin(a.dot(p) * 2) * std::cos(b.dot(p) * 2);
  return mesh;
}

/// A vessel: an outline that goes up outside and down inside.
TexturedMesh vessel(Dice& dice) {
  const int rows = 4 + dice.upto(6);
  std::vector<std::array<double, 2>> outline;
  for (int k = 0; k <= rows; ++k)
    outline.push_back({k == 0 ? 0 : dice.between(.2, .5), 1. * std::max(0, k - 1) / rows});
  const double wall = dice.between(.03, .15);
  for (int k = rows; k > 1; --k)
    outline.push_back({std::max(.02, outline[static_cast<std::size_t>(k)][0] - wall),
                       outline[static_cast<std::size_t>(k)][1] + (k == rows ? 0 : wall)});
  outline.push_back({0, outline.back()[1]});
  return test::grid(
      12 + dice.upto(12), static_cast<int>(outline.size()) - 1,
      [&](double u, double v) {
        const auto k = static_cast<std::size_t>(std::lround(v * static_cast<double>(outline.size() - 1)));
        const double turn = 2 * std::numbers::pi * u;
        return Eigen::Vector3d(outline[k][0] * std::cos(turn), outline[k][0] * std::sin(turn), outline[k][1]);
      },
      true);
}

void add_box(TexturedMesh& mesh, Dice& dice) {
  const Eigen::Vector3d half(dice.between(.05, .5), dice.between(.05, .5), dice.between(.05, .5));
  const Eigen::Vector3d middle = dice.in_box(.5);
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(dice.between(0, 3), (dice.in_box(1) + Eigen::Vector3d(0, 0, 1.1)).normalized())
          .toRotationMatrix();
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (int i = 0; i < 8; ++i)
    mesh.vertices.push_back(middle + turn * Eigen::Vector3d(i & 1 ? half.x() : -half.x(),
                                                            i & 2 ? half.y() : -half.y(),
                                                            i & 4 ? half.z() : -half.z()));
  constexpr std::uint32_t kQuads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                          {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& q : kQuads) test::add_quad(mesh, first + q[0], first + q[1], first + q[2], first + q[3]);
}

TexturedMesh boxes(Dice& dice, int count) {
  TexturedMesh mesh;
  for (int i = 0; i < count; ++i) add_box(mesh, dice);
  return mesh;
}

TexturedMesh soup(Dice& dice) {
  TexturedMesh mesh;
  const int count = 3 + dice.upto(20);
  for (int t = 0; t < count; ++t) {
    const Eigen::Vector3d middle = dice.in_box(.5);
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (int c = 0; c < 3; ++c) mesh.vertices.push_back(middle + dice.in_box(.4));
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  return mesh;
}

TexturedMesh random_shape(Dice& dice, std::string& shape) {
  switch (dice.upto(6)) {
    case 0:
      shape = "boxes";
      return boxes(dice, 2 + dice.upto(3));
    case 1:
      shape = "box";
      return boxes(dice, 1);
    case 2:
      shape = "soup";
      return soup(dice);
    case 3:
      shape = "torus";
      return test::torus(.5, dice.between(.05, .3), 12 + dice.upto(12), 6 + dice.upto(6));
    case 4:
      shape = "vessel";
      return vessel(dice);
    default:
      shape = "blob";
      return blob(dice);
  }
}

/// Black, turned anyhow, as large as asked, standing on z = 0.
TexturedMesh stand(TexturedMesh mesh, double size_m, Dice& dice) {
  const Eigen::Vector3d axis = (dice.in_box(1) + Eigen::Vector3d(0, 0, 1.1)).normalized();
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(dice.once_in(2) ? 0 : dice.between(0, 3), axis).toRotationMatrix();
  Eigen::AlignedBox3d box;
  for (auto& p : mesh.vertices) box.extend(p = turn * p);
  const double scale = size_m / std::max(1e-9, box.sizes().maxCoeff());
  for (auto& p : mesh.vertices)
    p = scale * (p - Eigen::Vector3d(box.center().x(), box.center().y(), box.min().z()));
  mesh.corner_uv.clear();
  mesh.corner_luminance.clear();
  mesh.material_index.clear();
  mesh.materials.clear();
  return test::finish(std::move(mesh));
}

}  // namespace

RandomWork random_work(std::uint64_t seed) {
  Dice dice(seed);
  RandomWork work;
  work.cell = load_cell(find_cell("default"));
  shake_axes(work.cell, dice);
  shake_arm(work.cell, dice);
  shake_table(work.cell, dice);
  shake_process(work.cell, dice);
  if (dice.once_in(4)) {  // a good cell, for a strange object
    work.cell = load_cell(find_cell("default"));
    work.cell.laser.power_max_w = 1e4;
  }
  TexturedMesh shape = random_shape(dice, work.shape);
  work.mesh = stand(std::move(shape), dice.between(.01, .12), dice);
  work.options.max_incidence = dice.between(15, 45) * kDegree;
  work.options.preferred_incidence = dice.between(.2, 1) * work.options.max_incidence;
  work.options.planning = static_cast<Planning>(dice.upto(2));
  work.options.order = static_cast<DotOrder>(dice.upto(1));
  work.options.policy = dice.once_in(5) ? PosePolicy::kFollowNormal : PosePolicy::kSearch;
  work.dot_count = static_cast<std::uint64_t>(5 + dice.upto(120));
  return work;
}

}  // namespace hilbrush::testing_pipeline
