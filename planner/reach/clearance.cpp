#include "planner/reach/clearance.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace hilbrush {
namespace {

/// The ray starts this far from the dot: above the rounding of single precision, below any error that could
/// be seen on the film.
constexpr double kBeamStartM = 2e-6;
/// The beam passes edges at this distance at least, except right at the dot, where its own surface is that
/// near.
constexpr double kBeamRadiusM = 20e-6, kSideBeamStartM = .3e-3;
/// The beam passes post and plate at this distance at least.
constexpr double kBeamTableGapM = .3e-3;

/// Distance from a point at (r, z) to a solid cylinder around the z axis.
double cylinder_distance_m(double r, double z, double radius, double z_low, double z_high) {
  const double dr = r - radius;
  const double dz = std::max(z_low - z, z - z_high);
  if (dr <= 0 || dz <= 0) return std::max(dr, dz);
  return std::sqrt(dr * dr + dz * dz);
}

/// Radius of object and table parts around an axis; `height` lifts O's origin above it. The tilt axis may
/// pass them in any direction: the radius around it is that of a ball.
double radius_around(const TexturedMesh& mesh, const CellDescription& cell, double height, bool around_tilt) {
  const auto along = [&](double r, double z) { return around_tilt ? std::hypot(r, z + height) : r; };
  const double post = cell.fixture.post_height_m;
  double radius = std::max({along(cell.fixture.post_radius_m, 0), along(cell.table.plate_radius_m, -post),
                            along(cell.table.plate_radius_m, -post - cell.table.plate_thickness_m)});
  for (const auto& p : mesh.vertices) radius = std::max(radius, along(p.head<2>().norm(), p.z()));
  return radius;
}

/// Half way between the highest and the lowest point of object and table parts, in O.
double middle_height_m(const TexturedMesh& mesh, const CellDescription& cell) {
  double high = 0;
  for (const auto& p : mesh.vertices) high = std::max(high, p.z());
  return .5 * (high - cell.fixture.post_height_m - cell.table.plate_thickness_m);
}

/// Whether any link can come near enough to what turns around the tilt axis to be checked.
bool links_come_near(const CellDescription& cell, double radius_around_tilt_m, double slack_m) {
  const double top_m = cell.table.tilt_axis_W.z() + radius_around_tilt_m + slack_m;
  const auto is_near = [&](const CellDescription::Arm::Link& link) {
    return link.radius_m > 0 && link.height_m - link.radius_m < top_m;
  };
  return is_near(cell.arm.upper_link) || is_near(cell.arm.fore_link);
}

bool links_come_near_lens(const CellDescription& cell, double slack_m) {
  const auto& arm = cell.arm;
  const double top_m =
      cell.axes[kJ3].max + slack_m + cell.lens.radius_m * std::cos(arm.beam_depression) +
      std::max(0., (cell.lens.far_m - arm.flange_to_focus_m) * std::sin(arm.beam_depression));
  const auto is_near = [&](const CellDescription::Arm::Link& link) {
    return link.radius_m > 0 && link.height_m - link.radius_m < top_m;
  };
  return is_near(arm.upper_link) || is_near(arm.fore_link);
}

/// Whether what turns around the tilt axis comes near the column.
bool column_comes_near(const CellDescription& cell, double radius_around_tilt_m, double slack_m) {
  const double column_m = cell.arm.column.radius_m;
  return column_m > 0 && std::abs(cell.table.tilt_axis_W.x()) < radius_around_tilt_m + column_m + slack_m;
}

double tool_radius_m(const CellDescription& cell) {
  const auto& arm = cell.arm;
  const double along_beam_m = std::max(std::abs(cell.lens.far_m - arm.flange_to_focus_m),
                                       std::abs(arm.flange_to_focus_m - cell.lens.near_m));
  return std::max({along_beam_m + cell.lens.radius_m, arm.quill_radius_m, arm.fore_link.radius_m});
}

/// The range of the distance field: beyond the radius of the largest body that is looked up.
double field_range_m(const CellDescription& cell, bool has_links, bool has_column) {
  double radius = std::max(cell.lens.radius_m, cell.arm.quill_radius_m);
  if (has_links) radius = std::max({radius, cell.arm.upper_link.radius_m, cell.arm.fore_link.radius_m});
  if (has_column) radius = std::max(radius, cell.arm.column.radius_m);
  return 1.1 * radius + Clearance::kSlackMaxM;
}

}  // namespace

