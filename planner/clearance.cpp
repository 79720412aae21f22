#include "planner/clearance.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace hilbrush {
namespace {

/// The ray starts this far from the dot: above the rounding of single precision, below any error that could be seen on
/// the film.
constexpr double kBeamStartM = 2e-6;
/// The beam passes edges at this distance at least, except right at the dot, where its own surface is that near.
constexpr double kBeamRadiusM = 20e-6, kSideBeamStartM = .3e-3;
/// The beam passes post and plate at this distance at least.
constexpr double kBeamTableGapM = .3e-3;
constexpr double kQuillLengthM = .25;
constexpr double kRangeBeyondLensM = 25e-3;

/// Distance from a point at (r, z) to a solid cylinder around the z axis.
double cylinder_distance_m(double r, double z, double radius, double z_low, double z_high) {
  const double dr = r - radius, dz = std::max(z_low - z, z - z_high);
  if (dr <= 0 || dz <= 0) return std::max(dr, dz);
  return std::hypot(dr, dz);
}

}  // namespace

Clearance::Clearance(const TexturedMesh& mesh, const CellDescription& cell)
    : cell_(cell),
      rays_(mesh),
      distance_(mesh, std::max(cell.lens.radius_m, cell.arm.quill_radius_m) + kRangeBeyondLensM) {}

double Clearance::table_distance_m(const Eigen::Vector3d& p_O) const {
  const double r = p_O.head<2>().norm(), z = p_O.z(), post = cell_.fixture.post_height_m;
  return std::min(cylinder_distance_m(r, z, cell_.fixture.post_radius_m, -post, 0),
                  cylinder_distance_m(r, z, cell_.table.plate_radius_m, -post - cell_.table.plate_thickness_m, -post));
}

Obstruction Clearance::beam_obstruction(const Eigen::Vector3d& focus_O, const Eigen::Vector3d& beam_O) const {
  if (rays_.is_blocked(focus_O, -beam_O, kBeamStartM, cell_.lens.far_m)) return Obstruction::kBeamObject;
  // What passes an edge by less than this passes it by rounding alone.
  const Eigen::Vector3d u = beam_O.unitOrthogonal(), v = beam_O.cross(u);
  for (const auto& [along_u, along_v] : {std::pair{1., 0.}, {-.5, .866}, {-.5, -.866}})
    if (rays_.is_blocked(focus_O + kBeamRadiusM * (along_u * u + along_v * v), -beam_O, kSideBeamStartM,
                         cell_.lens.far_m))
      return Obstruction::kBeamObject;
  // From the dot towards the lens in steps of the free distance. A dot that itself is nearer to the post than the gap
  // only has to get away from it.
  double free_m = table_distance_m(focus_O);
  const double gap_m = std::min(kBeamTableGapM, .9 * free_m);
  for (double t = 0; t < cell_.lens.far_m; t += free_m) {
    free_m = table_distance_m(focus_O - t * beam_O);
    if (free_m <= gap_m) return Obstruction::kBeamTable;
  }
  return Obstruction::kNone;
}

double Clearance::beam_free_length_m(const Eigen::Vector3d& focus_O, const Eigen::Vector3d& beam_O) const {
  return rays_.free_length_m(focus_O, -beam_O, kBeamStartM, cell_.lens.far_m);
}

void Clearance::row_of_balls(const Eigen::Vector3d& from_O, const Eigen::Vector3d& direction_O, double first_m,
                             double step_m, int count, double radius_m, Slack& slack) const {
  const double needed_m = radius_m + distance_.error_m(radius_m);
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d p_O = from_O + (first_m + i * step_m) * direction_O;
    slack.object_m = std::min(slack.object_m, distance_(p_O) - needed_m);
    slack.table_m = std::min(slack.table_m, table_distance_m(p_O) - radius_m);
  }
}

/// Balls on the axis, each covering a slice of the cylinder; they bulge over its two ends.
void Clearance::cover_cylinder(const Eigen::Vector3d& from_O, const Eigen::Vector3d& direction_O, double length_m,
                               double radius_m, double half_step_m, Slack& slack) const {
  const int count = static_cast<int>(std::ceil(length_m / (2 * half_step_m)));
  const double half = length_m / (2 * count);
  row_of_balls(from_O, direction_O, half, 2 * half, count, std::hypot(radius_m, half), slack);
}

