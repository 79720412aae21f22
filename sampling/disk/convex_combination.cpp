#include "sampling/disk/convex_combination.h"

#include <metis.h>

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseLU>
#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <numeric>

#include "sampling/base/check.h"

namespace hilbrush {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

/// Of a cotangent weight: a map without flipped faces needs positive ones, and an accurate factor needs
/// bounded ones.
constexpr double kMinWeight = 1e-4;
constexpr double kMaxWeight = 1e3;
/// Vertices; for smaller graphs METIS gains nothing.
constexpr std::size_t kSmallGraph = 2000;

double cotan_half(const Disk& disk, std::uint32_t face, std::size_t from, std::size_t to) {
  const std::size_t apex = 3 - from - to;
  const Triangle& f = disk.faces()[face];
  const Eigen::Vector3d u = disk.positions()[f[from]] - disk.positions()[f[apex]];
  const Eigen::Vector3d v = disk.positions()[f[to]] - disk.positions()[f[apex]];
  const double sine = u.cross(v).norm(), cosine = u.dot(v);
  // A triangle (almost) without area gets a finite weight, so that its neighbor's still counts.
  constexpr double kMaxHalf = 100 * kMaxWeight;
  return std::abs(cosine) < 2 * kMaxHalf * sine ? .5 * cosine / sine : std::copysign(kMaxHalf, cosine);
}

double mean_value_half(const Disk& disk, std::uint32_t face, std::size_t from, std::size_t to) {
  const Triangle& f = disk.faces()[face];
  const double length = (disk.positions()[f[to]] - disk.positions()[f[from]]).norm();
  const double weight = length > 0 ? std::tan(disk.angle(face, from) / 2) / length : 0;
  return std::max(weight, 1e-12);
}

/// `half(face, from, to)`: what a face gives to the arc between two of its corners. `limit` sees the sum of
/// both halves.
template <class Half, class Limit>
WeightedGraph make_graph(const Disk& disk, Half half, Limit limit) {
  WeightedGraph graph;
  const auto& faces = disk.faces();
  const auto is_first = [&](TriangleSide side) {
    const TriangleSide across = disk.neighbors()[side.triangle][side.side];
    return across == kNoSide || side.triangle < across.triangle ||
           (side.triangle == across.triangle && side.side < across.side);
  };
  const auto for_each_edge = [&](auto visit) {
    for (std::uint32_t f = 0; f < faces.size(); ++f)
      for (std::uint8_t s = 0; s < 3; ++s)
        if (is_first({f, s})) visit(TriangleSide{f, s});
  };
  graph.begin.assign(disk.positions().size() + 1, 0);
  for_each_edge([&](TriangleSide side) {
    ++graph.begin[disk.from(side) + 1];
    ++graph.begin[disk.to(side) + 1];
  });
  std::partial_sum(graph.begin.begin(), graph.begin.end(), graph.begin.begin());
  graph.to.resize(graph.begin.back());
  graph.weight.resize(graph.begin.back());
  std::vector<std::uint32_t> next(graph.begin.begin(), graph.begin.end() - 1);
  for_each_edge([&](TriangleSide side) {
    const std::size_t i = side.side, j = (i + 1) % 3;
    double forward = half(disk, side.triangle, i, j), back = half(disk, side.triangle, j, i);
    if (const TriangleSide across = disk.neighbors()[side.triangle][side.side]; across != kNoSide) {
      const std::size_t k = across.side, l = (k + 1) % 3;
      forward += half(disk, across.triangle, l, k);
      back += half(disk, across.triangle, k, l);
    }
    const auto add = [&](std::uint32_t v, std::uint32_t w, double weight) {
      graph.to[next[v]] = w;
      graph.weight[next[v]++] = limit(weight);
    };
    add(disk.from(side), disk.to(side), forward);
    add(disk.to(side), disk.from(side), back);
  });
  return graph;
}

/// The row of each free vertex in the system: along `order`, -1 for fixed ones.
struct FreeVertices {
  std::vector<int> index;
  std::vector<std::uint32_t> vertices;

  FreeVertices(const std::vector<std::uint32_t>& order, const std::vector<char>& is_fixed)
      : index(is_fixed.size(), -1) {
    for (const auto v : order)
      if (!is_fixed[v]) {
        index[v] = static_cast<int>(vertices.size());
        vertices.push_back(v);
      }
  }
};

/// The linear system of the free vertices; of a symmetric one only up to the diagonal of each row. The terms
/// of the fixed vertices are in the right sides.
struct System {
  Sparse rows;  ///< column i holds row i
  Eigen::MatrixXd right;

