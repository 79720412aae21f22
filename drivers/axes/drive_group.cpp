#include "drivers/axes/drive_group.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "drivers/driver_error.h"
#include "drivers/link/link.h"

namespace hilbrush {
namespace {

constexpr double kIdlePollS = 0.1;        ///< wall
constexpr double kReadyPollS = 0.01;      ///< cell: an axis that drifts from its place is seen before the next dot
constexpr double kReadyPollMinS = 0.001;  ///< wall
constexpr double kArrivalPollS = 0.0005;  ///< wall, on top of what the exchanges take
constexpr double kHandshakeS = 0.1;       ///< wall: what a stop waits for a handshake to end

}  // namespace

template <std::size_t N>
DriveGroup<N>::DriveGroup(std::string name, const std::array<ModbusAxisOptions, N>& options,
                          std::array<std::unique_ptr<AxisDrive>, N> drives, Clock& clock)
    : name_(std::move(name)), options_(options), drives_(std::move(drives)), clock_(clock) {}

template <std::size_t N>
DriveGroup<N>::~DriveGroup() {
  end_polling();
}

template <std::size_t N>
void DriveGroup<N>::refuse(const char* participle) const {
  const std::string is = state_ == DeviceState::kFault ? "it reports a fault: " + fault_
                                                       : std::string("it is ") + device_state_name(state_);
  throw DriverError("the " + name_ + " cannot be " + participle + ": " + is);
}

template <std::size_t N>
void DriveGroup<N>::require(DeviceState state, const char* participle) {
  const std::lock_guard lock(mutex_);
  if (state_ != state) refuse(participle);
}

template <std::size_t N>
void DriveGroup<N>::set_fault(const std::string& sentence) {
  {
    const std::lock_guard lock(mutex_);
    forget_target();
    if (state_ == DeviceState::kFault || state_ == DeviceState::kDisconnected) return;
    state_ = DeviceState::kFault;
    fault_ = sentence;
  }
  clock_.wake();
}

/// Under the lock. What a drive holds ahead is forgotten with the target: the next order is sent whole.
template <std::size_t N>
void DriveGroup<N>::forget_target() {
  is_target_current_ = is_in_position_ = false;
  ahead_.reset();
}

template <std::size_t N>
void DriveGroup<N>::connect() {
  require(DeviceState::kDisconnected, "connected");
  for (const auto& drive : drives_) drive->close();
  for (const auto& drive : drives_) drive->connect();
  const Readings readings = read_all();
  {
    const std::lock_guard lock(mutex_);
    fault_.clear();
    forget_target();
    for (std::size_t i = 0; i < N; ++i) positions_[i] = options_[i].scale.to_si(readings[i].position);
    state_ = DeviceState::kConnected;
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
  require(DeviceState::kConnected, "enabled");
  {
    const std::lock_guard command(command_mutex_);
    for (const auto& drive : drives_) drive->enable([this] { return stops_waiting_.load() > 0; });
  }
  check_alarms(read_all());
  const std::lock_guard lock(mutex_);
  if (state_ != DeviceState::kConnected) refuse("enabled");
  state_ = DeviceState::kEnabled;
}

template <std::size_t N>
void DriveGroup<N>::home() {
  require(DeviceState::kEnabled, "homed");
  {
    const std::lock_guard command(command_mutex_);
    for (const auto& drive : drives_) drive->home([this] { return stops_waiting_.load() > 0; });
  }
  const Readings readings = read_all();
  check_alarms(readings);
  for (const auto& reading : readings)
    if (!reading.is_homed) throw DriverError("the " + name_ + " has no reference after homing");
  const std::lock_guard lock(mutex_);
  if (state_ != DeviceState::kEnabled) refuse("homed");
  state_ = DeviceState::kReady;
}

template <std::size_t N>
void DriveGroup<N>::disable() noexcept {
  stop();
  try {
    const std::unique_lock command(command_mutex_, deadline_in(kHandshakeS));
    if (command)
      for (const auto& drive : drives_) drive->disable();
  } catch (const std::exception&) {
    // A drive that can't be asked is off, or its link is lost, which the polling thread reports.
  }
  const std::lock_guard lock(mutex_);
  if (state_ != DeviceState::kDisconnected && state_ != DeviceState::kFault) state_ = DeviceState::kConnected;
}

template <std::size_t N>
void DriveGroup<N>::clear_fault() {
  require(DeviceState::kFault, "cleared of a fault");
  end_polling();
  try {
    const std::lock_guard command(command_mutex_);
    for (const auto& drive : drives_) drive->close();
    for (const auto& drive : drives_) drive->connect();
    for (const auto& drive : drives_)
      if (drive->read().has_fault) drive->clear_fault();
    const double deadline_s = clock_.now_s() + 1;
    for (Readings readings = read_all();; readings = read_all()) {
      if (std::none_of(readings.begin(), readings.end(), [](const auto& reading) { return reading.has_fault; })) break;
      if (clock_.now_s() > deadline_s) check_alarms(readings);
    }
  } catch (const DriverError& error) {
    const std::lock_guard lock(mutex_);
    fault_ = error.what();
    throw;
  }
  {
    const std::lock_guard lock(mutex_);
    state_ = DeviceState::kConnected;
    fault_.clear();
  }
  start_polling();
}

template <std::size_t N>
void DriveGroup<N>::check_bounds(const Positions& target) const {
  for (std::size_t i = 0; i < N; ++i) {
    const AxisBounds& bounds = options_[i].bounds;
    const double steps = options_[i].scale.to_device(target[i]);
    const bool is_within = target[i] >= bounds.min - kBoundsTolerance && target[i] <= bounds.max + kBoundsTolerance;
    if (is_within && std::abs(steps) < 2147483647.) continue;
    char text[160];
    std::snprintf(text, sizeof text, "the %s refuses to move axis %zu to %.6g: its limits are %.6g to %.6g (rad or m)",
                  name_.c_str(), i + 1, target[i], bounds.min, bounds.max);
    throw DriverError(text);
  }
}

template <std::size_t N>
AxisDrive::Move DriveGroup<N>::order(std::size_t axis, double target) const {
  const ModbusAxisOptions& options = options_[axis];
  const auto steps = [&](double units) {
    return static_cast<std::uint32_t>(std::clamp(units * options.scale.steps_per_unit, 1., 4e9));
  };
  return {static_cast<std::int32_t>(std::lround(options.scale.to_device(target))), steps(options.bounds.speed_max),
          steps(options.bounds.acceleration_max)};
}

/// A trapezoidal profile at the cell file's limits; only a hint for whoever waits.
template <std::size_t N>
double DriveGroup<N>::travel_s(const Positions& target) const {
  double longest_s = 0;
  for (std::size_t i = 0; i < N; ++i) {
    const double way = std::abs(target[i] - positions_[i]);
    const double speed = options_[i].bounds.speed_max, rate = options_[i].bounds.acceleration_max;
    if (!(speed > 0) || !(rate > 0)) continue;
    longest_s =
        std::max(longest_s, way * rate < speed * speed ? 2 * std::sqrt(way / rate) : way / speed + speed / rate);
  }
  return longest_s;
}

template <std::size_t N>
void DriveGroup<N>::move_to(const Positions& target, double settle_s) {
  if (!(settle_s >= 0) || settle_s > kMaxSettleS)
    throw DriverError("the " + name_ + " refuses a settle time that is no time");
  check_bounds(target);
  const std::unique_lock command(command_mutex_, deadline_in(1));
  if (!command) throw DriverError("the " + name_ + " is busy");
  std::array<AxisDrive::Move, N> moves;
  std::array<bool, N> is_new{}, is_ahead{};
  {
    const std::lock_guard lock(mutex_);
    if (state_ != DeviceState::kReady) refuse("moved");
    if (is_target_current_ && !is_in_position_) throw DriverError("the " + name_ + " refuses to move: it is moving");
    for (std::size_t i = 0; i < N; ++i) {
      moves[i] = order(i, target[i]);
      is_new[i] = !is_in_position_ || moves[i].target != target_[i].target;
      is_ahead[i] = ahead_ && ahead_->is_written[i] && ahead_->moves[i] == moves[i];
    }
    // An order to stay, which only settles anew, leaves what is ahead for the move that will follow.
    if (std::find(is_new.begin(), is_new.end(), true) != is_new.end()) ahead_.reset();
    arrival_s_ = clock_.now_s() + travel_s(target) + settle_s;
    target_ = moves;
    settle_s_ = settle_s;
    is_target_current_ = true;
    is_accepted_ = is_in_position_ = false;
    rest_s_ = -1;
  }
  const auto give_up = [this] { return stops_waiting_.load() > 0; };
  try {
    for (std::size_t i = 0; i < N; ++i) {
      if (give_up()) throw DriverError("the " + name_ + " was stopped");
      if (is_new[i]) drives_[i]->start(moves[i], is_ahead[i], give_up);
    }
  } catch (const LinkError& error) {
    set_fault(error.what());
    throw;
  } catch (const DriverError&) {
    const std::lock_guard lock(mutex_);
    is_target_current_ = false;
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
  check_bounds(target);
  const std::lock_guard lock(mutex_);
  if (state_ != DeviceState::kReady || !is_in_position_) return;
  Ahead ahead;
  for (std::size_t i = 0; i < N; ++i) ahead.moves[i] = order(i, target[i]);
  if (ahead_ && ahead_->moves == ahead.moves) return;
  ahead_ = ahead;
  is_poll_due_ = true;
  poll_asked_.notify_all();
}

/// Polling thread. A drive that does not take it is no fault here: the move itself is then sent whole, and meets the
/// same drive.
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
  Status status;
  const bool is_under_way = state_ == DeviceState::kReady && is_target_current_ && !is_in_position_;
  status.state = is_under_way ? DeviceState::kMoving : state_;
  status.positions = positions_;
  status.in_position = state_ == DeviceState::kReady && is_in_position_;
  status.fault = fault_;
  status.in_position_since_s = status.in_position ? in_position_since_s_ : 0;
  status.read_s = read_s_;
  return status;
}

template <std::size_t N>
double DriveGroup<N>::expected_arrival_s() {
  const std::lock_guard lock(mutex_);
  const double now_s = clock_.now_s();
  return is_target_current_ && !is_in_position_ ? std::max(now_s, arrival_s_) : now_s;
}

template <std::size_t N>
void DriveGroup<N>::stop() noexcept {
  {
    const std::lock_guard lock(mutex_);
    if (state_ == DeviceState::kDisconnected || state_ == DeviceState::kConnected) return;
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
  if (!failure.empty()) set_fault("the " + name_ + " does not confirm a stop: " + failure);
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
      throw DriverError("axis " + std::to_string(i + 1) + " of the " + name_ + " reports " +
                        drives_[i]->alarm_text(readings[i].alarm));
}

/// Under the lock.
template <std::size_t N>
bool DriveGroup<N>::is_at_target(const Readings& readings) const {
  for (std::size_t i = 0; i < N; ++i) {
    const AxisDrive::Reading& reading = readings[i];
    const double target = target_[i].target;
    const double window = std::max(1., options_[i].window * options_[i].scale.steps_per_unit);
    if (!reading.has_arrived || !reading.is_enabled || std::abs(reading.position - target) > window) return false;
    if (reading.setpoint && std::abs(*reading.setpoint - target) > 0.5) return false;
  }
  return true;
}

/// Polling thread.
template <std::size_t N>
void DriveGroup<N>::take(const Readings& readings, double begun_s) {
  for (std::size_t i = 0; i < N; ++i)
    if (readings[i].has_fault) {
      set_fault("axis " + std::to_string(i + 1) + " of the " + name_ + " reports " +
                drives_[i]->alarm_text(readings[i].alarm));
      return;
    }
  bool is_news = false;
  {
    const std::lock_guard lock(mutex_);
    for (std::size_t i = 0; i < N; ++i) positions_[i] = options_[i].scale.to_si(readings[i].position);
    read_s_ = begun_s;
    const bool was_in_position = is_in_position_;
    if (!is_target_current_ || !is_accepted_ || begun_s < accepted_s_ || !is_at_target(readings)) {
      rest_s_ = -1;
      is_in_position_ = false;
    } else {
      // Rest is counted from the end of the first reading that shows it to the beginning of the last.
      const double now_s = clock_.now_s();
      is_in_position_ = settle_s_ <= 0 || (rest_s_ >= 0 && begun_s - rest_s_ >= settle_s_);
      if (rest_s_ < 0) rest_s_ = now_s;
      if (is_in_position_ && !was_in_position) in_position_since_s_ = now_s;
    }
    is_news = is_in_position_ != was_in_position;
  }
  if (is_news) clock_.wake();
}

/// Wall seconds until the next reading. Under the lock.
template <std::size_t N>
double DriveGroup<N>::poll_interval_s() const {
  if (state_ != DeviceState::kReady) return kIdlePollS;
  const double ready_s = std::max(clock_.wall_s(kReadyPollS), kReadyPollMinS);
  if (!is_target_current_ || is_in_position_) return ready_s;
  const double due_s = rest_s_ >= 0 ? rest_s_ + settle_s_ : arrival_s_ - settle_s_;
  return std::clamp(clock_.wall_s(due_s - clock_.now_s()), kArrivalPollS, ready_s);
}

template <std::size_t N>
void DriveGroup<N>::poll() {
  std::unique_lock lock(mutex_);
  while (is_polling_) {
    poll_asked_.wait_until(lock, deadline_in(poll_interval_s()), [this] { return !is_polling_ || is_poll_due_; });
    if (!is_polling_) return;
    is_poll_due_ = false;
    if (state_ == DeviceState::kFault) continue;
    const bool has_ahead = ahead_.has_value();
    lock.unlock();
    try {
      if (has_ahead) write_ahead();
      const double begun_s = clock_.now_s();
      take(read_all(), begun_s);
    } catch (const DriverError& error) {
      set_fault("the " + name_ + " can't be read: " + error.what());
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
