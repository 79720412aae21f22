#pragma once
#include <functional>
#include <memory>
#include <vector>

#include "sim/script/endpoints.h"
#include "sim/wire/time_record.h"
#include "sim/wire/true_cell.h"
#include "sim/wire/wire_options.h"

/// The simulated cell on wires: device servers on TCP ports of this machine (chosen by the system) and
/// pseudo-terminals, all in front of one TrueCell, on a clock that runs at a scale. A thread of its own
/// serves them from construction to destruction. Its public functions may be called from any thread.
namespace hilbrush {

class WireCell {
 public:
  /// @throws std::system_error if no port or pseudo-terminal is available.
  WireCell(const CellDescription& description, const WireOptions& options);
  /// Light that is on ends and is recorded.
  ~WireCell();
  WireCell(const WireCell&) = delete;
  WireCell& operator=(const WireCell&) = delete;

  const WireEndpoints& endpoints() const;
  double now_s() const;
  /// Called on the serving thread (or that of act()), which waits for it.
  void set_emission_sink(EmissionSink sink);
  /// Acts on the cell at its present time: a turn of the key switch, an open interlock, a reading of the
  /// axes.
  void act(const std::function<void(TrueCell&)>& action);
  void add_fault(const WireFault& fault);
  /// Ends all faults, also those that have not begun.
  void clear_faults();
  std::uint64_t faults_begun() const;
  std::uint64_t message_count(WireDevice device) const;
  /// Whose time the dots took, so far.
  std::vector<TimeRecord::Dot> dot_times() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace hilbrush