Clearance::Clearance(const TexturedMesh& mesh, const CellDescription& cell)
    : cell_(cell),
      radius_around_tilt_m_(
          radius_around(mesh, cell, cell.table.plate_height_m + cell.fixture.post_height_m, true)),
      radius_around_rotation_m_(radius_around(mesh, cell, 0, false)),
      links_may_touch_(links_come_near(cell, radius_around_tilt_m_, kSlackMaxM)),
      links_may_touch_lens_(links_come_near_lens(cell, kSlackMaxM)),
      column_may_touch_(column_comes_near(cell, radius_around_tilt_m_, kSlackMaxM)),
      tool_radius_m_(tool_radius_m(cell)),
      ball_height_m_(middle_height_m(mesh, cell)),
      ball_radius_m_(radius_around(mesh, cell, -ball_height_m_, true)),
      rays_(mesh),
      distance_(mesh, field_range_m(cell, links_may_touch_, column_may_touch_)) {}

Shortfall Clearance::Slack::shortfall(Obstruction by_object, Obstruction by_table) const {
  if (least_m() >= kMarginM) return {};
  return {table_m < object_m ? by_table : by_object, kMarginM - least_m()};
}

double Clearance::table_distance_m(const Eigen::Vector3d& p_O) const {
  const double r = p_O.head<2>().norm();
  const double z = p_O.z();
  const double post = cell_.fixture.post_height_m;
  if (z >= distance_.range_m()) return z;  // larger distances are not needed
  return std::min(
      cylinder_distance_m(r, z, cell_.fixture.post_radius_m, -post, 0),
      cylinder_distance_m(r, z, cell_.table.plate_radius_m, -post - cell_.table.plate_thickness_m, -post));
}

Obstruction Clearance::beam_obstruction(const Eigen::Vector3d& focus_O, const Eigen::Vector3d& beam_O) const {
  // A beam that passes an edge by less than the distance of the side rays passes it by rounding alone.
  const Eigen::Vector3d u = kBeamRadiusM * beam_O.unitOrthogonal();
  const Eigen::Vector3d v = beam_O.cross(u);
  if (rays_.is_beam_blocked(focus_O, -beam_O, {u, .866 * v - .5 * u, -.866 * v - .5 * u}, kBeamStartM,
                            kSideBeamStartM, cell_.lens.far_m))
    return Obstruction::kBeamObject;
  return table_free_length_m(focus_O, beam_O) < cell_.lens.far_m ? Obstruction::kBeamTable
                                                                 : Obstruction::kNone;
}

/// From the dot towards the lens in steps of the free distance. If the dot itself is nearer to the post than
/// the gap, the beam only has to move away from it.
double Clearance::table_free_length_m(const Eigen::Vector3d& focus_O, const Eigen::Vector3d& beam_O) const {
  const double far_m = cell_.lens.far_m;
  if (std::min(focus_O.z(), focus_O.z() - far_m * beam_O.z()) > kBeamTableGapM)
    return far_m;  // all of it is above
  double free_m = table_distance_m(focus_O);
  const double gap_m = std::min(kBeamTableGapM, .9 * free_m);
  for (double t = 0; t < far_m; t += free_m) {
    free_m = table_distance_m(focus_O - t * beam_O);
    if (free_m <= gap_m) return t;
  }
  return far_m;
}

double Clearance::beam_free_length_m(const Eigen::Vector3d& focus_O, const Eigen::Vector3d& beam_O) const {
  return std::min(rays_.free_length_m(focus_O, -beam_O, kBeamStartM, cell_.lens.far_m),
                  table_free_length_m(focus_O, beam_O));
}

Clearance::BallRow Clearance::cover(const Eigen::Vector3d& from_O, const Eigen::Vector3d& along_O,
                                    double length_m, double radius_m, double half_step_m) {
  const int count = std::max(1, static_cast<int>(std::ceil(length_m / (2 * half_step_m))));
  const double slice_m = length_m / count;
  return {from_O + .5 * slice_m * along_O,
          slice_m * along_O,
          count,
          std::sqrt(radius_m * radius_m + .25 * slice_m * slice_m),
          slice_m,
          radius_m};
}

Clearance::BallRow Clearance::lens_row(const Eigen::Vector3d& focus_O, const Eigen::Vector3d& beam_O,
                                       double half_step_m, double from_m) const {
  return cover(focus_O - from_m * beam_O, -beam_O, cell_.lens.far_m - from_m, cell_.lens.radius_m,
               half_step_m);
}

Clearance::BallRow Clearance::quill_row(const ToolPose& tool) const {
  const double radius_m = std::max(cell_.arm.quill_radius_m, 1e-3);
  return cover(tool.focus_O - cell_.arm.flange_to_focus_m * tool.beam_O, tool.up_O, cell_.arm.quill_length_m,
               radius_m, .4 * radius_m);
}

