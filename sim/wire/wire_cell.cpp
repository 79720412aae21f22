#include "sim/wire/wire_cell.h"

#include <poll.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "sim/devices/sim_clock.h"
#include "sim/wire/wire_port.h"
#include "sim/wire/wired_devices.h"

namespace hilbrush {
namespace {

constexpr std::size_t kConnectionsMax = 32;

double checked_scale(double time_scale) {
  if (!(time_scale > 0))
    throw std::invalid_argument("a wire has no virtual time: the time scale must be above 0");
  return time_scale;
}

}  // namespace

struct WireCell::Implementation {
  using Conversation = WiredDevices::Conversation;
  struct Listener {
    ListeningPort port;
    Conversation about;
  };

  Implementation(const CellDescription& description, const WireOptions& options)
      : clock(checked_scale(options.time_scale)),
        devices(description, options),
        wake_fd(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
    endpoints.dashboard_port = listen(Conversation::kDashboard);
    endpoints.motion_port = listen(Conversation::kMotion);
    endpoints.feedback_port = listen(Conversation::kFeedback);
    endpoints.gate_output = devices.robot().options().gate_output;

    endpoints.table_driver = options.table == WireOptions::Table::kOrientalAz ? "oriental-az" : "modbus-axes";
    if (options.table == WireOptions::Table::kCia402) endpoints.table_map = "cia402";
    if (options.table == WireOptions::Table::kLeadshinePr) endpoints.table_map = "leadshine-pr";
    endpoints.steps_per_deg = options.steps_per_deg;
    if (options.is_table_serial)
      endpoints.table_serial = open_terminal(Conversation::kTableRtu);
    else
      endpoints.table_tcp_port = listen(Conversation::kTableTcp);

    endpoints.is_gate_of_robot = options.laser == WireOptions::LaserHead::kObis;
    endpoints.laser_driver = endpoints.is_gate_of_robot ? "obis" : "cobolt";
    endpoints.laser_port = options.is_laser_serial ? open_terminal(Conversation::kLaser)
                                                   : "tcp://" + endpoints.host + ":" +
                                                         std::to_string(listen(Conversation::kLaser));
  }

  std::uint16_t listen(Conversation about) {
    listeners.push_back({ListeningPort(), about});
    return listeners.back().port.port();
  }
  std::string open_terminal(Conversation about) {
    PseudoTerminal terminal;
    slaves.push_back(std::move(terminal.slave));
    connections.push_back(
        std::make_unique<Connection>(std::move(terminal.master), devices.converse(about), true));
    return terminal.path;
  }

  void catch_up() { devices.advance(clock.now_s()); }
  void talk() {
    for (const auto& connection : connections) {
      connection->session().run();
      connection->write();
    }
    std::erase_if(connections, [](const auto& connection) { return connection->is_over(); });
  }
  double next_event_s() const {
    double next = devices.next_event_s();
    for (const auto& connection : connections) next = std::min(next, connection->session().next_event_s());
    return next;
  }

  void serve();
  timespec list_descriptors();
  void wait();
  void take_callers(std::size_t first);
  void wake() const {
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t written = ::write(wake_fd.get(), &one, sizeof one);
  }
  /// From any thread: `action` at the present time.
  template <class Action>
  auto locked(Action action) {
    const std::lock_guard lock(mutex);
    catch_up();
    if constexpr (std::is_void_v<decltype(action())>) {
      action();
      devices.observe();
      wake();
    } else {
      return action();
    }
  }

