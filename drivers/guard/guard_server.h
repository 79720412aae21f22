#pragma once
#include <atomic>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "drivers/clock.h"
#include "drivers/gate.h"
#include "drivers/guard/guard_codec.h"
#include "drivers/laser_head.h"
#include "drivers/link/link.h"

namespace hilbrush {

/// The guard's side of the channel: obeys requests, and disarms the laser by itself when heartbeats are
/// missing, when the channel ends, when it carries an invalid message, when the end of a pulse that was
/// announced is not reported in time, or when a signal asks the guard to end. A missing heartbeat, and a
/// missing end, latch until the user clears them. Requests that wait for the laser run on a thread of their
/// own, so that heartbeats are always heard; disarming and closing the gate do not wait for them.
class GuardServer {
 public:
  enum class End { kChannelEnded, kGarbage, kSignal };
  struct Options {
    double heartbeat_s = 0.02;
    int heartbeats_missed = 5;
  };

  /// `channel`: the guard's end of a SOCK_SEQPACKET pair. `signals`: a descriptor that becomes readable when
  /// the guard shall end, or -1. `gate` is null if the gate is not the laser's own. All outlive it.
  GuardServer(LaserHead& head, Gate* gate, int channel, int signals, const Options& options, Clock& clock);
  ~GuardServer();

  /// Serves until the end of the channel or a signal. The laser is disarmed when it returns; is_disarmed()
  /// says whether it confirmed that.
  End run();
  bool is_disarmed() const { return is_disarmed_; }

 private:
  static constexpr std::size_t kQueueMax = 16;

  std::optional<End> read_channel();
  void obey_at_once(const guard::Request& request);
  void work();
  std::string carry_out(const guard::Request& request);
  void send(const std::string& message);
  void send_status();
  bool disarm();
  void trip(const std::string& sentence);

  LaserHead& head_;
  Gate* const gate_;
  const int channel_, signals_;
  const Options options_;
  Clock& clock_;

  std::mutex mutex_;  ///< of what follows
  std::condition_variable ordered_;
  std::deque<guard::Request> requests_;
  std::string trip_;  ///< why it disarmed by itself; empty if it did not, or was cleared
  std::uint64_t requested_readings_ = 0;
  bool is_ending_ = false;
  bool has_beaten_ = false;                ///< the watch begins with the first heartbeat
  std::optional<Deadline> dark_deadline_;  ///< of the pulse that was announced; run()'s thread
  std::atomic<bool> is_disarmed_{true};
  std::thread worker_;
};

}  // namespace hilbrush