Clearance::Slack Clearance::lens_slack(const Eigen::Vector3d& focus_O, const Eigen::Vector3d& beam_O) const {
  Slack slack{kRangeBeyondLensM, kRangeBeyondLensM};
  const auto& lens = cell_.lens;
  cover_cylinder(focus_O - lens.near_m * beam_O, -beam_O, lens.far_m - lens.near_m, lens.radius_m, lens.radius_m / 3,
                 slack);
  return slack;
}

/// Small balls at the near end instead of a bulge, and thinner slices.
Clearance::Slack Clearance::lens_slack_fine(const Eigen::Vector3d& focus_O, const Eigen::Vector3d& beam_O) const {
  Slack slack{kRangeBeyondLensM, kRangeBeyondLensM};
  const auto& lens = cell_.lens;
  // 19 balls of .4 radius in two rings cover the end disc and the slice of .4 radius behind it: .2 above and below
  // their centres they still are discs of .346 radius, and 19 discs of .275 radius would do.
  const double ball_m = .4 * lens.radius_m, depth_m = .2 * lens.radius_m;
  const double front_m = lens.near_m + depth_m;
  const Eigen::Vector3d u = beam_O.unitOrthogonal(), v = beam_O.cross(u);
  for (int layer = 0; layer < 2; ++layer) {
    const Eigen::Vector3d center = focus_O - (front_m + layer * 2 * depth_m) * beam_O;
    row_of_balls(center, beam_O, 0, 0, 1, ball_m, slack);
    for (const auto& [count, ring] : {std::pair{6, .50}, std::pair{12, .83}})
      for (int i = 0; i < count; ++i) {
        const double angle = 2 * std::numbers::pi * i / count;
        const Eigen::Vector3d side = std::cos(angle) * u + std::sin(angle) * v;
        row_of_balls(center, side, ring * lens.radius_m, 0, 1, ball_m, slack);
      }
  }
  const double behind_m = lens.near_m + 4 * depth_m;
  cover_cylinder(focus_O - behind_m * beam_O, -beam_O, lens.far_m - behind_m, lens.radius_m, lens.radius_m / 6, slack);
  return slack;
}

Clearance::Slack Clearance::quill_slack(const ToolPose& tool) const {
  Slack slack{kRangeBeyondLensM, kRangeBeyondLensM};
  const Eigen::Vector3d flange_O = tool.focus_O - cell_.arm.flange_to_focus_m * tool.beam_O;
  cover_cylinder(flange_O, tool.up_O, kQuillLengthM, cell_.arm.quill_radius_m, .4 * cell_.arm.quill_radius_m, slack);
  return slack;
}

Obstruction Clearance::lens_obstruction(const Eigen::Vector3d& focus_O, const Eigen::Vector3d& beam_O) const {
  if (lens_slack(focus_O, beam_O).least_m() >= kMarginM) return Obstruction::kNone;
  const Slack slack = lens_slack_fine(focus_O, beam_O);
  if (slack.least_m() >= kMarginM) return Obstruction::kNone;
  return slack.table_m < slack.object_m ? Obstruction::kLensTable : Obstruction::kLensObject;
}

Obstruction Clearance::quill_obstruction(const ToolPose& tool) const {
  const Slack slack = quill_slack(tool);
  if (slack.least_m() >= kMarginM) return Obstruction::kNone;
  return slack.table_m < slack.object_m ? Obstruction::kLensTable : Obstruction::kLensObject;
}

Obstruction Clearance::body_obstruction(const ToolPose& tool) const {
  const Obstruction lens = lens_obstruction(tool.focus_O, tool.beam_O);
  return lens == Obstruction::kNone ? quill_obstruction(tool) : lens;
}

double Clearance::slack_m(const ToolPose& tool) const {
  const double quill_m = quill_slack(tool).least_m();
  double lens_m = lens_slack(tool.focus_O, tool.beam_O).least_m();
  if (lens_m < kMarginM) lens_m = std::max(lens_m, lens_slack_fine(tool.focus_O, tool.beam_O).least_m());
  return std::min(quill_m, lens_m);
}

}  // namespace hilbrush
