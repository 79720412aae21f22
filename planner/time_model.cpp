#include "planner/time_model.h"
