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
#include <numbers>
#include <stdexcept>
#include <thread>

#include "sim/devices/sim_clock.h"
#include "sim/wire/axis_banks.h"
#include "sim/wire/dobot_controller.h"
#include "sim/wire/laser_heads.h"
#include "sim/wire/wire_port.h"

namespace hilbrush {
namespace {

constexpr std::size_t kConnectionsMax = 32;

std::unique_ptr<DriveBank> make_bank(WireOptions::Table table, const DriveAxis& axis) {
  switch (table) {
    case WireOptions::Table::kCia402:
      return std::make_unique<Cia402Bank>(axis);
    case WireOptions::Table::kLeadshinePr:
      return std::make_unique<LeadshineBank>(axis);
    default:
      return std::make_unique<OrientalBank>(axis);
  }
}

}  // namespace

struct WireCell::Implementation {
  using SessionMaker = std::function<std::unique_ptr<WireSession>()>;
  struct Listener {
    ListeningPort port;
    SessionMaker make;
  };

  Implementation(const CellDescription& description, const WireOptions& wire_options)
      : options(wire_options),
        clock(wire_options.time_scale),
        cell(description, {wire_options.start_delay_s, wire_options.warm_up_s}),
        faults(cell, wire_options.faults),
        robot(cell, faults, times),
        wake_fd(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
    if (!(options.time_scale > 0)) throw std::invalid_argument("a wire has no virtual time: the scale must be above 0");
    cell.set_time_record(&times);
    const double steps_per_rad = options.steps_per_deg * 180 / std::numbers::pi;
    for (const int axis : {kTilt, kRotation})
      banks.push_back(make_bank(options.table, DriveAxis(axis, steps_per_rad, cell, faults, times)));
    faults.set_alarm([this](WireDevice device) {
      constexpr int kOverload = 0x30;
      if (device == WireDevice::kRobot) robot.raise_alarm(kOverload);
      if (device == WireDevice::kTable) banks.front()->drive().raise_alarm(kOverload);
    });
    open_robot();
    open_table();
    open_laser();
  }

  void open_robot() {
    const auto text_port = [this](DobotTextSession::Port port) {
      return listen([this, port] { return std::make_unique<DobotTextSession>(port, robot, cell, faults); });
    };
    endpoints.dashboard_port = text_port(DobotTextSession::Port::kDashboard);
    endpoints.motion_port = text_port(DobotTextSession::Port::kMotion);
    endpoints.feedback_port = listen([this] { return std::make_unique<DobotFeedbackSession>(robot, cell, faults); });
    endpoints.gate_output = robot.options().gate_output;
  }

  void open_table() {
    endpoints.steps_per_deg = options.steps_per_deg;
    endpoints.table_driver = options.table == WireOptions::Table::kOrientalAz ? "oriental-az" : "modbus-axes";
    if (options.table == WireOptions::Table::kCia402) endpoints.table_map = "cia402";
    if (options.table == WireOptions::Table::kLeadshinePr) endpoints.table_map = "leadshine-pr";
    const auto make = [this](ModbusServer::Framing framing) {
      return std::make_unique<ModbusServer>(framing, ModbusServer::Units{{1, banks[0].get()}, {2, banks[1].get()}},
                                            cell, faults);
    };
    if (options.is_table_serial)
      endpoints.table_serial = open_terminal(make(ModbusServer::Framing::kRtu));
    else
      endpoints.table_tcp_port = listen([make] { return make(ModbusServer::Framing::kTcp); });
  }

  void open_laser() {
    const bool is_obis = options.laser == WireOptions::LaserHead::kObis;
    endpoints.laser_driver = is_obis ? "obis" : "cobolt";
    endpoints.is_gate_of_robot = is_obis;
    const SessionMaker make = [this, is_obis]() -> std::unique_ptr<WireSession> {
      if (is_obis) return std::make_unique<ObisLaser>(cell, faults);
      return std::make_unique<CoboltLaser>(cell, faults);
    };
    endpoints.laser_port = options.is_laser_serial ? open_terminal(make())
                                                   : "tcp://" + endpoints.host + ":" + std::to_string(listen(make));
  }

  std::uint16_t listen(SessionMaker make) {
    listeners.push_back({ListeningPort(), std::move(make)});
    return listeners.back().port.port();
  }
  std::string open_terminal(std::unique_ptr<WireSession> session) {
    PseudoTerminal terminal;
    slaves.push_back(std::move(terminal.slave));
    connections.push_back(std::make_unique<Connection>(std::move(terminal.master), std::move(session), true));
    return terminal.path;
  }

