#include "daemon/execution/cell_devices.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "drivers/axes/drive_group.h"
#include "drivers/axes/mapped_drive.h"
#include "drivers/axes/oriental_az.h"
#include "drivers/dobot/dobot_robot.h"
#include "drivers/guard/guard_process.h"
#include "drivers/guard/guarded_head.h"
#include "drivers/laser/gated_laser.h"
#include "drivers/steady_clock.h"
#include "sim/devices/emission_keeper.h"
#include "sim/devices/sim_cell.h"

namespace hilbrush {
namespace {

class SimulatedDevices final : public CellDevices {
 public:
  explicit SimulatedDevices(const CellDescription& description) : sim_(description) {}
  Cell cell() override { return sim_.cell(); }
  bool is_simulated() const override { return true; }
  void record_emissions(const std::filesystem::path& file) override { keeper_.record(sim_, file); }

 private:
  EmissionKeeper keeper_;  // outlives the cell, whose laser may still end a pulse
  SimCell sim_;
};

/// Axes on the same endpoint share one bus.
template <std::size_t N>
std::array<std::unique_ptr<AxisDrive>, N> make_drives(const ModbusGroupOptions<N>& options, Clock& clock) {
  std::array<std::shared_ptr<ModbusBus>, N> buses;
  std::array<std::unique_ptr<AxisDrive>, N> drives;
  for (std::size_t i = 0; i < N; ++i) {
    for (std::size_t other = 0; other < i; ++other)
      if (options.axes[other].endpoint == options.axes[i].endpoint) buses[i] = buses[other];
    if (!buses[i]) buses[i] = std::make_shared<ModbusBus>(options.axes[i].endpoint);
    if (options.map)
      drives[i] = std::make_unique<MappedDrive>(buses[i], options.axes[i], *options.map, clock);
    else
      drives[i] = std::make_unique<OrientalDrive>(buses[i], options.axes[i]);
  }
  return drives;
}

/// Says that this process drives the devices of a cell file, until it ends.
class CellLock {
 public:
  explicit CellLock(const std::filesystem::path& cell_file)
      : fd_(::open(cell_file.c_str(), O_RDONLY | O_CLOEXEC)) {
    if (fd_ < 0) throw InputError(cell_file.string(), std::strerror(errno));
    if (::flock(fd_, LOCK_EX | LOCK_NB) == 0) return;
    const int error = errno;
    ::close(fd_);
    if (error != EWOULDBLOCK) throw InputError(cell_file.string(), std::strerror(error));
    throw CellHeld(cell_file.string(), "another process drives this cell: a daemon, or another command");
  }
  ~CellLock() { ::close(fd_); }
  CellLock(const CellLock&) = delete;
  CellLock& operator=(const CellLock&) = delete;

 private:
  int fd_;
};

double time_scale(const CellDescription& description) {
  return description.simulation.time_scale > 0 ? description.simulation.time_scale : 1;
}

CellDescription in_real_time(CellDescription description) {
  description.simulation.time_scale = time_scale(description);
  return description;
}

/// Where both the build and the installation put it.
std::string guard_beside_program() {
  std::error_code error;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
  return (error ? std::filesystem::path() : self.parent_path()) / "hilbrush-laserguard";
}

bool has_simulated(const CellDeviceOptions& options) {
  return options.robot.index() == 0 || options.table.index() == 0 || options.laser.index() == 0;
}

/// Real devices, and simulated ones where the cell file says so. Simulated devices have a clock of their own,
/// which all devices follow as soon as one is simulated.
class RealDevices final : public CellDevices {
 public:
  RealDevices(const CellDescription& description, const CellDeviceOptions& options,
              const std::filesystem::path& cell_file)
      : lock_(cell_file),
        steady_(time_scale(description)),
        sim_(in_real_time(description)),
        clock_(has_simulated(options) ? sim_.cell().clock : steady_) {
    if (const auto* dobot = std::get_if<DobotOptions>(&options.robot))
      dobot_ = std::make_unique<DobotRobot>(*dobot, clock_);
    if (const auto* axes = std::get_if<ModbusGroupOptions<4>>(&options.robot))
      robot_axes_ = std::make_unique<DriveGroup<4>>("robot", axes->axes, make_drives(*axes, clock_), clock_);
    if (const auto* axes = std::get_if<ModbusGroupOptions<2>>(&options.table))
      table_axes_ = std::make_unique<DriveGroup<2>>("table", axes->axes, make_drives(*axes, clock_), clock_);
    if (const auto* obis = std::get_if<ObisDevice>(&options.laser))
      make_laser(description, {"obis", false, obis->laser, time_scale(description)}, obis->gate);
    if (const auto* cobolt = std::get_if<CoboltDevice>(&options.laser))
      make_laser(description, {"cobolt", cobolt->gate.is_lasers_own, cobolt->laser, time_scale(description)},
                 cobolt->gate);
  }

