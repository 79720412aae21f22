#pragma once
#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "drivers/gate.h"
#include "drivers/laser/line_laser.h"

namespace hilbrush {

/// A Hübner (Cobolt) 06 laser in modulation mode. Gated by its own fast commands (!e, !d: command modulation)
/// or by a digital line, as `is_gated_by_line` says. Ordinary commands keep a distance of
/// LaserOptions::command_gap_s.
class CoboltHead final : public LineLaser {
 public:
  CoboltHead(const LaserOptions& options, bool is_gated_by_line, Clock& clock)
      : LineLaser(options, options.command_gap_s, clock), is_gated_by_line_(is_gated_by_line) {}
  ~CoboltHead() override { end_polling(); }

  void open_beam();   ///< !e
  void close_beam();  ///< !d
  bool is_answering() noexcept;

 private:
  std::string exchange(Link& link, LineReader& lines, const std::string& command, Deadline deadline) override;
  void set_up() override;
  std::vector<std::string> read_names() override;
  Powers read_powers() override;
  Condition read_condition() override;
  void prepare_arming() override;
  void order_emission() override;
  void stop_emission(double wall_s) override;
  void order_power(double power_w) override;
  double read_power() override;

  void order(const std::string& command, double wall_s = kReplyS);
  long ask_integer(const std::string& query);

  const bool is_gated_by_line_;
};

/// The serial gate: a thread of its own ends each pulse. Nothing else bounds it, so it belongs in a process
/// that survives its user: see guard_server.h. The laser does not answer !d, so off() sends a query
/// afterwards: a laser that answers it has carried out !d.
class CoboltGate final : public Gate {
 public:
  CoboltGate(CoboltHead& head, Clock& clock);
  ~CoboltGate() override;

  double resolution_s() const override { return 0; }
  void pulse(double pulse_s) override;
  bool off() noexcept override;
  bool is_on() override;
  void set_listener(Listener listener) override;

 private:
  void run();
  void close_beam(std::unique_lock<std::mutex>& lock);

  CoboltHead& head_;
  Clock& clock_;
  std::mutex mutex_;
  std::condition_variable ordered_;
  Listener listener_;
  bool is_ending_ = false;
  bool is_open_ = false;
  bool has_failed_ = false;
  bool is_known_off_ = false;
  Deadline end_{};
  std::thread thread_;
};

}  // namespace hilbrush
