#include <OpenMesh/Core/IO/reader/OBJReader.hh>
#include <algorithm>
#include <map>

#include "sampling/base/check.h"
#include "sampling/base/input_error.h"
#include "sampling/model/files/mesh_file.h"
#include "sampling/model/files/openmesh_reading.h"
#include "sampling/model/files/polygon_importer.h"
#include "sampling/model/files/text_lines.h"

/// OBJ. OpenMesh opens whatever a mtllib line names, resolves relative indices against the end of the file, misreads
/// what follows a coordinate that is not a number and forgets which material a face had. So the text is first put into
/// plain form: only v, vt and f lines, indices absolute and in range; materials are read here.
namespace hilbrush {
namespace {

constexpr std::size_t kMaterialLimit = 100'000;

struct MtlMaterial {
  std::optional<std::array<double, 3>> diffuse;
  double opacity = 1;
  std::string texture;
};

/// The file in plain form.
struct PlainObj {
  std::string text;
  std::vector<std::uint32_t> material_of_face;  ///< index into `materials`
  std::vector<std::string> materials{""};       ///< names by first use; "" before any usemtl
  std::vector<std::string> libraries;
  bool has_colors = false;
  std::vector<std::string> warnings;
};

/// Reads lines, joined where one ends in a backslash, and knows their numbers.
class ObjLines {
 public:
  explicit ObjLines(std::string_view text) : text_(text) {}
  bool next() {
    const auto line = take_line(text_);
    if (!line) return false;
    number_ = ++count_;
    line_ = *line;
    if (line_.empty() || line_.back() != '\\') return true;
    joined_.clear();
    std::string_view part = line_;
    while (!part.empty() && part.back() == '\\') {
      joined_.append(part.substr(0, part.size() - 1)).append(" ");
      const auto more = take_line(text_);
      if (!more) break;
      ++count_;
      part = *more;
      if (part.empty() || part.back() != '\\') joined_.append(part);
    }
    line_ = joined_;
    return true;
  }
  std::string_view line() const { return line_; }
  int number() const { return number_; }

 private:
  std::string_view text_, line_;
  std::string joined_;
  int count_ = 0;   ///< lines read
  int number_ = 0;  ///< of the line at hand
};

class ObjPlainer {
 public:
  ObjPlainer(std::string_view text, const std::string& name, const ModelLimits& limits)
      : lines_(text), name_(name), limits_(limits) {}

  PlainObj run() {
    while (lines_.next()) {
      std::string_view rest = lines_.line();
      const std::string_view key = take_word(rest);
      if (key == "v") {
        add_vertex(rest);
      } else if (key == "vt") {
        add_texture_vertex(rest);
      } else if (key == "f" || key == "fo") {
        add_face(rest);
      } else if (key == "usemtl") {
        use_material(std::string(trimmed(rest)));
      } else if (key == "mtllib") {
        if (plain_.libraries.size() < 16) plain_.libraries.emplace_back(trimmed(rest));
      }
    }
    if (colored_count_ > 0 && colored_count_ < vertex_count_)
      plain_.warnings.push_back(name_ + ": " + std::to_string(vertex_count_ - colored_count_) + " of " +
                                std::to_string(vertex_count_) + " points have no color; they are white");
    plain_.has_colors = colored_count_ > 0;
    if (dropped_count_ > 0)
      plain_.warnings.push_back(at(first_dropped_) + ": " + std::to_string(dropped_count_) +
                                " faces were dropped: they name points that do not exist (this is the first)");
    if (short_count_ > 0)
      plain_.warnings.push_back(at(first_short_) + ": " + std::to_string(short_count_) +
                                " faces with fewer than three different corners were dropped (this is the first)");
    plain_.text = std::move(vertices_);
    plain_.text += faces_;
    plain_.text += '\n';
    return std::move(plain_);
  }

 private:
  std::string at(int line) const { return name_ + ":" + std::to_string(line); }

