#include "daemon/server/daemon.h"

#include <chrono>
#include <stdexcept>

#include "config/cell_devices.h"
#include "config/cell_file.h"
#include "daemon/execution/cell_devices.h"
#include "daemon/server/access.h"
#include "daemon/server/audit_log.h"
#include "daemon/server/cell_controller.h"
#include "daemon/server/cell_thread.h"
#include "daemon/server/file_thread.h"
#include "daemon/server/job_painting.h"
#include "daemon/server/job_planning.h"
#include "daemon/server/job_queue.h"
#include "daemon/server/job_store.h"
#include "daemon/server/lock_file.h"
#include "daemon/server/method_table.h"
#include "daemon/server/pipeline_child.h"
#include "daemon/server/server.h"
#include "sampling/base/input_error.h"

namespace hilbrush {
namespace {

namespace fs = std::filesystem;

fs::path made_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error || !fs::is_directory(folder))
    throw std::runtime_error(folder.string() + ": cannot be made or is not a folder" +
                             (error ? ": " + error.message() : ""));
  return fs::canonical(folder);
}

CellDescription described_cell(const fs::path& file, const std::optional<double>& time_scale) {
  CellDescription description = load_cell(file);
  // A wire has no virtual time: its drivers take 0 for 1.
  const bool is_simulated = load_cell_devices(file).is_simulated();
  if (!is_simulated && description.simulation.time_scale <= 0) description.simulation.time_scale = 1;
  if (!time_scale) return description;
  if (!(*time_scale >= 0 && *time_scale <= 1000)) throw InputError("--time-scale", "must be 0 to 1000");
  if (!is_simulated)
    throw InputError("--time-scale", "is for simulated cells only: real time cannot be scaled");
  description.simulation.time_scale = *time_scale;
  return description;
}

}  // namespace

/// Built from top to bottom, destroyed from bottom to top. Threads that call
/// back have their own copies of what they call.
struct Daemon::Implementation {
  DaemonOptions options;
  fs::path state;
  LockFile state_lock, socket_lock;
  fs::path cell_file;
  CellDescription description;
  Access access;
  std::string notice, tcp_address;
  JobStore store;
  AuditLog audit;
  std::unique_ptr<CellDevices> devices;
  std::chrono::steady_clock::time_point begin = std::chrono::steady_clock::now();
  Server server;
  PostToSocketThread post{[this](std::function<void()> task) { server.post(std::move(task)); }};
  CellThread thread;
  PipelineChildren children;
  FileThread checks, copies;
  CellController controller;
  JobQueue queue;
  JobPlanning planning;
  JobPainting painting;
  MethodTable methods;
  bool is_ending = false;  ///< the socket thread's

  explicit Implementation(const DaemonOptions& given)
      : options(given),
        state(made_folder(given.state)),
        state_lock(state / "lock", state.string()),
        socket_lock(given.socket.string() + ".lock", given.socket.string()),
        cell_file(fs::absolute(find_cell(given.cell))),
        description(described_cell(cell_file, given.time_scale)),
        access(given.settings),
        store(state / "jobs.sqlite"),
        audit(state / "audit.log"),
        devices(given.make_devices ? given.make_devices(description)
                                   : make_cell_devices(description, cell_file)),
        thread(*devices, description, post),
        children(given.pipeline, ChildLimits{.silence_s = given.pipeline_silence_s,
                                             .resident_bytes = given.pipeline_memory_mb << 20}),
        controller(thread, *devices, description),
        queue(made_folder(state / "jobs"), store),
        planning(queue, {children, checks, copies}, description, cell_file, post),
        painting(queue, controller, thread, children, description, post),
        methods({queue, planning, painting}, controller, audit, [this] { return info(); }) {
    controller.on_own_stop = [this](const std::string& reason) {
      Peer self;
      self.uid = ::geteuid();
      self.pid = ::getpid();
      self.user = "hilbrushd";
      audit.record(self, "cell.stop", Json::object(), reason);
    };
    queue.on_change = [this](const Job& job) { server.notify(job); };
    notice = store.notice();
    if (const std::string found = queue.restore(); !found.empty())
      notice += (notice.empty() ? "" : "; ") + found;
    painting.restore();
    planning.plan_next();
    server.listen(options.socket, {methods, queue, access});
    if (const auto& tcp = options.settings.tcp)
      tcp_address =
          tcp->host + ":" + std::to_string(server.listen_tcp(tcp->host, tcp->port, {methods, queue, access}));
    constexpr double kDevicePollS = .05;
    server.every(kDevicePollS, [this] { controller.check_devices(); });
    constexpr double kStorePeriodS = 5;
    server.every(kStorePeriodS, [this] { queue.keep_unkept(); });
  }

  Json info() const {
    const std::chrono::duration<double> uptime = std::chrono::steady_clock::now() - begin;
    return {{"version", HILBRUSH_VERSION},
            {"pid", ::getpid()},
            {"uptime_s", uptime.count()},
            {"socket", options.socket.string()},
            {"tcp", tcp_address.empty() ? Json(nullptr) : Json(tcp_address)},
            {"state", state.string()},
            {"cell_file", cell_file.string()},
            {"pipeline", options.pipeline.string()},
            {"pipeline_silence_s", options.pipeline_silence_s},
            {"pipeline_memory_mb", options.pipeline_memory_mb},
            {"clients", server.client_count()},
            {"jobs", queue.jobs().size()},
            {"store_fault", queue.store_fault().empty() ? Json(nullptr) : Json(queue.store_fault())},
            {"journal_window", Journal::kWindow}};
  }

  /// Laser off first; then the executor is waited for, so that the job's last state is kept.
  void end() {
    if (std::exchange(is_ending, true)) return;
    controller.stop("the daemon ends");
    planning.shut_down();
    painting.shut_down();
    constexpr double kPeriodS = 0.01;
    constexpr auto kEndPatience = std::chrono::seconds(10);
    server.poll(kPeriodS, [this, deadline = std::chrono::steady_clock::now() + kEndPatience] {
      if ((thread.is_busy() || painting.is_painting()) && std::chrono::steady_clock::now() < deadline)
        return false;
      server.end_run();
      return true;
    });
  }
};

Daemon::Daemon(const DaemonOptions& options) : implementation_(std::make_unique<Implementation>(options)) {}
Daemon::~Daemon() = default;

void Daemon::end_on_signals(std::function<void()> on_signal) {
  implementation_->server.on_termination([this, on_signal = std::move(on_signal)] {
    if (on_signal) on_signal();
    implementation_->end();
  });
}

void Daemon::every(double period_s, std::function<void()> task) {
  implementation_->server.every(period_s, std::move(task));
}

const std::string& Daemon::tcp_address() const {
  return implementation_->tcp_address;
}

void Daemon::run() {
  implementation_->server.run();
}

void Daemon::end() {
  implementation_->server.post([this] { implementation_->end(); });
}

void Daemon::laser_off() noexcept {
  implementation_->devices->cell().laser.off();
  implementation_->devices->cell().laser.disable();
}

const std::string& Daemon::notice() const {
  return implementation_->notice;
}

}  // namespace hilbrush
