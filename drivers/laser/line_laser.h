#pragma once
#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "drivers/clock.h"
#include "drivers/deadline_mutex.h"
#include "drivers/device_options.h"
#include "drivers/laser_head.h"
#include "drivers/link/link.h"

namespace hilbrush {

/// What lasers with a line protocol have in common: one exchange at a time with a deadline, the life cycle of
/// a head, and a thread that reads the laser's condition ten times a second and on request. The next exchange
/// opens a link that failed again, because it is not known which command the answers still on it belong to.
class LineLaser : public LaserHead {
 public:
  void connect() override;
  std::vector<std::string> identify() override;
  Powers powers() override;
  void arm() override;
  bool disarm() noexcept override;
  void set_power(double power_w) override;
  Status status() override;
  void request_status() override;
  void clear_fault() override;
  void set_listener(std::function<void()> on_change) override { on_change_ = std::move(on_change); }

  /// The link's descriptor, for the last command of a dying process; -1 if not open.
  int descriptor() const { return descriptor_.load(); }

 protected:
  LineLaser(const LaserOptions& options, double gap_s, Clock& clock);
  /// The derived class's destructor ends the thread before its own parts go.
  void end_polling() noexcept;

  static constexpr double kReplyS = 0.5;   ///< wall
  static constexpr double kUrgentS = 0.1;  ///< wall

  struct Condition {
    bool is_interlock_closed = false;
    bool is_key_in = false;
    bool is_armed = false;  ///< emission can be gated now
    std::string fault;      ///< what else is wrong
  };

  // What differs between lasers. All but the first are called with no lock held and use ask().
  /// One exchange on the open link. @throws LinkError; DriverError if the laser refuses.
  virtual std::string exchange(Link& link, LineReader& lines, const std::string& command,
                               Deadline deadline) = 0;
  virtual void set_up() = 0;                          ///< a quiet, known state; emission off
  virtual std::vector<std::string> read_names() = 0;  ///< model, serial number: lines for the operator
  virtual Powers read_powers() = 0;
  virtual Condition read_condition() = 0;
  /// For the operator; empty: none.
  virtual std::string read_faults(const Condition& condition) { return condition.fault; }
  virtual void prepare_arming() = 0;  ///< the modulation mode, read back
  virtual void order_emission() = 0;
  virtual void stop_emission(double wall_s) = 0;
  virtual void order_power(double power_w) = 0;
  virtual double read_power() = 0;

  std::string ask(const std::string& command, double wall_s = kReplyS);
  double ask_number(const std::string& query);
  /// Sends bytes that are not answered, at once, even while an exchange waits for its answer. @throws
  /// LinkError
  void say(std::string_view bytes, double wall_s);
  Clock& clock() { return clock_; }

 private:
  void start_polling();
  void poll();
  void check_power();
  void take(const Condition& condition, double begun_s);
  void check_may_arm(const Condition& condition);
  void check_not_disarmed();
  void bring_up();
  void end_arming();
  void set_fault(const std::string& sentence);

  const LaserOptions options_;
  const double gap_s_;  ///< wall, between two commands
  Clock& clock_;
  std::function<void()> on_change_;

  DeadlineMutex exchange_mutex_;
  Deadline next_exchange_{};
  LineReader lines_;
  std::mutex write_mutex_;      ///< of the link's writing half; held for a write only
  std::shared_ptr<Link> link_;  ///< replaced under both of the above
  std::atomic<int> descriptor_{-1};

  std::mutex mutex_;  ///< of what follows; never held while waiting for the laser
  std::condition_variable asked_;
  DeviceState state_ = DeviceState::kDisconnected;
  std::string fault_;
  Condition condition_;
  double read_s_ = 0;
  bool is_polling_ = false;
  bool is_request_due_ = false;
  bool is_disarming_ = false;
  bool is_arming_ = false;
  Powers powers_;
  std::optional<double> power_w_;  ///< as last read back
  std::thread thread_;
};

}  // namespace hilbrush
