#pragma once
#include <functional>

namespace hilbrush {

inline constexpr double kGatePulseMaxS = 60;  ///< longest pulse that any gate takes

/// What opens and closes the beam for one dot: a digital output of the robot's controller with the laser in
/// external modulation, or the laser's own serial command. The pulse's end never depends on the caller being
/// alive.
class Gate {
 public:
  virtual ~Gate() = default;
  /// The lengths it can time are whole multiples of this; 0: any.
  virtual double resolution_s() const = 0;
  /// Starts one pulse and returns when the device that times it has accepted the whole of it. One thread.
  /// @throws DriverError if it was refused; it is then off or turned off.
  virtual void pulse(double pulse_s) = 0;
  /// Off, now; a pulse that is queued or on is ended. From any thread, idempotent, bounded time. True if
  /// confirmed.
  virtual bool off() noexcept = 0;
  /// On, or a pulse is not yet confirmed over. Cheap, from any thread.
  virtual bool is_on() = 0;
  /// Called, from any thread: with true when is_on() has become false, with false when something went wrong
  /// and the gate could not be confirmed off.
  using Listener = std::function<void(bool is_dark)>;
  virtual void set_listener(Listener listener) = 0;
};

}  // namespace hilbrush