  void add_vertex(std::string_view rest) {
    if (++vertex_count_ > 3 * limits_.triangles)
      throw InputError(at(lines_.number()),
                       "the model has more points than the limit of " + std::to_string(3 * limits_.triangles));
    std::array<std::string_view, 6> words;
    std::size_t count = 0;
    for (std::string_view word; count < 6 && !(word = take_word(rest)).empty();) words[count++] = word;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto number = i < count ? number_in<double>(words[i]) : std::nullopt;
      if (!number) throw InputError(at(lines_.number()), "expected three coordinates after v");
      if (!std::isfinite(*number)) words[i] = "9e37";  // out of range: its faces are dropped and counted
    }
    ((vertices_ += "v ").append(words[0]) += ' ').append(words[1]) += ' ';
    vertices_.append(words[2]);
    // Every point gets a color, as OpenMesh counts colors, not points.
    bool is_colored = count == 6;
    for (std::size_t i = 3; i < 6 && is_colored; ++i) {
      const auto number = number_in<double>(words[i]);
      is_colored = number && std::isfinite(*number);
    }
    if (is_colored) ++colored_count_;
    for (std::size_t i = 3; i < 6; ++i) (vertices_ += ' ').append(is_colored ? words[i] : "1");
    vertices_ += '\n';
  }

  void add_texture_vertex(std::string_view rest) {
    ++texture_vertex_count_;
    const auto u = number_in<double>(take_word(rest));
    if (!u) throw InputError(at(lines_.number()), "expected a texture coordinate after vt");
    const auto v = number_in<double>(take_word(rest));
    const auto usable = [](double x) { return std::isfinite(x) && std::abs(x) < 1e30 ? x : 0.; };
    vertices_ += "vt " + std::to_string(usable(*u)) + ' ' + std::to_string(usable(v.value_or(0))) + '\n';
  }

  /// An index of the file (from 1, or from the last one back) to one from 1; 0 if there is no such entry yet.
  static std::size_t absolute(long long index, std::size_t count) {
    if (index < 0) index += static_cast<long long>(count) + 1;
    return index >= 1 && static_cast<std::size_t>(index) <= count ? static_cast<std::size_t>(index) : 0;
  }

  void add_face(std::string_view rest) {
    corners_.clear();
    bool has_uv = true;
    bool is_good = true;
    for (std::string_view word; !(word = take_word(rest)).empty() && word.front() != '#';) {
      const std::size_t slash = std::min(word.find('/'), word.size());
      const auto v = number_in<long long>(word.substr(0, slash));
      if (!v)
        throw InputError(at(lines_.number()),
                         "expected the index of a point, found '" + std::string(word.substr(0, 40)) + "'");
      std::string_view after = word.substr(std::min(slash + 1, word.size()));
      const auto t = number_in<long long>(after.substr(0, after.find('/')));
      const std::size_t point = absolute(*v, vertex_count_);
      const std::size_t uv = t ? absolute(*t, texture_vertex_count_) : 0;
      is_good = is_good && point > 0;
      has_uv = has_uv && uv > 0;
      // OpenMesh drops a point's second visit from a face, but not its texture coordinates: do both here.
      const bool is_again = std::any_of(corners_.begin(), corners_.end(), [&](const auto& c) { return c[0] == point; });
      if (!is_again || !is_good) corners_.push_back({point, uv});
      if (corners_.size() > kCornerLimit)
        throw InputError(at(lines_.number()), "a face has more than " + std::to_string(kCornerLimit) + " corners");
    }
    if (!is_good) {
      if (dropped_count_++ == 0) first_dropped_ = lines_.number();
      return;
    }
    if (corners_.size() < 3) {
      if (short_count_++ == 0) first_short_ = lines_.number();
      return;
    }
    faces_ += 'f';
    for (const auto& [point, uv] : corners_) {
      (faces_ += ' ') += std::to_string(point);
      if (has_uv) (faces_ += '/') += std::to_string(uv);
    }
    faces_ += '\n';
    if (plain_.material_of_face.size() >= limits_.triangles)
      throw InputError(at(lines_.number()),
                       "the model has more faces than the limit of " + std::to_string(limits_.triangles));
    plain_.material_of_face.push_back(material_);
  }

  void use_material(const std::string& material) {
    const auto [found, is_new] = known_.try_emplace(material, static_cast<std::uint32_t>(plain_.materials.size()));
    if (is_new) plain_.materials.push_back(material);
    if (plain_.materials.size() > kMaterialLimit)
      throw InputError(at(lines_.number()),
                       "the model uses more than " + std::to_string(kMaterialLimit) + " materials");
    material_ = found->second;
  }