  Cell cell() override {
    const Cell sim = sim_.cell();
    Robot& robot = dobot_ ? *dobot_ : robot_axes_ ? static_cast<Robot&>(*robot_axes_) : sim.robot;
    Table& table = table_axes_ ? static_cast<Table&>(*table_axes_) : sim.table;
    Laser& laser = laser_ ? static_cast<Laser&>(*laser_) : sim.laser;
    return {robot, table, laser, clock_};
  }
  bool is_simulated() const override { return false; }
  void record_emissions(const std::filesystem::path& file) override {
    if (!laser_) keeper_.record(sim_, file);
  }
  std::vector<std::string> identify_robot() override {
    return dobot_        ? dobot_->identify()
           : robot_axes_ ? robot_axes_->identify()
                         : CellDevices::identify_robot();
  }
  std::vector<std::string> identify_table() override {
    return table_axes_ ? table_axes_->identify() : CellDevices::identify_table();
  }
  std::vector<std::string> identify_laser() override {
    return laser_ ? laser_->identify() : CellDevices::identify_laser();
  }
  Laser::Limits laser_device_limits() override {
    Laser::Limits limits = CellDevices::laser_device_limits();
    if (!laser_) return limits;
    const LaserHead::Powers powers = laser_->head().powers();
    limits.power_min_w = powers.min_w;
    limits.power_max_w = powers.max_w;
    return limits;
  }

 private:
  /// The laser's link belongs to its guard, which turns it off whatever happens to this process.
  void make_laser(const CellDescription& description, const GuardArguments& arguments,
                  const GateOptions& gate) {
    auto process = std::make_shared<GuardProcess>();
    auto launch = [process, arguments] {
      return process->start(guard_beside_program(), to_command_line(arguments));
    };
    const GuardedHead::Options options{.heartbeat_s = arguments.laser.heartbeat_s,
                                       .arm_timeout_s = arguments.laser.arm_timeout_s};
    auto head = std::make_unique<GuardedHead>(std::move(launch), options, clock_);
    Gate& opener = gate.is_lasers_own ? head->gate() : dobot_->gate(gate.output);
    const auto& limits = description.laser;
    laser_ = std::make_unique<GatedLaser>(
        std::move(head), opener,
        Laser::Limits{limits.power_min_w, limits.power_max_w, limits.pulse_min_s, limits.pulse_max_s},
        clock_);
  }

  CellLock lock_;
  SteadyClock steady_;
  EmissionKeeper keeper_;
  SimCell sim_;
  Clock& clock_;
  std::unique_ptr<DobotRobot> dobot_;
  std::unique_ptr<DriveGroup<4>> robot_axes_;
  std::unique_ptr<DriveGroup<2>> table_axes_;
  std::unique_ptr<GatedLaser> laser_;  // last, so that it goes first: it turns off a gate of the robot's
};

}  // namespace

std::unique_ptr<CellDevices> make_cell_devices(const CellDescription& description,
                                               const std::filesystem::path& cell_file) {
  return make_cell_devices(description, load_cell_devices(cell_file), cell_file);
}

std::unique_ptr<CellDevices> make_cell_devices(const CellDescription& description,
                                               const CellDeviceOptions& options,
                                               const std::filesystem::path& cell_file) {
  if (options.is_simulated()) return std::make_unique<SimulatedDevices>(description);
  return std::make_unique<RealDevices>(description, options, cell_file);
}

}  // namespace hilbrush
