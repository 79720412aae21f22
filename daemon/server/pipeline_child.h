#pragma once
#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

/// Runs hilbrush-pipeline as a child process, because models are untrusted bytes and meshes are large: a
/// child that crashes, hangs or eats memory costs its job and nothing else. The child writes JSON lines on
/// its standard output:
///   {"stage":"plan","fraction":0.4}   {"warning":".."}   and last   {"result":{..}}   or
///   {"error":{"at":"..","message":".."}}
namespace hilbrush {

/// What a child may use.
struct ChildLimits {
  double silence_s = 60;                      ///< a child without a line for this long hangs
  std::uint64_t resident_bytes = 8ull << 30;  ///< watched, because address-space limits fight Embree and TBB
  std::size_t line_bytes = std::size_t{4} << 20;  ///< of its output
};

/// The user the child runs as; only root can choose.
struct ChildOwner {
  uid_t uid = 0;
  gid_t gid = 0;
};

struct ChildOutcome {
  bool is_ok = false;
  std::string result;    ///< JSON text of "result"
  std::string error_at;  ///< if not ok
  std::string error;     ///< a sentence
};

struct ChildOrder {
  std::vector<std::string> arguments;  ///< after the program's name
  std::optional<ChildOwner> owner;
  /// Both are called on the watching thread and must only hand over. Progress comes at most ten times a
  /// second.
  std::function<void(const std::string& stage, double fraction)> on_progress;
  std::function<void(const std::string& sentence)> on_warning;
  std::function<void(ChildOutcome)> on_end;  ///< exactly once, unless cancelled
};

/// One thread that starts, watches and reaps all children, and does nothing else: what it would wait for, a
/// painting job would wait for, too. Methods: any thread.
class PipelineChildren {
 public:
  using ChildId = std::uint64_t;
  static constexpr std::size_t kRunningMax = 8;  ///< children; cancelled ones that are still ending count
  static constexpr std::size_t kQueueMax = 64;  ///< orders that wait; further ones end at once, with an error

  /// @throws std::runtime_error if the system has no descriptor left.
  PipelineChildren(std::filesystem::path program, ChildLimits limits);
  /// Kills the children that still run; no callback is called any more.
  ~PipelineChildren();
  PipelineChildren(const PipelineChildren&) = delete;
  PipelineChildren& operator=(const PipelineChildren&) = delete;

  ChildId start(const ChildOrder& order);
  /// Kills the child if it runs, drops its order if it waits; its on_end may still have been called before.
  void cancel(ChildId id);

 private:
  struct Child;
  struct Waiting {
    ChildId id = 0;
    ChildOrder order;
  };
  void watch();
  bool take_orders();
  void spawn(ChildId id, ChildOrder order);
  void read_output(Child& child);
  void take_line(Child& child, const std::string& line);
  void check_limits(Child& child);
  void kill_child(Child& child, std::string sentence);
  void report_progress(Child& child, bool is_due);
  bool reap(Child& child);

  const std::filesystem::path program_;
  const ChildLimits limits_;
  int wake_fd_ = -1;
  std::mutex mutex_;
  std::deque<Waiting> waiting_;     ///< guarded by mutex_
  std::vector<ChildId> cancelled_;  ///< guarded by mutex_; of children that run: each at most once
  bool is_ending_ = false;          ///< guarded by mutex_
  ChildId last_id_ = 0;             ///< guarded by mutex_
  std::vector<std::unique_ptr<Child>> children_;  ///< the watching thread's
  std::thread thread_;
};

}  // namespace hilbrush
