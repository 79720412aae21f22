#include "sampling/dots/path_meter.h"

#include <cmath>

namespace hilbrush {
namespace {

double path_constant(double length_m, std::uint64_t count, double area_m2) {
  return count > 1 && area_m2 > 0 ? length_m / std::sqrt(static_cast<double>(count) * area_m2) : 0;
}

}  // namespace

PathMeter::PathMeter(SampleReport& report) : report_(report) {
  report.path_length_m = 0;
  for (ComponentPath& path : report.components) {
    path.dot_count = 0;
    path.path_length_m = 0;
  }
}

void PathMeter::follow(std::span<const Dot> dots) {
  for (const Dot& dot : dots) {
    const double step_m = count_ > 0 ? (dot.position_O - last_O_).norm() : 0;
    report_.path_length_m += step_m;
    if (dot.component < report_.components.size()) {
      ComponentPath& path = report_.components[dot.component];
      ++path.dot_count;
      if (dot.component == last_component_) path.path_length_m += step_m;
    }
    ++count_;
    last_O_ = dot.position_O;
    last_component_ = dot.component;
  }
}

void PathMeter::finish() {
  report_.path_constant = path_constant(report_.path_length_m, count_, report_.painted_area_m2);
  for (ComponentPath& path : report_.components)
    path.path_constant = path_constant(path.path_length_m, path.dot_count, path.painted_area_m2);
}

}  // namespace hilbrush
