#include "sampling/images/image_file.h"
