#pragma once
#include <atomic>
#include <memory>
#include <mutex>
#include <vector>

#include "drivers/clock.h"
#include "drivers/gate.h"
#include "drivers/laser.h"
#include "drivers/laser_head.h"

namespace hilbrush {

/// A laser made of its two halves: a head that enables it and sets its power, and a gate that opens the beam.
/// A pulse counts as over when the gate is confirmed off and the head's status was read after that, so that
/// an interlock that cut it is seen before the pulse is believed.
class GatedLaser final : public Laser {
 public:
  /// `limits` are the cell file's; the device's own limits are checked when it is enabled. `gate` and `clock`
  /// outlive it.
  GatedLaser(std::unique_ptr<LaserHead> head, Gate& gate, const Limits& limits, Clock& clock);
  ~GatedLaser() override;

  void connect() override;
  Limits limits() override { return limits_; }
  void enable() override;
  void disable() noexcept override;
  /// Sets the head's power while the gate is closed.
  void prepare(double power_w, double pulse_s) override;
  void fire(double power_w, double pulse_s) override;
  bool off() noexcept override;
  Status status() override;
  void clear_fault() override;

  std::vector<std::string> identify() { return head_->identify(); }
  LaserHead& head() { return *head_; }

 private:
  /// A pulse as the gate can time it.
  struct Timed {
    double power_w, pulse_s;
  };
  Timed timed(double power_w, double pulse_s) const;
  void check_ready();
  void check_powers();
  void note_dark();
  void note_reading();

  const std::unique_ptr<LaserHead> head_;
  Gate& gate_;
  const Limits limits_;
  Clock& clock_;
  std::atomic<bool> may_fire_{false};

  std::mutex mutex_;             ///< of what follows
  bool is_reading_due_ = false;  ///< a pulse was fired that no reading has confirmed yet
  double gate_dark_s_ = -1;      ///< when the gate was confirmed off after it; negative: not yet
  double dark_since_s_ = 0;
};

}  // namespace hilbrush
