#include "sim/devices/sim_cell.h"