  // The search for repeated points takes time that grows with its square.
  static constexpr std::size_t kCornerLimit = 4096;

  ObjLines lines_;
  const std::string& name_;
  const ModelLimits& limits_;
  PlainObj plain_;
  std::string vertices_;
  std::string faces_;
  std::size_t vertex_count_ = 0;
  std::size_t texture_vertex_count_ = 0;
  std::size_t colored_count_ = 0;
  std::size_t dropped_count_ = 0;
  std::size_t short_count_ = 0;
  int first_dropped_ = 0;  ///< line
  int first_short_ = 0;    ///< line
  std::uint32_t material_ = 0;
  std::map<std::string, std::uint32_t> known_;
  std::vector<std::array<std::size_t, 2>> corners_;
};

/// The file name of a map_Kd line, after its options (-s 1 1 1, -clamp on, ...).
std::string_view texture_name(std::string_view rest) {
  rest = trimmed(rest);
  while (!rest.empty() && rest.front() == '-') {
    std::string_view after = rest;
    const std::string_view option = take_word(after);
    const bool takes_word = option == "-clamp" || option == "-blendu" || option == "-blendv" || option == "-cc" ||
                            option == "-imfchan" || option == "-texres" || option == "-bm" || option == "-boost";
    const bool takes_numbers = option == "-s" || option == "-o" || option == "-t" || option == "-mm";
    if (!takes_word && !takes_numbers) break;
    if (takes_word) take_word(after);
    for (std::string_view peek = after; takes_numbers && number_in<double>(take_word(peek)); peek = after)
      take_word(after);
    rest = trimmed(after);
  }
  return rest;
}

void read_mtl(std::string_view text, std::map<std::string, MtlMaterial>& materials) {
  MtlMaterial* current = nullptr;
  while (const auto line = take_line(text)) {
    std::string_view rest = *line;
    const std::string_view key = take_word(rest);
    if (key == "newmtl" && materials.size() < kMaterialLimit) current = &(materials[std::string(trimmed(rest))] = {});
    if (!current) continue;
    if (key == "Kd") {
      std::array<double, 3> color{};
      bool is_good = true;
      for (double& channel : color) {
        const auto number = number_in<double>(take_word(rest));
        is_good = is_good && number && std::isfinite(*number);
        channel = number.value_or(0);
      }
      if (is_good) current->diffuse = color;
    } else if (key == "d" || key == "Tr") {
      const auto number = number_in<double>(take_word(rest));
      // Some exporters write the opacity as Tr. A Tr of 1 would be an invisible surface: it is taken as opaque.
      const bool is_meant = number && std::isfinite(*number) && !(key == "Tr" && *number >= 1);
      if (is_meant) current->opacity = std::clamp(key == "d" ? *number : 1 - *number, 0., 1.);
    } else if (key == "map_Kd") {
      current->texture = texture_name(rest);
    }
  }
}

/// Reads the libraries that are there; each mtllib line may name several.
std::map<std::string, MtlMaterial> read_libraries(const PlainObj& plain, const std::string& name, ModelFolder& folder,
                                                  std::vector<std::string>& warnings) {
  std::map<std::string, MtlMaterial> materials;
  for (const std::string& library : plain.libraries) {
    // A name may hold spaces, or the line several names.
    std::vector<std::string> names{library};
    if (!folder.find(folder.path(), library)) {
      names.clear();
      std::string_view rest = library;
      for (std::string_view word; !(word = take_word(rest)).empty() && names.size() < 16;) names.emplace_back(word);
    }
    for (const std::string& each : names) {
      const auto file = folder.find(folder.path(), each);
      if (file)
        read_mtl(folder.read(*file), materials);
      else
        warnings.push_back(name + ": the material file cannot be read (" + file.reason() + "); tried '" +
                           each.substr(0, 120) + "'");
    }
  }
  return materials;
}

/// One Look for each material that the faces use.
std::vector<Look> looks_of(const PlainObj& plain, const std::string& name, ModelFolder& folder,
                           const ImageReader& read_image, const ModelLimits& limits, MeshBuilder& builder,
                           std::vector<std::string>& warnings) {
  const auto materials = read_libraries(plain, name, folder, warnings);
  std::map<std::string, int> textures;
  std::size_t pixels_left = limits.image_pixels;
  std::vector<Look> looks(plain.materials.size());
  for (std::size_t i = 0; i < looks.size(); ++i) {
    Look& look = looks[i];
    look.name = plain.materials[i];
    const auto found = materials.find(look.name);
    if (found == materials.end()) continue;
    const MtlMaterial& material = found->second;
    look.opacity = material.opacity;
    if (material.diffuse) {
      look.source = ColorSource::kMaterial;
      look.luminance = luminance_of_srgb((*material.diffuse)[0], (*material.diffuse)[1], (*material.diffuse)[2]);
    }
    if (material.texture.empty()) continue;
    const auto [texture, is_new] = textures.try_emplace(material.texture, -1);
    if (is_new) {
      const auto file = folder.find(folder.path(), material.texture);
      if (auto image = file ? read_image(*file, pixels_left) : Failure{file.reason()}) {
        pixels_left -= image->luminance.size();
        image->name = folder.name(*file);
        texture->second = builder.add_texture(std::move(*image));
        folder.note(*file);
      } else if (warnings.size() < 100) {
        warnings.push_back(name + ": the texture cannot be read (" + image.reason() + "); tried '" +
                           material.texture.substr(0, 120) + "'");
      }
    }
    look.texture = texture->second;
  }
  return looks;
}

/// The faces of one material, as a list of its own.
std::vector<FaceList> split_by_material(const FaceList& faces, const std::vector<std::uint32_t>& material_of_face,
                                        std::size_t material_count) {
  std::vector<FaceList> lists(material_count);
  // Points are shared by few materials: the index in the last owner's list is remembered, others get a copy, welded
  // later.
  std::vector<std::uint32_t> owner(faces.points.size(), 0);
  std::vector<std::uint32_t> index(faces.points.size(), 0);
  for (std::size_t f = 0, c = 0; f < faces.face_ends.size(); ++f) {
    const std::uint32_t m = material_of_face[f];
    FaceList& list = lists[m];
    for (; c < faces.face_ends[f]; ++c) {
      const std::uint32_t v = faces.corners[c];
      if (owner[v] != m + 1) {
        owner[v] = m + 1;
        index[v] = static_cast<std::uint32_t>(list.points.size());
        list.points.push_back(faces.points[v]);
      }
      list.corners.push_back(index[v]);
      if (!faces.corner_uv.empty()) list.corner_uv.push_back(faces.corner_uv[c]);
      if (!faces.corner_luminance.empty()) list.corner_luminance.push_back(faces.corner_luminance[c]);
    }
    list.end_face();
    list.at = faces.at;
  }
  return lists;
}

}  // namespace

