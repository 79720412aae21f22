#pragma once
#include <span>
#include <vector>

#include "sampling/predictive/predictive_loop.h"
#include "sampling/tone/tone_field.h"
#include "sim/film/film.h"

/// Wanted and painted coverage as the eye takes them in: Gaussian means on the surface.
namespace hilbrush {

struct PictureMeans {
  double wanted = 0, painted = 0;
};

/// Area-weighted Gaussian means around `center`, sigma `sigmas[k]` pitches in the tangent plane, cut at 3
/// sigma, only of film that faces the point and lies within 3 sigma of depth. `points` is room for the film's
/// nodes. A piece of surface too small to own a node within reach: the point itself. Without `tone` wanted
/// stays 0, which saves half the time.
void read_means(const Film& film, const ToneField* tone, const SurfacePoint& center,
                std::span<const double> sigmas, std::span<PictureMeans> means,
                std::vector<FilmPoint>& points);

/// What the predictive loop asks: a film on which every dot is exposed at normal incidence by a perfect cell.
/// Keeps references. Same answers for any number of threads. Memory: a film, see film_lattice.h.
PicturePredictor film_predictor(const CellDescription& cell, const ToneField& tone);

/// Exposes dots straight where they lie, with their levels.
void expose_dots(Film& film, const DotSequence& dots);

}  // namespace hilbrush
