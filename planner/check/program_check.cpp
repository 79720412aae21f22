#include "planner/check/program_check.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "planner/check/check_cell.h"
#include "sampling/base/angles.h"

namespace hilbrush {
namespace {

constexpr double kFocusToleranceM = 1e-9;
constexpr double kLandingToleranceM = 10e-6;
constexpr double kJointTolerance = 1e-9;
constexpr double kIncidenceTolerance = 1e-5;  // rad: normals and incidences are kept in single precision
constexpr double kEnergyTolerance = 1e-5;     // relative, for the same reason
constexpr double kCheckStepM = 3e-3;          // along moves, between two checks of the clearance
constexpr double kGapOnLegsM = .3e-3;         // kept around lens and quill along moves
constexpr std::size_t kCheckBlock = 512;

using Faults = std::vector<ProgramFault>;

/// Where an axis is `time_s` into a move over `distance`: the second half is the first one backwards.
double axis_position(double distance, double time_s, const AxisDescription& axis) {
  const double peak = std::min(axis.speed_max, std::sqrt(distance * axis.acceleration_max));
  const double end_s = peak > 0 ? distance / peak + peak / axis.acceleration_max : 0;
  if (time_s >= end_s) return distance;
  if (time_s > end_s / 2) return distance - axis_position(distance, end_s - time_s, axis);
  const double ramp_s = peak / axis.acceleration_max;
  const double ramping_s = std::min(time_s, ramp_s);
  return .5 * axis.acceleration_max * ramping_s * ramping_s + peak * (time_s - ramping_s);
}

double axis_end_s(double distance, const AxisDescription& axis) {
  const double peak = std::min(axis.speed_max, std::sqrt(distance * axis.acceleration_max));
  return peak > 0 ? distance / peak + peak / axis.acceleration_max : 0;
}

/// The cell with a longer and wider lens and quill: what does not touch them keeps the gap to the true ones.
CellDescription with_gap(CellDescription cell, double gap_m) {
  cell.lens.radius_m += gap_m;
  cell.lens.near_m -= gap_m;
  cell.lens.far_m += gap_m;
  cell.arm.quill_radius_m += gap_m;
  return cell;
}

/// The joints first..last of one controller on their way. All of them take the share of the move that the
/// weakest allows, or each its own.
class ControllerMove {
 public:
  ControllerMove(const CellDescription& cell, std::size_t first, std::size_t last, const Joints& from,
                 const Joints& to, bool is_coordinated)
      : cell_(cell), first_(first), last_(last), from_(from), to_(to), is_coordinated_(is_coordinated) {
    whole_.speed_max = whole_.acceleration_max = std::numeric_limits<double>::infinity();
    for (std::size_t axis = first; axis <= last; ++axis) {
      const double distance = std::abs(to[axis] - from[axis]);
      if (!(distance > 0)) continue;
      ++moving_;
      const AxisDescription& limits = cell.axes[axis];
      end_s_ = std::max(end_s_, limits.time_factor * axis_end_s(distance, limits));
      whole_.speed_max = std::min(whole_.speed_max, limits.speed_max / distance);
      whole_.acceleration_max = std::min(whole_.acceleration_max, limits.acceleration_max / distance);
      factor_ = std::max(moving_ == 1 ? 0 : factor_, limits.time_factor);
    }
    if (is_coordinated_ && moving_ > 0) end_s_ = factor_ * axis_end_s(1, whole_);
  }

  int moving() const { return moving_; }
  double end_s() const { return end_s_; }
  void put(double time_s, Joints& now) const {
    time_s = std::max(time_s, 0.);
    for (std::size_t axis = first_; axis <= last_; ++axis) {
      const double distance = to_[axis] - from_[axis];
      if (distance == 0) continue;
      const double factor = cell_.axes[axis].time_factor;
      now[axis] = is_coordinated_
                      ? from_[axis] + distance * axis_position(1, time_s / factor_, whole_)
                      : from_[axis] + std::copysign(axis_position(std::abs(distance), time_s / factor,
                                                                  cell_.axes[axis]),
                                                    distance);
    }
  }

