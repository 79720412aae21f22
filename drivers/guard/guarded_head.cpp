#include "drivers/guard/guarded_head.h"

#include <poll.h>
#include <pthread.h>
#include <sched.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "drivers/driver_error.h"
#include "drivers/link/link.h"

namespace hilbrush {
namespace {

using Steady = std::chrono::steady_clock;
constexpr double kReplyS = 3;       ///< wall: several exchanges of the guard's with the laser
constexpr double kTwoTriesS = 0.5;  ///< wall: a guard's two tries to disarm

}  // namespace

/// The laser's serial gate, pulsed by the guard.
class GuardedHead::RemoteGate final : public Gate {
 public:
  explicit RemoteGate(GuardedHead& head) : head_(head) {}

  double resolution_s() const override { return 0; }
  void pulse(double pulse_s) override {
    {
      const std::lock_guard lock(head_.mutex_);
      is_known_off_ = false;
    }
    head_.request(guard::Verb::kPulse, pulse_s, kReplyS);
  }
  bool off() noexcept override {
    try {
      {
        const std::lock_guard lock(head_.mutex_);
        if (is_known_off_ || head_.status_.state == DeviceState::kDisconnected) return true;
      }
      head_.request(guard::Verb::kGateOff, 0, kTwoTriesS);
      const std::lock_guard lock(head_.mutex_);
      is_known_off_ = true;
      return true;
    } catch (const std::exception&) {
      return false;
    }
  }
  bool is_on() override {
    const std::lock_guard lock(head_.mutex_);
    return head_.is_gate_on_;
  }
  void set_listener(Listener listener) override { listener_ = std::move(listener); }
  void on_gate_closed() {
    if (listener_) listener_(true);
  }

 private:
  GuardedHead& head_;
  Listener listener_;
  bool is_known_off_ = false;  ///< under the head's mutex
};

GuardedHead::GuardedHead(Launch launch, const Options& options, Clock& clock)
    : launch_(std::move(launch)),
      options_(options),
      clock_(clock),
      gate_(std::make_unique<RemoteGate>(*this)) {}

GuardedHead::~GuardedHead() {
  close_channel();
}

void GuardedHead::open_channel() {
  close_channel();
  const int channel = launch_();
  {
    const std::lock_guard lock(mutex_);
    channel_ = channel;
    is_ending_ = false;
    lost_.clear();
    replies_.clear();
    status_ = {};
    is_gate_on_ = false;
  }
  thread_ = std::thread([this] { run(); });
}

Gate& GuardedHead::gate() {
  return *gate_;
}

/// Closing the channel tells the guard to disarm and end.
void GuardedHead::close_channel() noexcept {
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
    if (channel_ >= 0) ::shutdown(channel_, SHUT_RDWR);
  }
  if (thread_.joinable()) thread_.join();
  const std::lock_guard lock(mutex_);
  if (channel_ >= 0) ::close(channel_);
  channel_ = -1;
}

/// Under the lock.
void GuardedHead::send(const std::string& message) {
  if (channel_ < 0) throw LinkError("the laser's guard is not running");
  if (::send(channel_, message.data(), message.size(), MSG_NOSIGNAL | MSG_DONTWAIT) < 0)
    throw LinkError(std::string("the laser's guard cannot be reached: ") + std::strerror(errno));
}

void GuardedHead::lose(const std::string& sentence) {
  {
    const std::lock_guard lock(mutex_);
    if (is_ending_ || !lost_.empty()) return;
    lost_ = sentence;
    if (status_.state != DeviceState::kDisconnected) {
      status_.state = DeviceState::kFault;
      status_.fault = sentence;
    }
  }
  replied_.notify_all();
  if (on_change_) on_change_();
  clock_.wake();
}

void GuardedHead::run() {
  // Where the system allows it heartbeats come before all ordinary threads: load must not turn the laser off.
  constexpr int kPriority = 10;
  const sched_param parameters{kPriority};
  ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &parameters);
  try {
    Deadline beat = Steady::now();
    Deadline silence = deadline_in(options_.silence_s);
    for (;;) {
      {
        const std::lock_guard lock(mutex_);
        if (is_ending_) return;
        if (Steady::now() >= beat) send(std::string(guard::kBeat));
      }
      if (Steady::now() >= beat) beat = deadline_in(options_.heartbeat_s);
      pollfd polled{channel_, POLLIN, 0};
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(beat - Steady::now()).count();
      ::poll(&polled, 1, static_cast<int>(std::max<long long>(left, 0)));
      if (polled.revents != 0 && read_messages()) silence = deadline_in(options_.silence_s);
      if (Steady::now() >= silence) throw LinkError("the laser's guard is silent");
    }
  } catch (const DriverError& error) {
    lose(error.what());
  }
}

/// True if there were any. @throws LinkError when the guard has ended.
bool GuardedHead::read_messages() {
  std::array<char, guard::kMessageMax + 1> bytes{};
  bool has_read = false;
  for (;;) {
    const ssize_t got = ::recv(channel_, bytes.data(), bytes.size(), MSG_DONTWAIT);
    if (got < 0 && (errno == EAGAIN || errno == EINTR)) return has_read;
    if (got <= 0) throw LinkError("the laser's guard has ended");
    has_read = true;
    const std::string_view message(bytes.data(), static_cast<std::size_t>(got));
    if (const auto status = guard::decode_status(message)) {
      take(*status);
      continue;
    }
    auto reply = guard::decode_reply(message);
    if (!reply) throw LinkError("invalid message from the laser guard");
    const std::lock_guard lock(mutex_);
    const auto waiting = replies_.find(reply->number);
    if (waiting != replies_.end()) waiting->second = std::make_unique<guard::Reply>(std::move(*reply));
    replied_.notify_all();
  }
}

