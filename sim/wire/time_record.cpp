#include "sim/wire/time_record.h"

#include <algorithm>

namespace hilbrush {

void TimeRecord::note_motion(WireDevice device, double now_s) {
  (device == WireDevice::kRobot ? is_robot_shown_ : is_table_shown_) = false;
  if (has_moved_) return;
  has_moved_ = true;
  if (is_dark_shown_ && !dots_.empty()) dots_.back().after_s = now_s - dark_shown_s_;
}

void TimeRecord::note_light(bool is_on, double now_s) {
  if (!is_on) {
    if (!dots_.empty()) dots_.back().light_off_s = now_s;
    is_dark_shown_ = false;
    return;
  }
  if (dots_.size() >= kDotsMax) return;
  has_moved_ = false;
  dots_.push_back(
      {.light_on_s = now_s, .before_s = now_s - std::max({robot_shown_s_, table_shown_s_, dark_shown_s_})});
}

void TimeRecord::note_settled_shown(WireDevice device, double now_s) {
  bool& is_shown = device == WireDevice::kRobot ? is_robot_shown_ : is_table_shown_;
  if (!is_shown) (device == WireDevice::kRobot ? robot_shown_s_ : table_shown_s_) = now_s;
  is_shown = true;
}

void TimeRecord::note_dark_shown(double now_s) {
  if (!is_dark_shown_) dark_shown_s_ = now_s;
  is_dark_shown_ = true;
}

}  // namespace hilbrush
