#pragma once
#include "drivers/axis_group.h"
#include "drivers/clock.h"
#include "drivers/laser.h"

namespace hilbrush {

/// The devices of one cell, behind their interfaces. The owner outlives every user.
struct Cell {
  Robot& robot;
  Table& table;
  Laser& laser;
  Clock& clock;
};

}  // namespace hilbrush
