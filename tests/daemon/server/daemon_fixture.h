#pragma once
#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>

#include "daemon/server/daemon.h"
#include "tests/daemon/execution/program_fixture.h"

/// A daemon in this process on a socket of its own, clients that talk to it as any other would, and a shell
/// script in the pipeline's place, which answers by the model's name.
namespace hilbrush::test {

using Json = nlohmann::ordered_json;

/// Parameters of the methods that name a job, and of those that say that its part is in place.
inline Json named(const std::string& id) {
  return {{"id", id}};
}
inline Json placed(const std::string& id) {
  return {{"id", id}, {"part_in_place", true}};
}

/// One connection. Every wait ends in a failure after kPatience.
class LineClient {
 public:
  static constexpr auto kPatience = std::chrono::seconds(30);

  explicit LineClient(const std::filesystem::path& socket);
  /// Over TCP, to "127.0.0.1:PORT".
  static std::unique_ptr<LineClient> over_tcp(const std::string& address);
  ~LineClient();
  LineClient(const LineClient&) = delete;
  LineClient& operator=(const LineClient&) = delete;

  void send_bytes(const std::string& bytes);
  /// Sends as much as the system takes without waiting; the number of bytes.
  std::size_t send_without_waiting(const std::string& bytes);
  /// The next line, without its end; nothing if the daemon closed the connection.
  std::optional<std::string> read_line();
  /// The next message, notifications included; null if the connection was closed.
  Json read_message();
  /// A request and its answer; notifications that come before are kept for next_update().
  Json call(const std::string& method, const Json& params = Json::object());
  /// The result. @throws std::runtime_error, which fails the test, if there is none.
  Json result(const std::string& method, const Json& params = Json::object());
  /// The error's code, or 0 if there was none.
  int error_code(const std::string& method, const Json& params = Json::object());
  /// The next job.update.
  Json next_update();
  /// Shuts the sending side down.
  void end_sending();

 private:
  explicit LineClient(int fd) : fd_(fd) {}
  int fd_ = -1;
  int last_id_ = 0;
  std::string inbox_;
  std::vector<Json> updates_;
};

/// State, socket and pipeline of a daemon; the daemon itself can be ended and started again.
class DaemonWorld {
 public:
  DaemonWorld();
  ~DaemonWorld();

  DaemonOptions options;

  void begin();
  void end();
  const Daemon& daemon() const { return *daemon_; }
  LineClient client() const { return LineClient(options.socket); }
  /// A model of that name that the script turns into a program of `exposures` exposures, or into the trouble
  /// that its name says: hang, crash, fat, bad, mute, garbage, endless, outside, stray (a program for another
  /// model), older (by another version), wild (one beyond the limits), hidden (all dots skipped), lost (no
  /// approach), slowway (an endless one), long (the longest pulses).
  std::filesystem::path model(const std::string& name, std::size_t exposures = 100);
  /// Submits and waits until the job is in `state`.
  std::string submit(LineClient& client, const std::filesystem::path& model, const std::string& state,
                     bool dry_run = false);
  /// Polls the job until it is in `state`; throws, which fails the test, if it gets into a final state that
  /// is another, or takes too long.
  Json wait_for(LineClient& client, const std::string& id, const std::string& state);
  /// stopped -> clear -> arm.
  void clear_and_arm(LineClient& client);
  std::filesystem::path job_folder(const std::string& id) const { return options.state / "jobs" / id; }
  const TemporaryFolder& folder() const { return folder_; }

 private:
  TemporaryFolder folder_;
  std::unique_ptr<Daemon> daemon_;
  std::thread thread_;
};

}  // namespace hilbrush::test
