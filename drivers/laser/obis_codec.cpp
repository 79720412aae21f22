#include "drivers/laser/obis_codec.h"

#include <charconv>

#include "drivers/link/line_codec.h"
#include "drivers/number_text.h"

namespace hilbrush::obis {

using line_codec::equals_ignoring_case;
using line_codec::trimmed;

std::string encode(std::string_view command) {
  return std::string(command) + "\r\n";
}

std::string power_command(double power_w) {
  return "SOUR:POW:LEV:IMM:AMPL " + fixed_text(power_w, 6);
}

LineKind classify(std::string_view line) {
  line = trimmed(line);
  if (equals_ignoring_case(line, "OK")) return LineKind::kOk;
  return line.size() >= 3 && equals_ignoring_case(line.substr(0, 3), "ERR") ? LineKind::kError
                                                                            : LineKind::kValue;
}

std::optional<bool> decode_switch(std::string_view line) {
  line = trimmed(line);
  if (equals_ignoring_case(line, "ON") || line == "1") return true;
  if (equals_ignoring_case(line, "OFF") || line == "0") return false;
  return std::nullopt;
}

std::optional<std::uint32_t> decode_hex_word(std::string_view line) {
  line = trimmed(line);
  if (line.size() > 2 && line[0] == '0' && (line[1] == 'x' || line[1] == 'X')) line.remove_prefix(2);
  std::uint32_t value = 0;
  const auto [rest, error] = std::from_chars(line.data(), line.data() + line.size(), value, 16);
  if (error != std::errc() || rest != line.data() + line.size()) return std::nullopt;
  return value;
}

std::string fault_text(std::uint32_t faults) {
  struct Known {
    std::uint32_t bit;
    const char* meaning;
  };
  // Bit 0x2000 says that the laser is ready: no fault.
  static constexpr Known kKnown[]{{0x1, "base plate temperature"},
                                  {0x2, "diode temperature"},
                                  {0x4, "internal temperature"},
                                  {0x8, "supply voltage"},
                                  {0x10, "internal bus (I2C)"},
                                  {0x20, "over-current"},
                                  {0x40, "checksum"},
                                  {0x80, "recovery"},
                                  {0x100, "buffer overflow"},
                                  {0x200, "warm-up limit"},
                                  {0x400, "cooler (TEC)"},
                                  {0x800, "internal bus"},
                                  {0x1000, "diode limit"},
                                  {0x4000, "photodiode"},
                                  {0x8000, "fatal"},
                                  {0x10000, "start-up"},
                                  {0x20000, "watchdog reset"},
                                  {0x40000, "field calibration"},
                                  {0x100000, "over-power"}};
  std::string text;
  for (const Known& known : kKnown)
    if ((faults & known.bit) != 0) text += (text.empty() ? "" : ", ") + std::string(known.meaning);
  return text;
}

}  // namespace hilbrush::obis
