#include "sim/wire/fault_injector.h"

#include <algorithm>

namespace hilbrush {

void FaultInjector::add(const WireFault& fault) {
  const FaultTrigger& trigger = fault.trigger;
  double due_s = trigger.at_s.value_or(cell_.now_s());
  if (trigger.phase) {
    due_s = TrueCell::kNever;
    // Counted from now on for a fault that is added while the cell runs.
    Waiting waiting{fault, due_s};
    waiting.fault.trigger.occurrence += phase_count(*trigger.phase);
    waiting_.push_back(waiting);
  } else {
    waiting_.push_back({fault, due_s});
  }
  observe();
}

void FaultInjector::clear() {
  waiting_.clear();
  of_exchange_.clear();
  for (const Lasting& lasting : lasting_) end(lasting.fault);
  lasting_.clear();
}

bool FaultInjector::is_due(const Waiting& waiting) const {
  if (waiting.due_s > cell_.now_s()) return false;
  const auto& at_message = waiting.fault.trigger.at_message;
  // Faults of an exchange begin one message earlier, so that they meet the one that was named.
  const std::uint64_t early = is_of_exchange(waiting.fault.kind) ? 1 : 0;
  return !at_message || message_count(waiting.fault.device) + early >= *at_message;
}

void FaultInjector::observe() {
  const CellPhase phase = cell_.phase();
  if (phase != phase_) {
    phase_ = phase;
    const std::uint64_t count = ++phases_[static_cast<std::size_t>(phase)];
    for (Waiting& waiting : waiting_) {
      const FaultTrigger& trigger = waiting.fault.trigger;
      if (trigger.phase == phase && trigger.occurrence == count)
        waiting.due_s = std::max(cell_.now_s() + trigger.delay_s, trigger.at_s.value_or(0));
    }
  }
  for (std::size_t i = 0; i < lasting_.size();) {
    if (cell_.now_s() < lasting_[i].until_s) {
      ++i;
      continue;
    }
    const WireFault ended = lasting_[i].fault;
    lasting_.erase(lasting_.begin() + static_cast<std::ptrdiff_t>(i));
    end(ended);
  }
  for (std::size_t i = 0; i < waiting_.size();) {
    if (!is_due(waiting_[i])) {
      ++i;
      continue;
    }
    const WireFault due = waiting_[i].fault;
    waiting_.erase(waiting_.begin() + static_cast<std::ptrdiff_t>(i));
    begin(due);
  }
}

/// A device at rest gets no messages that its connection could be dropped at: by time alone, all are cut at
/// once.
bool FaultInjector::cut_connections(const WireFault& fault) {
  const FaultTrigger& trigger = fault.trigger;
  if (fault.kind != WireFaultKind::kDroppedConnection || !trigger.at_s || trigger.at_message || trigger.phase)
    return false;
  ++cuts_[static_cast<std::size_t>(fault.device)];
  set_line_down(fault.device, fault.duration_s);
  return true;
}

void FaultInjector::begin(const WireFault& fault) {
  ++begun_count_;
  if (is_of_exchange(fault.kind)) {
    WireFault rest = fault;
    if (cut_connections(fault)) --rest.messages;
    if (rest.messages > 0) of_exchange_.push_back(rest);
    return;
  }
  switch (fault.kind) {
    case WireFaultKind::kDeviceAlarm:
      if (raise_alarm_) raise_alarm_(fault.device);
      return;  // lasts until it is cleared over the wire
    case WireFaultKind::kInterlockOpen:
      cell_.set_interlock(false);
      break;
    case WireFaultKind::kAxisStuck:
      cell_.jam_axis(fault.axis);
      break;
    case WireFaultKind::kAxisDrift:
      cell_.drift_axis(fault.axis, fault.amount);
      break;
    case WireFaultKind::kPowerLimit:
      cell_.set_power_max(cell_.description().laser.power_max_w * fault.amount);
      break;
    default:
      break;  // stale: the device asks
  }
  lasting_.push_back({fault, cell_.now_s() + fault.duration_s});
}

void FaultInjector::end(const WireFault& fault) {
  switch (fault.kind) {
    case WireFaultKind::kInterlockOpen:
      cell_.set_interlock(true);
      break;
    case WireFaultKind::kAxisStuck:
      cell_.free_axis(fault.axis);
      break;
    case WireFaultKind::kAxisDrift:
      cell_.drift_axis(fault.axis, 0);
      break;
    case WireFaultKind::kPowerLimit:
      cell_.set_power_max(cell_.description().laser.power_max_w);
      break;
    default:
      break;
  }
}

std::optional<WireFault> FaultInjector::on_message(WireDevice device) {
  ++messages_[static_cast<std::size_t>(device)];
  const auto found = std::find_if(of_exchange_.begin(), of_exchange_.end(),
                                  [&](const WireFault& fault) { return fault.device == device; });
  std::optional<WireFault> met;
  if (found != of_exchange_.end()) {
    met = *found;
    if (found->messages <= 1)
      of_exchange_.erase(found);
    else
      --found->messages;
  }
  observe();
  return met;
}

void FaultInjector::set_line_down(WireDevice device, double duration_s) {
  WireFault down;
  down.kind = WireFaultKind::kDroppedConnection;
  down.device = device;
  lasting_.push_back({down, cell_.now_s() + duration_s});
}

bool FaultInjector::lasts(WireFaultKind kind, WireDevice device) const {
  return std::any_of(lasting_.begin(), lasting_.end(), [&](const Lasting& lasting) {
    return lasting.fault.kind == kind && lasting.fault.device == device && cell_.now_s() < lasting.until_s;
  });
}

double FaultInjector::next_event_s() const {
  double next = TrueCell::kNever;
  for (const Waiting& waiting : waiting_)
    if (waiting.due_s > cell_.now_s()) next = std::min(next, waiting.due_s);
  for (const Lasting& lasting : lasting_)
    if (lasting.until_s > cell_.now_s()) next = std::min(next, lasting.until_s);
  return next;
}

}  // namespace hilbrush
