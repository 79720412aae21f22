#pragma once
#include <string>
#include <vector>

#include "drivers/laser/line_laser.h"

namespace hilbrush {

/// A Coherent OBIS laser in external digital modulation: emission is armed once per job, a digital line gates
/// it. Handshake on, prompt off, CDRH delay on, autostart off; all read back. Nothing of it is fast enough to
/// gate by.
class ObisHead final : public LineLaser {
 public:
  ObisHead(const LaserOptions& options, Clock& clock) : LineLaser(options, 0, clock) {}
  ~ObisHead() override { end_polling(); }

 private:
  std::string exchange(Link& link, LineReader& lines, const std::string& command, Deadline deadline) override;
  void set_up() override;
  std::vector<std::string> read_names() override;
  Powers read_powers() override;
  Condition read_condition() override;
  /// As the laser has them now, also those that stop nothing.
  std::string read_faults(const Condition& condition) override;
  void prepare_arming() override;
  void order_emission() override;
  void stop_emission(double wall_s) override;
  void order_power(double power_w) override;
  double read_power() override;

  std::string ask_faults();
  void set_switch(const std::string& name, bool is_on);
};

}  // namespace hilbrush
