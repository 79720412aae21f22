#pragma once
#include <cstddef>
#include <vector>

#include "sim/script/fault_script.h"

/// Whose time a dot takes: the devices' own, or what their controller adds. A device's own time ends with the
/// first frame or reply that shows it at rest and settled (or, after a pulse, dark); the time from there
/// until its next order was added. All times are the devices', on the cell's clock. One thread, the cell's.
namespace hilbrush {

class TimeRecord {
 public:
  /// One dot: before its light, and from its end to the next motion.
  struct Dot {
    double light_on_s = 0;
    double light_off_s = 0;
    double before_s = 0;  ///< from the last device's being seen settled to the light
    double after_s = 0;   ///< from the light's being seen off to the next motion; 0 for the last dot
  };

  void note_motion(WireDevice device, double now_s);
  void note_light(bool is_on, double now_s);
  /// A frame or reply left that shows `device` in position and settled.
  void note_settled_shown(WireDevice device, double now_s);
  /// A frame or reply left that shows the gate closed.
  void note_dark_shown(double now_s);
  const std::vector<Dot>& dots() const { return dots_; }
  void clear() { *this = {}; }

 private:
  static constexpr std::size_t kDotsMax = 1u << 22;
  double robot_shown_s_ = 0;
  double table_shown_s_ = 0;
  double dark_shown_s_ = 0;
  bool is_robot_shown_ = true;
  bool is_table_shown_ = true;
  bool is_dark_shown_ = true;
  bool has_moved_ = true;
  std::vector<Dot> dots_;
};

}  // namespace hilbrush
