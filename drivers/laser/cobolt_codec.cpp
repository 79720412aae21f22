#include "drivers/laser/cobolt_codec.h"

#include "drivers/link/line_codec.h"
#include "drivers/number_text.h"

namespace hilbrush::cobolt {

std::string encode(std::string_view command) {
  return std::string(command) + "\r";
}

std::string power_command(double power_w) {
  return "LASer:PM:POWer:SETPoint " + fixed_text(power_w * 1e3, 3);
}

bool is_ok(std::string_view line) {
  return line_codec::equals_ignoring_case(line_codec::trimmed(line), "OK");
}

std::string fault_text(long fault) {
  switch (fault) {
    case 0:
      return "";
    case 1:
      return "temperature";
    case 3:
      return "interlock";
    case 4:
      return "current limit";
    default:
      return "fault " + std::to_string(fault);
  }
}

}  // namespace hilbrush::cobolt
