#pragma once
#include <atomic>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "drivers/axes/axis_drive.h"
#include "drivers/axes/modbus_bus.h"
#include "drivers/clock.h"
#include "drivers/device_options.h"

namespace hilbrush {

/// Registers as numbers: pure functions of a register map.
namespace register_map {

/// One or two words in the register's word order.
std::vector<std::uint16_t> encode(const MappedRegister& reg, std::uint32_t value);
/// `words`: as many as the register has. Signed ones are sign-extended.
std::int64_t decode(const MappedRegister& reg, std::span<const std::uint16_t> words);
/// Steps, steps/s or steps/s2 in the register's unit, rounded, and limited to what it can hold.
std::uint32_t to_register(const MappedRegister& reg, double steps);
double to_steps(const MappedRegister& reg, std::int64_t value);

}  // namespace register_map

/// A drive that a register map describes: its handshakes are lists of writes and waits. Its times are the
/// cell's.
class MappedDrive final : public AxisDrive {
 public:
  MappedDrive(std::shared_ptr<ModbusBus> bus, const ModbusAxisOptions& options, RegisterMap map,
              Clock& clock);

  void connect() override;
  void close() noexcept override { bus_->close(); }
  std::string identify() override;
  Reading read() override;
  void enable(const GiveUp& give_up) override { run(map_.enable, "enabling", nullptr, give_up); }
  void disable() override;
  void home(const GiveUp& give_up) override;
  bool write_ahead(const Move& move, const GiveUp& give_up) override;
  void start(const Move& move, bool is_ahead, const GiveUp& give_up) override;
  void stop() override;
  void clear_fault() override;
  std::string alarm_text(std::uint32_t alarm) const override;

 private:
  std::int64_t value_of(std::size_t reg);
  void write(const MappedRegister& reg, std::uint32_t value);
  void run(const std::vector<RegisterStep>& steps, const char* gerund, const Move* move,
           const GiveUp& give_up);
  void wait(const RegisterStep& step, const char* gerund, const GiveUp& give_up);

  const std::shared_ptr<ModbusBus> bus_;
  const int unit_;
  const bool homes_to_zero_;
  const RegisterMap map_;
  Clock& clock_;
  std::atomic<bool> is_stopped_{false};
};

}  // namespace hilbrush
