#include "sampling/gaps/voronoi_places.h"

#include <algorithm>
#include <boost/polygon/voronoi.hpp>
#include <cmath>

namespace hilbrush {

std::vector<std::array<std::uint32_t, 3>> voronoi_triples(std::span<const Eigen::Vector2d> points,
                                                          double width) {
  const double steps = 0x1p30 / std::max(1., width);
  boost::polygon::voronoi_builder<std::int32_t> builder;
  for (const Eigen::Vector2d& p : points)
    builder.insert_point(static_cast<std::int32_t>(std::lround(p.x() * steps)),
                         static_cast<std::int32_t>(std::lround(p.y() * steps)));
  boost::polygon::voronoi_diagram<double> diagram;
  builder.construct(&diagram);
  std::vector<std::array<std::uint32_t, 3>> triples;
  triples.reserve(diagram.vertices().size());
  for (const auto& vertex : diagram.vertices()) {
    std::array<std::uint32_t, 3> triple{};
    const auto* edge = vertex.incident_edge();
    for (std::uint32_t& point : triple) {
      point = static_cast<std::uint32_t>(edge->cell()->source_index());
      edge = edge->rot_next();
    }
    triples.push_back(triple);
  }
  return triples;
}

}  // namespace hilbrush
