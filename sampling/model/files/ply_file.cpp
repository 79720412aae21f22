#include <OpenMesh/Core/IO/reader/PLYReader.hh>
#include <algorithm>
#include <map>

#include "sampling/base/input_error.h"
#include "sampling/model/files/mesh_file.h"
#include "sampling/model/files/openmesh_reading.h"
#include "sampling/model/files/polygon_importer.h"
#include "sampling/model/files/text_lines.h"

/// PLY. OpenMesh trusts the counts of the header, knows few names, and misreads what follows a list it does not know.
/// So the header is read and rewritten here; the body goes to OpenMesh as it is.
namespace hilbrush {
namespace {

constexpr std::size_t kPropertyLimit = 256;
constexpr std::size_t kTextureLimit = 1000;

struct PlyProperty {
  std::string type;
  std::string name;
  std::string count_type;  ///< of a list, else empty
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

/// Bytes of a binary value; 0 for an unknown type.
std::size_t size_of(const std::string& type) {
  static const std::map<std::string, std::size_t> sizes{{"char", 1},  {"uchar", 1},   {"int8", 1},   {"uint8", 1},
                                                        {"short", 2}, {"ushort", 2},  {"int16", 2},  {"uint16", 2},
                                                        {"int", 4},   {"uint", 4},    {"int32", 4},  {"uint32", 4},
                                                        {"float", 4}, {"float32", 4}, {"double", 8}, {"float64", 8}};
  const auto found = sizes.find(type);
  return found == sizes.end() ? 0 : found->second;
}

bool is_floating(const std::string& type) {
  return type == "float" || type == "float32" || type == "double" || type == "float64";
}
bool is_indices(const PlyProperty& p) {
  return !p.count_type.empty() && (p.name == "vertex_indices" || p.name == "vertex_index");
}
bool is_face_uv(const PlyProperty& p) {
  return !p.count_type.empty() && p.name == "texcoord";
}

/// The name OpenMesh knows for what a property means.
std::string known_name(const std::string& name) {
  static const std::map<std::string, std::string> names{{"s", "u"},
                                                        {"t", "v"},
                                                        {"texture_u", "u"},
                                                        {"texture_v", "v"},
                                                        {"texture_s", "u"},
                                                        {"texture_t", "v"},
                                                        {"diffuse_red", "red"},
                                                        {"diffuse_green", "green"},
                                                        {"diffuse_blue", "blue"},
                                                        {"r", "red"},
                                                        {"g", "green"},
                                                        {"b", "blue"}};
  const auto found = names.find(name);
  return found == names.end() ? name : found->second;
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
        fail("expected format, comment, element, property or end_header, found '" + std::string(key.substr(0, 40)) +
             "'");
      }
    }
    if (header_.format != "ascii" && header_.format != "binary_little_endian" && header_.format != "binary_big_endian")
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
    if (key == "TextureFile" && header_.textures.size() < kTextureLimit) header_.textures.emplace_back(trimmed(line));
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
    property.type = take_word(line);
    if (property.type == "list") {
      property.count_type = take_word(line);
      property.type = take_word(line);
      if (size_of(property.count_type) == 0 || is_floating(property.count_type))
        fail("a list is counted by an unknown type");
    }
    property.name = take_word(line);
    if (size_of(property.type) == 0) fail("the type '" + property.type.substr(0, 40) + "' is unknown");
    if (property.name.empty()) fail("a property has no name");
    auto& properties = header_.elements.back().properties;
    if (properties.size() >= kPropertyLimit) fail("there are too many properties");
    properties.push_back(std::move(property));
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

bool has_property(const PlyElement& element, const std::string& name) {
  return std::any_of(element.properties.begin(), element.properties.end(),
                     [&](const PlyProperty& p) { return known_name(p.name) == name; });
}

/// One element's lists: only those that are understood, and only where OpenMesh reads what follows them correctly.
void check_lists(const PlyElement& element, const std::string& name) {
  bool has_indices = false;
  for (const PlyProperty& p : element.properties) {
    if (p.count_type.empty()) continue;
    const bool is_face = element.name == "face";
    if (is_face && is_indices(p)) {
      if (has_indices || is_floating(p.type)) fail(name, "the faces' vertex indices must be one list of integers");
      has_indices = true;
    } else if (is_face && is_face_uv(p)) {
      if (!has_indices) fail(name, "the list texcoord must stand after the faces' vertex indices");
      if (size_of(p.count_type) > 1 || size_of(p.type) != 4 || !is_floating(p.type))
        fail(name, "the list texcoord must hold floats, counted by a byte");
    } else {
      fail(name, "the list '" + p.name.substr(0, 40) + "' of element " + element.name.substr(0, 40) + " is not read");
    }
  }
}

/// What counts and types must be for the body to be read safely.
void check_header(const PlyHeader& header, const std::string& name, std::size_t body_bytes) {
  const PlyElement* vertex = find_element(header, "vertex");
  const PlyElement* face = find_element(header, "face");
  if (!vertex || vertex->count == 0) fail(name, "there is no vertex in it");
  if (!face || face->count == 0) fail(name, "there is no face in it: point clouds have no surface to paint");
  for (const char* axis : {"x", "y", "z"})
    if (!has_property(*vertex, axis)) fail(name, std::string("its vertices have no property ") + axis);
  if (std::none_of(face->properties.begin(), face->properties.end(), is_indices))
    fail(name, "its faces have no list of vertex indices");
  std::size_t least_bytes = 0;
  std::map<std::string, int> seen;
  for (const PlyElement& element : header.elements) {
    if (seen[element.name]++ > 0) fail(name, "the element " + element.name.substr(0, 40) + " occurs twice");
    check_lists(element, name);
    std::size_t bytes = 0;
    for (const PlyProperty& p : element.properties) {
      // OpenMesh reads coordinates and colors of these types only.
      const std::string known = known_name(p.name);
      const bool is_coordinate = known == "x" || known == "y" || known == "z" || known == "u" || known == "v" ||
                                 known == "nx" || known == "ny" || known == "nz";
      if (element.name == "vertex" && is_coordinate && !is_floating(p.type))
        fail(name, "the property " + p.name.substr(0, 40) + " must be float or double");
      bytes += header.format == "ascii" ? 2 : size_of(p.count_type.empty() ? p.type : p.count_type);
    }
    if (element.properties.empty() && element.count > 0)
      fail(name, "the element " + element.name.substr(0, 40) + " has no properties");
    least_bytes += bytes * element.count;
    if (&element == face) break;
  }
  // The last number of an ASCII file need not be followed by a blank.
  if (least_bytes > body_bytes + 1)
    fail(name, "its header promises more than the file holds (" + std::to_string(least_bytes) + " bytes at least, " +
                   std::to_string(body_bytes) + " found)");
}

/// OpenMesh counts lists in these types only; no list is so long that the sign matters.
std::string counting_name(const std::string& type) {
  return size_of(type) == 1 ? "uchar" : size_of(type) == 2 ? "uint16" : "int";
}

/// The header as OpenMesh understands it, up to the faces.
std::string plain_header(const PlyHeader& header) {
  std::string text = "ply\nformat " + header.format + " 1.0\n";
  for (const PlyElement& element : header.elements) {
    text += "element " + element.name + " " + std::to_string(element.count) + "\n";
    for (const PlyProperty& p : element.properties) {
      const bool is_known = element.name == "vertex" || element.name == "face";
      text += "property " + (p.count_type.empty() ? p.type : "list " + counting_name(p.count_type) + " " + p.type) +
              " " +
              (is_indices(p) ? "vertex_indices"
               : is_known    ? known_name(p.name)
                             : p.name) +
              "\n";
    }
    if (element.name == "face") break;
  }
  return text + "end_header\n";
}

/// Reads the body with OpenMesh, after the header is replaced by the one it understands.
FaceList read_body(std::string text, const PlyHeader& header, const std::string& name, const ModelLimits& limits,
                   std::vector<std::string>& warnings) {
  const PlyElement& vertex = *find_element(header, "vertex");
  const PlyElement& face = *find_element(header, "face");
  text.replace(0, header.body, plain_header(header));
  text += '\n';  // so that the last number of the text ends

  const bool has_face_uv = std::any_of(face.properties.begin(), face.properties.end(), is_face_uv);
  using OpenMesh::IO::Options;
  Options options = Options::Default;
  if (has_property(vertex, "red")) options += Options::VertexColor;
  if (has_property(vertex, "u")) options += Options::VertexTexCoord;
  if (has_property(face, "red")) options += Options::FaceColor;
  if (has_face_uv) options += Options::Custom;
  PolygonImporter importer(name, limits);
  read_with_openmesh(std::move(text), name, true,
                     [&](std::istream& in) { return OpenMesh::IO::PLYReader().read(in, importer, options); });
  if (has_face_uv)
    for (std::size_t f = 0; f < importer.n_faces(); ++f)
      if (const auto* uv = importer.face_property<std::vector<float>>("texcoord", f)) importer.set_face_uv(f, *uv);
  if (importer.n_vertices() < vertex.count || importer.n_faces() < face.count) fail(name, "the file ends early");
  PolygonImporter::Polygons polygons = importer.take_polygons(1);
  if (polygons.dropped > 0)
    warnings.push_back(name + ": " + std::to_string(polygons.dropped) +
                       " faces were dropped: they name points that do not exist");
  return std::move(polygons.faces);
}

/// The first of the header's textures that can be read, or -1; `warnings` says what is not used.
int add_texture(const PlyHeader& header, const std::string& name, bool has_uv, ModelFolder& folder,
                const ImageReader& read_image, const ModelLimits& limits, MeshBuilder& builder,
                std::vector<std::string>& warnings) {
  int index = -1;
  for (const std::string& texture : header.textures) {
    const auto file = folder.find(folder.path(), texture);
    auto image = file ? read_image(*file, limits.image_pixels) : Failure{file.reason()};
    if (image) {
      image->name = folder.name(*file);
      index = builder.add_texture(std::move(*image));
      folder.note(*file);
      break;
    }
    warnings.push_back(name + ": the texture cannot be read (" + image.reason() + "); tried '" +
                       texture.substr(0, 120) + "'");
  }
  if (index < 0) return -1;
  if (header.textures.size() > 1)
    warnings.push_back(name + ": only one of the " + std::to_string(header.textures.size()) + " textures is used");
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
  const FaceList faces = read_body(std::move(text), header, name, limits, model.warnings);
  MeshBuilder builder(limits);
  Look look;
  look.texture =
      add_texture(header, name, !faces.corner_uv.empty(), folder, read_image, limits, builder, model.warnings);
  builder.add(faces, Eigen::Affine3d::Identity(), look);
  model.mesh = builder.finish(model.warnings);
  if (model.mesh.triangles.empty()) fail(name, "there is no usable face in it");
  return model;
}

}  // namespace hilbrush
