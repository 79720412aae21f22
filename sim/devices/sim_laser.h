#pragma once
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "drivers/laser.h"
#include "planner/cell_model/cell_description.h"
#include "sim/devices/emission_record.h"
#include "sim/devices/sim_clock.h"

namespace hilbrush {

/// The simulated laser. It times each pulse itself: the pulse's end is fixed when it starts, and only off(),
/// disable(), the interlock or a fault can bring it forward. off() closes the gate on the next control tick
/// and waits for it; the interlock cuts at once. It knows nothing of the axes and fires whenever it is
/// ordered to; the emission record says what it did while they moved.
class SimLaser final : public Laser {
 public:
  /// What the axes truly are, asked under the lock when a pulse begins.
  struct AxesState {
    Joints joints{};
    bool is_settled = false;
  };
  using AxesProbe = std::function<AxesState(double now_s)>;

  SimLaser(const CellDescription& cell, double start_delay_s, std::mutex& mutex, SimClock& clock,
           AxesProbe probe);
  ~SimLaser() override;

  void connect() override;
  Limits limits() override { return limits_; }
  void enable() override;
  void disable() noexcept override;
  void fire(double power_w, double pulse_s) override;
  bool off() noexcept override;
  Status status() override;
  void clear_fault() override;

  void set_sink(EmissionSink sink);
  void set_interlock_closed(bool closed);
  /// Axes begin to move at now_s: a pulse that is still on is marked, one that has ended is recorded. The
  /// caller holds the cell's mutex.
  void note_motion(double now_s) noexcept;

 private:
  struct Pulse {
    Emission emission;
    double end_s = 0;
  };

  bool is_emitting(double now_s) const { return pulse_ && now_s < pulse_->end_s; }
  void cut(double end_s) noexcept;
  /// Hands a pulse that has ended to the sink.
  void record_ended(double now_s) noexcept;
  void fail(const std::string& fault) noexcept;
  [[noreturn]] void refuse(const char* participle) const;

  const Limits limits_;
  const double tick_s_, start_delay_s_;
  std::mutex& mutex_;
  SimClock& clock_;
  const AxesProbe probe_;
  std::condition_variable state_changed_;

  DeviceState state_ = DeviceState::kDisconnected;
  bool is_interlock_closed_ = true;
  std::string fault_;
  std::optional<Pulse> pulse_;
  EmissionSink sink_;
};

}  // namespace hilbrush
