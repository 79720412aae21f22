#pragma once
#include <chrono>
#include <condition_variable>
#include <mutex>

namespace hilbrush {

/// A mutex that is waited for until a deadline, for std::unique_lock and std::lock_guard. std::timed_mutex
/// does the same, but by a system call that thread sanitizers do not recognize.
class DeadlineMutex {
 public:
  void lock() {
    std::unique_lock guard(mutex_);
    freed_.wait(guard, [this] { return !is_held_; });
    is_held_ = true;
  }
  bool try_lock_until(std::chrono::steady_clock::time_point deadline) {
    std::unique_lock guard(mutex_);
    if (!freed_.wait_until(guard, deadline, [this] { return !is_held_; })) return false;
    is_held_ = true;
    return true;
  }
  void unlock() {
    {
      const std::lock_guard guard(mutex_);
      is_held_ = false;
    }
    freed_.notify_one();
  }

 private:
  std::mutex mutex_;
  std::condition_variable freed_;
  bool is_held_ = false;
};

}  // namespace hilbrush
