#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <map>

#include "sampling/base/input_error.h"
#include "sampling/model/files/mesh_file.h"
#include "sampling/model/files/polygon_list.h"
#include "sampling/model/files/text_lines.h"
#include "sampling/model/model_images.h"

/// PLY, as text and binary. The header says what each entry of each element holds; the body is read entry by
/// entry into the few values that are understood. No count is believed: the file must hold what it promises.
namespace hilbrush {
namespace {

constexpr std::size_t kPropertyLimit = 256;
constexpr std::size_t kTextureLimit = 1000;
constexpr std::size_t kMaxWarnings = 100;

enum class PlyType { kNone, kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

/// What is understood of an element's properties; kOther is skipped.
enum class Meaning { kOther, kX, kY, kZ, kU, kV, kRed, kGreen, kBlue, kIndices, kCornerUv, kCount };

struct PlyProperty {
  PlyType type = PlyType::kNone;
  PlyType count_type = PlyType::kNone;  ///< of a list, else kNone
  Meaning meaning = Meaning::kOther;
};

struct PlyElement {
  std::string name;
  std::size_t count = 0;
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  std::string format;
  std::vector<PlyElement> elements;
  std::vector<std::string> textures;
  std::size_t body = 0;  ///< offset
  int lines = 0;
};

/// kNone for an unknown name.
PlyType type_named(std::string_view name) {
  static const std::map<std::string_view, PlyType> types{
      {"char", PlyType::kInt8},     {"int8", PlyType::kInt8},     {"uchar", PlyType::kUint8},
      {"uint8", PlyType::kUint8},   {"short", PlyType::kInt16},   {"int16", PlyType::kInt16},
      {"ushort", PlyType::kUint16}, {"uint16", PlyType::kUint16}, {"int", PlyType::kInt32},
      {"int32", PlyType::kInt32},   {"uint", PlyType::kUint32},   {"uint32", PlyType::kUint32},
      {"float", PlyType::kFloat},   {"float32", PlyType::kFloat}, {"double", PlyType::kDouble},
      {"float64", PlyType::kDouble}};
  const auto found = types.find(name);
  return found == types.end() ? PlyType::kNone : found->second;
}

/// Bytes of a binary value.
std::size_t size_of(PlyType type) {
  switch (type) {
    case PlyType::kNone:
      return 0;
    case PlyType::kInt8:
    case PlyType::kUint8:
      return 1;
    case PlyType::kInt16:
    case PlyType::kUint16:
      return 2;
    case PlyType::kInt32:
    case PlyType::kUint32:
    case PlyType::kFloat:
      return 4;
    case PlyType::kDouble:
      return 8;
  }
  return 0;
}

bool is_floating(PlyType type) {
  return type == PlyType::kFloat || type == PlyType::kDouble;
}

Meaning meaning_of(const std::string& name, bool is_list) {
  static const std::map<std::string, Meaning> lists{{"vertex_indices", Meaning::kIndices},
                                                    {"vertex_index", Meaning::kIndices},
                                                    {"texcoord", Meaning::kCornerUv}};
  static const std::map<std::string, Meaning> scalars{{"x", Meaning::kX},
                                                      {"y", Meaning::kY},
                                                      {"z", Meaning::kZ},
                                                      {"u", Meaning::kU},
                                                      {"v", Meaning::kV},
                                                      {"s", Meaning::kU},
                                                      {"t", Meaning::kV},
                                                      {"texture_u", Meaning::kU},
                                                      {"texture_v", Meaning::kV},
                                                      {"texture_s", Meaning::kU},
                                                      {"texture_t", Meaning::kV},
                                                      {"red", Meaning::kRed},
                                                      {"green", Meaning::kGreen},
                                                      {"blue", Meaning::kBlue},
                                                      {"diffuse_red", Meaning::kRed},
                                                      {"r", Meaning::kRed},
                                                      {"g", Meaning::kGreen},
                                                      {"b", Meaning::kBlue},
                                                      {"diffuse_green", Meaning::kGreen},
                                                      {"diffuse_blue", Meaning::kBlue}};
  const auto& meanings = is_list ? lists : scalars;
  const auto found = meanings.find(name);
  return found == meanings.end() ? Meaning::kOther : found->second;
}

class HeaderReader {
 public:
  HeaderReader(std::string_view text, const std::string& name, const ModelLimits& limits)
      : text_(text), rest_(text), name_(name), limits_(limits) {}

