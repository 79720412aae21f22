#pragma once
#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace hilbrush {

/// Damages files the way bad disks, careless exporters and attackers do: bits, bytes, numbers, words and
/// blocks are changed, cut, copied and mixed with other files. The same seed makes the same bytes on every
/// machine.
class Mutator {
 public:
  /// @param donors  files to take pieces from
  explicit Mutator(std::vector<std::string> donors) : donors_(std::move(donors)) {}

  /// A mutant of `input`, at most kSizeLimit long.
  std::string mutate(std::string input, std::uint64_t seed);

  static constexpr std::size_t kSizeLimit = 1 << 18;

 private:
  void mutate_once(std::string& text);
  std::size_t below(std::size_t limit) {
    return limit == 0 ? 0 : static_cast<std::size_t>(random_() % limit);
  }
  void replace_number(std::string& text);
  void replace_word(std::string& text);
  void copy_block(std::string& text);
  void splice(std::string& text);
  void nest(std::string& text);

  std::vector<std::string> donors_;
  std::mt19937_64 random_;
};

}  // namespace hilbrush
