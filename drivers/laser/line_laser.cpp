#include "drivers/laser/line_laser.h"

#include <cmath>
#include <thread>

#include "drivers/driver_error.h"
#include "drivers/link/line_codec.h"
#include "drivers/number_text.h"

namespace hilbrush {
namespace {

constexpr double kPollS = 0.1;      ///< wall
constexpr double kArmPollS = 0.02;  ///< cell
constexpr double kPowerTolerance = 0.005;
constexpr double kPowerRoundingW = 2e-6;

bool is_power(double power_w, double wanted_w) {
  return std::abs(power_w - wanted_w) <= kPowerTolerance * wanted_w + kPowerRoundingW;
}

}  // namespace

LineLaser::LineLaser(const LaserOptions& options, double gap_s, Clock& clock)
    : options_(options), gap_s_(gap_s), clock_(clock) {}

std::string LineLaser::ask(const std::string& command, double wall_s) {
  constexpr int kExchangesAhead = 5;  // of other threads that wait for the link
  const std::unique_lock lock(exchange_mutex_, deadline_in(wall_s + kExchangesAhead * gap_s_));
  if (!lock) throw LinkError("the laser's link is busy with a command that gets no answer");
  if (gap_s_ > 0 && wall_s > kUrgentS)
    std::this_thread::sleep_until(next_exchange_);  // what turns light off does not wait
  const Deadline deadline = deadline_in(wall_s);
  try {
    if (!link_) {
      lines_.clear();
      std::shared_ptr<Link> link = open_link(options_.port, options_.baud, Parity::kNone, deadline);
      const std::lock_guard write_lock(write_mutex_);
      descriptor_ = link->descriptor();
      link_ = std::move(link);
    }
    std::string answer = exchange(*link_, lines_, command, deadline);
    next_exchange_ = deadline_in(gap_s_);
    return answer;
  } catch (const LinkError&) {
    const std::lock_guard write_lock(write_mutex_);
    descriptor_ = -1;
    link_.reset();
    throw;
  }
}

void LineLaser::say(std::string_view bytes, double wall_s) {
  const std::lock_guard lock(write_mutex_);
  if (!link_) throw LinkError("the laser's link is lost");
  link_->write(bytes, deadline_in(wall_s));
}

double LineLaser::ask_number(const std::string& query) {
  const std::string line = ask(query);
  const auto value = line_codec::decode_number(line);
  if (!value) throw DriverError("the laser answers " + query + " with \"" + line + "\"");
  return *value;
}

void LineLaser::connect() {
  {
    const std::lock_guard lock(mutex_);
    if (state_ != DeviceState::kDisconnected) throw DriverError("the laser is connected already");
  }
  set_up();
  const Powers powers = read_powers();
  if (!(powers.min_w >= 0) || !(powers.max_w > powers.min_w))
    throw DriverError("the laser's power limits make no sense: " + std::to_string(powers.min_w) + " to " +
                      std::to_string(powers.max_w) + " W");
  const double begun_s = clock_.now_s();
  const Condition condition = read_condition();
  {
    const std::lock_guard lock(mutex_);
    powers_ = powers;
    power_w_.reset();
    condition_ = condition;
    read_s_ = begun_s;
    fault_.clear();
    state_ = DeviceState::kConnected;
  }
  start_polling();
}

std::vector<std::string> LineLaser::identify() {
  std::vector<std::string> lines = read_names();
  const Powers limits = powers();
  const auto mw = [](double power_w) { return number_text(power_w * 1e3, 4); };
  const std::string range = limits.min_w > 0 ? mw(limits.min_w) + " to " : "up to ";
  lines.push_back("power " + range + mw(limits.max_w) + " mW, now set to " + mw(read_power()) + " mW");
  const Condition condition = read_condition();
  lines.push_back(std::string("key ") + (condition.is_key_in ? "in" : "out") + ", interlock " +
                  (condition.is_interlock_closed ? "closed" : "open") + ", emission " +
                  (condition.is_armed ? "armed" : "off"));
  const std::string faults = read_faults(condition);
  lines.push_back("faults: " + (faults.empty() ? "none" : faults));
  return lines;
}

LaserHead::Powers LineLaser::powers() {
  const std::lock_guard lock(mutex_);
  return powers_;
}

void LineLaser::check_may_arm(const Condition& condition) {
  if (!condition.is_key_in) throw DriverError("the laser cannot be enabled: its key is out");
  if (!condition.is_interlock_closed) throw DriverError("the laser cannot be enabled: its interlock is open");
  if (!condition.fault.empty())
    throw DriverError("the laser cannot be enabled: it reports " + condition.fault);
}

void LineLaser::check_not_disarmed() {
  const std::lock_guard lock(mutex_);
  if (state_ != DeviceState::kConnected) throw DriverError("the laser cannot be enabled: " + fault_);
  if (is_disarming_) throw DriverError("the laser was turned off again during its start delay");
}

void LineLaser::arm() {
  {
    const std::lock_guard lock(mutex_);
    if (state_ != DeviceState::kConnected)
      throw DriverError(std::string("the laser cannot be enabled: it is ") + device_state_name(state_) +
                        (fault_.empty() ? "" : ": " + fault_));
    is_disarming_ = false;
    is_arming_ = true;
    power_w_.reset();
  }
  try {
    bring_up();
  } catch (const DriverError&) {
    end_arming();
    disarm();
    throw;
  }
  end_arming();
}

void LineLaser::end_arming() {
  const std::lock_guard lock(mutex_);
  is_arming_ = false;
}

void LineLaser::bring_up() {
  check_may_arm(read_condition());
  prepare_arming();
  check_not_disarmed();
  order_emission();
  const double deadline_s = clock_.now_s() + options_.arm_timeout_s;
  for (;;) {
    check_not_disarmed();
    const double begun_s = clock_.now_s();
    const Condition condition = read_condition();
    check_may_arm(condition);
    if (condition.is_armed) {
      const std::lock_guard lock(mutex_);
      if (is_disarming_ || state_ != DeviceState::kConnected) continue;
      condition_ = condition;
      read_s_ = begun_s;
      state_ = DeviceState::kReady;
      return;
    }
    if (begun_s > deadline_s) throw DriverError("the laser does not get ready in time");
    clock_.sleep_until(begun_s + kArmPollS);
  }
}

bool LineLaser::disarm() noexcept {
  try {
    {
      const std::lock_guard lock(mutex_);
      is_disarming_ = true;
      if (state_ == DeviceState::kReady) state_ = DeviceState::kConnected;
    }
    for (int attempt = 0;; ++attempt) {
      try {
        stop_emission(kUrgentS);
        return true;
      } catch (const LinkError&) {
        if (attempt == 1) return false;  // the first may have met a link that had died unnoticed
      }
    }
  } catch (const std::exception&) {
    return false;
  }
}

void LineLaser::set_power(double power_w) {
  {
    const std::lock_guard lock(mutex_);
    if (power_w_ && std::abs(*power_w_ - power_w) <= kPowerRoundingW / 2) return;
    power_w_.reset();
  }
  try {
    order_power(power_w);
    const double set_w = read_power();
    if (!is_power(set_w, power_w)) {
      throw DriverError("the laser was set to " + number_text(power_w * 1e3, 4) + " mW but reports " +
                        number_text(set_w * 1e3, 4) + " mW");
    }
  } catch (const LinkError& error) {
    set_fault(error.what());
    throw;
  }
  const std::lock_guard lock(mutex_);
  power_w_ = power_w;
}

LaserHead::Status LineLaser::status() {
  const std::lock_guard lock(mutex_);
  const bool is_closed =
      state_ != DeviceState::kDisconnected && condition_.is_interlock_closed && condition_.is_key_in;
  return {state_, is_closed, fault_, read_s_};
}

void LineLaser::request_status() {
  {
    const std::lock_guard lock(mutex_);
    is_request_due_ = true;
  }
  asked_.notify_all();
}

void LineLaser::clear_fault() {
  {
    const std::lock_guard lock(mutex_);
    if (state_ != DeviceState::kFault) throw DriverError("the laser reports no fault");
  }
  end_polling();
  try {
    set_up();
    const double begun_s = clock_.now_s();
    const Condition condition = read_condition();
    check_may_arm(condition);
    const Powers powers = read_powers();
    const std::lock_guard lock(mutex_);
    powers_ = powers;
    condition_ = condition;
    read_s_ = begun_s;
    power_w_.reset();
    fault_.clear();
    state_ = DeviceState::kConnected;
  } catch (const DriverError& error) {
    start_polling();
    throw DriverError(std::string("the laser's fault cannot be cleared: ") + error.what());
  }
  start_polling();
}

void LineLaser::set_fault(const std::string& sentence) {
  {
    const std::lock_guard lock(mutex_);
    if (state_ == DeviceState::kFault || state_ == DeviceState::kDisconnected) return;
    state_ = DeviceState::kFault;
    fault_ = sentence;
    power_w_.reset();
  }
  if (on_change_) on_change_();
}

/// An interlock or key that opens while armed is latched as a fault: closing it again must not bring the beam
/// back.
void LineLaser::take(const Condition& condition, double begun_s) {
  std::string sentence;
  {
    const std::lock_guard lock(mutex_);
    condition_ = condition;
    read_s_ = begun_s;
    if (state_ != DeviceState::kReady) return;
    if (!condition.is_interlock_closed)
      sentence = "the interlock was opened";
    else if (!condition.is_key_in)
      sentence = "the laser's key was turned";
    else if (!condition.fault.empty())
      sentence = "the laser reports " + condition.fault;
    else if (!condition.is_armed)
      sentence = "the laser's emission went off by itself";
  }
  if (sentence.empty()) return;
  set_fault(sentence);
  disarm();
}

/// A laser may lower its own limit, and the power with it.
void LineLaser::check_power() {
  std::optional<double> wanted_w;
  {
    const std::lock_guard lock(mutex_);
    if (state_ == DeviceState::kReady) wanted_w = power_w_;
  }
  if (!wanted_w) return;
  const double power_w = read_power();
  if (is_power(power_w, *wanted_w)) return;
  throw DriverError("the laser has changed its power from " + number_text(*wanted_w * 1e3, 4) + " to " +
                    number_text(power_w * 1e3, 4) + " mW by itself");
}

void LineLaser::poll() {
  std::unique_lock lock(mutex_);
  while (is_polling_) {
    asked_.wait_until(lock, deadline_in(kPollS), [this] { return !is_polling_ || is_request_due_; });
    if (!is_polling_) return;
    const bool was_asked = is_request_due_;
    is_request_due_ = false;
    if (state_ == DeviceState::kFault || is_arming_) continue;  // bring_up() reads it itself
    const bool was_closed = condition_.is_interlock_closed;
    lock.unlock();
    try {
      const double begun_s = clock_.now_s();
      const Condition condition = read_condition();
      if (was_asked && gap_s_ <= 0) check_power();  // a gap between commands would make it too slow
      take(condition, begun_s);
      if ((was_asked || was_closed != condition.is_interlock_closed) && on_change_) on_change_();
    } catch (const DriverError& error) {
      set_fault(error.what());
      disarm();
    }
    lock.lock();
  }
}

void LineLaser::start_polling() {
  end_polling();
  is_polling_ = true;
  thread_ = std::thread([this] { poll(); });
}

void LineLaser::end_polling() noexcept {
  {
    const std::lock_guard lock(mutex_);
    is_polling_ = false;
  }
  asked_.notify_all();
  if (thread_.joinable()) thread_.join();
}

}  // namespace hilbrush
