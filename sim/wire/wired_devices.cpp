#include "sim/wire/wired_devices.h"

#include <algorithm>
#include <numbers>

#include "sim/wire/laser_heads.h"

namespace hilbrush {
namespace {

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

WiredDevices::WiredDevices(const CellDescription& description, const WireOptions& options)
    : options_(options),
      cell_(description, {options.start_delay_s, options.warm_up_s, options.notice_s}),
      faults_(cell_),
      robot_(cell_, faults_, times_) {
  cell_.set_time_record(&times_);
  const double steps_per_rad = options.steps_per_deg * 180 / std::numbers::pi;
  for (const std::size_t axis : {kTilt, kRotation})
    banks_.push_back(make_bank(options.table, DriveAxis(axis, steps_per_rad, cell_, faults_, times_)));
  faults_.set_alarm([this](WireDevice device) {
    constexpr int kOverload = 0x30;
    if (device == WireDevice::kRobot) robot_.raise_alarm(kOverload);
    if (device == WireDevice::kTable) table_axis(0).raise_alarm(kOverload);
  });
  for (const WireFault& fault : options.faults) faults_.add(fault);  // some begin at once
}

void WiredDevices::observe() {
  robot_.run();
  faults_.observe();
}

void WiredDevices::advance(double now_s) {
  for (;;) {
    const double event_s = next_event_s();
    if (!(event_s <= now_s)) break;
    cell_.advance(event_s);
    observe();
  }
  cell_.advance(now_s);
  observe();
}

double WiredDevices::next_event_s() const {
  return std::min({cell_.next_event_s(), faults_.next_event_s(), robot_.next_event_s()});
}

std::unique_ptr<WireSession> WiredDevices::converse(Conversation about) {
  const ModbusServer::Units units{{1, banks_[0].get()}, {2, banks_[1].get()}};
  switch (about) {
    case Conversation::kDashboard:
      return std::make_unique<DobotTextSession>(DobotTextSession::Port::kDashboard, robot_, cell_, faults_);
    case Conversation::kMotion:
      return std::make_unique<DobotTextSession>(DobotTextSession::Port::kMotion, robot_, cell_, faults_);
    case Conversation::kFeedback:
      return std::make_unique<DobotFeedbackSession>(robot_, cell_, faults_);
    case Conversation::kTableTcp:
      return std::make_unique<ModbusServer>(ModbusServer::Framing::kTcp, units, cell_, faults_);
    case Conversation::kTableRtu:
      return std::make_unique<ModbusServer>(ModbusServer::Framing::kRtu, units, cell_, faults_);
    default:
      break;
  }
  if (options_.laser == WireOptions::LaserHead::kCobolt) return std::make_unique<CoboltLaser>(cell_, faults_);
  return std::make_unique<ObisLaser>(cell_, faults_);
}

}  // namespace hilbrush
