#include "sampling/dots/read_dots.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "sampling/base/input_error.h"

namespace hilbrush {
namespace {

static_assert(std::endian::native == std::endian::little, "the rows are read as they lie in memory");

/// A number in a row of the file.
struct Property {
  std::string name;
  std::size_t offset = 0;
  double (*read)(const char*) = nullptr;
};

template <class T>
double read_as(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return static_cast<double>(value);
}

struct NumberType {
  const char *name, *other_name;
  std::size_t size;
  double (*read)(const char*);
};
constexpr std::array<NumberType, 8> kTypes{{{"char", "int8", 1, read_as<std::int8_t>},
                                            {"uchar", "uint8", 1, read_as<std::uint8_t>},
                                            {"short", "int16", 2, read_as<std::int16_t>},
                                            {"ushort", "uint16", 2, read_as<std::uint16_t>},
                                            {"int", "int32", 4, read_as<std::int32_t>},
                                            {"uint", "uint32", 4, read_as<std::uint32_t>},
                                            {"float", "float32", 4, read_as<float>},
                                            {"double", "float64", 8, read_as<double>}}};

struct DotsHeader {
  std::uint64_t count = 0;
  std::size_t row_bytes = 0;
  std::vector<Property> properties;
  double pitch_m = 0;

  const Property* find(const char* name) const {
    for (const Property& property : properties)
      if (property.name == name) return &property;
    return nullptr;
  }
};

class DotsHeaderReader {
 public:
  DotsHeaderReader(std::istream& in, const std::filesystem::path& file) : in_(in), file_(file) {}

  DotsHeader read() {
    if (next_line() != "ply") refuse("is not a PLY file");
    while (true) {
      std::istringstream words(next_line());
      std::string word;
      words >> word;
      if (word == "end_header") break;
      if (word == "format")
        take_format(words);
      else if (word == "comment")
        take_comment(words);
      else if (word == "element")
        take_element(words);
      else if (word == "property")
        take_property(words);
    }
    for (const char* name : {"x", "y", "z"})
      if (!header_.find(name)) refuse("has no vertex property " + std::string(name));
    return header_;
  }

 private:
  [[noreturn]] void refuse(const std::string& sentence) const { throw InputError(file_.string(), sentence); }

  std::string next_line() {
    std::string line;
    constexpr std::size_t kMax = 4096;
    for (char c = 0; in_.get(c) && c != '\n';) {
      if (line.size() >= kMax) refuse("has a header line without end");
      if (c != '\r') line += c;
    }
    if (!in_) refuse("ends within its header");
    return line;
  }
  void take_format(std::istringstream& words) {
    std::string format;
    words >> format;
    if (format != "binary_little_endian") refuse("is not binary little-endian");
  }
  void take_comment(std::istringstream& words) {
    std::string key;
    double value = 0;
    if (words >> key >> value && key == "pitch_m" && std::isfinite(value)) header_.pitch_m = value;
  }
  void take_element(std::istringstream& words) {
    std::string name;
    words >> name;
    if (++element_count_ == 1 && (name != "vertex" || !(words >> header_.count)))
      refuse("does not begin with its vertices");
  }
  void take_property(std::istringstream& words) {
    if (element_count_ != 1) return;
    std::string type, name;
    words >> type >> name;
    for (const NumberType& known : kTypes) {
      if (type != known.name && type != known.other_name) continue;
      header_.properties.push_back({name, header_.row_bytes, known.read});
      header_.row_bytes += known.size;
      return;
    }
    refuse("has a vertex property of type \"" + type + "\"");
  }

  std::istream& in_;
  const std::filesystem::path& file_;
  DotsHeader header_;
  int element_count_ = 0;
};

}  // namespace

DotSequence read_dots(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw InputError(file.string(), "cannot be opened");
  const DotsHeader header = DotsHeaderReader(in, file).read();
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error || header.count > size / header.row_bytes)
    throw InputError(file.string(),
                     "is too short for the " + std::to_string(header.count) + " dots it announces");

  const auto find = [&](const char* name) { return header.find(name); };
  const std::array position{find("x"), find("y"), find("z")}, normal{find("nx"), find("ny"), find("nz")};
  const Property *tone = find("tone"), *level = find("level"), *component = find("component");
  DotSequence sequence;
  sequence.pitch_m = header.pitch_m;
  sequence.dots.resize(header.count);
  std::vector<char> row(header.row_bytes);
  for (Dot& dot : sequence.dots) {
    if (!in.read(row.data(), static_cast<std::streamsize>(row.size())))
      throw InputError(file.string(), "ends before its last dot");
    const auto value = [&](const Property* property, double otherwise) {
      return property ? property->read(row.data() + property->offset) : otherwise;
    };
    for (int k = 0; k < 3; ++k) {
      dot.position_O[k] = value(position[static_cast<std::size_t>(k)], 0);
      dot.normal_O[k] = static_cast<float>(value(normal[static_cast<std::size_t>(k)], 0));
    }
    if (!dot.position_O.allFinite())
      throw InputError(file.string(), "has a dot whose position is not finite");
    dot.smooth_normal_O = dot.normal_O;
    dot.tone = static_cast<float>(value(tone, 0));
    dot.level = static_cast<float>(value(level, 1));
    dot.component = static_cast<std::uint32_t>(value(component, 0));
  }
  return sequence;
}

}  // namespace hilbrush
