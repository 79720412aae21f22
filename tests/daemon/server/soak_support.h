#pragma once
#include <gtest/gtest.h>
#include <malloc.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <ostream>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>

#include "tests/daemon/server/daemon_fixture.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
// Of the sanitizers' allocator; the compiler brings the function, but no header that declares it.
extern "C" std::size_t __sanitizer_get_current_allocated_bytes();
#endif

/// What soaks share: clients that mean no good, and what is left in this process after hours of work.
namespace hilbrush::test {

/// HILBRUSH_SOAK_S=N seconds, an hour with HILBRUSH_LONG, else `by_default_s`.
inline std::chrono::seconds soak_length(int by_default_s) {
  if (const char* given_s = std::getenv("HILBRUSH_SOAK_S")) return std::chrono::seconds(std::atoi(given_s));
  return std::chrono::seconds(std::getenv("HILBRUSH_LONG") != nullptr ? 3600 : by_default_s);
}

inline std::size_t open_descriptors() {
  namespace fs = std::filesystem;
  return static_cast<std::size_t>(
      std::distance(fs::directory_iterator("/proc/self/fd"), fs::directory_iterator{}));
}

/// What this process holds. Under a sanitizer its allocator keeps freed memory resident by the hundred
/// megabytes, so there it is what is allocated.
inline double held_mb() {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  return static_cast<double>(__sanitizer_get_current_allocated_bytes()) / (1 << 20);
#else
  ::malloc_trim(0);
  std::ifstream in("/proc/self/statm");
  double size = 0;
  double resident = 0;
  in >> size >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / (1 << 20);
#endif
}

/// Clients that mean no good: half messages, nonsense, watchers that never read, connections dropped at any
/// time.
class Crowd {
 public:
  Crowd(DaemonWorld& world, unsigned seed) : world_(world), random_(seed), thread_([this] { run(); }) {}
  ~Crowd() { end(); }
  void end() {
    is_ending_ = true;
    if (thread_.joinable()) thread_.join();
  }
  std::size_t visits() const { return visits_; }

 private:
  void run() {
    while (!is_ending_) {
      try {
        visit();
      } catch (const std::exception&) {  // disconnected, or without an answer: both may happen
      }
      ++visits_;
    }
  }
  void visit() {
    LineClient client = world_.client();
    switch (random_() % 6) {
      case 0:
        client.send_bytes("{\"jsonrpc\":\"2.0\",\"id\":1,\"meth");
        break;
      case 1: {
        std::string noise(random_() % 5000, ' ');
        for (char& c : noise) c = static_cast<char>(random_());
        client.send_bytes(noise + "\n");
        break;
      }
      case 2:
        client.call("job.watch", {{"id", std::to_string(1 + random_() % 50)}});
        std::this_thread::sleep_for(std::chrono::milliseconds(random_() % 50));
        break;
      case 3:
        for (int i = 0; i < 50; ++i)
          client.send_without_waiting("{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"rpc.discover\"}\n");
        break;
      case 4:
        client.call("job.list", {{"limit", 20}});
        client.call("cell.status");
        client.call("job.start", {{"id", "1"}, {"part_in_place", true}});
        break;
      default:
        client.call("system.info");
        client.end_sending();
        while (client.read_line()) {
        }
    }
  }

  DaemonWorld& world_;
  std::mt19937 random_;
  std::atomic<bool> is_ending_{false};
  std::atomic<std::size_t> visits_{0};
  std::thread thread_;
};

inline std::string job_state(LineClient& client, const std::string& id) {
  return client.result("job.get", {{"id", id}}).at("job").at("state").get<std::string>();
}

/// Armed and painting, from whatever state the cell is in; `repair` undoes what went wrong.
inline void set_going(LineClient& client, const std::string& id, const std::function<void()>& repair) {
  for (int attempt = 0; attempt < 400; ++attempt) {
    repair();
    const auto cell = client.result("cell.status").at("cell").at("state").get<std::string>();
    if (cell == "stopped") client.call("cell.clear");
    if (cell == "idle") client.call("cell.arm");
    const std::string job = job_state(client, id);
    if (job != "ready" && job != "paused") return;
    client.call(job == "ready" ? "job.start" : "job.resume", {{"id", id}, {"part_in_place", true}});
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  throw std::runtime_error("job " + id + " cannot be started: " + client.call("cell.status").dump());
}

/// From the end of the first quarter to the end of it all.
struct SoakTrace {
  std::size_t jobs_before = 0;
  std::size_t jobs = 0;
  std::size_t visits = 0;
  std::size_t descriptors_before = 0;
  std::size_t descriptors = 0;
  double mb_before = 0;
  double mb = 0;
};
inline std::ostream& operator<<(std::ostream& out, const SoakTrace& trace) {
  return out << trace.visits << " visits; memory " << trace.mb_before << " -> " << trace.mb << " MB over "
             << trace.jobs - trace.jobs_before << " jobs, descriptors " << trace.descriptors_before << " -> "
             << trace.descriptors;
}

/// Gone clients are noticed when the daemon next looks.
inline void wait_for_clients_to_go(DaemonWorld& world) {
  LineClient client = world.client();
  const auto clients = [&] { return client.result("system.info").at("system").at("clients"); };
  for (int i = 0; i < 500 && clients() != 1; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_EQ(clients(), 1);
}

/// Paints one job after another among two crowds of clients.
inline SoakTrace soak(DaemonWorld& world, std::chrono::seconds length,
                      const std::function<void()>& paint_one_job) {
  using Steady = std::chrono::steady_clock;
  SoakTrace trace;
  const auto run_until = [&](Steady::time_point end, unsigned crowd_seed) {
    Crowd a(world, crowd_seed), b(world, crowd_seed + 1);
    for (; Steady::now() < end && !::testing::Test::HasFailure(); ++trace.jobs) paint_one_job();
    a.end();
    b.end();
    trace.visits += a.visits() + b.visits();
  };
  const auto begin = Steady::now();
  run_until(begin + length / 4, 100);
  wait_for_clients_to_go(world);
  trace.jobs_before = trace.jobs;
  trace.descriptors_before = open_descriptors();
  trace.mb_before = held_mb();
  run_until(begin + length, 200);
  wait_for_clients_to_go(world);
  trace.descriptors = open_descriptors();
  trace.mb = held_mb();
  return trace;
}

inline void expect_no_trace(const SoakTrace& trace) {
  EXPECT_LE(trace.descriptors, trace.descriptors_before + 2);
  // A thousand jobs of history are kept in memory, some kilobytes each.
  EXPECT_LE(trace.mb, trace.mb_before + 12);
  EXPECT_GT(trace.jobs, trace.jobs_before) << "nothing was painted in the time that was looked at";
}

}  // namespace hilbrush::test
