#pragma once
#include <array>
#include <functional>
#include <limits>
#include <optional>
#include <span>

#include "planner/cell_model/cell_description.h"
#include "sim/devices/axis_motion.h"
#include "sim/devices/emission_record.h"
#include "sim/script/cell_phase.h"

/// What the simulated cell truly is behind all its wires: six axes, one laser head with its gate, an
/// interlock, and the record of emissions. Everything happens at a time that the caller gives, so the same
/// cell runs on a scaled clock or in a test without any. Light is on exactly while the head may emit and its
/// gate is open; each stretch of light is one emission.
///
/// Axes come to rest by their trapezoidal profiles and then creep into place: the position error falls
/// exponentially from kCreep x (share of the settle figures) until the mechanics have settled by the cell
/// file's figures.
///
/// One thread. SI units: rad, m, s, W.
namespace hilbrush {

class TimeRecord;

struct TrueCellOptions {
  double start_delay_s = 5;  ///< from the order to emit until light may come (CDRH)
  double warm_up_s = 0;      ///< from time 0
  double notice_s = .03;     ///< an axis must be off its target for longer before light there is a fault
};

class TrueCell {
 public:
  static constexpr double kNever = std::numeric_limits<double>::infinity();
  static constexpr double kCreep = 1e-4;          ///< rad; prismatic joints a tenth of it, in m
  static constexpr double kOutOfPosition = 2e-4;  ///< rad or m off the target: an axis that drifted

  explicit TrueCell(const CellDescription& description, const TrueCellOptions& options = {});

  /// Lets time pass: light that begins by itself (the end of the start delay) begins at its own instant.
  /// Times never go back; a smaller one counts as the present.
  void advance(double now_s);
  double now_s() const { return now_s_; }
  /// The next instant at which something happens by itself: an axis comes to rest or settles, the start delay
  /// ends.
  double next_event_s() const;

  // Axes. `scale` of speed and acceleration: 0..1.
  void move_axis(std::size_t axis, double target, double speed_max, double acceleration);
  void move_axis(std::size_t axis, double target, double speed_scale = 1);
  /// Moves a whole chain as the cell's interpolation says (unknown: each axis on its own).
  void move_chain(Chain chain, std::span<const double> target, double speed_scale = 1);
  void brake_axis(std::size_t axis);
  double position(std::size_t axis) const;  ///< true
  double speed(std::size_t axis) const;
  double profile(std::size_t axis) const;  ///< what the axis's controller commands at present
  double target(std::size_t axis) const { return axes_[axis].target; }
  bool is_moving(std::size_t axis) const;   ///< on its profile, or held by a jam short of its target
  bool is_settled(std::size_t axis) const;  ///< at rest, rung down, where it was sent
  double rest_s(std::size_t axis) const { return axes_[axis].rest_s; }
  double settled_s(std::size_t axis) const { return axes_[axis].settled_s; }
  Joints joints() const;
  bool is_settled() const;
  CellPhase phase() const;
  const AxisDescription& limits(std::size_t axis) const { return description_.axes[axis]; }

  // Faults of the mechanics.
  void jam_axis(std::size_t axis);                        ///< stops at once, and stays until free_axis()
  void free_axis(std::size_t axis);                       ///< it remains where it is; the next order moves it
  void drift_axis(std::size_t axis, double speed);        ///< leaves its place at this speed; 0 ends it
  void displace_axis(std::size_t axis, double position);  ///< where it stands when power comes on

  // The laser head.
  /// Light while emission is on; or only while the wired gate input, or the gate of the serial line, is open
  /// as well.
  enum class Modulation { kNone, kWired, kSerial };
  void set_key(bool is_on);
  void set_interlock(bool is_closed);
  /// The order to emit. Refused (false) without key or with the interlock open.
  bool set_emission(bool is_on);
  void set_modulation(Modulation modulation);
  void set_power(double power_w);
  /// The wired input of the gate. `pulse_s`: what the output's owner says the pulse will last from now, for
  /// the record.
  void set_gate(bool is_open, std::optional<double> pulse_s = {});
  void set_serial_gate(bool is_open);
  bool has_key() const { return has_key_; }
  bool is_interlock_closed() const { return is_interlock_closed_; }
  /// The interlock or the key took emission away; until the next order to emit.
  bool is_tripped() const { return is_tripped_; }
  bool is_emission_ordered() const { return is_ordered_; }
  bool is_in_start_delay() const { return is_ordered_ && now_s_ < may_emit_s_; }
  bool is_warming_up() const { return now_s_ < options_.warm_up_s; }
  bool is_gate_open() const { return is_gate_open_; }
  bool is_emitting() const { return emission_.has_value(); }
  Modulation modulation() const { return modulation_; }
  double power_w() const { return power_w_; }
  double power_max_w() const { return power_max_w_; }
  /// A set power above it comes down with it.
  void set_power_max(double power_w);
  const CellDescription& description() const { return description_; }

  /// Told of motion and light; outlives the cell. May be null.
  void set_time_record(TimeRecord* times) { times_ = times; }
  void set_sink(EmissionSink sink) { sink_ = std::move(sink); }
  /// Ends the light and records it: when power goes off.
  void disarm();

 private:
  struct Axis {
    AxisMotion motion;
    double target = 0;
    double rest_s = -1;
    double settled_s = -1;
    double creep = 0;  ///< signed, at rest_s
    double drift_speed = 0;
    double drift_from_s = 0;
    double drifted = 0;
    double off_since_s = kNever;  ///< since when its place is not where it was sent
    bool is_jammed = false;
  };
  double drift(const Axis& axis) const;
  void begin_motion(std::size_t axis, double target, double speed_max, double acceleration, double share);
  void note_off(Axis& axis);
  bool may_emit() const;
  void update_light();
  void end_light();

  const CellDescription description_;
  const TrueCellOptions options_;
  double now_s_ = 0;
  std::array<Axis, kAxisCount> axes_;

  bool has_key_ = true;
  bool is_interlock_closed_ = true;
  bool is_tripped_ = false;
  bool is_ordered_ = false;
  bool is_gate_open_ = false;
  bool is_serial_gate_open_ = false;
  double may_emit_s_ = kNever;
  Modulation modulation_ = Modulation::kNone;
  double power_w_ = 0;
  double power_max_w_ = 0;
  std::optional<Emission> emission_;
  EmissionSink sink_;
  TimeRecord* times_ = nullptr;
};

}  // namespace hilbrush
