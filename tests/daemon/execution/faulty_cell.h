#pragma once
#include <atomic>
#include <cstddef>
#include <functional>
#include <map>
#include <new>
#include <stdexcept>
#include <string>

#include "drivers/cell.h"
#include "drivers/driver_error.h"

/// A cell whose devices misbehave on order: each call of each device is a place where something can go wrong.
namespace hilbrush::test {

enum class Place {
  kRobotMove,
  kTableMove,
  kRobotStatus,
  kTableStatus,
  kRobotArrival,
  kTableArrival,
  kPrepare,
  kPower,
  kFire,
  kLaserStatus,
  kLaserOff,
  kSleep
};
inline constexpr Place kPlaces[] = {Place::kRobotMove,   Place::kTableMove,    Place::kRobotStatus,
                                    Place::kTableStatus, Place::kRobotArrival, Place::kTableArrival,
                                    Place::kPrepare,     Place::kPower,        Place::kFire,
                                    Place::kLaserStatus, Place::kLaserOff,     Place::kSleep};

enum class Kind {
  kThrows,         ///< the call fails with a DriverError and has no effect
  kThrowsLate,     ///< it has its effect, and fails then: a lost acknowledgement
  kThrowsMemory,   ///< std::bad_alloc
  kThrowsOddly,    ///< something that is not a std::exception
  kFault,          ///< from now on the device reports a fault
  kLostLink,       ///< from now on it reports that it is disconnected
  kStalePosition,  ///< the next statuses say "in position" of the move before
  kNeverArrives,   ///< from now on it is never in position
  kElsewhere,      ///< it says that it is in position and stands elsewhere
  kOffUnconfirmed,
  kStaysOn,         ///< the laser's status goes on saying that it emits
  kInterlockOpens,  ///< at this moment
  kStop,            ///< the operator stops the cell, on this very thread, at this moment
  kClockJumps       ///< the clock leaps forward by an hour
};
inline constexpr Kind kKinds[] = {
    Kind::kThrows,   Kind::kThrowsLate,     Kind::kThrowsMemory, Kind::kThrowsOddly, Kind::kFault,
    Kind::kLostLink, Kind::kStalePosition,  Kind::kNeverArrives, Kind::kElsewhere,   Kind::kOffUnconfirmed,
    Kind::kStaysOn,  Kind::kInterlockOpens, Kind::kStop,         Kind::kClockJumps};

/// One fault at the n-th call of one place, counted from one.
struct Fault {
  Place place = Place::kFire;
  Kind kind = Kind::kThrows;
  int countdown = 0;  ///< 0: has struck, or never does
  bool has_struck = false;
  std::function<void()> open_interlock, stop;
  Clock* clock = nullptr;
  double* clock_offset_s = nullptr;

  /// What goes wrong before the call's effect; true if the call is the one.
  bool strikes(Place here) {
    if (here != place || countdown <= 0 || --countdown > 0) return false;
    has_struck = true;
    switch (kind) {
      case Kind::kThrows:
        throw DriverError("the device does not answer");
      case Kind::kThrowsMemory:
        throw std::bad_alloc();
      case Kind::kThrowsOddly:
        throw 4711;
      case Kind::kInterlockOpens:
        open_interlock();
        break;
      case Kind::kStop:
        stop();
        break;
      case Kind::kClockJumps:
        *clock_offset_s += 3600;
        break;
      default:
        break;
    }
    return true;
  }
  void strike_late(bool is_struck) const {
    if (is_struck && kind == Kind::kThrowsLate)
      throw DriverError("the device's acknowledgement did not come");
  }
};

template <std::size_t N>
class FaultyAxes final : public AxisGroup<N> {
 public:
  using Positions = typename AxisGroup<N>::Positions;
  using Status = typename AxisGroup<N>::Status;

