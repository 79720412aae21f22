#pragma once
#include <string>
#include <vector>

#include "drivers/laser/line_laser.h"

namespace hilbrush {

/// A Coherent OBIS laser in external digital modulation: emission is armed once per job, a digital line gates it.
/// Handshake on, prompt off, CDRH delay on, autostart off; all read back. Nothing of it is fast enough to gate by.
class ObisHead final : public LineLaser {
 public:
  ObisHead(const LaserOptions& options, Clock& clock) : LineLaser(options, 0, clock) {}
  ~ObisHead() override { end_polling(); }

  std::vector<std::string> identify() override;

 private:
  std::string exchange(Link& link, LineReader& lines, const std::string& command, Deadline deadline) override;
  void set_up() override;
  Powers read_powers() override;
  Condition read_condition() override;
  void prepare_arming() override;
  void order_emission() override;
  void stop_emission(double wall_s) override;
  void order_power(double power_w) override;
  double read_power() override;

  void set_switch(const std::string& name, bool is_on);
  std::string read_faults();
};

}  // namespace hilbrush
