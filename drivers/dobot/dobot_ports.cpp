#include "drivers/dobot/dobot_ports.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>

namespace hilbrush {
namespace {

using Steady = std::chrono::steady_clock;
constexpr double kConnectS = 2;
constexpr std::size_t kOwedMax = 64;

std::string refused(const std::string& command, const dobot::Reply& reply) {
  return "the robot: " + command + " " + dobot::error_text(reply.error);
}

}  // namespace

DobotPorts::DobotPorts(const DobotOptions& options, double feedback_silence_s)
    : options_(options), feedback_silence_s_(feedback_silence_s) {
  wake_fd_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
}

DobotPorts::~DobotPorts() {
  close();
  ::close(wake_fd_);
}

void DobotPorts::open(Listener listener) {
  close();
  listener_ = std::move(listener);
  motion_ = open_tcp_link(options_.host, options_.motion_port, deadline_in(kConnectS));
  feedback_ = open_tcp_link(options_.host, options_.feedback_port, deadline_in(kConnectS));
  frames_ = {};
  replies_.clear();
  feedback_deadline_ = deadline_in(feedback_silence_s_ + kConnectS);
  {
    const std::lock_guard lock(mutex_);
    owed_.clear();
    waited_for_ = 0;
    refusal_.clear();
    is_lost_ = false;
    lost_sentence_.clear();
  }
  std::uint64_t ignored = 0;
  [[maybe_unused]] const ssize_t got = ::read(wake_fd_, &ignored, sizeof ignored);
  reader_ = std::thread([this] { run(); });
}

void DobotPorts::close() noexcept {
  if (reader_.joinable()) {
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t written = ::write(wake_fd_, &one, sizeof one);
    reader_.join();
  }
  {
    const std::lock_guard lock(mutex_);
    is_lost_ = true;
    if (lost_sentence_.empty()) lost_sentence_ = "the robot is not connected";
  }
  const std::lock_guard lock(dashboard_mutex_);
  dashboard_.reset();
  motion_.reset();
  feedback_.reset();
}

std::vector<dobot::Reply> DobotPorts::exchange(const std::vector<std::string>& commands, Deadline deadline) {
  if (!dashboard_) dashboard_ = open_tcp_link(options_.host, options_.dashboard_port, deadline);
  std::string all;
  for (const std::string& command : commands) all += command;
  dashboard_->write(all, deadline);
  const auto fail_with = [&](const char* what) {
    throw LinkError("the robot " + std::string(what) + " to " + all + dashboard_->messages().text());
  };
  std::vector<dobot::Reply> replies;
  dobot::ReplyStream stream;
  while (replies.size() < commands.size()) {
    std::array<char, 1024> bytes{};
    const std::size_t got = dashboard_->read(bytes.data(), bytes.size(), deadline);
    if (got == 0) fail_with("gives no answer");
    dashboard_->messages().received({bytes.data(), got});
    stream.push({bytes.data(), got});
    while (const auto text = stream.next()) {
      auto reply = dobot::decode_reply(*text);
      if (!reply || replies.size() == commands.size() ||
          !dobot::is_echo(reply->command, commands[replies.size()]))
        fail_with("gives no proper answer");
      replies.push_back(std::move(*reply));
    }
    if (stream.is_overlong()) fail_with("gives an endless answer");
  }
  if (!stream.is_empty()) fail_with("gives more than an answer");
  return replies;
}

std::vector<dobot::Reply> DobotPorts::dashboard_all(const std::vector<std::string>& commands, double wall_s) {
  const Deadline deadline = deadline_in(wall_s);
  const std::unique_lock lock(dashboard_mutex_, deadline);
  if (!lock) throw LinkError("the robot's dashboard is busy with a command that gets no answer");
  try {
    return exchange(commands, deadline);
  } catch (const LinkError&) {
    dashboard_.reset();
    throw;
  }
}

std::string DobotPorts::dashboard(const std::string& command, double wall_s) {
  const dobot::Reply reply = dashboard_all({command}, wall_s).front();
  if (reply.error != 0) throw DriverError(refused(command, reply));
  return reply.values;
}

void DobotPorts::motion(const std::string* commands, std::size_t count, std::size_t later_count,
                        const OnReply& on_later) {
  std::string bytes;
  {
    const std::lock_guard lock(mutex_);
    if (is_lost_) throw LinkError(lost_sentence_);
    if (owed_.size() + count > kOwedMax) throw DriverError("the robot has left too many commands unanswered");
    for (std::size_t i = 0; i < count; ++i) {
      owed_.push_back({commands[i], i + 1 == count ? on_later : OnReply{}});
      if (i < count - later_count)
        owed_.back().on_reply = [this, command = commands[i]](const dobot::Reply* reply) {
          const std::lock_guard reply_lock(mutex_);
          if (waited_for_ == 0) return;  // motion() no longer waits
          --waited_for_;
          if (reply == nullptr)
            refusal_ = "the robot: " + command + " was overtaken by a stop";
          else if (reply->error != 0)
            refusal_ = refused(command, *reply);
        };
      bytes += commands[i];
    }
    waited_for_ = count - later_count;
    refusal_.clear();
  }
  motion_->write(bytes, deadline_in(kReplyS));
  std::unique_lock lock(mutex_);
  const bool is_answered =
      answered_.wait_until(lock, deadline_in(kReplyS), [this] { return waited_for_ == 0 || is_lost_; });
  if (is_lost_) throw LinkError(lost_sentence_);
  if (!is_answered) {
    waited_for_ = 0;
    const std::string sentence = "the robot does not answer " + bytes + motion_->messages().text();
    lock.unlock();
    fail(sentence);  // a later answer would be taken for that to another command
    throw LinkError(sentence);
  }
  if (!refusal_.empty()) throw DriverError(refusal_ + motion_->messages().text());
}

void DobotPorts::forget_owed() {
  std::deque<OnReply> callbacks;
  {
    const std::lock_guard lock(mutex_);
    for (Owed& owed : owed_) {
      owed.is_forgotten = true;
      if (owed.on_reply) callbacks.push_back(std::move(owed.on_reply));
      owed.on_reply = {};
    }
  }
  for (const OnReply& callback : callbacks) callback(nullptr);
  answered_.notify_all();
}

/// Reader's thread, or the one that gave up waiting. Reports it once.
void DobotPorts::fail(const std::string& sentence) {
  {
    const std::lock_guard lock(mutex_);
    if (is_lost_) return;
    is_lost_ = true;
    lost_sentence_ = sentence;
  }
  forget_owed();
  listener_.on_lost(sentence);
}

void DobotPorts::run() {
  try {
    for (;;) {
      std::array<pollfd, 3> polled{pollfd{wake_fd_, POLLIN, 0}, pollfd{motion_->descriptor(), POLLIN, 0},
                                   pollfd{feedback_->descriptor(), POLLIN, 0}};
      const auto left =
          std::chrono::ceil<std::chrono::milliseconds>(feedback_deadline_ - Steady::now()).count();
      const int ready = ::poll(polled.data(), polled.size(), static_cast<int>(std::max<long long>(left, 0)));
      if (ready < 0 && errno != EINTR) throw LinkError("the robot's ports cannot be polled");
      if (polled[0].revents != 0) return;
      // All frames that came before an answer are older than it: a reader that was kept waiting must not take
      // one of them for what followed.
      if (ready > 0 && polled[2].revents != 0) read_feedback();
      if (ready > 0 && polled[1].revents != 0) read_motion();
      if (Steady::now() >= feedback_deadline_)
        throw LinkError("the robot's feedback has stopped (" + feedback_->name() + ")");
    }
  } catch (const DriverError& error) {
    fail(error.what());
  }
}

/// What has come, within a bound: seconds of frames.
void DobotPorts::read_feedback() {
  constexpr int kReadsMax = 100;
  std::array<char, 8 * dobot::kFrameBytes> bytes{};
  std::size_t got = bytes.size();
  for (int i = 0; i < kReadsMax && got == bytes.size(); ++i) {
    got = feedback_->read(bytes.data(), bytes.size(), Steady::now());
    frames_.push({bytes.data(), got});
    while (const auto frame = frames_.next()) {
      feedback_deadline_ = deadline_in(feedback_silence_s_);
      listener_.on_frame(*frame);
    }
  }
}

void DobotPorts::read_motion() {
  std::array<char, 1024> bytes{};
  const std::size_t got = motion_->read(bytes.data(), bytes.size(), Steady::now());
  if (got == 0) return;
  motion_->messages().received({bytes.data(), got});
  replies_.push({bytes.data(), got});
  while (const auto text = replies_.next()) settle_reply(*text);
  if (replies_.is_overlong())
    throw LinkError("the robot gives an endless answer" + motion_->messages().text());
}

/// Answers come in the order of the commands. Those to commands that a stop has swept away may be missing.
void DobotPorts::settle_reply(const std::string& text) {
  const auto reply = dobot::decode_reply(text);
  if (!reply) throw LinkError("the robot gives no proper answer" + motion_->messages().text());
  OnReply callback;
  {
    const std::lock_guard lock(mutex_);
    while (!owed_.empty() && owed_.front().is_forgotten &&
           !dobot::is_echo(reply->command, owed_.front().command))
      owed_.pop_front();
    if (owed_.empty() || !dobot::is_echo(reply->command, owed_.front().command))
      throw LinkError("the robot sent an answer to no command" + motion_->messages().text());
    callback = std::move(owed_.front().on_reply);
    owed_.pop_front();
  }
  if (callback) callback(&*reply);
  answered_.notify_all();
}

}  // namespace hilbrush
