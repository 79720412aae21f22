#pragma once
#include <string>
#include <string_view>

#include "sim/wire/wire_session.h"

/// Lasers on a serial line: a line in, a line out. Each talks about the one laser head of the cell.
namespace hilbrush {

/// What both have: lines end with CR, LF or both; empty ones mean nothing.
class SerialLaser : public WireSession {
 public:
  SerialLaser(TrueCell& cell, FaultInjector& faults) : WireSession(WireDevice::kLaser, cell, faults) {}

 protected:
  std::size_t message_bytes(std::string_view buffer) const override;
  std::string answer(std::string_view message) final;
  std::string misaddressed(std::string answer) const override;
  /// To a line without its end, in lower case.
  virtual std::string answer_line(const std::string& line) = 0;
};

/// Coherent OBIS: SCPI. Commands are answered with OK or ERR only while the handshake is on; a query's value
/// comes before its OK. Powers in watts.
class ObisLaser final : public SerialLaser {
 public:
  using SerialLaser::SerialLaser;

 protected:
  std::string answer_line(const std::string& line) override;
  std::string refusal(std::string_view message, bool has_failed) override;

 private:
  struct Reply {
    bool is_known = true;
    bool is_done = true;
    std::string value;
  };
  Reply obey(const std::string& header, const std::string& parameter);
  Reply query(const std::string& header) const;
  unsigned status() const;
  unsigned faults_word() const;

  bool has_handshake_ = true;
  bool has_start_delay_ = true;
  bool has_autostart_ = false;
  bool is_digital_ = false;
  int error_count_ = 0;
};

/// Cobolt (Gen5/06): short commands of its own, some without an answer. Powers in W (p) or mW (the long ones,
/// !p).
class CoboltLaser final : public SerialLaser {
 public:
  using SerialLaser::SerialLaser;

 protected:
  std::string answer_line(const std::string& line) override;
  std::string refusal(std::string_view message, bool has_failed) override;

 private:
  bool obey(const std::string& line);
  bool set_power(const std::string& text, double unit_w);
  int operating_mode() const;

  bool is_modulated_ = false;
  bool is_commanded_ = false;
  bool is_paused_ = false;
};

}  // namespace hilbrush
