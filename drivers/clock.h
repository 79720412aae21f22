#pragma once

namespace hilbrush {

/// Time as the executor and the devices share it, in seconds of the cell. Real cells: the steady clock.
/// Simulated cells: scaled or virtual.
class Clock {
 public:
  virtual ~Clock() = default;
  virtual double now_s() const = 0;
  /// Blocks until now_s() >= time_s, or wake() is called. Any one thread may sleep.
  virtual void sleep_until(double time_s) = 0;
  /// Ends a sleep early; may be called from any thread. A wake() while no thread sleeps ends the next sleep
  /// at once, so that a thread which checks a flag and then goes to sleep misses nothing.
  virtual void wake() = 0;
  /// Wall seconds that `cell_s` seconds of the cell take; for waits that use wall time instead of this clock.
  virtual double wall_s(double cell_s) const { return cell_s; }
};

}  // namespace hilbrush