bool Clearance::is_far(const BallRow& row, double margin_m) const {
  const Eigen::Vector3d to_first = row.first_O - Eigen::Vector3d(0, 0, ball_height_m_);
  const double along = std::clamp(-to_first.dot(row.step_O) / row.step_O.squaredNorm(), 0., row.count - 1.);
  const double kept_m = ball_radius_m_ + row.ball_m + margin_m + 2 * distance_.error_m(row.ball_m);
  return (to_first + along * row.step_O).squaredNorm() > kept_m * kept_m;
}

bool Clearance::keeps_margin(const BallRow& row) const {
  if (is_far(row, kMarginM)) return true;
  const double error_m = distance_.error_m(row.ball_m);
  for (int i = 0; i < row.count;) {
    const Eigen::Vector3d p_O = row.first_O + i * row.step_O;
    const double free_m = std::min(distance_(p_O) - error_m, table_distance_m(p_O)) - kMarginM;
    if (free_m < row.ball_m) return false;
    // A free ball covers the cylinder as far as its chord reaches: that many slices need no check of their
    // own.
    const double chord_m = std::sqrt(free_m * free_m - row.cylinder_m * row.cylinder_m);
    i += std::max(1, 1 + static_cast<int>(std::floor((chord_m - .5 * row.slice_m) / row.slice_m)));
  }
  return true;
}

void Clearance::reduce_clearance(const Eigen::Vector3d& ball_O, double radius_m, Slack& slack) const {
  slack.object_m = std::min(slack.object_m, distance_(ball_O) - radius_m - distance_.error_m(radius_m));
  slack.table_m = std::min(slack.table_m, table_distance_m(ball_O) - radius_m);
}

void Clearance::reduce_clearance(const BallRow& row, Slack& slack) const {
  if (is_far(row, kSlackMaxM)) return;
  for (int i = 0; i < row.count; ++i) reduce_clearance(row.first_O + i * row.step_O, row.ball_m, slack);
}

Clearance::Slack Clearance::lens_slack(const Eigen::Vector3d& focus_O, const Eigen::Vector3d& beam_O) const {
  Slack slack;
  reduce_clearance(lens_row(focus_O, beam_O, cell_.lens.radius_m / 3, cell_.lens.near_m), slack);
  return slack;
}

/// Small balls at the near end instead of a bulge, and thinner slices.
Clearance::Slack Clearance::lens_slack_fine(const Eigen::Vector3d& focus_O,
                                            const Eigen::Vector3d& beam_O) const {
  Slack slack;
  const auto& lens = cell_.lens;
  // 19 balls of .4 radius in two rings cover the end disc and the slice of .4 radius behind it: .2 above and
  // below their centers they still are discs of .346 radius, and 19 discs of .275 radius would do.
  const double ball_m = .4 * lens.radius_m;
  const double depth_m = .2 * lens.radius_m;
  const double front_m = lens.near_m + depth_m;
  const Eigen::Vector3d u = beam_O.unitOrthogonal();
  const Eigen::Vector3d v = beam_O.cross(u);
  for (int layer = 0; layer < 2; ++layer) {
    const Eigen::Vector3d center = focus_O - (front_m + layer * 2 * depth_m) * beam_O;
    reduce_clearance(center, ball_m, slack);
    for (const auto& [count, ring] : {std::pair{6, .50}, std::pair{12, .83}})
      for (int i = 0; i < count; ++i) {
        const double angle = 2 * std::numbers::pi * i / count;
        reduce_clearance(center + ring * lens.radius_m * (std::cos(angle) * u + std::sin(angle) * v), ball_m,
                         slack);
      }
  }
  const double behind_m = lens.near_m + 4 * depth_m;
  if (behind_m < lens.far_m) reduce_clearance(lens_row(focus_O, beam_O, lens.radius_m / 6, behind_m), slack);
  return slack;
}

Clearance::Slack Clearance::quill_slack(const ToolPose& tool) const {
  Slack slack;
  reduce_clearance(quill_row(tool), slack);
  return slack;
}

Clearance::Slack Clearance::links_slack(const TablePose& table, const Joints& joints) const {
  Slack slack;
  if (!links_may_touch_) return slack;
  for (const Capsule& link_W : arm_links_W(cell_.arm, joints)) {
    if (link_W.radius_m > 0) reduce_clearance(link_W.in_O(table), slack);
  }
  return slack;
}

Clearance::Slack Clearance::column_slack(const TablePose& table) const {
  Slack slack;
  if (column_may_touch_) reduce_clearance(column_capsule_W(cell_.arm).in_O(table), slack);
  return slack;
}

void Clearance::reduce_clearance(const Capsule& capsule_O, Slack& slack) const {
  const double length_m = std::max((capsule_O.to - capsule_O.from).norm(), 1e-6);
  reduce_clearance(cover(capsule_O.from, (capsule_O.to - capsule_O.from) / length_m, length_m,
                         capsule_O.radius_m, .3 * capsule_O.radius_m),
                   slack);
}

