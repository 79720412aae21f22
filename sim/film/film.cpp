#include "sim/film/film.h"
