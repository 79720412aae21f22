#include "drivers/laser/cobolt_head.h"

#include <sys/prctl.h>

#include <cmath>
#include <cstdio>

#include "drivers/driver_error.h"
#include "drivers/laser/cobolt_codec.h"
#include "drivers/link/line_codec.h"
#include "drivers/number_text.h"

namespace hilbrush {
namespace {

constexpr double kSayS = 0.05;  ///< wall: until a few bytes are taken
constexpr unsigned long kTimerSlackNs = 1000;

}  // namespace

/// One line for each command; a refusal is a line that begins with "Syntax error" or "Error".
std::string CoboltHead::exchange(Link& link, LineReader& lines, const std::string& command,
                                 Deadline deadline) {
  link.write(cobolt::encode(command), deadline);
  std::string line = lines.read_line(link, deadline);
  if (line.starts_with("Syntax error") || line.starts_with("Error") || line.starts_with("error"))
    throw DriverError("the laser refuses " + command + ": " + line + link.messages().text());
  return line;
}

void CoboltHead::order(const std::string& command, double wall_s) {
  const std::string line = ask(command, wall_s);
  if (!cobolt::is_ok(line)) throw LinkError("the laser answers " + command + " with \"" + line + "\"");
}

long CoboltHead::ask_integer(const std::string& query) {
  const std::string line = ask(query);
  const auto value = line_codec::decode_integer(line);
  if (!value) throw LinkError("the laser answers " + query + " with \"" + line + "\"");
  return *value;
}

void CoboltHead::set_up() {
  try {
    order("l0");
  } catch (const DriverError&) {
    order("l0");  // the first may have been appended to an unfinished line
  }
  order("@cob0");
}

LaserHead::Powers CoboltHead::read_powers() {
  return {0, ask_number("glp?") * 1e-3};
}

/// The mode alone shows that there is no fault; only otherwise is the fault read, because of the gap between
/// commands.
LineLaser::Condition CoboltHead::read_condition() {
  const auto mode = static_cast<cobolt::Mode>(ask_integer("gom?"));
  Condition condition;
  condition.is_key_in = mode != cobolt::Mode::kWaitingForKey;
  condition.is_armed = mode == cobolt::Mode::kModulation;
  condition.is_interlock_closed = condition.is_armed || ask_integer("ilk?") == cobolt::kInterlockClosed;
  if (mode == cobolt::Mode::kFault && condition.is_interlock_closed) {
    const std::string fault = cobolt::fault_text(ask_integer("f?"));
    condition.fault = fault.empty() ? "a fault without a name" : "a fault: " + fault;
  }
  return condition;
}

void CoboltHead::prepare_arming() {
  order("cf");
  order("em");
  order(std::string("LASer:PM:DIG:MODulator ") + (is_gated_by_line_ ? "External" : "Command"));
  if (!is_gated_by_line_) close_beam();
}

void CoboltHead::order_emission() {
  order("l1");
}

void CoboltHead::stop_emission(double wall_s) {
  order("l0", wall_s);
}

void CoboltHead::order_power(double power_w) {
  order(cobolt::power_command(power_w));
}

double CoboltHead::read_power() {
  return ask_number("p?");
}

void CoboltHead::open_beam() {
  say(cobolt::kOpen, kSayS);
}

void CoboltHead::close_beam() {
  say(cobolt::kClose, kSayS);
}

bool CoboltHead::is_answering() noexcept {
  try {
    ask("l?", kUrgentS);
    return true;
  } catch (const std::exception&) {
    return false;
  }
}

std::vector<std::string> CoboltHead::read_names() {
  return {"model " + ask("glm?") + ", serial number " + ask("gsn?") + ", firmware " + ask("gfv?")};
}

CoboltGate::CoboltGate(CoboltHead& head, Clock& clock)
    : head_(head), clock_(clock), thread_([this] { run(); }) {}

CoboltGate::~CoboltGate() {
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
  }
  ordered_.notify_all();
  thread_.join();
}

void CoboltGate::set_listener(Listener listener) {
  const std::lock_guard lock(mutex_);
  listener_ = std::move(listener);
}

void CoboltGate::pulse(double pulse_s) {
  if (!(pulse_s > 0) || pulse_s > kGatePulseMaxS)
    throw DriverError("the laser refuses a pulse of " + number_text(pulse_s, 6) + " s: its limit is " +
                      number_text(kGatePulseMaxS, 6) + " s");
  {
    const std::lock_guard lock(mutex_);
    if (is_open_) throw DriverError("the laser refuses a pulse: the last one is not over");
    if (has_failed_) throw DriverError("the laser refuses a pulse: its beam could not be closed");
    is_open_ = true;
    is_known_off_ = false;
    try {
      head_.open_beam();
    } catch (const DriverError&) {
      end_ = {};  // whether it was received is not known: close at once
      ordered_.notify_all();
      throw;
    }
    end_ = deadline_in(clock_.wall_s(pulse_s));
  }
  ordered_.notify_all();
}

/// Under the lock, which is released while the listener is called.
void CoboltGate::close_beam(std::unique_lock<std::mutex>& lock) {
  try {
    head_.close_beam();
    is_open_ = has_failed_ = false;
  } catch (const DriverError&) {
    has_failed_ = true;  // must be taken as still open
  }
  const Listener listener = listener_;
  const bool is_dark = !has_failed_;
  lock.unlock();
  if (listener) listener(is_dark);
  clock_.wake();
  lock.lock();
}

void CoboltGate::run() {
  ::prctl(PR_SET_TIMERSLACK, kTimerSlackNs);
  std::unique_lock lock(mutex_);
  while (!is_ending_) {
    if (!is_open_ || has_failed_) {
      ordered_.wait(lock, [this] { return is_ending_ || (is_open_ && !has_failed_); });
      continue;
    }
    ordered_.wait_until(lock, end_, [this] { return is_ending_ || !is_open_; });
    if (is_open_) close_beam(lock);
  }
}

bool CoboltGate::off() noexcept {
  try {
    std::unique_lock lock(mutex_);
    if (is_known_off_ && !is_open_) return true;
    close_beam(lock);
    if (has_failed_) return false;
    lock.unlock();
    ordered_.notify_all();
    if (!head_.is_answering()) return false;
    lock.lock();
    is_known_off_ = !is_open_;
    return is_known_off_;
  } catch (const std::exception&) {
    return false;
  }
}

bool CoboltGate::is_on() {
  const std::lock_guard lock(mutex_);
  return is_open_;
}

}  // namespace hilbrush
