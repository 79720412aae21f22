#include "tests/fuzz/mutator.h"

#include <algorithm>
#include <array>

namespace hilbrush {
namespace {

constexpr std::array kNumbers{"0",          "-1",          "1",
                              "2",          "-2147483648", "2147483647",
                              "4294967295", "4294967296",  "99999999999999999999",
                              "1e308",      "1e999",       "-1e-320",
                              "nan",        "inf",         "-inf",
                              "0x",         "0xFFFFFFFF",  "1e",
                              ".",          "-",           "+.5",
                              "65536",      "1000000000",  "3.5"};
constexpr std::array kWords{"DEF A",
                            "USE A",
                            "USE Again",
                            "{",
                            "}",
                            "[",
                            "]",
                            "\"",
                            "#",
                            "NULL",
                            "TRUE",
                            "IS",
                            "IS children",
                            "PROTO",
                            "ROUTE",
                            "Shape",
                            "geometry",
                            "children",
                            "Inline",
                            "url",
                            "Group {",
                            "Transform {",
                            "children [",
                            "Box { }",
                            "IndexedFaceSet {",
                            "PixelTexture {",
                            "image",
                            "ElevationGrid {",
                            "xDimension",
                            "Extrusion {",
                            "spine",
                            "coordIndex [",
                            "Separator {",
                            "Switch {",
                            "\\",
                            "(",
                            "|",
                            ")",
                            "f 1 2 3",
                            "f -1 -2 -3",
                            "usemtl",
                            "mtllib",
                            "v",
                            "vt",
                            "list uint int",
                            "element face",
                            "element vertex",
                            "property",
                            "vertex",
                            "outer loop",
                            "../outside.wrl",
                            "leak.wrl",
                            "/etc/passwd",
                            "inlines.wrl"};

bool is_word_byte(char c) {
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '.' || c == '-' ||
         c == '_';
}

/// The run of word bytes around a position: where it begins, and its length.
std::pair<std::size_t, std::size_t> word_around(const std::string& text, std::size_t position) {
  std::size_t begin = position;
  std::size_t end = position;
  while (begin > 0 && is_word_byte(text[begin - 1])) --begin;
  while (end < text.size() && is_word_byte(text[end])) ++end;
  return {begin, end - begin};
}

}  // namespace

std::string Mutator::mutate(std::string input, std::uint64_t seed) {
  random_.seed(seed);
  const std::size_t count = 1 + below(4) * below(4);
  for (std::size_t i = 0; i < count; ++i) {
    mutate_once(input);
    if (input.size() > kSizeLimit) input.resize(kSizeLimit);
  }
  return input;
}

void Mutator::mutate_once(std::string& text) {
  if (text.empty()) text = " ";
  const std::size_t position = below(text.size());
  switch (below(12)) {
    case 0:
      text[position] = static_cast<char>(text[position] ^ (1 << below(8)));
      break;
    case 1:
      text[position] = static_cast<char>(below(256));
      break;
    case 2:
      text.erase(position, 1 + below(32));
      break;
    case 3:
      text.resize(position);
      break;
    case 4:
    case 5:
      return replace_number(text);
    case 6:
    case 7:
      return replace_word(text);
    case 8:
      return copy_block(text);
    case 9:
      return splice(text);
    case 10:
      return nest(text);
    default:
      text.insert(position, std::string(1 + below(64), static_cast<char>(below(256))));
  }
}

void Mutator::replace_number(std::string& text) {
  // Looks for a digit from a random position on.
  const std::size_t digit = text.find_first_of("0123456789", below(text.size()));
  if (digit == text.npos) return;
  const auto [begin, length] = word_around(text, digit);
  text.replace(begin, length, below(4) ? kNumbers[below(kNumbers.size())] : std::to_string(random_()));
}

void Mutator::replace_word(std::string& text) {
  const auto [begin, length] = word_around(text, below(text.size()));
  text.replace(begin, below(2) ? length : 0, std::string(" ") + kWords[below(kWords.size())] + " ");
}

void Mutator::copy_block(std::string& text) {
  const std::size_t from = below(text.size());
  const std::string block = text.substr(from, 1 + below(200));
  const std::size_t times = below(8) ? 1 : 1 + below(200);
  const std::size_t to = below(text.size());
  for (std::size_t i = 0; i < times && text.size() < kSizeLimit; ++i) text.insert(to, block);
}

void Mutator::splice(std::string& text) {
  if (donors_.empty()) return;
  const std::string& donor = donors_[below(donors_.size())];
  const std::size_t from = below(donor.size());
  text.insert(below(text.size()), donor.substr(from, 1 + below(400)));
}

/// Deep nesting, or repeated doubling by USE, which makes a small file expand without end.
void Mutator::nest(std::string& text) {
  const std::size_t position = below(text.size());
  std::string block;
  const std::size_t depth = 1 + below(200);
  if (below(2)) {
    for (std::size_t i = 0; i < depth; ++i) block += "Group { children [ ";
    if (below(2))
      for (std::size_t i = 0; i < depth; ++i) block += "] } ";
  } else {
    block = " DEF L0 Shape { geometry Box { } } ";
    for (std::size_t i = 1; i < 1 + depth % 40; ++i) {
      const std::string inner = "USE L" + std::to_string(i - 1) + " ";
      block += "DEF L" + std::to_string(i) + " Group { children [ " + inner + inner + "] } ";
    }
  }
  text.insert(position, block);
}

}  // namespace hilbrush
