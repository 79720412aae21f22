#include "drivers/guard/guard_server.h"

#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>

#include "drivers/driver_error.h"
#include "drivers/link/link.h"
#include "drivers/number_text.h"

namespace hilbrush {
namespace {

using Steady = std::chrono::steady_clock;
constexpr double kStatusS = 0.05;  ///< wall: the guard's own sign of life
constexpr double kDarkenRetryS = 0.1;
constexpr int kDarkenAttempts = 50;  ///< on the way out
constexpr double kLightMaxS = 120;   ///< longer than any pulse

}  // namespace

GuardServer::GuardServer(LaserHead& head, Gate* gate, int channel, int signals, const Options& options,
                         Clock& clock)
    : head_(head), gate_(gate), channel_(channel), signals_(signals), options_(options), clock_(clock) {
  head_.set_listener([this] {
    {
      const std::lock_guard lock(mutex_);
      ++requested_readings_;
    }
    send_status();
  });
  // If the gate cannot be closed, only disarming the head turns the light off.
  if (gate_ != nullptr)
    gate_->set_listener([this](bool is_dark) {
      if (!is_dark) head_.disarm();
      send_status();
    });
  worker_ = std::thread([this] { work(); });
}

GuardServer::~GuardServer() {
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
    requests_.clear();
  }
  ordered_.notify_all();
  worker_.join();
  head_.set_listener({});
  if (gate_ != nullptr) gate_->set_listener({});
}

/// A user that takes no messages is not waited for: the channel's buffer is bounded, and its silence ends in
/// a missed heartbeat anyway.
void GuardServer::send(const std::string& message) {
  [[maybe_unused]] const ssize_t sent =
      ::send(channel_, message.data(), message.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
}

void GuardServer::send_status() {
  guard::StatusMessage message;
  message.status = head_.status();
  const double age_s = clock_.wall_s(clock_.now_s() - message.status.read_s);
  const auto read =
      Steady::now() - std::chrono::duration_cast<Steady::duration>(std::chrono::duration<double>(age_s));
  message.read_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(read.time_since_epoch()).count();
  message.is_gate_on = gate_ != nullptr && gate_->is_on();
  {
    const std::lock_guard lock(mutex_);
    message.requested_readings = requested_readings_;
    if (!trip_.empty()) {
      message.status.state = DeviceState::kFault;
      message.status.fault = trip_;
    }
  }
  send(guard::encode(message));
}

bool GuardServer::disarm() {
  const bool is_shut = gate_ == nullptr || gate_->off();
  const bool is_disarmed = head_.status().state == DeviceState::kDisconnected || head_.disarm();
  is_disarmed_ = is_shut && is_disarmed;
  return is_disarmed_;
}

void GuardServer::trip(const std::string& sentence) {
  {
    const std::lock_guard lock(mutex_);
    trip_ = sentence;
    requests_.clear();
  }
  disarm();
  send_status();
}

GuardServer::End GuardServer::run() {
  const double allowance_s = options_.heartbeat_s * options_.heartbeats_missed;
  Deadline beat_deadline = Steady::now();
  Deadline status_deadline = Steady::now();
  std::optional<End> end;
  while (!end) {
    std::array<pollfd, 2> polled{pollfd{channel_, POLLIN, 0}, pollfd{signals_, POLLIN, 0}};
    Deadline next = has_beaten_ ? std::min(beat_deadline, status_deadline) : status_deadline;
    if (dark_deadline_) next = std::min(next, *dark_deadline_);
    const int ready = ::poll(polled.data(), polled.size(), milliseconds_until(next));
    if (ready > 0 && polled[1].revents != 0) end = End::kSignal;
    if (ready > 0 && polled[0].revents != 0 && !end) {
      const bool had_beaten = has_beaten_;
      has_beaten_ = false;
      end = read_channel();
      if (has_beaten_) beat_deadline = deadline_in(allowance_s);
      has_beaten_ = has_beaten_ || had_beaten;
    }
    if (end) break;
    if (has_beaten_ && Steady::now() >= beat_deadline) {
      has_beaten_ = false;  // watched again after the next heartbeat
      trip("the laser's guard heard nothing of its user for " +
           std::to_string(std::lround(allowance_s * 1e3)) + " ms and turned the laser off");
    }
    if (dark_deadline_ && Steady::now() >= *dark_deadline_) {
      dark_deadline_.reset();
      trip("the laser's guard received no report in time that a pulse was over and turned the laser off");
    }
    if (Steady::now() >= status_deadline) {
      status_deadline = deadline_in(kStatusS);
      if (!is_disarmed_ && !trip_.empty()) disarm();
      send_status();
    }
  }
  for (int attempt = 0; attempt < kDarkenAttempts && !disarm(); ++attempt)
    std::this_thread::sleep_for(std::chrono::duration<double>(kDarkenRetryS));
  return *end;
}

/// Everything that has arrived, so that a heartbeat behind a slow request is not taken for a missing one.
std::optional<GuardServer::End> GuardServer::read_channel() {
  std::array<char, guard::kMessageMax + 1> bytes{};
  for (;;) {
    const ssize_t got = ::recv(channel_, bytes.data(), bytes.size(), MSG_DONTWAIT);
    if (got < 0 && (errno == EAGAIN || errno == EINTR)) return std::nullopt;
    if (got <= 0) return End::kChannelEnded;
    const std::string_view message(bytes.data(), static_cast<std::size_t>(got));
    if (message == guard::kBeat) {
      has_beaten_ = true;
      continue;
    }
    const auto request = guard::decode_request(message);
    if (!request) return End::kGarbage;
    obey_at_once(*request);
  }
}

void GuardServer::obey_at_once(const guard::Request& request) {
  if (request.verb == guard::Verb::kRequestStatus) return head_.request_status();
  if (request.verb == guard::Verb::kDark) return dark_deadline_.reset();
  if (request.verb == guard::Verb::kLight) {
    dark_deadline_ = deadline_in(std::clamp(request.value, 0., kLightMaxS));
    return;
  }
  if (request.verb == guard::Verb::kDisarm || request.verb == guard::Verb::kGateOff) {
    {
      const std::lock_guard lock(mutex_);
      std::erase_if(requests_, [](const guard::Request& waiting) {
        return waiting.verb == guard::Verb::kPulse || waiting.verb == guard::Verb::kArm;
      });
    }
    const bool is_gate = request.verb == guard::Verb::kGateOff;
    const bool is_off = is_gate ? gate_ == nullptr || gate_->off() : disarm();
    send(guard::encode(guard::Reply{request.number, is_off, is_off ? "" : "the laser does not confirm"}));
    return;
  }
  {
    const std::lock_guard lock(mutex_);
    if (requests_.size() < kQueueMax) {
      requests_.push_back(request);
      ordered_.notify_all();
      return;
    }
  }
  send(guard::encode(guard::Reply{request.number, false, "the laser's guard has too many requests waiting"}));
}

void GuardServer::work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    ordered_.wait(lock, [this] { return is_ending_ || !requests_.empty(); });
    if (is_ending_) return;
    const guard::Request request = requests_.front();
    requests_.pop_front();
    lock.unlock();
    guard::Reply reply{request.number, true, {}};
    try {
      reply.text = carry_out(request);
    } catch (const std::exception& error) {
      reply.is_ok = false;
      reply.text = error.what();
    }
    send_status();
    send(guard::encode(reply));
    lock.lock();
  }
}

