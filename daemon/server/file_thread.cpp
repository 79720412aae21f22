#include "daemon/server/file_thread.h"

#include <utility>

namespace hilbrush {

FileThread::FileThread() : thread_([this](const std::stop_token& ending) { work(ending); }) {}

FileThread::~FileThread() {
  thread_.request_stop();
  const std::lock_guard lock(mutex_);
  waiting_.clear();
  running_stop_.request_stop();
}

std::optional<FileThread::TaskId> FileThread::run(std::function<void(std::stop_token)> task) {
  const std::lock_guard lock(mutex_);
  if (waiting_.size() >= kQueueMax) return std::nullopt;
  waiting_.push_back({++last_id_, std::move(task), {}});
  changed_.notify_one();
  return last_id_;
}

void FileThread::cancel(TaskId id) {
  const std::lock_guard lock(mutex_);
  if (id == running_) running_stop_.request_stop();
  std::erase_if(waiting_, [id](const Task& task) { return task.id == id; });
}

void FileThread::work(const std::stop_token& ending) {
  for (;;) {
    std::unique_lock lock(mutex_);
    if (!changed_.wait(lock, ending, [this] { return !waiting_.empty(); }) || ending.stop_requested()) return;
    const Task task = std::move(waiting_.front());
    waiting_.pop_front();
    running_ = task.id;
    running_stop_ = task.stop;
    lock.unlock();
    task.work(task.stop.get_token());
    lock.lock();
    running_ = 0;
  }
}

}  // namespace hilbrush
