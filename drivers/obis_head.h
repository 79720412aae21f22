#pragma once
#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "drivers/clock.h"
#include "drivers/device_options.h"
#include "drivers/laser_head.h"
#include "drivers/link.h"

namespace hilbrush {

/// A Coherent OBIS laser in external digital modulation: emission is armed once per job, a digital line gates it.
/// Handshake on, prompt off, CDRH delay on, autostart off; all read back. A thread reads the status word ten times a
/// second and when asked.
class ObisHead final : public LaserHead {
 public:
  ObisHead(const LaserOptions& options, Clock& clock);
  ~ObisHead() override;

  void connect() override;
  std::vector<std::string> identify() override;
  Powers powers() override;
  void arm() override;
  bool disarm() noexcept override;
  void set_power(double power_w) override;
  Status status() override;
  void look() override;
  void clear_fault() override;
  void set_listener(std::function<void()> on_change) override { on_change_ = std::move(on_change); }
  /// The raw descriptor, for the last words of a dying process; -1 if not open.
  int descriptor() const { return descriptor_.load(); }

 private:
  /// An exchange; for a query (ends with '?') the value. @throws LinkError; DriverError on ERR.
  std::string ask(const std::string& command, double wall_s);
  std::string ask(const std::string& command) { return ask(command, kReplyS); }
  std::string exchange(const std::string& command, Deadline deadline);
  void open_link(Deadline deadline);
  void set_switch(const std::string& name, bool is_on);
  double ask_number(const std::string& query);
  void set_up();
  std::uint32_t read_status();
  void take_status(std::uint32_t word, double begun_s);
  void check_ready_to_arm(std::uint32_t word);
  void poll();
  void start_polling();
  void end_polling() noexcept;
  void set_fault(const std::string& sentence);
  static constexpr double kReplyS = 0.5;   ///< wall
  static constexpr double kUrgentS = 0.1;  ///< wall

  const LaserOptions options_;
  Clock& clock_;
  std::function<void()> on_change_;

  std::timed_mutex link_mutex_;
  std::unique_ptr<Link> link_;
  LineReader lines_;
  std::atomic<int> descriptor_{-1};

  std::mutex mutex_;  ///< of what follows; never held while waiting for the laser
  std::condition_variable asked_;
  DeviceState state_ = DeviceState::kDisconnected;
  std::string fault_;
  std::uint32_t word_ = 0;
  double read_s_ = 0;
  bool is_polling_ = false, is_look_due_ = false, is_disarming_ = false;
  Powers powers_;
  std::optional<double> power_w_;  ///< as last read back
  std::thread thread_;
};

}  // namespace hilbrush