 private:
  const CellDescription& cell_;
  std::size_t first_, last_;
  const Joints& from_;
  const Joints& to_;
  bool is_coordinated_;
  int moving_ = 0;
  double end_s_ = 0, factor_ = 1;
  AxisDescription whole_;
};

/// The motions that one controller may make.
std::vector<ControllerMove> controller_moves(const CellDescription& cell, std::size_t first, std::size_t last,
                                             Interpolation interpolation, const Joints& from,
                                             const Joints& to) {
  std::vector<ControllerMove> moves;
  if (interpolation != Interpolation::kCoordinated) moves.emplace_back(cell, first, last, from, to, false);
  // Of one joint both are the same.
  if (interpolation == Interpolation::kCoordinated ||
      (interpolation == Interpolation::kUnknown && moves[0].moving() > 1))
    moves.emplace_back(cell, first, last, from, to, true);
  return moves;
}

class ProgramCheck {
 public:
  ProgramCheck(const ExposureProgram& program, const DotSequence& dots, const TexturedMesh& mesh,
               const CellDescription& cell, const PlanOptions& options)
      : program_(program),
        dots_(dots),
        cell_(cell),
        options_(options),
        check_cell_(mesh, cell),
        wide_cell_(mesh, with_gap(cell, kGapOnLegsM)) {}

  void check_counts(const std::vector<SkippedDot>& skipped, Faults& faults) const;
  void check_vias(Faults& faults) const;
  void check_provenance(const Provenance& made_from, Faults& faults) const;
  void check_exposure(std::size_t i, Faults& faults) const;
  /// The path from exposure i - 1 (or home) to exposure i (or home, if i is the count).
  void check_path(std::size_t i, Faults& faults) const;

 private:
  bool is_inside(std::size_t axis, double value) const;
  bool is_inside(const Joints& joints) const;
  void check_limits(const Joints& joints, std::size_t i, Faults& faults) const;
  void check_dot(std::size_t i, const Eigen::Isometry3d& X_OF, Faults& faults) const;
  void check_dose(std::size_t i, Faults& faults) const;
  void check_leg_at_dot(const Joints& from, const Joints& to, std::size_t i, Faults& faults) const;
  void check_leg(const Joints& from, const Joints& to, std::size_t i, Faults& faults) const;
  /// What is touched on this leg with these motions, the robot or the table late; empty if nothing.
  std::string motion_fault(const ControllerMove& robot, const ControllerMove& table, double robot_late_s,
                           double table_late_s, int step_count, const Joints& from) const;