std::string GuardServer::carry_out(const guard::Request& request) {
  const auto check_not_tripped = [this] {
    const std::lock_guard lock(mutex_);
    if (!trip_.empty()) throw DriverError(trip_);
  };
  switch (request.verb) {
    case guard::Verb::kConnect:
      head_.connect();
      return {};
    case guard::Verb::kIdentify: {
      std::string text;
      for (const std::string& line : head_.identify()) text += (text.empty() ? "" : "\n") + line;
      return text;
    }
    case guard::Verb::kPowers: {
      const LaserHead::Powers powers = head_.powers();
      return exact_text(powers.min_w) + ' ' + exact_text(powers.max_w);
    }
    case guard::Verb::kArm:
      check_not_tripped();
      is_disarmed_ = false;
      head_.arm();
      check_not_tripped();
      return {};
    case guard::Verb::kPower:
      head_.set_power(request.value);
      return {};
    case guard::Verb::kClear: {
      if (!disarm()) throw DriverError("the laser does not confirm that it is off");
      if (head_.status().state == DeviceState::kFault) head_.clear_fault();
      const std::lock_guard lock(mutex_);
      trip_.clear();
      return {};
    }
    case guard::Verb::kPulse:
      check_not_tripped();
      if (gate_ == nullptr) throw DriverError("this laser is not gated by its own link");
      if (head_.status().state != DeviceState::kReady) throw DriverError("the laser is not armed");
      gate_->pulse(request.value);
      return {};
    case guard::Verb::kDisarm:
    case guard::Verb::kRequestStatus:
    case guard::Verb::kGateOff:
    case guard::Verb::kLight:
    case guard::Verb::kDark:
      break;  // obeyed at once
  }
  return {};
}

}  // namespace hilbrush
