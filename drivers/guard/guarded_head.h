#pragma once
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "drivers/clock.h"
#include "drivers/gate.h"
#include "drivers/guard/guard_codec.h"
#include "drivers/laser_head.h"

namespace hilbrush {

/// A laser's head in another process: its guard (guard_server.h). Sends heartbeats from a thread of its own
/// for as long as it lives; the guard turns the laser off without them. A guard that ends or falls silent is
/// a fault.
class GuardedHead final : public LaserHead {
 public:
  struct Options {
    double heartbeat_s = 0.02;
    double silence_s = 0.5;      ///< wall: a guard that is silent for longer is lost
    double arm_timeout_s = 30;   ///< cell: what the guard's own arming may take
    double pulse_grace_s = 0.2;  ///< wall: a pulse whose end is reported later than this ends emission
  };
  /// Starts (again) a guard; returns this side's end of its channel. @throws DriverError
  using Launch = std::function<int()>;

  GuardedHead(Launch launch, const Options& options, Clock& clock);
  ~GuardedHead() override;

  void connect() override;
  std::vector<std::string> identify() override;
  Powers powers() override { return powers_; }
  void arm() override;
  bool disarm() noexcept override;
  void set_power(double power_w) override;
  Status status() override;
  void request_status() override;
  void begin_pulse(double pulse_s) override;
  void end_pulse() noexcept override;
  void clear_fault() override;
  void set_listener(std::function<void()> on_change) override { on_change_ = std::move(on_change); }

  /// The laser's own gate, if it has one. Owned by the head.
  Gate& gate();

 private:
  class RemoteGate;
  void open_channel();
  void close_channel() noexcept;
  void run();
  bool read_messages();
  void take(const guard::StatusMessage& message);
  void lose(const std::string& sentence);
  std::string request(guard::Verb verb, double value, double wall_s);
  void send(const std::string& message);
  void post(guard::Verb verb, double value);

  const Launch launch_;
  const Options options_;
  Clock& clock_;
  std::function<void()> on_change_;
  const std::unique_ptr<RemoteGate> gate_;
  Powers powers_;
  double power_w_ = -1;  ///< as last confirmed; negative: unknown. Executor's thread

  std::mutex mutex_;  ///< of what follows
  std::condition_variable replied_;
  int channel_ = -1;
  bool is_ending_ = false;
  std::string lost_;  ///< why the guard is lost
  std::uint32_t next_number_ = 1;
  std::map<std::uint32_t, std::unique_ptr<guard::Reply>> replies_;  ///< null: still waited for
  Status status_;
  bool is_gate_on_ = false;
  std::uint64_t requested_readings_ = 0;
  std::thread thread_;
};

}  // namespace hilbrush