Model load_obj(std::string text, const std::string& name, ModelFolder& folder, const ImageReader& read_image,
               const ModelLimits& limits) {
  PlainObj plain = ObjPlainer(text, name, limits).run();
  std::string().swap(text);
  if (plain.material_of_face.empty()) {
    const std::string cause = plain.warnings.empty() ? "" : "; " + plain.warnings.front();
    throw InputError(name, "there is no face in it" + cause);
  }
  PolygonImporter importer(name, limits);
  read_with_openmesh(std::move(plain.text), name, false, [&](std::istream& in) {
    OpenMesh::IO::Options options = OpenMesh::IO::Options::FaceTexCoord;
    if (plain.has_colors) options += OpenMesh::IO::Options::VertexColor;
    return OpenMesh::IO::OBJReader().read(in, importer, options);
  });
  const FaceList faces = importer.take_polygons(1).faces;
  CHECK_EQ(importer.n_faces(), plain.material_of_face.size());

  Model model;
  model.warnings = std::move(plain.warnings);
  MeshBuilder builder(limits);
  const std::vector<Look> looks = looks_of(plain, name, folder, read_image, limits, builder, model.warnings);
  const std::vector<FaceList> lists = split_by_material(faces, plain.material_of_face, looks.size());
  for (std::size_t m = 0; m < lists.size(); ++m)
    if (!lists[m].face_ends.empty()) builder.add(lists[m], Eigen::Affine3d::Identity(), looks[m]);
  model.mesh = builder.finish(model.warnings);
  if (model.mesh.triangles.empty()) throw InputError(name, "there is no usable face in it");
  model.up = UpAxis::kY;
  return model;
}

}  // namespace hilbrush
