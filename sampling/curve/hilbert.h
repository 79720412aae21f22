#pragma once
#include <array>
#include <bit>
#include <cstdint>

/// The Hilbert curve as integers: in which order a quad's four children (or a cube's eight) are walked, and
/// how the curve turns in each. A child is named by its slot: bit 0 is the upper half in x, bit 1 in y, bit 2
/// in z.
namespace hilbrush {

/// In the plane: the permutation table of the thesis (table 4.1, figure 4.3). The curve starts at the lower
/// left corner of the square and ends at the lower right one.
struct HilbertQuad {
  static constexpr unsigned kSide = 2;        ///< children along a side
  static constexpr unsigned kChildCount = 4;  ///< kSide^2
  static constexpr unsigned kPermutationCount = 4;
  std::uint8_t permutation = 0;  ///< A, B, C or D

  /// Slot of the i-th child along the curve: column + kSide * row.
  constexpr unsigned slot(unsigned i) const { return kSlots[permutation][i]; }
  constexpr HilbertQuad child(unsigned i) const { return {kPermutations[permutation][i]}; }
  /// How the curve runs in the square to the right of this one, if both are walked one after the other.
  constexpr HilbertQuad next_square() const { return {kA}; }

 private:
  enum Permutation : std::uint8_t { kA, kB, kC, kD };
  static constexpr std::array<std::array<std::uint8_t, 4>, 4> kPermutations{
      {{kB, kA, kA, kD}, {kA, kB, kB, kC}, {kD, kC, kC, kB}, {kC, kD, kD, kA}}};
  static constexpr std::array<std::array<std::uint8_t, 4>, 4> kSlots{
      {{0, 2, 3, 1}, {0, 1, 3, 2}, {3, 1, 0, 2}, {3, 2, 0, 1}}};

 public:
  constexpr HilbertQuad(std::uint8_t p = kA) : permutation(p) {}
};

/// In space: Gray code with entry corner and direction, after Hamilton, "Compact Hilbert Indices", 2006.
struct HilbertCube {
  static constexpr unsigned kSide = 2;
  static constexpr unsigned kChildCount = 8;
  std::uint8_t entry = 0;      ///< the corner where the curve comes in
  std::uint8_t direction = 0;  ///< the axis along which it leaves, counted down by one

  unsigned slot(unsigned i) const { return rotate(gray(i), direction + 1u) ^ entry; }
  HilbertCube child(unsigned i) const {
    const unsigned e = i == 0 ? 0 : gray(2 * ((i - 1) / 2));
    const unsigned turn = i == 0 ? 0u : static_cast<unsigned>(std::countr_one(i % 2 == 0 ? i - 1 : i)) % 3;
    return {static_cast<std::uint8_t>(entry ^ rotate(e, direction + 1u)),
            static_cast<std::uint8_t>((direction + turn + 1) % 3)};
  }

 private:
  static constexpr unsigned gray(unsigned i) { return i ^ (i >> 1); }
  static constexpr unsigned rotate(unsigned bits, unsigned by) {
    by %= 3;
    return ((bits << by) | (bits >> (3 - by))) & 7u;
  }

 public:
  constexpr HilbertCube(std::uint8_t e = 0, std::uint8_t d = 0) : entry(e), direction(d) {}
};

}  // namespace hilbrush
