#pragma once
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "drivers/axes/axis_drive.h"
#include "drivers/axes/modbus_bus.h"
#include "drivers/device_options.h"

/// Oriental Motor AZ drives by "direct data operation": one write of 16 registers carries target, speed,
/// rates and the trigger that starts the move; or one write carries them with the trigger at 0, and a second,
/// of the trigger alone, starts it later. 32-bit values have their high word first.
namespace hilbrush {

namespace oriental_az {

inline constexpr int kDirectDataAt = 0x0058;    ///< 16 words
inline constexpr int kTriggerAt = 0x0066;       ///< the last 2 of them
inline constexpr int kDriverInputAt = 0x007D;   ///< low word of 0x007C: level inputs
inline constexpr int kDriverOutputAt = 0x007F;  ///< low word of 0x007E
inline constexpr int kAlarmAt = 0x0080;         ///< 2 words
inline constexpr int kPositionAt = 0x0120;      ///< 4 words: feedback position, command position

enum Input : std::uint16_t {
  kStart = 1 << 3,
  kHome = 1 << 4,
  kStop = 1 << 5,
  kFree = 1 << 6,
  kAlarmReset = 1 << 7
};
enum Output : std::uint16_t {
  kReady = 1 << 5,
  kAlarm = 1 << 7,
  kBusy = 1 << 8,
  kMove = 1 << 13,
  kInPosition = 1 << 14
};

using DirectData = std::array<std::uint16_t, 16>;
enum class Trigger : std::uint32_t { kNone = 0, kAllData = 1 };
/// Operation data 0, absolute positioning, full current.
DirectData encode_move(const AxisDrive::Move& move, Trigger trigger);
std::array<std::uint16_t, 2> encode_trigger(Trigger trigger);

/// The two blocks that are polled. `position_words`: 4, from kPositionAt.
AxisDrive::Reading decode_reading(std::uint16_t output, std::span<const std::uint16_t, 4> position_words);

std::string alarm_text(std::uint32_t alarm);

}  // namespace oriental_az

class OrientalDrive final : public AxisDrive {
 public:
  /// Axes on one bus share it.
  OrientalDrive(std::shared_ptr<ModbusBus> bus, const ModbusAxisOptions& options);

  void connect() override;
  void close() noexcept override { bus_->close(); }
  std::string identify() override;
  Reading read() override;
  void enable(const GiveUp& give_up) override;
  void disable() override;
  void home(const GiveUp& give_up) override;
  bool write_ahead(const Move& move, const GiveUp& give_up) override;
  void start(const Move& move, bool is_ahead, const GiveUp& give_up) override;
  void stop() override;
  void clear_fault() override;
  std::string alarm_text(std::uint32_t alarm) const override { return oriental_az::alarm_text(alarm); }

 private:
  void set_inputs(std::uint16_t inputs);
  void pulse_input(std::uint16_t input);

  std::shared_ptr<ModbusBus> bus_;
  const int unit_;
  const bool homes_to_zero_;
  std::atomic<bool> is_stop_held_{true};  ///< unknown at first
};

}  // namespace hilbrush
