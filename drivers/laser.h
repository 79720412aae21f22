#pragma once
#include <string>

#include "drivers/axis_group.h"

/// The laser in two halves: *enable* (key, interlock, emission armed once per job) and *gate* (one dot's
/// pulse, timed by the device). Life cycle: disconnected -> connected -> enabled (start delay is paid here)
/// -> ready; emitting counts as moving; any -> fault.
namespace hilbrush {

class Laser {
 public:
  struct Status {
    DeviceState state = DeviceState::kDisconnected;
    bool is_emitting = false;
    bool interlock_closed = false;
    std::string fault;
    /// When the first frame or reply came that showed the last pulse over, on the cell's clock; 0 if unknown.
    double dark_since_s = 0;
  };
  struct Limits {
    double power_min_w = 0;
    double power_max_w = 0;
    double pulse_min_s = 0;
    double pulse_max_s = 0;
  };

  virtual ~Laser() = default;
  virtual void connect() = 0;
  virtual Limits limits() = 0;
  /// Arms emission: key and interlock are checked, the start delay is waited for. No light yet. @throws
  /// DriverError
  virtual void enable() = 0;
  /// Emission cannot happen any more until enable(). From any thread, idempotent, never throws.
  virtual void disable() noexcept = 0;
  /// Sets what the next pulse needs, such as its power, while the axes move and the gate is closed. No light
  /// comes of it, and fire() need not follow. Executor's thread only. @throws DriverError if the device
  /// refuses or is lost
  virtual void prepare(double /*power_w*/, double /*pulse_s*/) {}
  /// Starts one pulse; the device itself ends it after pulse_s, whatever happens to the caller. Executor's
  /// thread only.
  /// @throws DriverError if not enabled, outside limits(), interlock open, or still emitting.
  virtual void fire(double power_w, double pulse_s) = 0;
  /// The gate off, now. From any thread, idempotent, never throws. True if the device confirms that it is
  /// off.
  virtual bool off() noexcept = 0;
  /// As AxisGroup::status(): cheap, wakes the cell's clock when is_emitting, interlock or fault change. From
  /// any thread.
  virtual Status status() = 0;
  virtual void clear_fault() = 0;
};

}  // namespace hilbrush
