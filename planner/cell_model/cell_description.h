#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

/// The robot cell as data, read from config/cells/*.json. SI units.
///
/// Frames: W world = B robot base, +z up, J1's axis at the origin, the table on +x. F flange. T tool: origin
/// at the focus, +z along the beam. R table; O object: on the fixture's post, +z along the C axis, z = 0 at
/// the post's top. Arm (SCARA): J1, J2 revolute about z, J3 prismatic (the flange's height), J4 revolute
/// about z. yaw = J1 + J2 + J4. Beam direction in W: (cos e cos yaw, cos e sin yaw, -sin e) with e the beam
/// depression; the focus lies `flange_to_focus_m` along it from the flange's center. Table: tilt A about the
/// axis through `tilt_axis_W` along -y (A > 0 brings the object's top towards the robot, -x), then rotation C
/// about the tilted z: X_WO = T(tilt_axis_W) * Ry(-A) * T(0, 0, plate_height_m + post_height_m) * Rz(C).
namespace hilbrush {

inline constexpr std::size_t kAxisCount = 6;
/// Indices into Joints.
inline constexpr std::size_t kJ1 = 0;
inline constexpr std::size_t kJ2 = 1;
inline constexpr std::size_t kJ3 = 2;
inline constexpr std::size_t kJ4 = 3;
inline constexpr std::size_t kTilt = 4;
inline constexpr std::size_t kRotation = 5;
/// J1, J2, J3, J4, A, C; rad, J3 in m.
using Joints = std::array<double, kAxisCount>;
inline constexpr std::array<const char*, kAxisCount> kAxisNames{"j1", "j2", "j3", "j4", "a", "c"};

/// The joints that one controller moves.
struct Chain {
  std::size_t first, count;
};
inline constexpr Chain kRobotChain{kJ1, 4};
inline constexpr Chain kTableChain{kTilt, 2};

/// How a controller leads its joints from rest to rest.
enum class Interpolation {
  kUnknown,  ///< moves must be clear under both of the others; time model and simulation take kIndependent
  kIndependent,  ///< each joint at its own limits: all start together, each arrives when it can
  kCoordinated   ///< one time law for all joints, slow enough for each: a straight line in joint space
};

struct AxisDescription {
  double min = 0, max = 0;       ///< rad or m
  double speed_max = 0;          ///< rad/s or m/s
  double acceleration_max = 0;   ///< rad/s2 or m/s2
  double settle_saturation = 0;  ///< the move at which settling takes longest, rad or m
  double home = 0;               ///< where homing ends
  double time_factor = 1;  ///< measured duration of its moves over that by speed_max and acceleration_max
};

/// How paint responds to x = dose / full dose; coverage in 0..1.
enum class PaintResponse {
  kLinear,      ///< min(x, 1)
  kSaturating,  ///< 1 - exp(-3 x)
  kSigmoid      ///< smooth threshold around x = .5
};

/// A calibrated tone curve and what it was made for.
struct ToneCurveEntry {
  std::string sampler, curve = "hilbert";  ///< the placement's names, as in a job's settings
  int levels = 1;                          ///< energies of the dots
  std::optional<double> spot_pitches;      ///< the spot's 1/e2 diameter, where it matters
  std::vector<double> wanted, asked;
};

struct CellDescription {
  std::string name;
  std::string sha256;  ///< of the file's bytes, as the provenance of programs names it

  std::array<AxisDescription, kAxisCount> axes;
  double limit_margin = 0;  ///< fraction of each axis's range that planning keeps free at both ends

  struct Arm {
    double upper_arm_m = 0, forearm_m = 0;
    double beam_depression = 0;  ///< rad
    double flange_to_focus_m = 0;
    double quill_radius_m = 0;  ///< the vertical shaft above the flange
    double quill_length_m = .25;
    /// A capsule around the horizontal line between the axes of two joints.
    struct Link {
      double height_m = 0;  ///< of that line, in W
      double radius_m = 0;  ///< 0: no link
    } upper_link, fore_link;
    /// What J1 stands on: an upright cylinder around its axis, from z = 0 in W.
    struct Column {
      double height_m = 0;
      double radius_m = 0;  ///< 0: no column
    } column;
  } arm;
  struct Lens {  ///< a cylinder around the beam, behind the focus
    double radius_m = 0, near_m = 0, far_m = 0;
  } lens;
  struct Table {
    Eigen::Vector3d tilt_axis_W = Eigen::Vector3d::Zero();
    double plate_height_m = 0;  ///< of the plate's top above the tilt axis at A = 0; may be negative
    double plate_radius_m = 0, plate_thickness_m = 0;
  } table;
  struct Fixture {
    double post_height_m = 0, post_radius_m = 0;
  } fixture;
  struct Laser {
    double power_min_w = 0, power_max_w = 0;
    double pulse_min_s = 0, pulse_max_s = 0;
    double pulse_s = 0;                     ///< preferred; stretched only when power_max_w is not enough
    std::optional<double> spot_diameter_m;  ///< 1/e2, or
    double spot_pitches = 1.41;             ///< in pitches
  } laser;
  struct Paint {
    PaintResponse response = PaintResponse::kSaturating;
    double reflectance_white = 1, reflectance_black = 0;
    double dose_full_j_m2 = 0;  ///< x = 1: one dot's energy over one pitch squared
    double asked_max = 1;       ///< the largest coverage a tone curve may ask for
    std::vector<ToneCurveEntry> tone_curves;
  } paint;
  struct Timing {
    double tick_s = 0;  ///< control tick
    double settle_min_s = 0;
    double settle_max_s = 0;  ///< settle = min + (max - min) * min(1, largest move / settle_saturation)
    double retract_s = 0;     ///< backing off and coming back around a re-pose
    double message_s = 0;     ///< duration of one exchange with the devices
    double move_delay_s = 0;  ///< measured, added to each move
  } timing;
  struct Motion {
    Interpolation robot = Interpolation::kUnknown;
    Interpolation table = Interpolation::kUnknown;
    double start_lag_s = .02;  ///< either chain may start this much later than the other
  } motion;
  struct Simulation {
    double time_scale = 0;  ///< wall seconds of one cell second: 1 real time, 0 virtual (as fast as possible)
  } simulation;
};

/// Where all axes rest after homing.
Joints home_joints(const CellDescription& cell);
/// Spot diameter (1/e2) for dots at this pitch.
double spot_diameter_m(const CellDescription& cell, double pitch_m);
/// Energy of a dot of level 1: the full dose over one pitch squared.
double full_energy_j(const CellDescription& cell, double pitch_m);
/// Coverage, 0..1, of paint that got `x` times the full dose.
double painted_coverage(PaintResponse response, double x);

}  // namespace hilbrush
