#pragma once
#include <atomic>
#include <cstdint>
#include <mutex>
#include <span>
#include <string>

#include "drivers/deadline_mutex.h"
#include "drivers/device_options.h"
#include "drivers/link/link.h"

struct _modbus;

namespace hilbrush {

/// A Modbus master on one RS-485 bus or TCP connection, by libmodbus. One exchange at a time, from any
/// thread; each ends within its time-out. Reads are tried a second time after silence or a damaged answer;
/// writes never are, because whether they were carried out is not known. An answer that comes too late is
/// thrown away before the next request.
class ModbusBus {
 public:
  static constexpr double kReplyS = 0.2;  ///< wall

  explicit ModbusBus(const ModbusEndpoint& endpoint, double reply_s = kReplyS);
  ~ModbusBus();
  ModbusBus(const ModbusBus&) = delete;
  ModbusBus& operator=(const ModbusBus&) = delete;

  void connect();  ///< @throws LinkError
  void close() noexcept;
  bool is_open() const { return is_open_.load(); }

  /// Holding registers, function 3. @throws LinkError if nothing usable came back; DriverError on an
  /// exception code.
  void read(int unit, int address, std::span<std::uint16_t> words);
  void write(int unit, int address, std::span<const std::uint16_t> words);  ///< function 16
  void write_one(int unit, int address, std::uint16_t word);                ///< function 6

  const std::string& name() const { return name_; }
  MessageRing& messages() { return messages_; }

 private:
  template <class Exchange>
  void exchange(int unit, const std::string& what, int attempts, Exchange exchange);

  const ModbusEndpoint endpoint_;
  const double reply_s_;
  const std::string name_;
  DeadlineMutex mutex_;
  _modbus* context_ = nullptr;
  std::atomic<bool> is_open_{false};
  MessageRing messages_;
};

}  // namespace hilbrush
