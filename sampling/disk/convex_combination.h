#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "sampling/disk/disk.h"

/// Maps in which every inner vertex is a weighted mean of its neighbors (Tutte 1963, Floater 1997): the
/// weights, and the sparse solve.
namespace hilbrush {

/// Both directions of every edge, by the vertex where they begin, with their weights, all above 0.
struct WeightedGraph {
  std::vector<std::uint32_t> begin;  ///< #V + 1
  std::vector<std::uint32_t> to;
  std::vector<double> weight;

  std::size_t vertex_count() const { return begin.size() - 1; }
};

/// Half the sum of the two opposite cotangents, no less than a small share: as conformal as positive weights
/// can be. Symmetric.
WeightedGraph cotan_graph(const Disk& disk);
/// Floater's mean values: valid with a fixed convex boundary on any triangle, not symmetric.
WeightedGraph mean_value_graph(const Disk& disk);

/// An order of elimination with little fill-in (nested dissection by METIS), the same for any set of fixed
/// vertices.
std::vector<std::uint32_t> elimination_order(const WeightedGraph& graph);

/// Solves for the vertices that are not fixed: each becomes the mean of its neighbors. Row v of `values` is
/// vertex v's. Fixed ones are given, the others are written. False if the factor fails. Symmetric weights: a
/// Cholesky factor, about .7 s for 134,000 vertices.
bool solve_symmetric(const WeightedGraph& graph, const std::vector<std::uint32_t>& order,
                     const std::vector<char>& is_fixed, Eigen::Ref<Eigen::MatrixXd> values);
/// Any weights: an LU factor, several times slower.
bool solve_general(const WeightedGraph& graph, const std::vector<char>& is_fixed,
                   Eigen::Ref<Eigen::MatrixXd> values);

}  // namespace hilbrush
