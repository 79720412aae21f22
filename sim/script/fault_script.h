#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "sim/script/cell_phase.h"

/// What shall go wrong in a simulated cell, and when. Data only: config/fault_script_file reads it from JSON,
/// sim/wire/fault_injector makes it happen.
namespace hilbrush {

enum class WireDevice { kRobot, kTable, kLaser };
inline constexpr std::array<const char*, 3> kWireDeviceNames{"robot", "table", "laser"};

enum class WireFaultKind {
  // Of one exchange: the next message after the trigger.
  kLostRequest,    ///< not obeyed, not answered
  kSilence,        ///< obeyed, but the answer is lost
  kHalfFrame,      ///< the answer ends in its middle
  kWrongId,        ///< the answer is another exchange's
  kWrongChecksum,  ///< damaged on the way (Modbus RTU); elsewhere a byte of the answer is another
  kException,      ///< the device says that it failed, and does nothing
  kRefused,        ///< the device says no, and does nothing
  kLateAnswer,     ///< obeyed at once, answered duration_s later
  /// Closed instead of answered; with a trigger of at_s alone, all connections of the device are closed at
  /// that time,
  /// whether or not a message comes. A serial line goes silent for duration_s.
  kDroppedConnection,
  // Of the device, for duration_s.
  kStaleInPosition,  ///< reports the state from before the fault: at rest, in position
  kDeviceAlarm,      ///< the robot or table stops and reports a fault until it is cleared
  // Of the cell.
  kInterlockOpen,  ///< for duration_s
  kAxisStuck,      ///< `axis` stops and moves no more, for duration_s
  kAxisDrift,      ///< `axis` leaves its place with `amount` rad/s (m/s), for duration_s
  kPowerLimit,     ///< the laser's upper limit becomes `amount` of what it was (0..1), for duration_s
};
inline constexpr std::size_t kWireFaultKinds = 15;
inline constexpr std::array<const char*, kWireFaultKinds> kWireFaultNames{
    "lost_request", "silence",        "half_frame",  "wrong_id",           "wrong_checksum",
    "exception",    "refused",        "late_answer", "dropped_connection", "stale_in_position",
    "device_alarm", "interlock_open", "axis_stuck",  "axis_drift",         "power_limit"};
inline bool is_of_exchange(WireFaultKind kind) {
  return kind <= WireFaultKind::kDroppedConnection;
}

/// When: the first instant at which all that is given holds.
struct FaultTrigger {
  std::optional<double> at_s;               ///< on the cell's clock
  std::optional<std::uint64_t> at_message;  ///< the device's messages, counted from 1
  std::optional<CellPhase> phase;           ///< `delay_s` after the `occurrence`-th beginning of this phase
  std::uint64_t occurrence = 1;
  double delay_s = 0;
};

struct WireFault {
  WireFaultKind kind = WireFaultKind::kSilence;
  WireDevice device = WireDevice::kRobot;
  FaultTrigger trigger;
  std::uint64_t messages = 1;  ///< how many exchanges in a row it takes, if it is of an exchange
  double duration_s = .05;
  std::size_t axis = 0;  ///< of j1, j2, j3, j4, a, c
  double amount = 0;
};

using FaultScript = std::vector<WireFault>;

}  // namespace hilbrush
