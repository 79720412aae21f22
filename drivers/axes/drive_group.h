#pragma once
#include <array>
#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "drivers/axes/axis_drive.h"
#include "drivers/axis_group.h"
#include "drivers/axis_group_state.h"
#include "drivers/clock.h"
#include "drivers/deadline_mutex.h"
#include "drivers/device_options.h"

namespace hilbrush {

/// N drives on fieldbuses as one group. A polling thread reads the drives: as fast as they answer while an
/// axis is under way, a few times a second at rest. In position: after the order was taken, every drive says
/// so, its set-point (if it reports one) is the target, and its position is within the window, in every
/// reading for the settle time; a reading counts only if it was begun after the order had been taken, because
/// before that a drive may still report the end of its last move.
///
/// prepare() leaves the next target to the polling thread, which writes ahead what starts nothing of the axes
/// that will move; a move_to() of that very target then sends only the rest.
template <std::size_t N>
class DriveGroup final : public AxisGroup<N> {
 public:
  using Positions = typename AxisGroup<N>::Positions;
  using Status = typename AxisGroup<N>::Status;

  /// `name`: "table". `clock` outlives it and is woken when status() changes.
  DriveGroup(std::string name, const std::array<ModbusAxisOptions, N>& options,
             std::array<std::unique_ptr<AxisDrive>, N> drives, Clock& clock);
  ~DriveGroup() override;

  void connect() override;
  void enable() override;
  void home() override;
  void disable() noexcept override;
  void clear_fault() override;
  void move_to(const Positions& target, double settle_s) override;
  void prepare(const Positions& target) override;
  Status status() override;
  double expected_arrival_s() override;
  void stop() noexcept override;

  /// A line for each drive, for the operator. @throws DriverError
  std::vector<std::string> identify();

 private:
  using Readings = std::array<AxisDrive::Reading, N>;
  /// The target given to prepare(), and which drives have it.
  struct Ahead {
    std::array<AxisDrive::Move, N> moves{};
    std::array<bool, N> is_written{};
  };

  void start_polling();
  void end_polling() noexcept;
  void poll();
  void write_ahead();
  void forget_target();
  Readings read_all();
  void take(const Readings& readings, double begun_s);
  bool is_at_target(const Readings& readings) const;
  void check_alarms(const Readings& readings) const;
  void check_target(const Positions& target) const;
  AxisDrive::Move order(std::size_t axis, double target) const;
  double travel_s(const Positions& target) const;
  void set_fault(const std::string& sentence);
  double poll_interval_s() const;

  const std::array<ModbusAxisOptions, N> options_;
  const std::array<std::unique_ptr<AxisDrive>, N> drives_;
  Clock& clock_;

  DeadlineMutex command_mutex_;        ///< held through a handshake with a drive
  std::atomic<int> stops_waiting_{0};  ///< handshakes end early while not 0

  std::mutex mutex_;  ///< of what follows; never held while waiting for a drive
  std::condition_variable poll_asked_;
  bool is_polling_ = false;
  bool is_poll_due_ = false;
  AxisGroupState<N> group_;
  Positions positions_{};
  bool is_accepted_ = false;
  std::array<AxisDrive::Move, N> target_{};  ///< in steps
  std::optional<Ahead> ahead_;               ///< of the next move; only while no axis moves
  double accepted_s_ = 0;
  double rest_s_ = -1;  ///< since when it rests at the target, on the cell's clock; negative: it does not
  double read_s_ = 0;
  std::thread thread_;
};

extern template class DriveGroup<2>;
extern template class DriveGroup<4>;

}  // namespace hilbrush