  FaultyAxes(AxisGroup<N>& axes, Fault& fault) : axes_(axes), fault_(fault) {}
  void connect() override { axes_.connect(); }
  void enable() override { axes_.enable(); }
  void home() override { axes_.home(); }
  void disable() noexcept override { axes_.disable(); }
  void clear_fault() override { axes_.clear_fault(); }
  void move_to(const Positions& target, double settle_s) override {
    const bool is_struck = note(fault_.strikes(N == 4 ? Place::kRobotMove : Place::kTableMove));
    if (is_struck && fault_.kind == Kind::kStalePosition) stale_ = axes_.status();
    axes_.move_to(target, settle_s);
    fault_.strike_late(is_struck);
  }
  void prepare(const Positions& target) override {
    note(fault_.strikes(Place::kPrepare));
    axes_.prepare(target);
  }
  Status status() override {
    note(fault_.strikes(N == 4 ? Place::kRobotStatus : Place::kTableStatus));
    Status status = axes_.status();
    if (stale_count_ < kStaleAnswers && stale_.in_position) {
      ++stale_count_;
      return stale_;
    }
    if (mood_ == Kind::kFault) {
      status.state = DeviceState::kFault;
      status.fault = "following error";
    }
    if (mood_ == Kind::kLostLink) status.state = DeviceState::kDisconnected;
    if (mood_ == Kind::kNeverArrives) status.in_position = false;
    if (mood_ == Kind::kElsewhere) status.positions[0] += .01;
    return status;
  }
  double expected_arrival_s() override {
    const bool is_struck = note(fault_.strikes(N == 4 ? Place::kRobotArrival : Place::kTableArrival));
    fault_.strike_late(is_struck);
    return axes_.expected_arrival_s();
  }
  void stop() noexcept override { axes_.stop(); }

 private:
  static constexpr int kStaleAnswers = 3;
  bool note(bool is_struck) {
    if (is_struck) mood_ = fault_.kind;
    return is_struck;
  }

  AxisGroup<N>& axes_;
  Fault& fault_;
  Kind mood_ = Kind::kThrows;  ///< of those that last
  Status stale_;
  int stale_count_ = 0;
};

class FaultyLaser final : public Laser {
 public:
  FaultyLaser(Laser& laser, Fault& fault) : laser_(laser), fault_(fault) {}
  void connect() override { laser_.connect(); }
  Limits limits() override { return laser_.limits(); }
  void enable() override { laser_.enable(); }
  void disable() noexcept override { laser_.disable(); }
  void prepare(double power_w, double pulse_s) override {
    const bool is_struck = note(fault_.strikes(Place::kPower));
    laser_.prepare(power_w, pulse_s);
    fault_.strike_late(is_struck);
  }
  void fire(double power_w, double pulse_s) override {
    const bool is_struck = note(fault_.strikes(Place::kFire));
    laser_.fire(power_w, pulse_s);
    fault_.strike_late(is_struck);
  }
  bool off() noexcept override {
    bool is_struck = false;
    try {
      is_struck = note(fault_.strikes(Place::kLaserOff));
    } catch (...) {
      is_struck = true;
    }
    const bool is_off = laser_.off();
    return is_off && !is_struck;
  }
  Status status() override {
    note(fault_.strikes(Place::kLaserStatus));
    Status status = laser_.status();
    if (mood_ == Kind::kFault) status.state = DeviceState::kFault;
    if (mood_ == Kind::kLostLink) status.state = DeviceState::kDisconnected;
    if (mood_ == Kind::kStaysOn) status.is_emitting = true;
    return status;
  }
  void clear_fault() override { laser_.clear_fault(); }

 private:
  bool note(bool is_struck) {
    if (is_struck) mood_ = fault_.kind;
    return is_struck;
  }

  Laser& laser_;
  Fault& fault_;
  Kind mood_ = Kind::kThrows;
};

/// Runs ahead of the cell's clock by what the fault adds. Times that come from the devices are behind by as
/// much, as they are after a process was stopped for an hour.
class JumpingClock final : public Clock {
 public:
  JumpingClock(Clock& clock, Fault& fault) : clock_(clock), fault_(fault) {
    fault_.clock_offset_s = &offset_s_;
  }
  double now_s() const override { return clock_.now_s() + offset_s_; }
  void sleep_until(double time_s) override {
    fault_.strikes(Place::kSleep);
    clock_.sleep_until(time_s - offset_s_);
  }
  void wake() override { clock_.wake(); }

 private:
  Clock& clock_;
  Fault& fault_;
  double offset_s_ = 0;
};

}  // namespace hilbrush::test