  PlyHeader read() {
    take();  // ply
    for (;;) {
      std::string_view line = take();
      const std::string_view key = take_word(line);
      if (key == "end_header") break;
      if (key == "format") {
        header_.format = take_word(line);
      } else if (key == "comment" || key == "obj_info") {
        read_comment(line);
      } else if (key == "element") {
        read_element(line);
      } else if (key == "property") {
        read_property(line);
      } else if (!key.empty()) {
        fail("expected format, comment, element, property or end_header, found '" +
             std::string(key.substr(0, 40)) + "'");
      }
    }
    if (header_.format != "ascii" && header_.format != "binary_little_endian" &&
        header_.format != "binary_big_endian")
      fail("the format must be ascii, binary_little_endian or binary_big_endian");
    header_.body = text_.size() - rest_.size();
    return std::move(header_);
  }

 private:
  [[noreturn]] void fail(const std::string& sentence) const {
    throw InputError(name_ + ":" + std::to_string(header_.lines), sentence);
  }
  std::string_view take() {
    const auto line = take_line(rest_);
    if (!line) fail("the header does not end");
    ++header_.lines;
    return *line;
  }
  void read_comment(std::string_view line) {
    const std::string_view key = take_word(line);
    if (key == "TextureFile" && header_.textures.size() < kTextureLimit)
      header_.textures.emplace_back(trimmed(line));
  }
  void read_element(std::string_view line) {
    PlyElement element;
    element.name = take_word(line);
    const auto count = number_in<unsigned long long>(take_word(line));
    if (element.name.empty() || !count) fail("expected a name and a count after element");
    if (*count > 3 * limits_.triangles)
      fail("the element " + element.name.substr(0, 40) + " has more entries than the limit of " +
           std::to_string(3 * limits_.triangles));
    element.count = *count;
    if (header_.elements.size() >= kPropertyLimit) fail("there are too many elements");
    header_.elements.push_back(std::move(element));
  }
  void read_property(std::string_view line) {
    if (header_.elements.empty()) fail("a property stands before the first element");
    PlyProperty property;
    std::string_view type = take_word(line);
    const bool is_list = type == "list";
    if (is_list) {
      property.count_type = type_named(take_word(line));
      type = take_word(line);
      if (property.count_type == PlyType::kNone || is_floating(property.count_type))
        fail("a list is counted by an unknown type");
    }
    property.type = type_named(type);
    const std::string name(take_word(line));
    if (property.type == PlyType::kNone)
      fail("the type '" + std::string(type.substr(0, 40)) + "' is unknown");
    if (name.empty()) fail("a property has no name");
    property.meaning = meaning_of(name, is_list);
    auto& properties = header_.elements.back().properties;
    if (properties.size() >= kPropertyLimit) fail("there are too many properties");
    properties.push_back(property);
  }