void GuardedHead::take(const guard::StatusMessage& message) {
  bool is_news = false;
  bool is_dark = false;
  {
    const std::lock_guard lock(mutex_);
    const auto age = Steady::now().time_since_epoch() - std::chrono::nanoseconds(message.read_ns);
    const double scale = clock_.wall_s(1);
    Status status = message.status;
    status.read_s = clock_.now_s() - std::chrono::duration<double>(age).count() / (scale > 0 ? scale : 1);
    is_dark = is_gate_on_ && !message.is_gate_on;
    is_news = message.requested_readings != requested_readings_ || status.state != status_.state || is_dark ||
              status.interlock_closed != status_.interlock_closed;
    requested_readings_ = message.requested_readings;
    is_gate_on_ = message.is_gate_on;
    status_ = std::move(status);
  }
  if (is_dark) gate_->on_gate_closed();
  if (is_news && on_change_) on_change_();
  if (is_news) clock_.wake();
}

std::string GuardedHead::request(guard::Verb verb, double value, double wall_s) {
  std::unique_lock lock(mutex_);
  if (!lost_.empty()) throw LinkError(lost_);
  const std::uint32_t number = next_number_++;
  replies_[number] = nullptr;
  try {
    send(guard::encode(guard::Request{number, verb, value}));
  } catch (const LinkError&) {
    replies_.erase(number);
    throw;
  }
  replied_.wait_until(lock, deadline_in(wall_s),
                      [&] { return replies_[number] != nullptr || !lost_.empty(); });
  const std::unique_ptr<guard::Reply> reply = std::move(replies_[number]);
  replies_.erase(number);
  if (!reply) throw LinkError(lost_.empty() ? "the laser's guard does not answer" : lost_);
  if (!reply->is_ok) throw DriverError(reply->text);
  return reply->text;
}

void GuardedHead::connect() {
  if (status().state != DeviceState::kDisconnected) throw DriverError("the laser is connected already");
  open_channel();
  try {
    request(guard::Verb::kConnect, 0, kReplyS);
    const std::string powers = request(guard::Verb::kPowers, 0, kReplyS);
    if (std::sscanf(powers.c_str(), "%lf %lf", &powers_.min_w, &powers_.max_w) != 2)
      throw DriverError("invalid message from the laser guard");
    power_w_ = -1;
  } catch (const DriverError&) {
    close_channel();
    const std::lock_guard lock(mutex_);
    status_ = {};
    throw;
  }
}

std::vector<std::string> GuardedHead::identify() {
  std::vector<std::string> lines;
  const std::string text = request(guard::Verb::kIdentify, 0, kReplyS * 2);
  for (std::size_t start = 0; start < text.size();) {
    const std::size_t end = std::min(text.find('\n', start), text.size());
    lines.push_back(text.substr(start, end - start));
    start = end + 1;
  }
  lines.push_back("guarded by a process of its own");
  return lines;
}

void GuardedHead::arm() {
  power_w_ = -1;
  request(guard::Verb::kArm, 0, clock_.wall_s(options_.arm_timeout_s) + kReplyS);
}

bool GuardedHead::disarm() noexcept {
  try {
    request(guard::Verb::kDisarm, 0, kTwoTriesS);
    return true;
  } catch (const std::exception&) {
    return false;
  }
}

void GuardedHead::set_power(double power_w) {
  if (power_w == power_w_) return;
  power_w_ = -1;
  request(guard::Verb::kPower, power_w, kReplyS);
  power_w_ = power_w;
}

LaserHead::Status GuardedHead::status() {
  const std::lock_guard lock(mutex_);
  return status_;
}

/// What gets no reply.
void GuardedHead::post(guard::Verb verb, double value) {
  const std::lock_guard lock(mutex_);
  if (!lost_.empty()) throw LinkError(lost_);
  send(guard::encode(guard::Request{next_number_++, verb, value}));
}

void GuardedHead::request_status() {
  try {
    post(guard::Verb::kRequestStatus, 0);
  } catch (const DriverError&) {
    // The thread that listens to the guard notices the same.
  }
}

void GuardedHead::begin_pulse(double pulse_s) {
  post(guard::Verb::kLight, clock_.wall_s(pulse_s) + options_.pulse_grace_s);
}

void GuardedHead::end_pulse() noexcept {
  try {
    post(guard::Verb::kDark, 0);
  } catch (const std::exception&) {
    // A guard that hears of no end turns emission off, which is as safe.
  }
}

/// A guard that was lost is started again.
void GuardedHead::clear_fault() {
  bool is_lost = false;
  {
    const std::lock_guard lock(mutex_);
    if (status_.state != DeviceState::kFault) throw DriverError("the laser reports no fault");
    is_lost = !lost_.empty();
  }
  power_w_ = -1;
  if (!is_lost) {
    request(guard::Verb::kClear, 0, kReplyS * 2);
    return;
  }
  const std::string sentence = status().fault;
  try {
    open_channel();
    request(guard::Verb::kConnect, 0, kReplyS);
  } catch (const DriverError&) {
    const std::lock_guard lock(mutex_);
    status_.state = DeviceState::kFault;
    status_.fault = sentence;
    if (lost_.empty()) lost_ = sentence;
    throw;
  }
}

}  // namespace hilbrush
