#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "sampling/base/input_error.h"
#include "sampling/model/files/face_list.h"
#include "sampling/model/files/mesh_file.h"
#include "sampling/model/files/text_lines.h"
#include "sampling/model/model_images.h"

/// OBJ: v, vt, f, usemtl and mtllib lines; the others say nothing of the surface. Indices are relative to
/// where they stand or absolute.
namespace hilbrush {
namespace {

constexpr std::size_t kMaterialLimit = 100'000;

struct MtlMaterial {
  std::optional<std::array<double, 3>> diffuse;
  double opacity = 1;
  std::string texture;
};

/// What the file holds.
struct ObjContent {
  FaceList faces;
  std::vector<std::uint32_t> material_of_face;  ///< index into `materials`
  std::vector<std::string> materials{""};       ///< names by first use; "" before any usemtl
  std::vector<std::string> libraries;
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

class ObjReader {
 public:
  ObjReader(std::string_view text, const std::string& name, const ModelLimits& limits)
      : lines_(text), name_(name), limits_(limits) {}

  ObjContent run() {
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
        if (content_.libraries.size() < 16) content_.libraries.emplace_back(trimmed(rest));
      }
    }
    if (colored_count_ > 0 && colored_count_ < points().size())
      content_.warnings.push_back(name_ + ": " + std::to_string(points().size() - colored_count_) + " of " +
                                  std::to_string(points().size()) + " points have no color; they are white");
    if (colored_count_ > 0) set_colors();
    if (dropped_count_ > 0)
      content_.warnings.push_back(
          at(first_dropped_) + ": " + std::to_string(dropped_count_) +
          " faces were dropped: they name points that do not exist (this is the first)");
    if (short_count_ > 0)
      content_.warnings.push_back(
          at(first_short_) + ": " + std::to_string(short_count_) +
          " faces with fewer than three different corners were dropped (this is the first)");
    content_.faces.at = name_;
    return std::move(content_);
  }

 private:
  std::string at(int line) const { return name_ + ":" + std::to_string(line); }

  std::vector<Eigen::Vector3d>& points() { return content_.faces.points; }

  void add_vertex(std::string_view rest) {
    if (points().size() >= 3 * limits_.triangles)
      throw InputError(at(lines_.number()), "the model has more points than the limit of " +
                                                std::to_string(3 * limits_.triangles));
    std::array<std::optional<double>, 6> numbers;
    for (auto& number : numbers) number = number_in<double>(take_word(rest));
    if (!numbers[0] || !numbers[1] || !numbers[2])
      throw InputError(at(lines_.number()), "expected three coordinates after v");
    points().emplace_back(*numbers[0], *numbers[1],
                          *numbers[2]);  // faces of what is not finite are dropped later
    const auto is_channel = [](const std::optional<double>& number) {
      return number && std::isfinite(*number);
    };
    const bool is_colored = std::all_of(numbers.begin() + 3, numbers.end(), is_channel);
    colored_count_ += is_colored;
    luminances_.push_back(is_colored ? luminance_of_srgb(*numbers[3], *numbers[4], *numbers[5]) : 1);
  }

  /// Colors belong to points in the file, to corners in the list of faces.
  void set_colors() {
    content_.faces.corner_luminance.reserve(content_.faces.corners.size());
    for (const std::uint32_t corner : content_.faces.corners)
      content_.faces.corner_luminance.push_back(luminances_[corner]);
  }

  void add_texture_vertex(std::string_view rest) {
    const auto u = number_in<double>(take_word(rest));
    if (!u) throw InputError(at(lines_.number()), "expected a texture coordinate after vt");
    const auto v = number_in<double>(take_word(rest));
    const auto usable = [](double x) { return std::isfinite(x) && std::abs(x) < 1e30 ? x : 0.; };
    texture_vertices_.emplace_back(usable(*u), usable(v.value_or(0)));
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
      const std::size_t point = absolute(*v, points().size());
      const std::size_t uv = t ? absolute(*t, texture_vertices_.size()) : 0;
      is_good = is_good && point > 0;
      has_uv = has_uv && uv > 0;
      // A point that a face visits twice is taken once: faces with spikes and bridges are common, and
      // repaired so.
      const bool is_again =
          std::any_of(corners_.begin(), corners_.end(), [&](const auto& c) { return c[0] == point; });
      if (!is_again || !is_good) corners_.push_back({point, uv});
      if (corners_.size() > kCornerLimit)
        throw InputError(at(lines_.number()),
                         "a face has more than " + std::to_string(kCornerLimit) + " corners");
    }
    if (!is_good) {
      if (dropped_count_++ == 0) first_dropped_ = lines_.number();
      return;
    }
    if (corners_.size() < 3) {
      if (short_count_++ == 0) first_short_ = lines_.number();
      return;
    }
    if (content_.material_of_face.size() >= limits_.triangles)
      throw InputError(at(lines_.number()),
                       "the model has more faces than the limit of " + std::to_string(limits_.triangles));
    content_.material_of_face.push_back(material_);
    add_corners(has_uv);
  }

  /// Faces before the first one with texture coordinates have none, and so do faces with an index that has
  /// none.
  void add_corners(bool has_uv) {
    FaceList& faces = content_.faces;
    if (has_uv) faces.corner_uv.resize(faces.corners.size(), Eigen::Vector2d::Zero());
    for (const auto& [point, uv] : corners_) {
      faces.corners.push_back(static_cast<std::uint32_t>(point - 1));
      if (has_uv) faces.corner_uv.push_back(texture_vertices_[uv - 1]);
    }
    if (!faces.corner_uv.empty()) faces.corner_uv.resize(faces.corners.size(), Eigen::Vector2d::Zero());
    faces.end_face();
  }