  std::string_view text_;
  std::string_view rest_;
  const std::string& name_;
  const ModelLimits& limits_;
  PlyHeader header_;
};

[[noreturn]] void fail(const std::string& name, const std::string& sentence) {
  throw InputError(name, sentence);
}

const PlyElement* find_element(const PlyHeader& header, const std::string& name) {
  for (const PlyElement& element : header.elements)
    if (element.name == name) return &element;
  return nullptr;
}

bool has_property(const PlyElement* element, Meaning meaning) {
  return element &&
         std::ranges::any_of(element->properties, [&](const PlyProperty& p) { return p.meaning == meaning; });
}

/// Elements that are read; the others are skipped.
bool is_of_surface(const PlyElement& element) {
  return element.name == "vertex" || element.name == "face" || element.name == "tristrips";
}

/// How many of the header's elements must be read: up to the last one of the surface.
std::size_t needed_elements(const PlyHeader& header) {
  std::size_t needed = 0;
  for (std::size_t i = 0; i < header.elements.size(); ++i)
    if (is_of_surface(header.elements[i])) needed = i + 1;
  return needed;
}

/// What counts and types must be for the body to be read.
void check_header(const PlyHeader& header, const std::string& name, std::size_t body_bytes) {
  const auto count_of = [&](const char* element) {
    const PlyElement* found = find_element(header, element);
    return found ? found->count : 0;
  };
  if (count_of("vertex") == 0) fail(name, "there is no vertex in it");
  if (count_of("face") == 0 && count_of("tristrips") == 0)
    fail(name, "there is no face in it: point clouds have no surface to paint");
  const PlyElement* vertex = find_element(header, "vertex");
  for (const auto& [meaning, axis] : {std::pair{Meaning::kX, "x"}, {Meaning::kY, "y"}, {Meaning::kZ, "z"}})
    if (!has_property(vertex, meaning)) fail(name, std::string("its vertices have no property ") + axis);
  for (const char* element : {"face", "tristrips"})
    if (count_of(element) > 0 && !has_property(find_element(header, element), Meaning::kIndices))
      fail(name, std::string("its element ") + element + " has no list of vertex indices");
  std::size_t least_bytes = 0;
  std::map<std::string, int> seen;
  for (std::size_t i = 0; i < needed_elements(header); ++i) {
    const PlyElement& element = header.elements[i];
    if (seen[element.name]++ > 0) fail(name, "the element " + element.name.substr(0, 40) + " occurs twice");
    if (element.properties.empty() && element.count > 0)
      fail(name, "the element " + element.name.substr(0, 40) + " has no properties");
    std::size_t bytes = 0;
    for (const PlyProperty& p : element.properties)
      bytes += header.format == "ascii" ? 2 : size_of(p.count_type == PlyType::kNone ? p.type : p.count_type);
    least_bytes += bytes * element.count;
  }
  // The last number of an ASCII file need not be followed by a blank.
  if (least_bytes > body_bytes + 1)
    fail(name, "its header promises more than the file holds (" + std::to_string(least_bytes) +
                   " bytes at least, " + std::to_string(body_bytes) + " found)");
}

/// The numbers of a body, one after another.
class BodyReader {
 public:
  BodyReader(std::string_view body, const std::string& format, const std::string& name)
      : rest_(body),
        is_text_(format == "ascii"),
        is_big_endian_(format == "binary_big_endian"),
        name_(name) {}

  /// @throws InputError at the end of the file, or at what is not a number.
  double take(PlyType type) {
    if (is_text_) return take_text();
    const std::size_t size = size_of(type);
    if (rest_.size() < size) fail(name_, "the file ends early");
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < size; ++i)
      bits = bits << 8 | static_cast<unsigned char>(rest_[is_big_endian_ ? i : size - 1 - i]);
    rest_.remove_prefix(size);
    return value_of(type, bits);
  }

  /// The length of a list whose values have `type`.
  std::size_t take_count(PlyType count_type, PlyType type) {
    const double count = take(count_type);
    const std::size_t bytes = is_text_ ? 1 : size_of(type);
    if (!(count >= 0) || count * static_cast<double>(bytes) > static_cast<double>(rest_.size()))
      fail(name_, "the file ends early, or a list has a wrong length");
    return static_cast<std::size_t>(count);
  }

 private:
  double take_text() {
    const std::string_view word = take_word(rest_);
    if (word.empty()) fail(name_, "the file ends early");
    const auto number = number_in<double>(word);
    if (!number) fail(name_, "expected a number, found '" + std::string(word.substr(0, 40)) + "'");
    return *number;
  }

