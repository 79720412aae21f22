#include "drivers/axes/drive_group.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "drivers/driver_error.h"
#include "drivers/link/link.h"
#include "drivers/number_text.h"

namespace hilbrush {
namespace {

constexpr double kIdlePollS = 0.1;  ///< wall
constexpr double kReadyPollS =
    0.01;  ///< cell: an axis that drifts from its place is seen before the next dot
constexpr double kReadyPollMinS = 0.001;  ///< wall
constexpr double kArrivalPollS = 0.0005;  ///< wall, on top of what the exchanges take
constexpr double kHandshakeS = 0.1;       ///< wall: what a stop waits for a handshake to end
constexpr double kStepsMax = 2147483647.;

template <std::size_t N>
std::array<AxisBounds, N> bounds_of(const std::array<ModbusAxisOptions, N>& options) {
  std::array<AxisBounds, N> bounds;
  for (std::size_t i = 0; i < N; ++i) bounds[i] = options[i].bounds;
  return bounds;
}

/// Which axes are prismatic is not known here.
template <std::size_t N>
std::array<AxisLabel, N> numbered_labels() {
  std::array<AxisLabel, N> labels;
  for (std::size_t i = 0; i < N; ++i) labels[i] = {"axis " + std::to_string(i + 1), 1, "(rad or m)"};
  return labels;
}

}  // namespace

template <std::size_t N>
DriveGroup<N>::DriveGroup(std::string name, const std::array<ModbusAxisOptions, N>& options,
                          std::array<std::unique_ptr<AxisDrive>, N> drives, Clock& clock)
    : options_(options),
      drives_(std::move(drives)),
      clock_(clock),
      group_(mutex_, std::move(name), bounds_of(options), numbered_labels<N>()) {}

template <std::size_t N>
DriveGroup<N>::~DriveGroup() {
  end_polling();
}

template <std::size_t N>
void DriveGroup<N>::set_fault(const std::string& sentence) {
  {
    const std::lock_guard lock(mutex_);
    forget_target();
    if (!group_.set_fault(sentence)) return;
  }
  clock_.wake();
}

/// Under the lock. What a drive holds ahead is forgotten with the target: the next order is sent whole.
template <std::size_t N>
void DriveGroup<N>::forget_target() {
  group_.is_target_current = group_.is_in_position = false;
  ahead_.reset();
}

template <std::size_t N>
void DriveGroup<N>::connect() {
  group_.require(DeviceState::kDisconnected, "connected");
  for (const auto& drive : drives_) drive->close();
  for (const auto& drive : drives_) drive->connect();
  const Readings readings = read_all();
  {
    const std::lock_guard lock(mutex_);
    group_.fault.clear();
    forget_target();
    for (std::size_t i = 0; i < N; ++i) positions_[i] = options_[i].scale.to_si(readings[i].position);
    group_.state = DeviceState::kConnected;
  }
  start_polling();
  try {
    check_alarms(readings);
  } catch (const DriverError& error) {
    set_fault(error.what());  // it is connected, and can be cleared
    throw;
  }
}

template <std::size_t N>
void DriveGroup<N>::enable() {
  group_.require(DeviceState::kConnected, "enabled");
  {
    const std::lock_guard command(command_mutex_);
    for (const auto& drive : drives_) drive->enable([this] { return stops_waiting_.load() > 0; });
  }
  check_alarms(read_all());
  const std::lock_guard lock(mutex_);
  if (group_.state != DeviceState::kConnected) group_.refuse("enabled");
  group_.state = DeviceState::kEnabled;
}

template <std::size_t N>
void DriveGroup<N>::home() {
  group_.require(DeviceState::kEnabled, "homed");
  {
    const std::lock_guard command(command_mutex_);
    for (const auto& drive : drives_) drive->home([this] { return stops_waiting_.load() > 0; });
  }
  const Readings readings = read_all();
  check_alarms(readings);
  for (const auto& reading : readings)
    if (!reading.is_homed) throw DriverError("the " + group_.name() + " has no reference after homing");
  const std::lock_guard lock(mutex_);
  if (group_.state != DeviceState::kEnabled) group_.refuse("homed");
  group_.state = DeviceState::kReady;
}

template <std::size_t N>
void DriveGroup<N>::disable() noexcept {
  stop();
  try {
    const std::unique_lock command(command_mutex_, deadline_in(kHandshakeS));
    if (command)
      for (const auto& drive : drives_) drive->disable();
  } catch (const std::exception&) {
    // A drive that cannot be asked is off, or its link is lost, which the polling thread reports.
  }
  const std::lock_guard lock(mutex_);
  if (group_.state != DeviceState::kDisconnected && group_.state != DeviceState::kFault)
    group_.state = DeviceState::kConnected;
}

template <std::size_t N>
void DriveGroup<N>::clear_fault() {
  group_.require(DeviceState::kFault, "cleared of a fault");
  end_polling();
  try {
    const std::lock_guard command(command_mutex_);
    for (const auto& drive : drives_) drive->close();
    for (const auto& drive : drives_) drive->connect();
    for (const auto& drive : drives_)
      if (drive->read().has_fault) drive->clear_fault();
    const double deadline_s = clock_.now_s() + 1;
    for (Readings readings = read_all();; readings = read_all()) {
      if (std::none_of(readings.begin(), readings.end(),
                       [](const auto& reading) { return reading.has_fault; }))
        break;
      if (clock_.now_s() > deadline_s) check_alarms(readings);
    }
  } catch (const DriverError& error) {
    const std::lock_guard lock(mutex_);
    group_.fault = error.what();
    throw;
  }
  {
    const std::lock_guard lock(mutex_);
    group_.state = DeviceState::kConnected;
    group_.fault.clear();
  }
  start_polling();
}

/// Drives count steps in 32 bits.
template <std::size_t N>
void DriveGroup<N>::check_target(const Positions& target) const {
  group_.check_bounds(target);
  for (std::size_t i = 0; i < N; ++i)
    if (!(std::abs(options_[i].scale.to_device(target[i])) < kStepsMax))
      throw DriverError("the " + group_.name() + " refuses to move axis " + std::to_string(i + 1) + " to " +
                        number_text(target[i], 7) + " (rad or m): it is more steps than the drive can count");
}

template <std::size_t N>
AxisDrive::Move DriveGroup<N>::order(std::size_t axis, double target) const {
  const ModbusAxisOptions& options = options_[axis];
  const auto steps = [&](double units) {
    return static_cast<std::uint32_t>(std::clamp(units * options.scale.steps_per_unit, 1., 4e9));
  };
  return {static_cast<std::int32_t>(std::lround(options.scale.to_device(target))),
          steps(options.bounds.speed_max), steps(options.bounds.acceleration_max)};
}

template <std::size_t N>
double DriveGroup<N>::travel_s(const Positions& target) const {
  Positions distances;
  for (std::size_t i = 0; i < N; ++i) distances[i] = std::abs(target[i] - positions_[i]);
  return group_.travel_s(distances);
}

template <std::size_t N>
void DriveGroup<N>::move_to(const Positions& target, double settle_s) {
  group_.check_settle_time(settle_s);
  check_target(target);
  const std::unique_lock command(command_mutex_, deadline_in(1));
  if (!command) throw DriverError("the " + group_.name() + " is busy");
  std::array<AxisDrive::Move, N> moves;
  std::array<bool, N> is_new{};
  std::array<bool, N> is_ahead{};
  {
    const std::lock_guard lock(mutex_);
    if (group_.state != DeviceState::kReady) group_.refuse("moved");
    if (group_.is_under_way()) throw DriverError("the " + group_.name() + " refuses to move: it is moving");
    for (std::size_t i = 0; i < N; ++i) {
      moves[i] = order(i, target[i]);
      is_new[i] = !group_.is_in_position || moves[i].target != target_[i].target;
      is_ahead[i] = ahead_ && ahead_->is_written[i] && ahead_->moves[i] == moves[i];
    }
    // An order to stay at the target, which only restarts settling, leaves what was sent ahead for the next
    // move.
    if (std::find(is_new.begin(), is_new.end(), true) != is_new.end()) ahead_.reset();
    group_.arrival_s = clock_.now_s() + travel_s(target) + settle_s;
    target_ = moves;
    group_.settle_s = settle_s;
    group_.is_target_current = true;
    is_accepted_ = group_.is_in_position = false;
    rest_s_ = -1;
  }
  const auto give_up = [this] { return stops_waiting_.load() > 0; };
  try {
    for (std::size_t i = 0; i < N; ++i) {
      if (give_up()) throw DriverError("the " + group_.name() + " was stopped");
      if (is_new[i]) drives_[i]->start(moves[i], is_ahead[i], give_up);
    }
  } catch (const LinkError& error) {
    set_fault(error.what());
    throw;
  } catch (const DriverError&) {
    const std::lock_guard lock(mutex_);
    group_.is_target_current = false;
    throw;
  }
  const std::lock_guard lock(mutex_);
  is_accepted_ = true;
  accepted_s_ = clock_.now_s();
  is_poll_due_ = true;
  poll_asked_.notify_all();
}

template <std::size_t N>
void DriveGroup<N>::prepare(const Positions& target) {
  check_target(target);
  const std::lock_guard lock(mutex_);
  if (group_.state != DeviceState::kReady || !group_.is_in_position) return;
  Ahead ahead;
  for (std::size_t i = 0; i < N; ++i) ahead.moves[i] = order(i, target[i]);
  if (ahead_ && ahead_->moves == ahead.moves) return;
  ahead_ = ahead;
  is_poll_due_ = true;
  poll_asked_.notify_all();
}

/// Polling thread. It is not a fault if a drive does not take it: the move itself is then sent whole, and
/// reports what is wrong with the drive.
template <std::size_t N>
void DriveGroup<N>::write_ahead() {
  const std::unique_lock command(command_mutex_, deadline_in(0));
  if (!command) return;
  const auto give_up = [this] { return stops_waiting_.load() > 0; };
  for (std::size_t i = 0; i < N && !give_up(); ++i) {
    AxisDrive::Move move;
    {
      const std::lock_guard lock(mutex_);
      if (!ahead_ || ahead_->is_written[i]) continue;
      move = ahead_->moves[i];
      if (move.target == target_[i].target) continue;  // it will not move
    }
    bool is_written = false;
    try {
      is_written = drives_[i]->write_ahead(move, give_up);
    } catch (const DriverError&) {
      is_written = false;
    }
    const std::lock_guard lock(mutex_);
    if (!is_written) ahead_.reset();
    if (ahead_ && ahead_->moves[i] == move) ahead_->is_written[i] = true;
  }
}

template <std::size_t N>
typename DriveGroup<N>::Status DriveGroup<N>::status() {
  const std::lock_guard lock(mutex_);
  return group_.status(positions_, read_s_);
}

template <std::size_t N>
double DriveGroup<N>::expected_arrival_s() {
  const std::lock_guard lock(mutex_);
  return group_.expected_arrival_s(clock_.now_s());
}

template <std::size_t N>
void DriveGroup<N>::stop() noexcept {
  {
    const std::lock_guard lock(mutex_);
    if (group_.state == DeviceState::kDisconnected || group_.state == DeviceState::kConnected) return;
    forget_target();
  }
  ++stops_waiting_;
  std::string failure;
  try {
    const std::unique_lock command(command_mutex_, deadline_in(kHandshakeS));
    // A handshake that does not end is stuck on a silent drive; the others are stopped all the same.
    for (const auto& drive : drives_) {
      try {
        drive->stop();
      } catch (const std::exception& error) {
        failure = error.what();
      }
    }
  } catch (const std::exception& error) {
    failure = error.what();
  }
  --stops_waiting_;
  if (!failure.empty()) set_fault("the " + group_.name() + " does not confirm a stop: " + failure);
  clock_.wake();
}

template <std::size_t N>
std::vector<std::string> DriveGroup<N>::identify() {
  std::vector<std::string> lines;
  for (const auto& drive : drives_) lines.push_back(drive->identify());
  return lines;
}

template <std::size_t N>
typename DriveGroup<N>::Readings DriveGroup<N>::read_all() {
  Readings readings;
  for (std::size_t i = 0; i < N; ++i) readings[i] = drives_[i]->read();
  return readings;
}

template <std::size_t N>
void DriveGroup<N>::check_alarms(const Readings& readings) const {
  for (std::size_t i = 0; i < N; ++i)
    if (readings[i].has_fault)
      throw DriverError("axis " + std::to_string(i + 1) + " of the " + group_.name() + " reports " +
                        drives_[i]->alarm_text(readings[i].alarm));
}

/// Under the lock.
template <std::size_t N>
bool DriveGroup<N>::is_at_target(const Readings& readings) const {
  for (std::size_t i = 0; i < N; ++i) {
    const AxisDrive::Reading& reading = readings[i];
    const double target = target_[i].target;
    const double window = std::max(1., options_[i].window * options_[i].scale.steps_per_unit);
    if (!reading.has_arrived || !reading.is_enabled || std::abs(reading.position - target) > window)
      return false;
    if (reading.setpoint && std::abs(*reading.setpoint - target) > 0.5) return false;
  }
  return true;
}

/// Polling thread.
template <std::size_t N>
void DriveGroup<N>::take(const Readings& readings, double begun_s) {
  for (std::size_t i = 0; i < N; ++i)
    if (readings[i].has_fault) {
      set_fault("axis " + std::to_string(i + 1) + " of the " + group_.name() + " reports " +
                drives_[i]->alarm_text(readings[i].alarm));
      return;
    }
  bool is_news = false;
  {
    const std::lock_guard lock(mutex_);
    for (std::size_t i = 0; i < N; ++i) positions_[i] = options_[i].scale.to_si(readings[i].position);
    read_s_ = begun_s;
    const bool was_in_position = group_.is_in_position;
    if (!group_.is_target_current || !is_accepted_ || begun_s < accepted_s_ || !is_at_target(readings)) {
      rest_s_ = -1;
      group_.is_in_position = false;
    } else {
      // Rest is counted from the end of the first reading that shows it to the beginning of the last.
      const double now_s = clock_.now_s();
      group_.is_in_position = group_.settle_s <= 0 || (rest_s_ >= 0 && begun_s - rest_s_ >= group_.settle_s);
      if (rest_s_ < 0) rest_s_ = now_s;
      if (group_.is_in_position && !was_in_position) group_.in_position_since_s = now_s;
    }
    is_news = group_.is_in_position != was_in_position;
  }
  if (is_news) clock_.wake();
}

/// Wall seconds until the next reading. Under the lock.
template <std::size_t N>
double DriveGroup<N>::poll_interval_s() const {
  if (group_.state != DeviceState::kReady) return kIdlePollS;
  const double ready_s = std::max(clock_.wall_s(kReadyPollS), kReadyPollMinS);
  if (!group_.is_under_way()) return ready_s;
  const double due_s = rest_s_ >= 0 ? rest_s_ + group_.settle_s : group_.arrival_s - group_.settle_s;
  return std::clamp(clock_.wall_s(due_s - clock_.now_s()), kArrivalPollS, ready_s);
}

template <std::size_t N>
void DriveGroup<N>::poll() {
  std::unique_lock lock(mutex_);
  while (is_polling_) {
    poll_asked_.wait_until(lock, deadline_in(poll_interval_s()),
                           [this] { return !is_polling_ || is_poll_due_; });
    if (!is_polling_) return;
    is_poll_due_ = false;
    if (group_.state == DeviceState::kFault) continue;
    const bool has_ahead = ahead_.has_value();
    lock.unlock();
    try {
      if (has_ahead) write_ahead();
      const double begun_s = clock_.now_s();
      take(read_all(), begun_s);
    } catch (const DriverError& error) {
      set_fault("the " + group_.name() + " cannot be read: " + error.what());
    }
    lock.lock();
  }
}

template <std::size_t N>
void DriveGroup<N>::start_polling() {
  end_polling();
  is_polling_ = true;
  thread_ = std::thread([this] { poll(); });
}

template <std::size_t N>
void DriveGroup<N>::end_polling() noexcept {
  {
    const std::lock_guard lock(mutex_);
    is_polling_ = false;
  }
  poll_asked_.notify_all();
  if (thread_.joinable()) thread_.join();
}

template class DriveGroup<2>;
template class DriveGroup<4>;

}  // namespace hilbrush