  const ExposureProgram& program_;
  const DotSequence& dots_;
  const CellDescription& cell_;
  const PlanOptions& options_;
  CheckCell check_cell_;
  CheckCell wide_cell_;  ///< with a gap around lens and quill
};

void ProgramCheck::check_counts(const std::vector<SkippedDot>& skipped, Faults& faults) const {
  std::vector<std::uint8_t> seen(dots_.dots.size(), 0);
  const auto count = [&](std::uint32_t dot, std::size_t exposure, const char* where) {
    if (dot >= seen.size())
      faults.push_back(
          {fmt::format("dot {}, {}, is not one of the {} dots", dot, where, seen.size()), exposure});
    else if (seen[dot]++)
      faults.push_back({fmt::format("dot {}, {}, occurs more than once", dot, where), exposure});
  };
  for (std::size_t i = 0; i < program_.exposures.size(); ++i)
    count(program_.exposures[i].dot_index, i, "exposed");
  for (const auto& s : skipped) {
    count(s.dot_index, program_.exposures.size(), "skipped");
    if (s.detail.empty())
      faults.push_back(
          {fmt::format("dot {} is skipped without a reason", s.dot_index), program_.exposures.size()});
  }
  const auto missing = static_cast<std::size_t>(std::count(seen.begin(), seen.end(), 0));
  if (missing > 0)
    faults.push_back(
        {fmt::format("{} dots are neither exposed nor skipped", missing), program_.exposures.size()});
  if (!(program_.pitch_m > 0) || std::abs(program_.pitch_m - dots_.pitch_m) > 1e-12)
    faults.push_back(
        {fmt::format("the pitch is {:.6g} m, the dots' {:.6g} m", program_.pitch_m, dots_.pitch_m), 0});
}

void ProgramCheck::check_vias(Faults& faults) const {
  std::size_t previous = 0;
  for (const Via& via : program_.vias) {
    if (via.before_exposure < previous || via.before_exposure > program_.exposures.size())
      faults.push_back(
          {fmt::format("a way-point before exposure {} is out of order", via.before_exposure), previous});
    previous = via.before_exposure;
    check_limits(via.joints, via.before_exposure, faults);
  }
  if (program_.vias.empty() || program_.vias.front().before_exposure != 0 ||
      program_.vias.front().joints != home_joints(cell_))
    faults.push_back({"the program does not start at home", 0});
  if (program_.vias.empty() || program_.vias.back().before_exposure != program_.exposures.size() ||
      program_.vias.back().joints != home_joints(cell_))
    faults.push_back({"the program does not end at home", program_.exposures.size()});
}

void ProgramCheck::check_provenance(const Provenance& made_from, Faults& faults) const {
  const auto compare = [&](const std::string& stated, const std::string& expected, const char* what) {
    if (stated != expected) faults.push_back({fmt::format("the program was made from another {}", what), 0});
  };
  const Provenance& stated = program_.provenance;
  compare(stated.model_sha256, made_from.model_sha256, "model");
  compare(stated.settings_sha256, made_from.settings_sha256, "job's settings");
  compare(stated.cell_sha256, made_from.cell_sha256, "cell");
  compare(stated.version, made_from.version, "version of this program");
}

/// The comparison is such that NaN fails it.
bool ProgramCheck::is_inside(std::size_t axis, double value) const {
  const auto& limits = cell_.axes[axis];
  return value >= limits.min - kJointTolerance && value <= limits.max + kJointTolerance;
}

bool ProgramCheck::is_inside(const Joints& joints) const {
  for (std::size_t axis = 0; axis < kAxisCount; ++axis)
    if (!is_inside(axis, joints[axis])) return false;
  return true;
}

void ProgramCheck::check_limits(const Joints& joints, std::size_t i, Faults& faults) const {
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
    const auto& limits = cell_.axes[axis];
    const double value = joints[axis];
    if (is_inside(axis, value)) continue;
    const bool is_length = axis == kJ3;
    const double unit = is_length ? 1e-3 : kDegree;
    faults.push_back(
        {fmt::format("{} at {:.6g} {} is outside {:.6g} to {:.6g}", kAxisNames[axis], value / unit,
                     is_length ? "mm" : "degrees", limits.min / unit, limits.max / unit),
         i});
  }
}

void ProgramCheck::check_dot(std::size_t i, const Eigen::Isometry3d& X_OF, Faults& faults) const {
  const Exposure& exposure = program_.exposures[i];
  if (exposure.dot_index >= dots_.dots.size()) return;  // counted already
  const Dot& dot = dots_.dots[exposure.dot_index];
  if (exposure.position_O != dot.position_O || exposure.normal_O != dot.normal_O || exposure.tone != dot.tone)
    faults.push_back(
        {fmt::format("position, normal or tone differs from that of dot {}", exposure.dot_index), i});

  const double off_m = (check_cell_.focus_O(X_OF) - dot.position_O).norm();
  if (!(off_m <= kFocusToleranceM))
    faults.push_back({fmt::format("the focus is {:.3g} mm off the dot", off_m * 1e3), i});
  const double cosine = -check_cell_.beam_O(X_OF).dot(dot.normal_O.cast<double>().normalized());
  const double incidence = std::acos(std::clamp(cosine, -1., 1.));
  if (!(incidence <= options_.max_incidence + kIncidenceTolerance))
    faults.push_back({fmt::format("the beam meets the face at {:.3f} degrees, more than {:.3f}",
                                  incidence / kDegree, options_.max_incidence / kDegree),
                      i});
  // acos is steep near 0: compare cosines.
  if (!(std::abs(std::cos(static_cast<double>(exposure.incidence)) - cosine) <= kIncidenceTolerance))
    faults.push_back({fmt::format("the incidence is stated as {:.3f} degrees and is {:.3f}",
                                  static_cast<double>(exposure.incidence) / kDegree, incidence / kDegree),
                      i});
}

void ProgramCheck::check_dose(std::size_t i, Faults& faults) const {
  const Exposure& exposure = program_.exposures[i];
  const double power = exposure.power_w;
  const double pulse = exposure.pulse_s;
  const double energy = exposure.energy_j;
  const auto& laser = cell_.laser;
  const auto within = [](double value, double low, double high) {
    return value >= low * (1 - kEnergyTolerance) && value <= high * (1 + kEnergyTolerance);
  };
  if (!within(power, laser.power_min_w, laser.power_max_w))
    faults.push_back({fmt::format("{:.6g} W is outside the laser's limits", power), i});
  if (!within(pulse, laser.pulse_min_s, laser.pulse_max_s))
    faults.push_back({fmt::format("a pulse of {:.6g} s is outside the laser's limits", pulse), i});
  if (!within(energy, power * pulse, power * pulse))
    faults.push_back({fmt::format("{:.6g} J is not {:.6g} W for {:.6g} s", energy, power, pulse), i});
  if (exposure.dot_index >= dots_.dots.size()) return;
  const double wanted = dots_.dots[exposure.dot_index].level * full_energy_j(cell_, dots_.pitch_m);
  if (!within(energy, wanted, wanted))
    faults.push_back(
        {fmt::format("{:.6g} J is not the {:.6g} J that the dot's level needs", energy, wanted), i});
}

void ProgramCheck::check_exposure(std::size_t i, Faults& faults) const {
  const Joints& joints = program_.exposures[i].joints;
  check_dose(i, faults);
  check_limits(joints, i, faults);
  if (!is_inside(joints)) return;
  const Eigen::Isometry3d X_OF = check_cell_.X_OF(joints);
  check_dot(i, X_OF, faults);
  if (auto fault = check_cell_.beam_fault(X_OF, kLandingToleranceM); !fault.empty())
    faults.push_back({fault, i});
  if (auto fault = check_cell_.body_fault(joints); !fault.empty()) faults.push_back({fault, i});
}

/// What may only happen with the tool retracted, never on a leg that begins or ends at a dot: an elbow flip,
/// more than half a turn of J4 or C at once.
void ProgramCheck::check_leg_at_dot(const Joints& from, const Joints& to, std::size_t i,
                                    Faults& faults) const {
  if (from[kJ2] * to[kJ2] < 0) faults.push_back({"the elbow flips without a retract", i});
  for (const std::size_t axis : {kJ4, kRotation}) {
    const double turn = std::abs(to[axis] - from[axis]);
    if (!(turn <= 200 * kDegree))
      faults.push_back(
          {fmt::format("{} turns by {:.0f} degrees without a retract", kAxisNames[axis], turn / kDegree), i});
  }
}

std::string ProgramCheck::motion_fault(const ControllerMove& robot, const ControllerMove& table,
                                       double robot_late_s, double table_late_s, int step_count,
                                       const Joints& from) const {
  const double end_s = std::max(robot.end_s() + robot_late_s, table.end_s() + table_late_s);
  for (int k = 1; k <= step_count; ++k) {
    Joints now = from;
    robot.put(end_s * k / step_count - robot_late_s, now);
    table.put(end_s * k / step_count - table_late_s, now);
    if (std::string fault = wide_cell_.body_fault(now); !fault.empty()) return fault;
  }
  return {};
}

void ProgramCheck::check_leg(const Joints& from, const Joints& to, std::size_t i, Faults& faults) const {
  if (from == to) return;
  double sweep_m = 0;
  for (std::size_t axis = 0; axis < kAxisCount; ++axis)
    sweep_m += std::abs(to[axis] - from[axis]) * (axis == kJ3 ? 1 : .25);
  const double travel_m = check_cell_.travel_m(check_cell_.X_OF(from), check_cell_.X_OF(to));
  if (travel_m < kCheckStepM && sweep_m < 4 * kCheckStepM) return;  // both ends are checked as poses
  const int step_count = static_cast<int>(std::ceil(std::max(travel_m, sweep_m) / kCheckStepM));
  const double late_s = cell_.motion.start_lag_s;
  for (const ControllerMove& robot : controller_moves(cell_, kJ1, kJ4, cell_.motion.robot, from, to))
    for (const ControllerMove& table :
         controller_moves(cell_, kTilt, kRotation, cell_.motion.table, from, to)) {
      const bool has_lag = late_s > 0 && robot.moving() > 0 && table.moving() > 0;
      std::string fault = motion_fault(robot, table, 0, 0, step_count, from);
      if (fault.empty() && has_lag) fault = motion_fault(robot, table, late_s, 0, step_count, from);
      if (fault.empty() && has_lag) fault = motion_fault(robot, table, 0, late_s, step_count, from);
      if (fault.empty()) continue;
      faults.push_back(
          {fmt::format("on the path there, {} or comes within {:.1f} mm", fault, kGapOnLegsM * 1e3), i});
      return;
    }
}

void ProgramCheck::check_path(std::size_t i, Faults& faults) const {
  // Joints outside their limits have been reported; no path leads to or from them.
  if (i > 0 && !is_inside(program_.exposures[i - 1].joints)) return;
  if (i < program_.exposures.size() && !is_inside(program_.exposures[i].joints)) return;
  std::vector<Joints> path{i == 0 ? home_joints(cell_) : program_.exposures[i - 1].joints};
  for (const Via& via : program_.vias_before(i)) path.push_back(via.joints);
  if (i < program_.exposures.size()) path.push_back(program_.exposures[i].joints);
  for (std::size_t leg = 1; leg < path.size(); ++leg) {
    const bool leaves_dot = leg == 1 && i > 0;
    const bool meets_dot = leg + 1 == path.size() && i < program_.exposures.size();
    if (leaves_dot || meets_dot) check_leg_at_dot(path[leg - 1], path[leg], i, faults);
    check_leg(path[leg - 1], path[leg], i, faults);
  }
}

}  // namespace

