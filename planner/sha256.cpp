#include "planner/sha256.h"
