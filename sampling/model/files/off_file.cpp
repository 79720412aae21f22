#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "sampling/base/input_error.h"
#include "sampling/model/files/mesh_file.h"
#include "sampling/model/files/polygon_list.h"
#include "sampling/model/files/text_lines.h"

/// OFF, as text. Vertices and faces may span lines; what follows one on its line is its color.
namespace hilbrush {
namespace {

/// Lines that hold something, without comments, and their numbers.
class OffLines {
 public:
  OffLines(std::string_view text, const std::string& name) : text_(text), name_(name) {}
  /// Null at the end of the file.
  std::optional<std::string_view> take() {
    while (const auto line = take_line(text_)) {
      ++number_;
      const std::string_view rest = trimmed(line->substr(0, line->find('#')));
      if (!rest.empty()) return rest;
    }
    return std::nullopt;
  }
  /// @throws InputError if there is none.
  std::string_view next(const std::string& expected) {
    const auto line = take();
    if (!line) fail("expected " + expected + ", found the end of the file");
    return *line;
  }
  [[noreturn]] void fail(const std::string& sentence) const {
    throw InputError(name_ + ":" + std::to_string(number_), sentence);
  }

 private:
  std::string_view text_;
  const std::string& name_;
  int number_ = 0;
};

struct Header {
  bool has_normals = false;
  std::size_t vertices = 0;
  std::size_t faces = 0;
};

Header read_header(OffLines& lines, const ModelLimits& limits) {
  Header header;
  std::string_view line = lines.next("OFF");
  // A count may follow the word without a blank: OFF8 6 12.
  const std::size_t word_end = line.find("OFF");
  if (word_end == line.npos || word_end > 4) lines.fail("expected OFF");
  const std::string_view letters = line.substr(0, word_end);
  line.remove_prefix(word_end + 3);
  header.has_normals = letters.find('N') != letters.npos;
  line = trimmed(line);
  if (line == "BINARY") lines.fail("binary OFF is not read; save it as text");
  // The counts may stand on the first line, too.
  if (line.empty()) line = lines.next("the numbers of vertices, faces and edges");
  const auto vertices = number_in<unsigned long long>(take_word(line));
  const auto faces = number_in<unsigned long long>(take_word(line));
  if (!vertices || !faces) lines.fail("expected the numbers of vertices, faces and edges");
  if (*vertices > 3 * limits.triangles || *faces > limits.triangles)
    lines.fail("it has more faces than the limit of " + std::to_string(limits.triangles));
  header.vertices = *vertices;
  header.faces = *faces;
  return header;
}

/// Numbers that may span lines.
class OffNumbers {
 public:
  explicit OffNumbers(OffLines& lines) : lines_(lines) {}

  /// @throws InputError with what was expected, which `describe` says.
  template <class Number, class Describe>
  Number take(const Describe& describe) {
    std::string_view word = take_word(rest_);
    if (word.empty()) {
      const auto line = lines_.take();
      if (!line) lines_.fail("expected " + describe() + ", found the end of the file");
      rest_ = *line;
      word = take_word(rest_);
    }
    const auto number = number_in<Number>(word);
    if (!number) lines_.fail("expected " + describe() + ", found '" + std::string(word.substr(0, 40)) + "'");
    return *number;
  }
  /// What is left of the line; the next number is looked for on the next one.
  std::string_view take_rest() { return std::exchange(rest_, {}); }

 private:
  OffLines& lines_;
  std::string_view rest_;
};

/// Color at the end of a line: three or four numbers, whole ones up to 255 or fractions up to 1. Its
/// luminance; null if there is none.
std::optional<float> read_color(std::string_view rest) {
  std::array<double, 3> channels{};
  bool is_fraction = false;
  for (double& channel : channels) {
    const std::string_view word = take_word(rest);
    const auto number = number_in<double>(word);
    if (!number || !(*number >= 0 && *number <= 255)) return std::nullopt;
    is_fraction = is_fraction || word.find('.') != word.npos;
    channel = *number;
  }
  for (double& channel : channels) channel /= is_fraction ? 1 : 255;
  return luminance_of_srgb(channels[0], channels[1], channels[2]);
}

/// Notes the color of the entry number `index`; those before it that had none are white.
void add_color(const std::optional<float>& luminance, std::size_t index, std::vector<float>& list) {
  if (!luminance) return;
  list.resize(index, 1);
  list.push_back(*luminance);
}

void read_vertices(OffLines& lines, const Header& header, PolygonList& polygons) {
  OffNumbers numbers(lines);
  for (std::size_t i = 0; i < header.vertices; ++i) {
    const auto vertex = [&] {
      return "vertex " + std::to_string(i + 1) + " of " + std::to_string(header.vertices);
    };
    Eigen::Vector3d p;
    for (double& coordinate : p) coordinate = numbers.take<double>(vertex);
    polygons.points.push_back(p);
    std::string_view rest = numbers.take_rest();
    for (int c = 0; header.has_normals && c < 3; ++c) take_word(rest);
    add_color(read_color(rest), i, polygons.point_luminance);
  }
  if (!polygons.point_luminance.empty()) polygons.point_luminance.resize(header.vertices, 1);
}

void read_faces(OffLines& lines, const Header& header, const std::string& name, const ModelLimits& limits,
                PolygonList& polygons) {
  OffNumbers numbers(lines);
  for (std::size_t i = 0; i < header.faces; ++i) {
    const auto face = [&] { return "face " + std::to_string(i + 1) + " of " + std::to_string(header.faces); };
    const auto count = numbers.take<std::uint32_t>(face);
    polygons.check_room(count, name, limits);
    const auto corners = [&] {
      return "the indices of the " + std::to_string(count) + " corners of " + face();
    };
    for (std::uint32_t c = 0; c < count; ++c)
      polygons.corners.push_back(numbers.take<std::uint32_t>(corners));
    polygons.face_ends.push_back(polygons.corners.size());
    add_color(read_color(numbers.take_rest()), i, polygons.face_luminance);
  }
}

}  // namespace

Model load_off(std::string text, const std::string& name, const ModelLimits& limits) {
  OffLines lines(text, name);
  const Header header = read_header(lines, limits);
  PolygonList polygons;
  read_vertices(lines, header, polygons);
  read_faces(lines, header, name, limits, polygons);
  std::string().swap(text);
  Model model;
  model.up = UpAxis::kZ;
  std::size_t dropped = 0;
  const FaceList faces = polygons.take_faces(name, dropped);
  if (dropped > 0)
    model.warnings.push_back(name + ": " + std::to_string(dropped) +
                             " faces were dropped: they name points that do not exist");
  MeshBuilder builder(limits);
  builder.add(faces, Eigen::Affine3d::Identity(), Look());
  model.mesh = builder.finish(model.warnings);
  if (model.mesh.triangles.empty()) throw InputError(name, "there is no usable face in it");
  return model;
}

}  // namespace hilbrush