/// Lens, quill and forearm against the column; the upper arm stands on it.
double Clearance::column_tool_gap_m(const Joints& joints) const {
  const auto& arm = cell_.arm;
  if (arm.column.radius_m <= 0) return kSlackMaxM;
  const double cos_elbow = std::cos(joints[kJ2]);
  const double l1 = arm.upper_arm_m;
  const double l2 = arm.forearm_m;
  // The forearm's nearest point to J1's axis is where it passes it, or one of its ends.
  const bool passes = -l1 * cos_elbow > 0 && -l1 * cos_elbow < l2;
  const double nearest_m = passes ? l1 * std::sqrt(1 - cos_elbow * cos_elbow)
                                  : std::min(l1, std::sqrt(l1 * l1 + l2 * l2 + 2 * l1 * l2 * cos_elbow));
  if (nearest_m - tool_radius_m_ - arm.column.radius_m >= kSlackMaxM) return kSlackMaxM;
  double gap_m = std::min({kSlackMaxM, column_gap_m(arm, lens_capsule_W(cell_, joints)),
                           column_gap_m(arm, quill_capsule_W(arm, joints))});
  if (arm.fore_link.radius_m > 0) gap_m = std::min(gap_m, column_gap_m(arm, arm_links_W(arm, joints)[1]));
  return gap_m;
}

double Clearance::link_lens_gap_m(const Joints& joints) const {
  double gap_m = kSlackMaxM;
  if (!links_may_touch_lens_) return gap_m;
  const Capsule lens = lens_capsule_W(cell_, joints);
  for (const Capsule& link : arm_links_W(cell_.arm, joints))
    if (link.radius_m > 0) gap_m = std::min(gap_m, capsule_gap_m(link, lens));
  return gap_m;
}

Obstruction Clearance::lens_obstruction(const Eigen::Vector3d& focus_O, const Eigen::Vector3d& beam_O) const {
  if (keeps_margin(lens_row(focus_O, beam_O, cell_.lens.radius_m / 3, cell_.lens.near_m)))
    return Obstruction::kNone;
  return lens_shortfall(focus_O, beam_O).what;
}

Obstruction Clearance::quill_obstruction(const ToolPose& tool) const {
  return keeps_margin(quill_row(tool)) ? Obstruction::kNone : quill_shortfall(tool).what;
}

Obstruction Clearance::links_obstruction(const TablePose& table, const Joints& joints) const {
  return arm_may_touch() ? links_shortfall(table, joints).what : Obstruction::kNone;
}

Obstruction Clearance::body_obstruction(const ToolPose& tool) const {
  const Obstruction lens = lens_obstruction(tool.focus_O, tool.beam_O);
  return lens == Obstruction::kNone ? quill_obstruction(tool) : lens;
}

Shortfall Clearance::lens_shortfall(const Eigen::Vector3d& focus_O, const Eigen::Vector3d& beam_O) const {
  return lens_slack_fine(focus_O, beam_O).shortfall(Obstruction::kLensObject, Obstruction::kLensTable);
}

Shortfall Clearance::quill_shortfall(const ToolPose& tool) const {
  return quill_slack(tool).shortfall(Obstruction::kQuillObject, Obstruction::kQuillTable);
}

Shortfall Clearance::links_shortfall(const TablePose& table, const Joints& joints) const {
  Shortfall worst = links_slack(table, joints).shortfall(Obstruction::kLinkObject, Obstruction::kLinkTable);
  for (const Shortfall& other :
       {Shortfall{Obstruction::kLinkLens, kMarginM - link_lens_gap_m(joints)},
        column_slack(table).shortfall(Obstruction::kColumnObject, Obstruction::kColumnTable),
        Shortfall{Obstruction::kColumnTool, kMarginM - column_tool_gap_m(joints)}})
    if (other.amount_m > worst.amount_m) worst = other;
  return worst;
}

double Clearance::slack_m(const ToolPose& tool) const {
  const double quill_m = quill_slack(tool).least_m();
  double lens_m = lens_slack(tool.focus_O, tool.beam_O).least_m();
  if (lens_m < kMarginM) lens_m = std::max(lens_m, lens_slack_fine(tool.focus_O, tool.beam_O).least_m());
  return std::min(quill_m, lens_m);
}

double Clearance::slack_m(const Kinematics& kinematics, const Joints& joints) const {
  const double tool_m = slack_m(kinematics.tool_pose(joints));
  if (!arm_may_touch()) return tool_m;
  const TablePose table = kinematics.table_pose(joints[kTilt], joints[kRotation]);
  return std::min({tool_m, links_slack(table, joints).least_m(), link_lens_gap_m(joints),
                   column_slack(table).least_m(), column_tool_gap_m(joints)});
}

}  // namespace hilbrush
