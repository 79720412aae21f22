#pragma once
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "sim/wire/wire_session.h"

/// The answering side of Modbus, as TCP (MBAP header) and as RTU (CRC-16), for units that are banks of
/// registers. Functions 3 and 4 (read), 6 and 16 (write), 23 (write, then read). After the Modbus application
/// protocol specification V1.1b3 and the serial line guide V1.02; written apart from anything that the
/// drivers use.
namespace hilbrush {

/// Zero is success; the others are the protocol's exception codes.
enum class ModbusOutcome : std::uint8_t {
  kDone = 0,
  kIllegalFunction = 1,
  kIllegalAddress = 2,
  kIllegalValue = 3,
  kDeviceFailure = 4,
  kNoSuchUnit = 0x0B
};

/// The registers of one unit. Called on the cell's thread, at its present time.
class RegisterBank {
 public:
  virtual ~RegisterBank() = default;
  /// Fills `values`, as many as were asked for.
  virtual ModbusOutcome read(std::uint16_t address, std::span<std::uint16_t> values) = 0;
  virtual ModbusOutcome write(std::uint16_t address, std::span<const std::uint16_t> values) = 0;
};

class ModbusServer final : public WireSession {
 public:
  enum class Framing { kTcp, kRtu };
  using Units = std::map<std::uint8_t, RegisterBank*>;

  ModbusServer(Framing framing, Units units, TrueCell& cell, FaultInjector& faults)
      : WireSession(WireDevice::kTable, cell, faults), framing_(framing), units_(std::move(units)) {}

 protected:
  std::size_t message_bytes(std::string_view buffer) const override;
  std::string answer(std::string_view message) override;
  std::string refusal(std::string_view message, bool has_failed) override;
  std::string misaddressed(std::string answer) const override;
  std::string damaged(std::string answer) const override;

 private:
  struct Request {
    std::uint16_t transaction = 0;
    std::uint8_t unit = 0;
    std::string_view pdu;
  };
  bool parse(std::string_view message, Request& request) const;
  std::string framed(const Request& request, const std::string& pdu) const;
  std::string obey(RegisterBank& bank, std::string_view pdu);

  const Framing framing_;
  const Units units_;
};

/// Of a frame without its checksum; polynomial 0xA001, low byte first on the wire.
std::uint16_t modbus_crc(std::string_view bytes);

}  // namespace hilbrush
