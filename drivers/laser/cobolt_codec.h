#pragma once
#include <string>
#include <string_view>

/// Messages of Hübner (Cobolt) 06 lasers as pure functions: ASCII lines that end with CR, 115200 baud; each
/// is answered by one line, except those that begin with '!': command modulation, for fast dots.
namespace hilbrush::cobolt {

std::string encode(std::string_view command);  ///< with its line end
/// "LASer:PM:POWer:SETPoint 12.300": power while modulated, milliwatts.
std::string power_command(double power_w);

inline constexpr std::string_view kOpen = "!e\r";
inline constexpr std::string_view kClose = "!d\r";

/// Whether the answer to a command that asks nothing means that it was obeyed.
bool is_ok(std::string_view line);

/// ilk?
inline constexpr long kInterlockClosed = 0;
/// f? in words: "interlock", "temperature"; empty for 0.
std::string fault_text(long fault);
/// gom? of the 06-01 series.
enum class Mode : long {
  kOff = 0,
  kTemperature = 1,
  kWaitingForKey = 2,
  kWarmUp = 3,
  kCompleted = 4,
  kFault = 5,
  kAborted = 6,
  kModulation = 7,
  kStandby = 8
};

}  // namespace hilbrush::cobolt
