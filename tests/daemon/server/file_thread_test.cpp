#include "daemon/server/file_thread.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>

namespace hilbrush {
namespace {

/// As a copy, or a file system that answers late.
void run_until_asked_to_stop(const std::stop_token& stop, std::promise<void>& begun) {
  begun.set_value();
  while (!stop.stop_requested()) std::this_thread::yield();
}

TEST(FileThreadTest, ARunningTaskIsAskedToStopAndAWaitingOneIsDropped) {
  FileThread files;
  std::promise<void> begun, ended;
  std::atomic<bool> was_run{false};
  const auto running = files.run([&](const std::stop_token& stop) { run_until_asked_to_stop(stop, begun); });
  begun.get_future().wait();
  const auto waiting = files.run([&](const std::stop_token&) { was_run = true; });
  ASSERT_TRUE(running && waiting);
  files.cancel(*waiting);
  ASSERT_TRUE(files.run([&](const std::stop_token&) { ended.set_value(); }));
  files.cancel(*running);
  ended.get_future().wait();
  EXPECT_FALSE(was_run);
}

TEST(FileThreadTest, TheQueueIsBoundedAndTheEndDropsIt) {
  std::promise<void> begun;
  std::atomic<int> run_count{0};
  {
    FileThread files;
    ASSERT_TRUE(files.run([&](const std::stop_token& stop) { run_until_asked_to_stop(stop, begun); }));
    begun.get_future().wait();
    for (std::size_t i = 0; i < FileThread::kQueueMax; ++i)
      ASSERT_TRUE(files.run([&](const std::stop_token&) { ++run_count; }));
    EXPECT_FALSE(files.run([&](const std::stop_token&) { ++run_count; }));
  }
  EXPECT_EQ(run_count, 0);
}

}  // namespace
}  // namespace hilbrush
