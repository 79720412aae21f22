#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// Messages of Coherent OBIS lasers (SCPI over a serial line) as pure functions. Commands end with CR LF.
/// With handshake on, every command is answered by OK or ERR..., every query by a value and then OK or
/// ERR....
namespace hilbrush::obis {

std::string encode(std::string_view command);  ///< with its line end
/// "SOUR:POW:LEV:IMM:AMPL 0.012345", watts to the microwatt.
std::string power_command(double power_w);

enum class LineKind { kOk, kError, kValue };
LineKind classify(std::string_view line);

std::optional<bool> decode_switch(std::string_view line);             ///< ON, OFF, 1, 0
std::optional<std::uint32_t> decode_hex_word(std::string_view line);  ///< "C8001002", with or without 0x

/// SYST:STAT?
enum Status : std::uint32_t {
  kFault = 1 << 0,
  kEmission = 1 << 1,
  kReady = 1 << 2,
  kStandby = 1 << 3,
  kStartDelay = 1 << 4,  ///< CDRH
  kHardwareFault = 1 << 5,
  kError = 1 << 6,
  kWarmUp = 1 << 8,
  kExternalMode = 1 << 10,
  kKeyOut = 1u << 25,
  kInterlockOpen = 1u << 26,
};
inline constexpr std::uint32_t kAnyFault = kFault | kHardwareFault;

/// SYST:FAUL? in words: "diode temperature, over-current"; empty if there is none.
std::string fault_text(std::uint32_t faults);

}  // namespace hilbrush::obis