  SimClock clock;
  std::mutex mutex;  ///< guards everything below
  WiredDevices devices;
  WireEndpoints endpoints;
  std::vector<Listener> listeners;
  std::vector<Descriptor> slaves;
  std::vector<std::unique_ptr<Connection>> connections;
  std::vector<pollfd> polled;  ///< the serving thread's: the wake-up, the listeners, the connections
  Descriptor wake_fd;
  std::atomic<bool> is_ending{false};
  std::thread thread;
};

void WireCell::Implementation::serve() {
  ::prctl(PR_SET_TIMERSLACK, 1000UL, 0UL, 0UL, 0UL);
  // A client that has disconnected is noticed by the error of a write, not by a signal.
  sigset_t pipe_signal;
  ::sigemptyset(&pipe_signal);
  ::sigaddset(&pipe_signal, SIGPIPE);
  ::pthread_sigmask(SIG_BLOCK, &pipe_signal, nullptr);
  while (!is_ending) {
    {
      const std::lock_guard lock(mutex);
      catch_up();
      talk();
    }
    wait();
  }
}

/// What to wait for, and how long at most.
timespec WireCell::Implementation::list_descriptors() {
  const std::lock_guard lock(mutex);
  polled.clear();
  polled.push_back({wake_fd.get(), POLLIN, 0});
  for (const Listener& listener : listeners) polled.push_back({listener.port.fd(), POLLIN, 0});
  for (const auto& connection : connections)
    polled.push_back(
        {connection->fd(), static_cast<short>(connection->wants_to_write() ? POLLIN | POLLOUT : POLLIN), 0});
  constexpr double kMaxS = 1;
  const double wall_s = std::clamp(clock.wall_s(next_event_s() - clock.now_s()), 0., kMaxS);
  return {static_cast<time_t>(wall_s), static_cast<long>((wall_s - std::floor(wall_s)) * 1e9)};
}

/// Until something arrives or is due; then takes what has arrived.
void WireCell::Implementation::wait() {
  const timespec timeout = list_descriptors();
  if (::ppoll(polled.data(), polled.size(), &timeout, nullptr) <= 0) return;

  const std::lock_guard lock(mutex);
  std::uint64_t count = 0;
  if (polled[0].revents != 0 && ::read(wake_fd.get(), &count, sizeof count) < 0) return;
  catch_up();
  const std::size_t first = 1 + listeners.size();
  for (std::size_t i = 0; first + i < polled.size(); ++i)
    if (polled[first + i].revents & (POLLIN | POLLHUP | POLLERR)) connections[i]->read();
  devices.observe();
  take_callers(1);
}

void WireCell::Implementation::take_callers(std::size_t first) {
  for (std::size_t i = 0; i < listeners.size(); ++i) {
    if (polled[first + i].revents == 0) continue;
    Descriptor caller = listeners[i].port.accept();
    if (!caller.is_open() || connections.size() >= kConnectionsMax) continue;
    connections.push_back(
        std::make_unique<Connection>(std::move(caller), devices.converse(listeners[i].about), false));
  }
}

WireCell::WireCell(const CellDescription& description, const WireOptions& options)
    : implementation_(std::make_unique<Implementation>(description, options)) {
  implementation_->thread = std::thread([this] { implementation_->serve(); });
}

WireCell::~WireCell() {
  implementation_->is_ending = true;
  implementation_->wake();
  implementation_->thread.join();
  implementation_->catch_up();
  implementation_->devices.cell().disarm();
}

const WireEndpoints& WireCell::endpoints() const {
  return implementation_->endpoints;
}
double WireCell::now_s() const {
  return implementation_->clock.now_s();
}
void WireCell::set_emission_sink(EmissionSink sink) {
  implementation_->locked([&] { implementation_->devices.cell().set_sink(std::move(sink)); });
}
void WireCell::act(const std::function<void(TrueCell&)>& action) {
  implementation_->locked([&] { action(implementation_->devices.cell()); });
}
void WireCell::add_fault(const WireFault& fault) {
  implementation_->locked([&] { implementation_->devices.faults().add(fault); });
}
void WireCell::clear_faults() {
  implementation_->locked([&] { implementation_->devices.faults().clear(); });
}
std::uint64_t WireCell::faults_begun() const {
  return implementation_->locked([&] { return implementation_->devices.faults().begun_count(); });
}
std::uint64_t WireCell::message_count(WireDevice device) const {
  return implementation_->locked([&] { return implementation_->devices.faults().message_count(device); });
}
std::vector<TimeRecord::Dot> WireCell::dot_times() const {
  return implementation_->locked([&] { return implementation_->devices.times().dots(); });
}

}  // namespace hilbrush