  static double value_of(PlyType type, std::uint64_t bits) {
    switch (type) {
      case PlyType::kInt8:
        return static_cast<std::int8_t>(bits);
      case PlyType::kInt16:
        return static_cast<std::int16_t>(bits);
      case PlyType::kInt32:
        return static_cast<std::int32_t>(bits);
      case PlyType::kFloat:
        return std::bit_cast<float>(static_cast<std::uint32_t>(bits));
      case PlyType::kDouble:
        return std::bit_cast<double>(bits);
      default:
        return static_cast<double>(bits);
    }
  }

  std::string_view rest_;
  bool is_text_;
  bool is_big_endian_;
  const std::string& name_;
};

/// A channel of a color, 0 to 1: whole numbers run up to the greatest of their type, or, as exporters write
/// integers, to 255.
double channel_of(double value, PlyType type) {
  if (is_floating(type)) return value;
  return value / (type == PlyType::kUint16 ? 65535 : 255);
}

/// The values of one entry that are understood.
struct Entry {
  std::array<double, static_cast<std::size_t>(Meaning::kCount)> values{};
  std::vector<double> indices;
  std::vector<double> corner_uv;

  double operator[](Meaning meaning) const { return values[static_cast<std::size_t>(meaning)]; }
  float luminance() const {
    return luminance_of_srgb((*this)[Meaning::kRed], (*this)[Meaning::kGreen], (*this)[Meaning::kBlue]);
  }
};

void read_entry(BodyReader& body, const PlyElement& element, Entry& entry) {
  entry.indices.clear();
  entry.corner_uv.clear();
  for (const PlyProperty& p : element.properties) {
    if (p.count_type == PlyType::kNone) {
      const double value = body.take(p.type);
      const bool is_color = p.meaning >= Meaning::kRed && p.meaning <= Meaning::kBlue;
      entry.values[static_cast<std::size_t>(p.meaning)] = is_color ? channel_of(value, p.type) : value;
      continue;
    }
    std::vector<double>* list = p.meaning == Meaning::kIndices    ? &entry.indices
                                : p.meaning == Meaning::kCornerUv ? &entry.corner_uv
                                                                  : nullptr;
    const std::size_t count = body.take_count(p.count_type, p.type);
    for (std::size_t i = 0; i < count; ++i) {
      const double value = body.take(p.type);
      if (list) list->push_back(value);
    }
  }
}

/// Reads a body into polygons.
class SurfaceReader {
 public:
  SurfaceReader(const PlyHeader& header, const std::string& name, const ModelLimits& limits)
      : header_(header), name_(name), limits_(limits) {}

  PolygonList read(std::string_view bytes) {
    BodyReader body(bytes, header_.format, name_);
    Entry entry;
    for (std::size_t e = 0; e < needed_elements(header_); ++e) {
      const PlyElement& element = header_.elements[e];
      for (std::size_t i = 0; i < element.count; ++i) {
        read_entry(body, element, entry);
        if (element.name == "vertex") add_point(element, entry);
        if (element.name == "face") add_face(element, entry);
        if (element.name == "tristrips") add_strips(entry);
      }
    }
    return std::move(polygons_);
  }

 private:
  void add_point(const PlyElement& element, const Entry& entry) {
    polygons_.points.emplace_back(entry[Meaning::kX], entry[Meaning::kY], entry[Meaning::kZ]);
    if (has_property(&element, Meaning::kRed)) polygons_.point_luminance.push_back(entry.luminance());
    if (has_property(&element, Meaning::kU))
      polygons_.point_uv.emplace_back(entry[Meaning::kU], entry[Meaning::kV]);
  }

