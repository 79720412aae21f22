#include "daemon/pipeline/quality/figures.h"

#include <nlohmann/json.hpp>

#include "sampling/base/input_error.h"

namespace hilbrush {
namespace {

using Json = nlohmann::ordered_json;

void measure_plane(const MeasuredDots& dots, const TestShapes& shapes, SizedFigures& figures) {
  const auto found = plane_discrepancies(dots.plane_points, shapes);
  figures.discrepancy = {{"rectangles", found[0]}, {"quarter_circles", found[1]}, {"triangles", found[2]}};
  figures.spacing = plane_spacing(dots.plane_points);
  figures.largest_hole = plane_largest_hole(dots.plane_points);
  figures.path_constant = path_constant(dots.plane_points);
  figures.spectrum = plane_spectrum(dots.plane_points);
}

void measure_surface(const SurfaceQuality& surface, const MeasuredDots& dots, const TestShapes& shapes,
                     SizedFigures& figures) {
  const std::vector<std::span<const Dot>> sets{dots.dots};
  figures.discrepancy["triangle_sets"] = surface.triangle_sets(sets, shapes).front();
  figures.discrepancy["balls"] = surface.balls(sets, shapes).front();
  if (!dots.directions.empty())
    figures.discrepancy["spherical_triangles"] = sphere_discrepancy(dots.directions, shapes);
  figures.spacing = surface.spacing(dots.dots);
  figures.largest_hole = surface.largest_hole(dots.dots);
  figures.path_constant = surface.path_constant(dots.dots);
  try {
    figures.spectrum = surface.spectrum(dots.dots, shapes.seed);
  } catch (const InputError& error) {
    figures.no_spectrum = error.sentence();
  }
}

Json json_of(const Discrepancy& discrepancy) {
  return {{"rms", discrepancy.rms}, {"largest", discrepancy.largest}};
}

Json json_of(const Spectrum& spectrum, bool is_whole) {
  Json json{{"below_half", spectrum.below_half},
            {"below_quarter", spectrum.below_quarter},
            {"peak", spectrum.peak}};
  json["anisotropy"] = spectrum.directions.empty() ? Json(nullptr) : Json(spectrum.anisotropy);
  if (!is_whole) return json;
  Json rings = Json::array();
  for (const Spectrum::Ring& ring : spectrum.rings)
    rings.push_back({ring.frequency, ring.power, ring.anisotropy});
  json["rings"] = std::move(rings);
  json["directions"] = spectrum.directions;
  return json;
}

}  // namespace

SizedFigures measure(const MeasuredSet& set, const MeasuredDots& dots, const TestShapes& shapes) {
  SizedFigures figures;
  figures.count = std::max(dots.dots.size(), dots.plane_points.size());
  const SurfaceQuality* surface = set.surface();
  if (!surface) return figures;
  if (!dots.plane_points.empty())
    measure_plane(dots, shapes, figures);
  else
    measure_surface(*surface, dots, shapes, figures);
  return figures;
}

Json json_of(const SizedFigures& figures, bool is_whole) {
  Json json{{"count", figures.count}};
  Json& discrepancy = json["discrepancy"] = Json::object();
  for (const auto& [shapes, value] : figures.discrepancy) discrepancy[shapes] = json_of(value);
  if (figures.spacing)
    json["spacing"] = {{"smallest", figures.spacing->smallest},
                       {"mean", figures.spacing->mean},
                       {"spread", figures.spacing->spread}};
  if (figures.largest_hole) json["largest_hole"] = *figures.largest_hole;
  if (figures.path_constant) json["path_constant"] = *figures.path_constant;
  json["spectrum"] = figures.spectrum ? json_of(*figures.spectrum, is_whole) : Json(nullptr);
  if (!figures.no_spectrum.empty()) json["no_spectrum"] = figures.no_spectrum;
  return json;
}

Json slopes_of(const std::vector<SizedFigures>& sizes) {
  Json slopes = Json::object();
  if (sizes.size() < 2) return slopes;
  for (const auto& [shapes, unused] : sizes.front().discrepancy) {
    std::vector<double> counts, rms, largest;
    for (const SizedFigures& figures : sizes) {
      counts.push_back(static_cast<double>(figures.count));
      rms.push_back(figures.discrepancy.at(shapes).rms);
      largest.push_back(figures.discrepancy.at(shapes).largest);
    }
    slopes[shapes] = {{"rms", log_log_slope(counts, rms)}, {"largest", log_log_slope(counts, largest)}};
  }
  return slopes;
}

}  // namespace hilbrush
