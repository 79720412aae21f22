#include "tests/cell/fault_plan.h"

#include <fmt/format.h>

namespace hilbrush::test {

WireFault random_fault(std::mt19937& random, std::size_t dots) {
  const auto among = [&](std::size_t count) { return static_cast<std::size_t>(random() % count); };
  const auto between = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() % 100'000) / 1e5;
  };
  WireFault fault;
  fault.kind = static_cast<WireFaultKind>(among(kWireFaultKinds));
  fault.device = static_cast<WireDevice>(among(3));
  if (!is_of_exchange(fault.kind) && fault.device == WireDevice::kLaser) fault.device = WireDevice::kRobot;
  if (fault.kind == WireFaultKind::kPowerLimit || fault.kind == WireFaultKind::kInterlockOpen)
    fault.device = WireDevice::kLaser;
  fault.trigger.phase = static_cast<CellPhase>(among(4));
  fault.trigger.occurrence = 1 + among(dots);
  // A pulse lasts 5 ms, settling 20 to 120, a move of these programs some tens.
  fault.trigger.delay_s = fault.trigger.phase == CellPhase::kPulse ? between(0, .006) : between(0, .03);
  fault.messages = among(4) == 0 ? 1 + among(20) : 1;
  fault.duration_s = among(3) == 0 ? between(0, .5) : between(0, .05);
  fault.axis = static_cast<int>(among(kAxisCount));
  if (fault.kind == WireFaultKind::kAxisDrift) fault.amount = between(-.1, .1) * (fault.axis == kJ3 ? .1 : 1);
  if (fault.kind == WireFaultKind::kPowerLimit) fault.amount = between(0, .2);
  return fault;
}

WireFault in_wall_time(WireFault fault, double time_scale) {
  if (fault.kind == WireFaultKind::kAxisDrift) fault.amount *= time_scale;
  return fault;
}

std::string described(const WireFault& fault) {
  return fmt::format(
      "{} of {} (axis {}, amount {:.3g}), {:.2f} ms into {} {}, {} messages, {:.1f} ms",
      kWireFaultNames[static_cast<std::size_t>(fault.kind)],
      kWireDeviceNames[static_cast<std::size_t>(fault.device)], kAxisNames[fault.axis], fault.amount,
      fault.trigger.delay_s * 1e3,
      fault.trigger.phase ? kCellPhaseNames[static_cast<std::size_t>(*fault.trigger.phase)] : "none",
      fault.trigger.occurrence, fault.messages, fault.duration_s * 1e3);
}

}  // namespace hilbrush::test
