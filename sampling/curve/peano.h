#pragma once
#include <array>
#include <cstdint>

/// The Peano II curve as integers, with the same interface as HilbertQuad.
namespace hilbrush {

/// In the plane: the permutation table of the thesis (table 4.2, figure 4.4). In permutation A the curve
/// starts at the lower left corner of the square, winds up, down and up, and ends at the upper right one; C
/// is A mirrored in x, D is A mirrored in y, B is both.
struct PeanoQuad {
  static constexpr unsigned kSide = 3;        ///< children along a side
  static constexpr unsigned kChildCount = 9;  ///< kSide^2
  static constexpr unsigned kPermutationCount = 4;
  std::uint8_t permutation = 0;  ///< A, B, C or D

  /// Slot of the i-th child along the curve: column + kSide * row.
  constexpr unsigned slot(unsigned i) const { return kSlots[permutation][i]; }
  constexpr PeanoQuad child(unsigned i) const { return {kPermutations[permutation][i]}; }
  /// How the curve runs in the square to the right of this one, if both are walked one after the other.
  constexpr PeanoQuad next_square() const { return {permutation == kA ? kD : kA}; }

 private:
  enum Permutation : std::uint8_t { kA, kB, kC, kD };
  static constexpr std::array<std::array<std::uint8_t, 9>, 4> kPermutations{
      {{kA, kC, kA, kD, kB, kD, kA, kC, kA},
       {kB, kD, kB, kC, kA, kC, kB, kD, kB},
       {kC, kA, kC, kB, kD, kB, kC, kA, kC},
       {kD, kB, kD, kA, kC, kA, kD, kB, kD}}};
  static constexpr std::array<std::array<std::uint8_t, 9>, 4> kSlots{{{0, 3, 6, 7, 4, 1, 2, 5, 8},
                                                                      {8, 5, 2, 1, 4, 7, 6, 3, 0},
                                                                      {2, 5, 8, 7, 4, 1, 0, 3, 6},
                                                                      {6, 3, 0, 1, 4, 7, 8, 5, 2}}};

 public:
  constexpr PeanoQuad(std::uint8_t p = kA) : permutation(p) {}
};

}  // namespace hilbrush
