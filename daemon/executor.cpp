#include "daemon/executor.h"
