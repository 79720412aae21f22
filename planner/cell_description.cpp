#include "planner/cell_description.h"
