#include "daemon/journal.h"
