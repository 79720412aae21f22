#pragma once
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "drivers/deadline_mutex.h"
#include "drivers/device_options.h"
#include "drivers/dobot/dobot_codec.h"
#include "drivers/link/link.h"

namespace hilbrush {

/// The three connections of one Dobot controller. The dashboard answers each command at once; motion commands
/// are queued, each is answered when accepted (Sync when all before it is done); the feedback port sends a
/// frame every 8 ms. One reader thread takes whatever motion and feedback ports say.
class DobotPorts {
 public:
  static constexpr double kReplyS = 1;     ///< wall: an ordinary answer
  static constexpr double kUrgentS = 0.1;  ///< wall: an answer that safety waits for

  /// From the reader's thread, with no lock held.
  struct Listener {
    std::function<void(const dobot::Frame&)> on_frame;
    std::function<void(const std::string& sentence)> on_lost;  ///< once: motion or feedback are gone
  };

  DobotPorts(const DobotOptions& options, double feedback_silence_s);
  ~DobotPorts();

  /// Connects motion and feedback and starts the reader; dashboard() connects by itself. @throws LinkError
  void open(Listener listener);
  /// Ends the reader and closes all. Not from the reader's thread.
  void close() noexcept;

  /// One command on the dashboard; returns the reply's values. From any thread, one exchange at a time;
  /// connects if need be. A reply that does not come in time or does not belong to the command closes the
  /// connection, so that a late one cannot be taken for another's. @throws LinkError; DriverError if the
  /// controller refuses.
  std::string dashboard(const std::string& command, double wall_s = kReplyS);

  /// Several commands in one write, so that nothing comes between them; their replies in the same order,
  /// refusals included. @throws LinkError
  std::vector<dobot::Reply> dashboard_all(const std::vector<std::string>& commands, double wall_s);

  /// Called by the reader's thread with the reply, or with nothing if it will never come.
  using OnReply = std::function<void(const dobot::Reply*)>;
  /// Queues commands in one write and waits until all but `later_count` of them are answered; `on_later` gets
  /// the last one's answer. One thread. @throws LinkError; DriverError if one is refused.
  void motion(const std::string* commands, std::size_t count, std::size_t later_count = 0,
              const OnReply& on_later = {});
  /// The queue was cleared: answers that are still owed may never come.
  void forget_owed();

  bool is_reader(std::thread::id id) const { return reader_.get_id() == id; }

 private:
  struct Owed {
    std::string command;
    OnReply on_reply;
    bool is_forgotten = false;
  };
  void run();
  void read_feedback();
  void read_motion();
  void settle_reply(const std::string& text);
  void fail(const std::string& sentence);
  std::vector<dobot::Reply> exchange(const std::vector<std::string>& commands, Deadline deadline);

  const DobotOptions options_;
  const double feedback_silence_s_;  ///< wall
  Listener listener_;

  DeadlineMutex dashboard_mutex_;
  std::unique_ptr<Link> dashboard_;

  std::unique_ptr<Link> motion_, feedback_;
  std::thread reader_;
  int wake_fd_ = -1;
  dobot::FrameStream frames_;
  dobot::ReplyStream replies_;
  Deadline feedback_deadline_{};

  std::mutex mutex_;  ///< of what follows
  std::condition_variable answered_;
  std::deque<Owed> owed_;
  std::size_t waited_for_ = 0;  ///< replies that motion() still waits for
  std::string refusal_;         ///< of one of them
  bool is_lost_ = true;
  std::string lost_sentence_;
};

}  // namespace hilbrush
