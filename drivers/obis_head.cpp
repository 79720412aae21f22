#include "drivers/obis_head.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "drivers/driver_error.h"
#include "drivers/obis_codec.h"

namespace hilbrush {
namespace {

constexpr double kPollS = 0.1;      ///< wall
constexpr double kArmPollS = 0.02;  ///< cell
constexpr double kPowerTolerance = 0.005;
constexpr double kPowerRoundingW = 2e-6;

}  // namespace

ObisHead::ObisHead(const LaserOptions& options, Clock& clock) : options_(options), clock_(clock) {}

ObisHead::~ObisHead() {
  end_polling();
}

void ObisHead::open_link(Deadline deadline) {
  lines_.clear();
  link_ = hilbrush::open_link(options_.port, options_.baud, Parity::kNone, deadline);
  descriptor_ = link_->descriptor();
}

std::string ObisHead::exchange(const std::string& command, Deadline deadline) {
  if (!link_) open_link(deadline);
  link_->write(obis::encode(command), deadline);
  const bool is_query = command.back() == '?';
  std::optional<std::string> value;
  for (;;) {
    std::string line = lines_.read_line(*link_, deadline);
    const obis::LineKind kind = obis::classify(line);
    if (kind == obis::LineKind::kError)
      throw DriverError("the laser refuses " + command + ": " + line + link_->messages().text());
    if (kind == obis::LineKind::kOk && value.has_value() == is_query) return value.value_or("");
    if (kind == obis::LineKind::kOk || !is_query || value)
      throw LinkError("the laser gives no proper answer to " + command + link_->messages().text());
    value = std::move(line);
  }
}

/// After a failure of the link the answers' places are unknown: it is opened anew by the next exchange.
std::string ObisHead::ask(const std::string& command, double wall_s) {
  const Deadline deadline = deadline_in(wall_s);
  const std::unique_lock lock(link_mutex_, deadline);
  if (!lock) throw LinkError("the laser's link is busy with a command that gets no answer");
  try {
    return exchange(command, deadline);
  } catch (const LinkError&) {
    descriptor_ = -1;
    link_.reset();
    throw;
  }
}

double ObisHead::ask_number(const std::string& query) {
  const std::string line = ask(query);
  const auto value = obis::decode_number(line);
  if (!value) throw DriverError("the laser answers " + query + " with \"" + line + "\"");
  return *value;
}

void ObisHead::set_switch(const std::string& name, bool is_on) {
  ask(name + (is_on ? " ON" : " OFF"));
  const std::string line = ask(name + "?");
  if (obis::decode_switch(line) != is_on)
    throw DriverError("the laser does not keep " + name + (is_on ? " ON" : " OFF") + ": it says \"" + line + "\"");
}

/// Emission off before anything else. The first command may meet a laser whose handshake is off and that answers
/// nothing, so only the second answer counts.
void ObisHead::set_up() {
  try {
    ask("SYST:COMM:HAND ON");
  } catch (const LinkError&) {
    ask("SYST:COMM:HAND ON");
  }
  ask("SYST:COMM:PROM OFF");
  ask("SOUR:AM:STAT OFF");
  set_switch("SYST:CDRH", true);
  set_switch("SYST:AUT", false);
  ask("SYST:ERR:CLE");
}

std::uint32_t ObisHead::read_status() {
  const std::string line = ask("SYST:STAT?");
  const auto word = obis::decode_hex_word(line);
  if (!word) throw DriverError("the laser answers SYST:STAT? with \"" + line + "\"");
  return *word;
}

void ObisHead::connect() {
  {
    const std::lock_guard lock(mutex_);
    if (state_ != DeviceState::kDisconnected) throw DriverError("the laser is connected already");
  }
  set_up();
  Powers powers{ask_number("SOUR:POW:LIM:LOW?"), ask_number("SOUR:POW:LIM:HIGH?")};
  if (!(powers.min_w >= 0) || !(powers.max_w > powers.min_w))
    throw DriverError("the laser's power limits make no sense" + link_->messages().text());
  const double begun_s = clock_.now_s();
  const std::uint32_t word = read_status();
  {
    const std::lock_guard lock(mutex_);
    powers_ = powers;
    power_w_.reset();
    state_ = DeviceState::kConnected;
    fault_.clear();
  }
  take_status(word, begun_s);
  start_polling();
}

std::vector<std::string> ObisHead::identify() {
  std::vector<std::string> lines;
  lines.push_back(ask("*IDN?"));
  lines.push_back("model " + ask("SYST:INF:MOD?") + ", serial number " + ask("SYST:INF:SNUM?") + ", " +
                  ask("SYST:INF:WAV?") + " nm");
  char text[120];
  std::snprintf(text, sizeof text, "power %.4g to %.4g mW, now set to %.4g mW", powers().min_w * 1e3,
                powers().max_w * 1e3, ask_number("SOUR:POW:LEV:IMM:AMPL?") * 1e3);
  lines.push_back(text);
  const std::uint32_t word = read_status();
  lines.push_back(std::string("key ") + ((word & obis::kKeyOut) != 0 ? "out" : "in") + ", interlock " +
                  ((word & obis::kInterlockOpen) != 0 ? "open" : "closed") + ", emission " +
                  ((word & obis::kEmission) != 0 ? "armed" : "off"));
  const auto faults = obis::decode_hex_word(ask("SYST:FAUL?"));
  const std::string text_of_faults = faults ? obis::fault_text(*faults) : "unreadable";
  lines.push_back("faults: " + (text_of_faults.empty() ? "none" : text_of_faults));
  return lines;
}

LaserHead::Powers ObisHead::powers() {
  const std::lock_guard lock(mutex_);
  return powers_;
}

void ObisHead::check_ready_to_arm(std::uint32_t word) {
  if ((word & obis::kKeyOut) != 0) throw DriverError("the laser cannot be enabled: its key is out");
  if ((word & obis::kInterlockOpen) != 0) throw DriverError("the laser cannot be enabled: its interlock is open");
  if ((word & obis::kAnyFault) == 0) return;
  const auto faults = obis::decode_hex_word(ask("SYST:FAUL?"));
  throw DriverError("the laser cannot be enabled: it reports a fault: " +
                    (faults ? obis::fault_text(*faults) : std::string("unreadable")));
}

void ObisHead::arm() {
  {
    const std::lock_guard lock(mutex_);
    if (state_ != DeviceState::kConnected)
      throw DriverError(std::string("the laser cannot be enabled: it is ") + device_state_name(state_) +
                        (fault_.empty() ? "" : ": " + fault_));
    is_disarming_ = false;
  }
  check_ready_to_arm(read_status());
  ask("SOUR:AM:EXT DIGITAL");
  const std::string mode = ask("SOUR:AM:SOUR?");
  if (mode.find("DIG") == std::string::npos)
    throw DriverError("the laser does not take external digital modulation: it says \"" + mode + "\"");
  const auto check_disarming = [this] {
    const std::lock_guard lock(mutex_);
    if (is_disarming_) throw DriverError("the laser was turned off again during its start delay");
    if (state_ != DeviceState::kConnected) throw DriverError("the laser cannot be enabled: " + fault_);
  };
  check_disarming();
  ask("SOUR:AM:STAT ON");
  try {
    const double deadline_s = clock_.now_s() + options_.arm_timeout_s;
    for (;;) {
      check_disarming();
      const std::uint32_t word = read_status();
      check_ready_to_arm(word);
      constexpr std::uint32_t kNotYet = obis::kStartDelay | obis::kWarmUp;
      if ((word & obis::kEmission) != 0 && (word & kNotYet) == 0) break;
      if (clock_.now_s() > deadline_s) throw DriverError("the laser does not get ready in time");
      clock_.sleep_until(clock_.now_s() + kArmPollS);
    }
    const double begun_s = clock_.now_s();
    const std::uint32_t word = read_status();
    const std::lock_guard lock(mutex_);
    if (is_disarming_ || state_ != DeviceState::kConnected) throw DriverError("the laser was turned off again");
    word_ = word;
    read_s_ = begun_s;
    state_ = DeviceState::kReady;
  } catch (const DriverError&) {
    disarm();
    throw;
  }
}

bool ObisHead::disarm() noexcept {
  try {
    {
      const std::lock_guard lock(mutex_);
      is_disarming_ = true;
      if (state_ == DeviceState::kReady) state_ = DeviceState::kConnected;
    }
    for (int attempt = 0;; ++attempt) {
      try {
        ask("SOUR:AM:STAT OFF", kUrgentS);
        return true;
      } catch (const LinkError&) {
        if (attempt == 1) return false;  // the first may have met a link that had died unnoticed
      }
    }
  } catch (const std::exception&) {
    return false;
  }
}

void ObisHead::set_power(double power_w) {
  {
    const std::lock_guard lock(mutex_);
    if (power_w_ && std::abs(*power_w_ - power_w) <= kPowerRoundingW / 2) return;
    power_w_.reset();
  }
  try {
    ask(obis::power_command(power_w));
    const double set_w = ask_number("SOUR:POW:LEV:IMM:AMPL?");
    if (!(std::abs(set_w - power_w) <= kPowerTolerance * power_w + kPowerRoundingW)) {
      char text[120];
      std::snprintf(text, sizeof text, "the laser was told %.4g mW and has set itself to %.4g mW", power_w * 1e3,
                    set_w * 1e3);
      throw DriverError(text);
    }
  } catch (const LinkError& error) {
    set_fault(error.what());
    throw;
  }
  const std::lock_guard lock(mutex_);
  power_w_ = power_w;
}

LaserHead::Status ObisHead::status() {
  const std::lock_guard lock(mutex_);
  const bool is_closed = state_ != DeviceState::kDisconnected && (word_ & (obis::kInterlockOpen | obis::kKeyOut)) == 0;
  return {state_, is_closed, fault_, read_s_};
}

void ObisHead::look() {
  {
    const std::lock_guard lock(mutex_);
    is_look_due_ = true;
  }
  asked_.notify_all();
}

void ObisHead::clear_fault() {
  {
    const std::lock_guard lock(mutex_);
    if (state_ != DeviceState::kFault) throw DriverError("the laser reports no fault");
  }
  end_polling();
  try {
    set_up();
    const double begun_s = clock_.now_s();
    const std::uint32_t word = read_status();
    check_ready_to_arm(word);
    const std::lock_guard lock(mutex_);
    state_ = DeviceState::kConnected;
    fault_.clear();
    word_ = word;
    read_s_ = begun_s;
    power_w_.reset();
  } catch (const DriverError& error) {
    start_polling();
    throw DriverError(std::string("the laser's fault cannot be cleared: ") + error.what());
  }
  start_polling();
}

void ObisHead::set_fault(const std::string& sentence) {
  {
    const std::lock_guard lock(mutex_);
    if (state_ == DeviceState::kFault || state_ == DeviceState::kDisconnected) return;
    state_ = DeviceState::kFault;
    fault_ = sentence;
    power_w_.reset();
  }
  if (on_change_) on_change_();
}

/// An interlock or key that opens while armed is latched as a fault: closing it again must not bring the beam back.
void ObisHead::take_status(std::uint32_t word, double begun_s) {
  DeviceState state;
  {
    const std::lock_guard lock(mutex_);
    word_ = word;
    read_s_ = begun_s;
    state = state_;
  }
  if (state != DeviceState::kReady) return;
  std::string sentence;
  if ((word & obis::kInterlockOpen) != 0)
    sentence = "the interlock was opened";
  else if ((word & obis::kKeyOut) != 0)
    sentence = "the laser's key was turned";
  else if ((word & obis::kAnyFault) != 0)
    sentence = "the laser reports a fault";
  else if ((word & obis::kEmission) == 0)
    sentence = "the laser's emission went off by itself";
  if (sentence.empty()) return;
  {
    // A disarm() between the reading and here explains it.
    const std::lock_guard lock(mutex_);
    if (state_ != DeviceState::kReady) return;
  }
  set_fault(sentence);
  disarm();
}

void ObisHead::poll() {
  std::unique_lock lock(mutex_);
  while (is_polling_) {
    asked_.wait_until(lock, deadline_in(kPollS), [this] { return !is_polling_ || is_look_due_; });
    if (!is_polling_) return;
    const bool was_asked = is_look_due_;
    is_look_due_ = false;
    if (state_ == DeviceState::kFault) continue;
    const bool was_closed = (word_ & obis::kInterlockOpen) == 0;
    lock.unlock();
    try {
      const double begun_s = clock_.now_s();
      const std::uint32_t word = read_status();
      take_status(word, begun_s);
      const bool is_closed = (word & obis::kInterlockOpen) == 0;
      if ((was_asked || was_closed != is_closed) && on_change_) on_change_();
    } catch (const DriverError& error) {
      set_fault(error.what());
      disarm();
    }
    lock.lock();
  }
}

void ObisHead::start_polling() {
  end_polling();
  is_polling_ = true;
  thread_ = std::thread([this] { poll(); });
}

void ObisHead::end_polling() noexcept {
  {
    const std::lock_guard lock(mutex_);
    is_polling_ = false;
  }
  asked_.notify_all();
  if (thread_.joinable()) thread_.join();
}

}  // namespace hilbrush
