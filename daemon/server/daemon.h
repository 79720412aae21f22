#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "config/daemon_settings.h"

// clang-format off
/// hilbrushd as a value: everything that lives between its start and its end. The main program and the tests hold one
/// each. Threads:
///
///   socket thread (Asio)     Server, MethodTable, JobQueue, JobPlanning, JobPainting, CellController, JobStore, AuditLog:
///                            all state of jobs and cell
///   executor's thread        CellThread: the only one that commands motion
///   stop thread              CellThread: carries out stops, so that no device delays another request
///   children's thread        PipelineChildren: starts and watches hilbrush-pipeline
///   check and copy threads   FileThread: open and copy the models of clients, whose file systems may hang
///
/// Threads hand each other closures. Nothing is shared but the executor's stop and pause flags, and the calls of devices
/// that are thread-safe by themselves.
// clang-format on
namespace hilbrush {

class CellDevices;
struct CellDescription;

struct DaemonOptions {
  std::filesystem::path socket;             ///< of the operator's command, mode 0660
  std::filesystem::path state;              ///< folder: jobs.sqlite, jobs/, audit.log, lock
  std::string cell = "default";             ///< name of a cell or a file
  std::optional<double> time_scale;         ///< instead of the cell file's; simulated cells only
  std::filesystem::path pipeline;           ///< the program hilbrush-pipeline
  double pipeline_silence_s = 60;           ///< a child that is silent for this long is killed
  std::uint64_t pipeline_memory_mb = 8192;  ///< a child that grows beyond is killed
  DaemonSettings settings;                  ///< who may connect
  /// Instead of the cell file's devices: for tests whose devices misbehave.
  std::function<std::unique_ptr<CellDevices>(const CellDescription&)> make_devices;
};

class Daemon {
 public:
  /// Everything up and listening. @throws std::runtime_error (InputError for the cell file) with a sentence.
  explicit Daemon(const DaemonOptions& options);
  ~Daemon();
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;

  /// SIGTERM and SIGINT end the daemon in order; `on_signal` is called first. Before run().
  void end_on_signals(std::function<void()> on_signal = {});
  /// Calls `task` on the socket thread periodically: as long as it is called, requests are served. Before
  /// run().
  void every(double period_s, std::function<void()> task);
  /// host:port that is listened on, or empty.
  const std::string& tcp_address() const;
  /// Serves until end(): then the laser is off, the cell stopped, a painting job paused.
  void run();
  /// Any thread.
  void end();
  /// The beam off at once, for the last moments of a process that is about to abort. Any thread, never
  /// throws.
  void laser_off() noexcept;
  /// For the operator at start-up, such as that a job store had to be set aside; or empty.
  const std::string& notice() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace hilbrush
