#include "sampling/tone/boundary_sum.h"

namespace hilbrush {
namespace {

/// Four numbers side by side: one register with AVX2, two without. No products are fused, so that both give
/// the same bits.
using Four = double __attribute__((vector_size(BoundarySum::kLanes * sizeof(double))));

/// Gauss, three places about the middle of a piece: exact to degree 5.
constexpr double kOff = 0.3872983346207417;
constexpr double kAtMiddle = 4. / 9, kAtSides = 5. / 18;

struct FourTotals {
  Four mass, first_x, first_y, square;
};

/// Vectors go by reference: how they are returned differs between machines.
[[gnu::always_inline]] inline void load(Four& four, const BoundarySum::Pieces::Numbers& numbers,
                                        std::size_t i) {
  __builtin_memcpy(&four, &numbers[i], sizeof four);
}

/// What four pieces have in their cells.
struct FourCells {
  [[gnu::always_inline]] explicit FourCells(const BoundaryCell* const* cells) {
    const BoundaryCell &p = *cells[0], &q = *cells[1], &u = *cells[2], &v = *cells[3];
    left = Four{p.left, q.left, u.left, v.left};
    low = Four{p.low, q.low, u.low, v.low};
    a = Four{p.tones.a, q.tones.a, u.tones.a, v.tones.a};
    across = Four{p.tones.b, q.tones.b, u.tones.b, v.tones.b} - a;
    up = Four{p.tones.c, q.tones.c, u.tones.c, v.tones.c};
    twist = Four{p.tones.d, q.tones.d, u.tones.d, v.tones.d} - up - across;
    up -= a;
    f = Four{p.sums.f, q.sums.f, u.sums.f, v.sums.f};
    g_f = Four{p.sums.g, q.sums.g, u.sums.g, v.sums.g} - f;
    xf = Four{p.sums.xf, q.sums.xf, u.sums.xf, v.sums.xf};
    xg_xf = Four{p.sums.xg, q.sums.xg, u.sums.xg, v.sums.xg} - xf;
    ff = Four{p.sums.ff, q.sums.ff, u.sums.ff, v.sums.ff};
    fg = Four{p.sums.fg, q.sums.fg, u.sums.fg, v.sums.fg};
    gg = Four{p.sums.gg, q.sums.gg, u.sums.gg, v.sums.gg};
  }

  /// Adds the integrands at (s, t).
  [[gnu::always_inline]] void add(FourTotals& sum, double weight, const Four& s, const Four& t) const {
    const Four u = 1 - t, level = a + t * up, bend = s * (across + t * twist);
    const Four half = level + .5 * bend, third = bend * (1. / 3);
    const Four here = s * half, weighted = weight * (f + t * g_f + here);
    sum.mass += weighted;
    sum.first_x += weight * (xf + t * xg_xf + left * here + s * s * (.5 * level + third));
    sum.first_y += weighted * (low + t);
    sum.square +=
        weight * (u * (u * ff + t * (2 * fg)) + t * t * gg + s * (level * level + bend * (level + third)));
  }

  Four a, across, up, twist;  // the tone is a + s across + t up + s t twist
  Four left, low;
  Four f, g_f, xf, xg_xf, ff, fg, gg;
};

[[gnu::always_inline]] inline double sum_of(const Four& four) {
  return (four[0] + four[1]) + (four[2] + four[3]);
}

[[gnu::always_inline]] inline void add_up(const BoundarySum::Pieces& pieces, std::size_t count,
                                          TexelIntegral& total) {
  FourTotals totals{};
  for (std::size_t i = 0; i < count; i += BoundarySum::kLanes) {
    const FourCells cells(&pieces.cells[i]);
    Four s, t, ds, dt;
    load(s, pieces.s, i), load(t, pieces.t, i), load(ds, pieces.ds, i), load(dt, pieces.dt, i);
    s += .5 * ds;
    t += .5 * dt;
    FourTotals sum{};
    cells.add(sum, kAtSides, s - kOff * ds, t - kOff * dt);
    cells.add(sum, kAtMiddle, s, t);
    cells.add(sum, kAtSides, s + kOff * ds, t + kOff * dt);
    totals.mass += dt * sum.mass;
    totals.first_x += dt * sum.first_x;
    totals.first_y += dt * sum.first_y;
    totals.square += dt * sum.square;
  }
  total.mass += sum_of(totals.mass);
  total.first += Eigen::Vector2d(sum_of(totals.first_x), sum_of(totals.first_y));
  total.square += sum_of(totals.square);
}

using AddUp = void (*)(const BoundarySum::Pieces& pieces, std::size_t count, TexelIntegral& total);

void add_up_anywhere(const BoundarySum::Pieces& pieces, std::size_t count, TexelIntegral& total) {
  add_up(pieces, count, total);
}

#if defined(__x86_64__)
[[gnu::target("avx2")]] void add_up_with_avx2(const BoundarySum::Pieces& pieces, std::size_t count,
                                              TexelIntegral& total) {
  add_up(pieces, count, total);
}
const AddUp kAddUpHere = __builtin_cpu_supports("avx2") ? add_up_with_avx2 : add_up_anywhere;
#else
const AddUp kAddUpHere = add_up_anywhere;
#endif

}  // namespace

void BoundarySum::flush() {
  // A piece without height adds nothing.
  static const BoundaryCell kNowhere{};
  while (count_ % kLanes != 0) add(0, 0, 0, 0, kNowhere);
  kAddUpHere(pieces_, count_, total_);
  count_ = 0;
}

}  // namespace hilbrush