  void add_face(const PlyElement& element, const Entry& entry) {
    const std::size_t count = entry.indices.size();
    polygons_.check_room(count, name_, limits_);
    const std::size_t first = polygons_.corners.size();
    for (const double index : entry.indices) polygons_.corners.push_back(point_of(index));
    polygons_.face_ends.push_back(polygons_.corners.size());
    if (has_property(&element, Meaning::kRed)) polygons_.face_luminance.push_back(entry.luminance());
    if (count == 0 || entry.corner_uv.size() != 2 * count) return;
    polygons_.corner_uv.resize(first, Eigen::Vector2d::Zero());
    for (std::size_t c = 0; c < count; ++c)
      polygons_.corner_uv.emplace_back(entry.corner_uv[2 * c], entry.corner_uv[2 * c + 1]);
  }

  /// Each point makes a triangle with the two before it, every second one the other way around; -1 begins a
  /// new strip.
  void add_strips(const Entry& entry) {
    std::size_t length = 0;
    for (std::size_t i = 0; i < entry.indices.size(); ++i) {
      length = entry.indices[i] < 0 ? 0 : length + 1;
      if (length < 3) continue;
      const std::uint32_t a = point_of(entry.indices[i - 2]);
      const std::uint32_t b = point_of(entry.indices[i - 1]);
      const std::uint32_t c = point_of(entry.indices[i]);
      if (a == b || b == c || c == a) continue;  // as strips are joined to one
      polygons_.check_room(3, name_, limits_);
      const bool is_odd = length % 2 == 0;
      polygons_.corners.insert(polygons_.corners.end(), {is_odd ? b : a, is_odd ? a : b, c});
      polygons_.face_ends.push_back(polygons_.corners.size());
    }
  }

  static std::uint32_t point_of(double index) {
    const bool is_index = index >= 0 && index < PolygonList::kNoPoint;
    return is_index ? static_cast<std::uint32_t>(index) : PolygonList::kNoPoint;
  }

  const PlyHeader& header_;
  const std::string& name_;
  const ModelLimits& limits_;
  PolygonList polygons_;
};

/// The first of the header's textures that can be read, or -1; `warnings` says what is not used.
int add_texture(const PlyHeader& header, const std::string& name, bool has_uv, ModelFolder& folder,
                const ImageReader& read_image, const ModelLimits& limits, MeshBuilder& builder,
                std::vector<std::string>& warnings) {
  int index = -1;
  ModelImages images(folder, read_image, limits, builder);
  for (const std::string& texture : header.textures) {
    const auto image = images.open(folder.path(), texture);
    if (image) {
      index = *image;
      break;
    }
    if (warnings.size() < kMaxWarnings)
      warnings.push_back(name + ": the texture cannot be read (" + image.reason() + "); tried '" +
                         texture.substr(0, 120) + "'");
  }
  if (index < 0) return -1;
  if (header.textures.size() > 1)
    warnings.push_back(name + ": only one of the " + std::to_string(header.textures.size()) +
                       " textures is used");
  if (has_uv) return index;
  warnings.push_back(name + ": the texture is not used, as there are no texture coordinates");
  return -1;
}

}  // namespace

Model load_ply(std::string text, const std::string& name, ModelFolder& folder, const ImageReader& read_image,
               const ModelLimits& limits) {
  const PlyHeader header = HeaderReader(text, name, limits).read();
  check_header(header, name, text.size() - header.body);
  Model model;
  model.up = UpAxis::kZ;
  PolygonList polygons = SurfaceReader(header, name, limits).read(std::string_view(text).substr(header.body));
  std::string().swap(text);
  std::size_t dropped = 0;
  const FaceList faces = polygons.take_faces(name, dropped);
  if (dropped > 0)
    model.warnings.push_back(name + ": " + std::to_string(dropped) +
                             " faces were dropped: they name points that do not exist");
  MeshBuilder builder(limits);
  Look look;
  look.texture = add_texture(header, name, !faces.corner_uv.empty(), folder, read_image, limits, builder,
                             model.warnings);
  builder.add(faces, Eigen::Affine3d::Identity(), look);
  model.mesh = builder.finish(model.warnings);
  if (model.mesh.triangles.empty()) fail(name, "there is no usable face in it");
  return model;
}

}  // namespace hilbrush
