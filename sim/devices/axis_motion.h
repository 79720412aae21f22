#pragma once
#include <array>
#include <span>

namespace hilbrush {

/// One axis's position as a closed-form function of time: at rest, then at most five pieces of constant
/// acceleration (a braking piece if it was still moving, a rest until others have braked, then speed up,
/// cruise, slow down), then at rest again. Units of the axis: rad or m.
class AxisMotion {
 public:
  explicit AxisMotion(double position = 0) : first_position_(position), last_position_(position) {}

  /// The motion that leaves this one at `start_s` and comes to rest at `target`. An axis that is still moving
  /// brakes first.
  AxisMotion move_to(double target, double start_s, double speed_max, double acceleration) const;
  /// The same, but it leaves its resting place at `go_s` at the earliest, with `speed_max` and
  /// `acceleration`; it brakes with `braking`.
  AxisMotion move_to(double target, double start_s, double go_s, double speed_max, double acceleration,
                     double braking) const;
  /// The motion that leaves this one at `start_s` and brakes until it rests.
  AxisMotion brake(double start_s, double acceleration) const;

  double position(double time_s) const;
  double speed(double time_s) const;
  /// When it rests for good; minus infinity if it never moved.
  double end_s() const { return end_s_; }
  double target() const { return last_position_; }

 private:
  struct Piece {
    double start_s, position, speed, acceleration;
  };
  /// Appends a piece that lasts duration_s from the present end; returns the speed at its end.
  double append(double duration_s, double speed, double acceleration);
  const Piece* piece_at(double time_s) const;

  std::array<Piece, 5> pieces_{};
  int piece_count_ = 0;
  double first_position_, last_position_;
  double end_s_ = -kForever;
  static constexpr double kForever = 1e300;
};

/// What one axis may do.
struct AxisLimits {
  double speed_max, acceleration;
};
/// Leads all axes to `target` along a straight line, each within its limits: they start together, once all
/// have braked, and arrive together.
void move_coordinated(std::span<AxisMotion> motions, std::span<const double> target,
                      std::span<const AxisLimits> limits, double start_s);

}  // namespace hilbrush
