#include "config/job_settings.h"