std::vector<ProgramFault> check_program(const ExposureProgram& program,
                                        const std::vector<SkippedDot>& skipped, const DotSequence& dots,
                                        const TexturedMesh& mesh, const CellDescription& cell,
                                        const PlanOptions& options, std::size_t limit,
                                        const Progress& progress, const Provenance* made_from) {
  const ProgramCheck check(program, dots, mesh, cell, options);
  Faults faults;
  check.check_counts(skipped, faults);
  check.check_vias(faults);
  if (made_from) check.check_provenance(*made_from, faults);
  if (!faults.empty()) {  // the rest relies on order and counts
    faults.resize(std::min(faults.size(), limit));
    return faults;
  }

  // Blocks have their own lists, joined in order: the same faults for any number of threads.
  const std::size_t count = program.exposures.size() + 1;
  const std::size_t block_count = (count + kCheckBlock - 1) / kCheckBlock;
  constexpr std::size_t kBlocksAtOnce = 16;
  for (std::size_t first = 0; first < block_count && faults.size() < limit; first += kBlocksAtOnce) {
    std::vector<Faults> found(std::min(kBlocksAtOnce, block_count - first));
    tbb::parallel_for(std::size_t{0}, found.size(), [&](std::size_t b) {
      const std::size_t begin = (first + b) * kCheckBlock;
      const std::size_t end = std::min(count, begin + kCheckBlock);
      for (std::size_t i = begin; i < end && found[b].size() < limit; ++i) {
        if (i < program.exposures.size()) check.check_exposure(i, found[b]);
        check.check_path(i, found[b]);
      }
    });
    for (Faults& block : found) faults.insert(faults.end(), block.begin(), block.end());
    progress.step(std::min(first + kBlocksAtOnce, block_count), block_count);
  }
  faults.resize(std::min(faults.size(), limit));
  return faults;
}

}  // namespace hilbrush