  System(const WeightedGraph& graph, const FreeVertices& free, bool is_symmetric,
         const Eigen::Ref<const Eigen::MatrixXd>& values) {
    const auto n = static_cast<Eigen::Index>(free.vertices.size());
    right = Eigen::MatrixXd::Zero(n, values.cols());
    rows.resize(n, n);
    rows.resizeNonZeros(static_cast<Eigen::Index>(graph.to.size()) + n);
    int at = 0;
    const auto put = [&](int j, double value) {
      rows.innerIndexPtr()[at] = j;
      rows.valuePtr()[at++] = value;
    };
    for (int i = 0; i < n; ++i) {
      rows.outerIndexPtr()[i] = at;
      const std::uint32_t v = free.vertices[static_cast<std::size_t>(i)];
      double sum = 0;
      for (auto a = graph.begin[v]; a < graph.begin[v + 1]; ++a) {
        sum += graph.weight[a];
        const int j = free.index[graph.to[a]];
        if (j < 0)
          right.row(i) += graph.weight[a] * values.row(graph.to[a]);
        else if (!is_symmetric || j < i)
          put(j, -graph.weight[a]);
      }
      put(i, sum);
    }
    rows.outerIndexPtr()[n] = at;
    rows.resizeNonZeros(at);
  }
};

template <class Solver>
bool solve(const Solver& solver, const FreeVertices& free, const Eigen::MatrixXd& right,
           Eigen::Ref<Eigen::MatrixXd> values) {
  if (solver.info() != Eigen::Success) return false;
  const Eigen::MatrixXd solution = solver.solve(right);
  if (!solution.allFinite()) return false;
  for (std::size_t i = 0; i < free.vertices.size(); ++i)
    values.row(free.vertices[i]) = solution.row(static_cast<Eigen::Index>(i));
  return true;
}

std::vector<std::uint32_t> dissected(const WeightedGraph& graph) {
  auto vertex_count = static_cast<idx_t>(graph.vertex_count());
  std::vector<idx_t> begin(graph.begin.begin(), graph.begin.end()), to(graph.to.begin(), graph.to.end());
  std::vector<idx_t> order(graph.vertex_count()), place(graph.vertex_count());
  // METIS uses the C library's only rand(), which each call seeds again.
  static std::mutex metis;
  const std::lock_guard lock(metis);
  std::array<idx_t, METIS_NOPTIONS> options{};
  METIS_SetDefaultOptions(options.data());
  options[METIS_OPTION_COMPRESS] = 0;  // no two vertices of a mesh have the same neighbors
  const int result = METIS_NodeND(&vertex_count, begin.data(), to.data(), nullptr, options.data(),
                                  order.data(), place.data());
  CHECK(result == METIS_OK);
  return {order.begin(), order.end()};
}

std::vector<std::uint32_t> least_degree(const WeightedGraph& graph) {
  const std::vector<char> none(graph.vertex_count(), 0);
  std::vector<std::uint32_t> order(graph.vertex_count());
  std::iota(order.begin(), order.end(), 0u);
  const auto n = static_cast<Eigen::Index>(graph.vertex_count());
  // Transposing sorts the columns, which AMD wants.
  const Sparse pattern =
      System(graph, FreeVertices(order, none), false, Eigen::MatrixXd(n, 0)).rows.transpose();
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation;
  Eigen::AMDOrdering<int>()(pattern, permutation);
  for (std::size_t i = 0; i < order.size(); ++i)
    order[i] = static_cast<std::uint32_t>(permutation.indices()[static_cast<Eigen::Index>(i)]);
  return order;
}

}  // namespace

WeightedGraph cotan_graph(const Disk& disk) {
  return make_graph(disk, cotan_half,
                    [](double weight) { return std::clamp(weight, kMinWeight, kMaxWeight); });
}

WeightedGraph mean_value_graph(const Disk& disk) {
  return make_graph(disk, mean_value_half, [](double weight) { return weight; });
}

std::vector<std::uint32_t> elimination_order(const WeightedGraph& graph) {
  return graph.vertex_count() < kSmallGraph ? least_degree(graph) : dissected(graph);
}

bool solve_symmetric(const WeightedGraph& graph, const std::vector<std::uint32_t>& order,
                     const std::vector<char>& is_fixed, Eigen::Ref<Eigen::MatrixXd> values) {
  const FreeVertices free(order, is_fixed);
  if (free.vertices.empty()) return true;
  const System system(graph, free, true, values);
  // The vertices are in order already. The lower rows of a symmetric matrix are its upper columns.
  const Eigen::SimplicialLDLT<Sparse, Eigen::Upper, Eigen::NaturalOrdering<int>> solver(system.rows);
  return solve(solver, free, system.right, values);
}

bool solve_general(const WeightedGraph& graph, const std::vector<char>& is_fixed,
                   Eigen::Ref<Eigen::MatrixXd> values) {
  std::vector<std::uint32_t> order(graph.vertex_count());
  std::iota(order.begin(), order.end(), 0u);
  const FreeVertices free(order, is_fixed);
  if (free.vertices.empty()) return true;
  const System system(graph, free, false, values);
  const Sparse matrix = system.rows.transpose();
  Eigen::SparseLU<Sparse, Eigen::COLAMDOrdering<int>> solver;
  solver.compute(matrix);
  return solve(solver, free, system.right, values);
}

}  // namespace hilbrush
