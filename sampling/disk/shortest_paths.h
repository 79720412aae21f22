#pragma once
#include <cstdint>
#include <functional>
#include <limits>
#include <queue>
#include <span>
#include <utility>
#include <vector>

namespace hilbrush {

/// Lengths of the shortest paths (Dijkstra) from the nearest of `sources` to every node of a graph; infinite
/// where none leads. `visit_arcs(node, reach)` is called once or more for each node, and calls reach(next,
/// length) for each arc that leaves it: true if the path to `next` by this arc is the shortest so far.
template <class VisitArcs>
std::vector<double> shortest_distances(std::size_t node_count, std::span<const std::uint32_t> sources,
                                       VisitArcs visit_arcs) {
  std::vector<double> distances(node_count, std::numeric_limits<double>::infinity());
  using Entry = std::pair<double, std::uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  for (const std::uint32_t source : sources) {
    distances[source] = 0;
    queue.push({0, source});
  }
  while (!queue.empty()) {
    const auto [distance, node] = queue.top();
    queue.pop();
    if (distance > distances[node]) continue;
    visit_arcs(node, [&queue, &distances, so_far = distance](std::uint32_t next, double length) {
      const double longer = so_far + length;
      if (!(longer < distances[next]))
        return false;  // also of a length that is not a number, which would never end
      distances[next] = longer;
      queue.push({longer, next});
      return true;
    });
  }
  return distances;
}

}  // namespace hilbrush
