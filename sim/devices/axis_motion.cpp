#include "sim/devices/axis_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace hilbrush {

double AxisMotion::append(double duration_s, double speed, double acceleration) {
  if (duration_s <= 0) return speed;
  pieces_[piece_count_++] = {end_s_, last_position_, speed, acceleration};
  last_position_ += speed * duration_s + .5 * acceleration * duration_s * duration_s;
  end_s_ += duration_s;
  return speed + acceleration * duration_s;
}

AxisMotion AxisMotion::brake(double start_s, double acceleration) const {
  AxisMotion motion(position(start_s));
  motion.end_s_ = start_s;
  const double v = speed(start_s);
  motion.append(std::abs(v) / acceleration, v, -std::copysign(acceleration, v));
  return motion;
}

AxisMotion AxisMotion::move_to(double target, double start_s, double speed_max, double acceleration) const {
  return move_to(target, start_s, start_s, speed_max, acceleration, acceleration);
}

AxisMotion AxisMotion::move_to(double target, double start_s, double go_s, double speed_max,
                               double acceleration, double braking) const {
  AxisMotion motion = brake(start_s, braking);
  motion.append(go_s - motion.end_s_, 0, 0);
  const double distance = std::abs(target - motion.last_position_);
  const double direction = std::copysign(1., target - motion.last_position_);
  const double peak_speed = std::min(speed_max, std::sqrt(distance * acceleration));
  const double ramp_s = peak_speed / acceleration;
  const double cruise_s = peak_speed > 0 ? distance / peak_speed - ramp_s : 0;
  motion.append(ramp_s, 0, direction * acceleration);
  motion.append(cruise_s, direction * peak_speed, 0);
  motion.append(ramp_s, direction * peak_speed, -direction * acceleration);
  motion.last_position_ = target;  // exactly, whatever the sums rounded to
  return motion;
}

void move_coordinated(std::span<AxisMotion> motions, std::span<const double> target,
                      std::span<const AxisLimits> limits, double start_s) {
  // The whole move is 1 long; of it every axis allows a speed and an acceleration.
  double speed_max = std::numeric_limits<double>::infinity();
  double acceleration = std::numeric_limits<double>::infinity();
  double go_s = start_s;
  std::vector<double> distances;
  for (std::size_t i = 0; i < motions.size(); ++i) {
    const AxisMotion braking = motions[i].brake(start_s, limits[i].acceleration);
    go_s = std::max(go_s, braking.end_s());
    distances.push_back(std::abs(target[i] - braking.target()));
    if (distances[i] <= 0) continue;
    speed_max = std::min(speed_max, limits[i].speed_max / distances[i]);
    acceleration = std::min(acceleration, limits[i].acceleration / distances[i]);
  }
  for (std::size_t i = 0; i < motions.size(); ++i)
    motions[i] = distances[i] > 0 ? motions[i].move_to(target[i], start_s, go_s, distances[i] * speed_max,
                                                       distances[i] * acceleration, limits[i].acceleration)
                                  : motions[i].brake(start_s, limits[i].acceleration);
}

const AxisMotion::Piece* AxisMotion::piece_at(double time_s) const {
  for (int i = piece_count_ - 1; i >= 0; --i)
    if (time_s >= pieces_[i].start_s) return &pieces_[i];
  return nullptr;
}

double AxisMotion::position(double time_s) const {
  if (time_s >= end_s_) return last_position_;
  const Piece* piece = piece_at(time_s);
  if (!piece) return first_position_;
  const double t = time_s - piece->start_s;
  return piece->position + piece->speed * t + .5 * piece->acceleration * t * t;
}

double AxisMotion::speed(double time_s) const {
  if (time_s >= end_s_) return 0;
  const Piece* piece = piece_at(time_s);
  return piece ? piece->speed + piece->acceleration * (time_s - piece->start_s) : 0;
}

}  // namespace hilbrush
