#include "config/cell_file.h"
