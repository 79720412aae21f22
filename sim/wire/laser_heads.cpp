#include "sim/wire/laser_heads.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

#include "sampling/base/text.h"
#include "sim/wire/read_number.h"

namespace hilbrush {
namespace {

constexpr int kSerialNumber = 20117;

}  // namespace

std::size_t SerialLaser::message_bytes(std::string_view buffer) const {
  const std::size_t end = buffer.find_first_of("\r\n");
  if (end == std::string_view::npos) return 0;
  return end + 1;
}

std::string SerialLaser::answer(std::string_view message) {
  message = trimmed(message);
  return message.empty() ? std::string() : answer_line(lower_case(message));
}

/// A line has no address: what belongs to another exchange is simply another answer.
std::string SerialLaser::misaddressed(std::string answer) const {
  return answer.empty() ? answer : "0.12345\r\n" + answer;
}

// ---- Coherent OBIS

std::string ObisLaser::answer_line(const std::string& line) {
  const std::size_t blank = line.find(' ');
  std::string header = line.substr(0, blank);
  const std::string parameter = blank == std::string::npos ? "" : line.substr(line.find_last_of(' ') + 1);
  const bool is_query = header.back() == '?';
  if (is_query) header.pop_back();
  const Reply reply = is_query ? query(header) : obey(header, parameter);
  if (!reply.is_known || !reply.is_done) {
    ++error_count_;
    return !has_handshake_ ? "" : reply.is_known ? "ERR-222\r\n" : "ERR-100\r\n";
  }
  return (reply.value.empty() ? "" : reply.value + "\r\n") + (has_handshake_ ? "OK\r\n" : "");
}

ObisLaser::Reply ObisLaser::obey(const std::string& header, const std::string& parameter) {
  const bool is_on = parameter == "on";
  const bool is_switch = is_on || parameter == "off";
  const auto set = [&](bool& flag) -> Reply {
    if (!is_switch) return {true, false, ""};
    flag = is_on;
    return {};
  };
  if (header == "syst:comm:hand") return set(has_handshake_);
  if (header == "syst:comm:prom") return {true, is_switch, ""};
  if (header == "syst:cdrh") return set(has_start_delay_);
  if (header == "syst:aut") return set(has_autostart_);
  if (header == "syst:err:cle") {
    error_count_ = 0;
    return {};
  }
  if (header == "sour:am:stat") return {true, is_switch && cell_.set_emission(is_on), ""};
  if (header == "sour:am:ext" || header == "sour:am:int") {
    const bool is_external = header == "sour:am:ext";
    if (is_external ? parameter != "digital" : parameter != "cwp") return {true, false, ""};
    is_digital_ = is_external;
    cell_.set_modulation(is_digital_ ? TrueCell::Modulation::kWired : TrueCell::Modulation::kNone);
    return {};
  }
  if (header == "sour:pow:lev:imm:ampl") {
    double power = 0;
    const double low = cell_.description().laser.power_min_w;
    if (!read_number(parameter, power) || power < low * (1 - 1e-6) ||
        power > cell_.power_max_w() * (1 + 1e-6))
      return {true, false, ""};
    cell_.set_power(power);
    return {};
  }
  if (header == "*rst") {
    cell_.set_emission(false);
    return {};
  }
  return {false, false, ""};
}

ObisLaser::Reply ObisLaser::query(const std::string& header) const {
  const auto value = [](std::string text) -> Reply { return {true, true, std::move(text)}; };
  const auto on_off = [&](bool is_on) { return value(is_on ? "ON" : "OFF"); };
  const auto watts = [&](double power_w) { return value(fmt::format("{:.6f}", power_w)); };
  const auto hex = [&](unsigned word) { return value(fmt::format("{:08X}", word)); };
  if (header == "*idn") return value("Coherent, Inc - OBIS 405nm 100mW C - V1.0.2 - simulated");
  if (header == "syst:inf:mod") return value("OBIS 405nm 100mW C");
  if (header == "syst:inf:snum") return value(std::to_string(kSerialNumber));
  if (header == "syst:inf:wav") return value("405");
  if (header == "syst:inf:pow" || header == "sour:pow:nom")
    return watts(cell_.description().laser.power_max_w);
  if (header == "syst:inf:fver") return value("V1.0.2");
  if (header == "syst:comm:hand") return on_off(has_handshake_);
  if (header == "syst:cdrh") return on_off(has_start_delay_);
  if (header == "syst:aut") return on_off(has_autostart_);
  if (header == "syst:lock") return on_off(cell_.is_interlock_closed());
  if (header == "syst:stat") return hex(status());
  if (header == "syst:faul") return hex(faults_word());
  if (header == "syst:err:coun") return value(std::to_string(error_count_));
  if (header == "syst:err:nex") return value(error_count_ > 0 ? "-222" : "0");
  if (header == "syst:diod:hour") return value("12.5");
  if (header == "sour:pow:lim:low") return watts(cell_.description().laser.power_min_w);
  if (header == "sour:pow:lim:high") return watts(cell_.power_max_w());
  if (header == "sour:pow:lev:imm:ampl") return watts(cell_.power_w());
  if (header == "sour:pow:lev") return watts(cell_.is_emitting() ? cell_.power_w() : 0);
  if (header == "sour:am:stat") return on_off(cell_.is_emission_ordered());
  if (header == "sour:am:sour") return value(is_digital_ ? "DIGITAL" : "CWP");
  if (header == "sour:temp:bas" || header == "sour:temp:diod") return value("25.0C");
  return {false, false, ""};
}

/// The upper byte is what LS and LX heads add: CC with the interlock open, CE with the key out.
unsigned ObisLaser::status() const {
  const bool is_safe = cell_.has_key() && cell_.is_interlock_closed();
  const bool is_armed = cell_.is_emission_ordered() && !cell_.is_in_start_delay() && !cell_.is_warming_up();
  unsigned word = 0xC8000000;
  if (!cell_.is_interlock_closed()) word |= 0x04000000;
  if (!cell_.has_key()) word |= 0x06000000;
  if (cell_.is_tripped()) word |= 0x1;
  if (is_armed) word |= 0x2 | 0x4;
  if (!is_safe || !cell_.is_emission_ordered()) word |= 0x8;
  if (cell_.is_in_start_delay()) word |= 0x10;
  if (cell_.is_warming_up()) word |= 0x100;
  if (is_digital_) word |= 0x400;
  return word;
}

unsigned ObisLaser::faults_word() const {
  return 0;
}

std::string ObisLaser::refusal(std::string_view, bool has_failed) {
  ++error_count_;
  return !has_handshake_ ? "" : has_failed ? "ERR-310\r\n" : "ERR-222\r\n";
}

// ---- Cobolt

std::string CoboltLaser::answer_line(const std::string& line) {
  if (line == "!e" || line == "!d" || line.starts_with("!p ")) {
    obey(line);
    return {};
  }
  const auto value = [](const std::string& text) { return text + "\r\n"; };
  if (line == "l?") return value(cell_.is_emission_ordered() ? "1" : "0");
  if (line == "ilk?") return value(cell_.is_interlock_closed() ? "0" : "1");
  if (line == "f?") return value(cell_.is_tripped() || !cell_.is_interlock_closed() ? "3" : "0");
  if (line == "gom?") return value(std::to_string(operating_mode()));
  if (line == "p?") return value(fmt::format("{:.6f}", cell_.power_w()));
  if (line == "pa?") return value(fmt::format("{:.6f}", cell_.is_emitting() ? cell_.power_w() : 0));
  if (line == "glm?") return value("0405-06-01-0100-100");
  if (line == "glp?" || line == "laser:cp:power:max?")
    return value(fmt::format("{:.4f}", cell_.power_max_w() * 1e3));
  if (line == "sn?" || line == "gsn?") return value(std::to_string(kSerialNumber));
  if (line == "gfv?") return value("50070");
  if (line == "hrs?") return value("12.5");
  if (line == "las:paus?") return value(is_paused_ ? "1" : "0");
  if (line == "laser:pm:dig:modulator?") return value(is_commanded_ ? "Command" : "External");
  return obey(line) ? "OK\r\n" : "Syntax error: illegal command\r\n";
}

bool CoboltLaser::obey(const std::string& line) {
  const auto update = [this] {
    cell_.set_modulation(!is_modulated_  ? TrueCell::Modulation::kNone
                         : is_commanded_ ? TrueCell::Modulation::kSerial
                                         : TrueCell::Modulation::kWired);
    return true;
  };
  if (line == "@cob1" || line == "l1") return cell_.set_emission(true);
  if (line == "@cob0") return true;  // autostart off; it never starts by itself here
  if (line == "l0") return cell_.set_emission(false);
  if (line == "cf") {
    if (!cell_.is_interlock_closed()) return false;
    return cell_.set_emission(false);
  }
  if (line == "cp" || line == "las:runm constantpower") {
    is_modulated_ = false;
    return update();
  }
  if (line == "em" || line == "las:runm powermodulation") {
    is_modulated_ = true;
    return update();
  }
  if (line == "laser:pm:dig:modulator command" || line == "laser:pm:dig:modulator external") {
    is_commanded_ = line.ends_with("command");
    cell_.set_serial_gate(false);
    return update();
  }
  if (line == "las:paus 1" || line == "las:paus 0") {
    is_paused_ = line.ends_with("1");
    if (is_paused_) cell_.set_serial_gate(false);
    return true;
  }
  if (line == "!e" || line == "!d") {
    cell_.set_serial_gate(line == "!e" && is_commanded_ && !is_paused_);
    return true;
  }
  const std::size_t blank = line.find(' ');
  if (blank == std::string::npos) return false;
  const std::string name = line.substr(0, blank);
  const std::string parameter = line.substr(blank + 1);
  if (name == "p") return set_power(parameter, 1);
  if (name == "!p" || name == "laser:cp:power:setpoint" || name == "laser:pm:power:setpoint")
    return set_power(parameter, 1e-3);
  return false;
}

bool CoboltLaser::set_power(const std::string& text, double unit_w) {
  double value = 0;
  if (!read_number(text, value) || value < 0 || value * unit_w > cell_.power_max_w() * (1 + 1e-6))
    return false;
  cell_.set_power(value * unit_w);
  return true;
}

/// 0 off, 2 waiting for key, 3 warm-up (and start delay), 4 completed, 5 fault, 7 modulation.
int CoboltLaser::operating_mode() const {
  if (cell_.is_tripped() || !cell_.is_interlock_closed()) return 5;
  if (!cell_.has_key()) return 2;
  if (!cell_.is_emission_ordered()) return 0;
  if (cell_.is_warming_up() || cell_.is_in_start_delay()) return 3;
  return is_modulated_ ? 7 : 4;
}

std::string CoboltLaser::refusal(std::string_view message, bool) {
  return message.starts_with('!') ? "" : "Syntax error: illegal command\r\n";
}

}  // namespace hilbrush
