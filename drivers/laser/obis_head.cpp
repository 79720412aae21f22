#include "drivers/laser/obis_head.h"

#include <optional>

#include "drivers/driver_error.h"
#include "drivers/laser/obis_codec.h"

namespace hilbrush {

std::string ObisHead::exchange(Link& link, LineReader& lines, const std::string& command, Deadline deadline) {
  link.write(obis::encode(command), deadline);
  const bool is_query = command.back() == '?';
  std::optional<std::string> value;
  for (;;) {
    std::string line = lines.read_line(link, deadline);
    const obis::LineKind kind = obis::classify(line);
    if (kind == obis::LineKind::kError)
      throw DriverError("the laser refuses " + command + ": " + line + link.messages().text());
    if (kind == obis::LineKind::kOk && value.has_value() == is_query) return value.value_or("");
    if (kind == obis::LineKind::kOk || !is_query || value)
      throw LinkError("the laser gives no proper answer to " + command + link.messages().text());
    value = std::move(line);
  }
}

/// Safety depends on the CDRH delay and on autostart, so they are read back.
void ObisHead::set_switch(const std::string& name, bool is_on) {
  ask(name + (is_on ? " ON" : " OFF"));
  const std::string line = ask(name + "?");
  if (obis::decode_switch(line) != is_on)
    throw DriverError("the laser does not keep " + name + (is_on ? " ON" : " OFF") + ": it says \"" + line +
                      "\"");
}

/// The first command may meet a laser whose handshake is off and that answers nothing, or an exchange that
/// another program left unfinished, so it may fail once.
void ObisHead::set_up() {
  try {
    ask("SYST:COMM:HAND ON");
  } catch (const DriverError&) {
    ask("SYST:COMM:HAND ON");
  }
  ask("SYST:COMM:PROM OFF");
  ask("SOUR:AM:STAT OFF");
  set_switch("SYST:CDRH", true);
  set_switch("SYST:AUT", false);
  ask("SYST:ERR:CLE");
}

LaserHead::Powers ObisHead::read_powers() {
  return {ask_number("SOUR:POW:LIM:LOW?"), ask_number("SOUR:POW:LIM:HIGH?")};
}

std::string ObisHead::ask_faults() {
  const std::string line = ask("SYST:FAUL?");
  const auto faults = obis::decode_hex_word(line);
  if (!faults) throw DriverError("the laser answers SYST:FAUL? with \"" + line + "\"");
  return obis::fault_text(*faults);
}

std::string ObisHead::read_faults(const Condition&) {
  return ask_faults();
}

/// The fault bit comes with an open interlock too, which is reported as such.
LineLaser::Condition ObisHead::read_condition() {
  const std::string line = ask("SYST:STAT?");
  const auto word = obis::decode_hex_word(line);
  if (!word) throw DriverError("the laser answers SYST:STAT? with \"" + line + "\"");
  Condition condition;
  condition.is_interlock_closed = (*word & obis::kInterlockOpen) == 0;
  condition.is_key_in = (*word & obis::kKeyOut) == 0;
  condition.is_armed = (*word & obis::kEmission) != 0 && (*word & (obis::kStartDelay | obis::kWarmUp)) == 0;
  if ((*word & obis::kAnyFault) != 0 && condition.is_interlock_closed && condition.is_key_in) {
    const std::string faults = ask_faults();
    condition.fault = faults.empty() ? "a fault without a name" : "a fault: " + faults;
  }
  return condition;
}

void ObisHead::prepare_arming() {
  ask("SOUR:AM:EXT DIGITAL");
  const std::string mode = ask("SOUR:AM:SOUR?");
  if (mode.find("DIG") == std::string::npos)
    throw DriverError("the laser does not take external digital modulation: it says \"" + mode + "\"");
}

void ObisHead::order_emission() {
  ask("SOUR:AM:STAT ON");
}

void ObisHead::stop_emission(double wall_s) {
  ask("SOUR:AM:STAT OFF", wall_s);
}

void ObisHead::order_power(double power_w) {
  ask(obis::power_command(power_w));
}

double ObisHead::read_power() {
  return ask_number("SOUR:POW:LEV:IMM:AMPL?");
}

std::vector<std::string> ObisHead::read_names() {
  const std::string identity = ask("*IDN?");
  return {identity, "model " + ask("SYST:INF:MOD?") + ", serial number " + ask("SYST:INF:SNUM?") + ", " +
                        ask("SYST:INF:WAV?") + " nm"};
}

}  // namespace hilbrush