  void use_material(const std::string& material) {
    const auto [found, is_new] =
        known_.try_emplace(material, static_cast<std::uint32_t>(content_.materials.size()));
    if (is_new) content_.materials.push_back(material);
    if (content_.materials.size() > kMaterialLimit)
      throw InputError(at(lines_.number()),
                       "the model uses more than " + std::to_string(kMaterialLimit) + " materials");
    material_ = found->second;
  }

  // The search for repeated points takes time that grows with its square.
  static constexpr std::size_t kCornerLimit = 4096;

  ObjLines lines_;
  const std::string& name_;
  const ModelLimits& limits_;
  ObjContent content_;
  std::vector<float> luminances_;  ///< of the points
  std::vector<Eigen::Vector2d> texture_vertices_;
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
    const bool takes_word = option == "-clamp" || option == "-blendu" || option == "-blendv" ||
                            option == "-cc" || option == "-imfchan" || option == "-texres" ||
                            option == "-bm" || option == "-boost";
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
    if (key == "newmtl" && materials.size() < kMaterialLimit)
      current = &(materials[std::string(trimmed(rest))] = {});
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
      // Some exporters write the opacity as Tr. A Tr of 1 would be an invisible surface: it is taken as
      // opaque.
      const bool is_meant = number && std::isfinite(*number) && !(key == "Tr" && *number >= 1);
      if (is_meant) current->opacity = std::clamp(key == "d" ? *number : 1 - *number, 0., 1.);
    } else if (key == "map_Kd") {
      current->texture = texture_name(rest);
    }
  }
}

/// Reads the libraries that are there; each mtllib line may name several.
std::map<std::string, MtlMaterial> read_libraries(const ObjContent& content, const std::string& name,
                                                  ModelFolder& folder, std::vector<std::string>& warnings) {
  std::map<std::string, MtlMaterial> materials;
  std::set<std::string> files;  // each is read once, however often it is named
  for (const std::string& library : content.libraries) {
    // A name may hold spaces, or the line several names.
    std::vector<std::string> names{library};
    if (!folder.find(folder.path(), library)) {
      names.clear();
      std::string_view rest = library;
      for (std::string_view word; !(word = take_word(rest)).empty() && names.size() < 16;)
        names.emplace_back(word);
    }
    for (const std::string& each : names) {
      const auto file = folder.find(folder.path(), each);
      if (file && files.insert(file->string()).second)
        read_mtl(folder.read(*file), materials);
      else if (!file)
        warnings.push_back(name + ": the material file cannot be read (" + file.reason() + "); tried '" +
                           each.substr(0, 120) + "'");
    }
  }
  return materials;
}

/// One Look for each material that the faces use.
std::vector<Look> looks_of(const ObjContent& content, const std::string& name, ModelFolder& folder,
                           const ImageReader& read_image, const ModelLimits& limits, MeshBuilder& builder,
                           std::vector<std::string>& warnings) {
  const auto materials = read_libraries(content, name, folder, warnings);
  std::map<std::string, int> textures;
  ModelImages images(folder, read_image, limits, builder);
  std::vector<Look> looks(content.materials.size());
  for (std::size_t i = 0; i < looks.size(); ++i) {
    Look& look = looks[i];
    look.name = content.materials[i];
    const auto found = materials.find(look.name);
    if (found == materials.end()) continue;
    const MtlMaterial& material = found->second;
    look.opacity = material.opacity;
    if (material.diffuse) {
      look.source = ColorSource::kMaterial;
      look.luminance =
          luminance_of_srgb((*material.diffuse)[0], (*material.diffuse)[1], (*material.diffuse)[2]);
    }
    if (material.texture.empty()) continue;
    const auto [texture, is_new] = textures.try_emplace(material.texture, -1);
    if (is_new) {
      const auto image = images.open(folder.path(), material.texture);
      if (image)
        texture->second = *image;
      else if (warnings.size() < 100)
        warnings.push_back(name + ": the texture cannot be read (" + image.reason() + "); tried '" +
                           material.texture.substr(0, 120) + "'");
    }
    look.texture = texture->second;
  }
  return looks;
}

/// The faces of one material, as a list of its own.
std::vector<FaceList> split_by_material(const FaceList& faces,
                                        const std::vector<std::uint32_t>& material_of_face,
                                        std::size_t material_count) {
  std::vector<FaceList> lists(material_count);
  // Points are shared by few materials: the index in the last owner's list is remembered, others get a copy,
  // welded later.
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
  ObjContent content = ObjReader(text, name, limits).run();
  std::string().swap(text);
  if (content.material_of_face.empty()) {
    const std::string cause = content.warnings.empty() ? "" : "; " + content.warnings.front();
    throw InputError(name, "there is no face in it" + cause);
  }
  Model model;
  model.warnings = std::move(content.warnings);
  MeshBuilder builder(limits);
  const std::vector<Look> looks =
      looks_of(content, name, folder, read_image, limits, builder, model.warnings);
  const std::vector<FaceList> lists =
      split_by_material(content.faces, content.material_of_face, looks.size());
  for (std::size_t m = 0; m < lists.size(); ++m)
    if (!lists[m].face_ends.empty()) builder.add(lists[m], Eigen::Affine3d::Identity(), looks[m]);
  model.mesh = builder.finish(model.warnings);
  if (model.mesh.triangles.empty()) throw InputError(name, "there is no usable face in it");
  model.up = UpAxis::kY;
  return model;
}

}  // namespace hilbrush