  /// What happens at an instant, by itself.
  void step() {
    robot.run();
    faults.observe();
  }
  /// Every event at its own time, up to the present: a thread that woke late changes no pulse.
  void catch_up() {
    const double now_s = clock.now_s();
    for (;;) {
      const double event_s = std::min({cell.next_event_s(), faults.next_event_s(), robot.next_event_s()});
      if (!(event_s <= now_s)) break;
      cell.advance(event_s);
      step();
    }
    cell.advance(now_s);
    step();
  }
  void talk() {
    for (const auto& connection : connections) {
      connection->session().run();
      connection->write();
    }
    std::erase_if(connections, [](const auto& connection) { return connection->is_over(); });
  }
  double next_event_s() const {
    double next = std::min({cell.next_event_s(), faults.next_event_s(), robot.next_event_s()});
    for (const auto& connection : connections) next = std::min(next, connection->session().next_event_s());
    return next;
  }

  void serve();
  void wait();
  void take_callers(std::size_t first);
  void wake() const {
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t written = ::write(wake_fd.get(), &one, sizeof one);
  }
  template <class Action>
  auto locked(Action action) {
    const std::lock_guard lock(mutex);
    catch_up();
    if constexpr (std::is_void_v<decltype(action())>) {
      action();
      step();
      wake();
    } else {
      return action();
    }
  }

  const WireOptions options;
  SimClock clock;
  mutable std::mutex mutex;  ///< guards everything below
  TimeRecord times;
  TrueCell cell;
  FaultInjector faults;
  DobotController robot;
  std::vector<std::unique_ptr<DriveBank>> banks;
  WireEndpoints endpoints;
  std::vector<Listener> listeners;
  std::vector<Descriptor> slaves;
  std::vector<std::unique_ptr<Connection>> connections;
  std::vector<pollfd> polled;
  Descriptor wake_fd;
  std::atomic<bool> is_ending{false};
  std::thread thread;
};

void WireCell::Implementation::serve() {
  ::prctl(PR_SET_TIMERSLACK, 1000UL, 0UL, 0UL, 0UL);
  // A caller who has gone is found out by the write's error, not by a signal.
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

/// Until something arrives or is due; then takes what has arrived.
void WireCell::Implementation::wait() {
  timespec timeout{};
  {
    const std::lock_guard lock(mutex);
    polled.clear();
    polled.push_back({wake_fd.get(), POLLIN, 0});
    for (const Listener& listener : listeners) polled.push_back({listener.port.fd(), POLLIN, 0});
    for (const auto& connection : connections)
      polled.push_back(
          {connection->fd(), static_cast<short>(connection->wants_to_write() ? POLLIN | POLLOUT : POLLIN), 0});
    constexpr double kLongestS = 1;
    const double wall_s = std::clamp(clock.wall_s(next_event_s() - clock.now_s()), 0., kLongestS);
    timeout.tv_sec = static_cast<time_t>(wall_s);
    timeout.tv_nsec = static_cast<long>((wall_s - std::floor(wall_s)) * 1e9);
  }
  if (::ppoll(polled.data(), polled.size(), &timeout, nullptr) <= 0) return;

  const std::lock_guard lock(mutex);
  std::uint64_t count = 0;
  if (polled[0].revents != 0 && ::read(wake_fd.get(), &count, sizeof count) < 0) return;
  catch_up();
  const std::size_t first = 1 + listeners.size();
  for (std::size_t i = 0; first + i < polled.size(); ++i)
    if (polled[first + i].revents & (POLLIN | POLLHUP | POLLERR)) connections[i]->read();
  step();
  take_callers(1);
}

void WireCell::Implementation::take_callers(std::size_t first) {
  for (std::size_t i = 0; i < listeners.size(); ++i) {
    if (polled[first + i].revents == 0) continue;
    Descriptor caller = listeners[i].port.accept();
    if (!caller.is_open() || connections.size() >= kConnectionsMax) continue;
    connections.push_back(std::make_unique<Connection>(std::move(caller), listeners[i].make(), false));
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
  implementation_->cell.darken();
}

const WireEndpoints& WireCell::endpoints() const {
  return implementation_->endpoints;
}
double WireCell::now_s() const {
  return implementation_->clock.now_s();
}
void WireCell::set_emission_sink(EmissionSink sink) {
  implementation_->locked([&] { implementation_->cell.set_sink(std::move(sink)); });
}
void WireCell::act(const std::function<void(TrueCell&)>& action) {
  implementation_->locked([&] { action(implementation_->cell); });
}
void WireCell::add_fault(const WireFault& fault) {
  implementation_->locked([&] { implementation_->faults.add(fault); });
}
void WireCell::clear_faults() {
  implementation_->locked([&] { implementation_->faults.clear(); });
}
std::uint64_t WireCell::faults_begun() const {
  return implementation_->locked([&] { return implementation_->faults.begun_count(); });
}
std::uint64_t WireCell::message_count(WireDevice device) const {
  return implementation_->locked([&] { return implementation_->faults.message_count(device); });
}
std::vector<TimeRecord::Dot> WireCell::dot_times() const {
  return implementation_->locked([&] { return implementation_->times.dots(); });
}

}  // namespace hilbrush
