#include "planner/exposure_program.h"
