#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "sim/script/fault_script.h"
#include "sim/wire/true_cell.h"

/// Makes a fault script happen: it is called for every message and as time passes, decides what happens to an
/// exchange, and acts on the cell. One thread, the cell's.
namespace hilbrush {

class FaultInjector {
 public:
  /// `alarm`: raises the robot's or the table's own alarm.
  using RaiseAlarm = std::function<void(WireDevice)>;

  explicit FaultInjector(TrueCell& cell) : cell_(cell) {}
  void set_alarm(RaiseAlarm alarm) { raise_alarm_ = std::move(alarm); }

  void add(const WireFault& fault);
  /// Forgets what has not happened, ends what lasts.
  void clear();
  /// The cell has come to its present time or changed: looks for phases that began, and faults that begin or
  /// end.
  void observe();
  /// What happens to the message that the device receives now; nothing: it is obeyed and answered.
  std::optional<WireFault> on_message(WireDevice device);
  bool is_stale(WireDevice device) const { return lasts(WireFaultKind::kStaleInPosition, device); }
  /// A serial line that is down.
  bool is_line_down(WireDevice device) const { return lasts(WireFaultKind::kDroppedConnection, device); }
  void set_line_down(WireDevice device, double duration_s);
  /// How often all connections of the device were cut at once: sessions that began before the last time are
  /// over.
  std::uint64_t cut_count(WireDevice device) const { return cuts_[static_cast<std::size_t>(device)]; }
  double next_event_s() const;
  std::uint64_t begun_count() const { return begun_count_; }
  std::uint64_t message_count(WireDevice device) const { return messages_[static_cast<std::size_t>(device)]; }
  std::uint64_t phase_count(CellPhase phase) const { return phases_[static_cast<std::size_t>(phase)]; }

 private:
  struct Waiting {
    WireFault fault;
    double due_s;  ///< once its phase has begun; infinity before
  };
  struct Lasting {
    WireFault fault;
    double until_s;
  };
  bool lasts(WireFaultKind kind, WireDevice device) const;
  bool is_due(const Waiting& waiting) const;
  bool cut_connections(const WireFault& fault);
  void begin(const WireFault& fault);
  void end(const WireFault& fault);

  TrueCell& cell_;
  RaiseAlarm raise_alarm_;
  std::vector<Waiting> waiting_;
  std::vector<WireFault> of_exchange_;  ///< begun, and not yet met by enough messages
  std::vector<Lasting> lasting_;
  std::array<std::uint64_t, 3> messages_{};
  std::array<std::uint64_t, 3> cuts_{};
  std::array<std::uint64_t, 4> phases_{};
  CellPhase phase_ = CellPhase::kSettled;
  std::uint64_t begun_count_ = 0;
};

}  // namespace hilbrush
