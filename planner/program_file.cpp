#include "planner/program_file.h"
