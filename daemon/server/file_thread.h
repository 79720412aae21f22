#pragma once
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>

/// Opens and copies the files that clients name, because a file system may take long to answer, or never
/// answer: no other thread opens such a path.
namespace hilbrush {

/// One thread, one task after another. Methods: any thread.
class FileThread {
 public:
  using TaskId = std::uint64_t;
  static constexpr std::size_t kQueueMax = 1000;  ///< tasks that wait; about one for each client

  FileThread();
  /// Drops the tasks that wait, asks the running one to stop, and waits for it.
  ~FileThread();
  FileThread(const FileThread&) = delete;
  FileThread& operator=(const FileThread&) = delete;

  /// `task` hands its result over by itself, does not throw, and returns early when it is asked to stop.
  /// @return nothing if the queue is full.
  [[nodiscard]] std::optional<TaskId> run(std::function<void(std::stop_token)> task);
  /// Drops the task if it waits, asks it to stop if it runs.
  void cancel(TaskId id);

 private:
  struct Task {
    TaskId id = 0;
    std::function<void(std::stop_token)> work;
    std::stop_source stop;
  };
  void work(const std::stop_token& ending);

  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<Task> waiting_;                         ///< guarded by mutex_
  TaskId last_id_ = 0;                               ///< guarded by mutex_
  TaskId running_ = 0;                               ///< guarded by mutex_; 0: none
  std::stop_source running_stop_{std::nostopstate};  ///< guarded by mutex_
  std::jthread thread_;
};

}  // namespace hilbrush
