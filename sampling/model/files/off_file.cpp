#include <array>

#include "sampling/base/input_error.h"
#include "sampling/model/files/mesh_file.h"
#include "sampling/model/files/text_lines.h"

/// OFF. OpenMesh's reader keeps what the last file's header said when it reads from memory, and knows no comments. A
/// PLY with the same content is nearly the same text, so an OFF is rewritten as one, and read as one.
namespace hilbrush {
namespace {

/// Lines that hold something, without comments, and their numbers.
class OffLines {
 public:
  OffLines(std::string_view text, const std::string& name) : text_(text), name_(name) {}
  /// @throws InputError if there is none.
  std::string_view next(const std::string& expected) {
    while (const auto line = take_line(text_)) {
      ++number_;
      const std::string_view rest = trimmed(line->substr(0, line->find('#')));
      if (!rest.empty()) return rest;
    }
    fail("expected " + expected + ", found the end of the file");
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
  bool has_uv = false;
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
  header.has_uv = letters.find("ST") != letters.npos;
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

/// Color at the end of a line: three or four numbers, whole ones up to 255 or fractions up to 1. As three bytes; null
/// if there is none.
std::optional<std::array<int, 3>> read_color(std::string_view rest) {
  std::array<double, 3> channels{};
  bool is_fraction = false;
  for (double& channel : channels) {
    const std::string_view word = take_word(rest);
    const auto number = number_in<double>(word);
    if (!number || !(*number >= 0 && *number <= 255)) return std::nullopt;
    is_fraction = is_fraction || word.find('.') != word.npos;
    channel = *number;
  }
  std::array<int, 3> color{};
  for (std::size_t i = 0; i < 3; ++i)
    color[i] = static_cast<int>(is_fraction ? std::min(channels[i], 1.) * 255 + .5 : channels[i]);
  return color;
}

void append_color(std::string& text, const std::optional<std::array<int, 3>>& color) {
  for (const int channel : color.value_or(std::array<int, 3>{255, 255, 255})) (text += ' ') += std::to_string(channel);
  text += '\n';
}

/// Lines of a PLY's body, and whether any of them has a color of its own.
struct PlyLines {
  std::string text;
  bool have_colors = false;
};

PlyLines vertex_lines(OffLines& lines, const Header& header) {
  PlyLines vertices;
  for (std::size_t i = 0; i < header.vertices; ++i) {
    std::string_view line = lines.next("vertex " + std::to_string(i + 1) + " of " + std::to_string(header.vertices));
    for (int c = 0; c < 3; ++c) {
      const std::string_view word = take_word(line);
      const auto number = number_in<double>(word);
      if (!number) lines.fail("expected three coordinates");
      vertices.text.append(std::isfinite(*number) ? word : "9e37") += ' ';  // out of range: its faces are dropped
    }
    for (int c = 0; header.has_normals && c < 3; ++c) take_word(line);
    const auto color = read_color(line);
    vertices.have_colors = vertices.have_colors || color;
    append_color(vertices.text, color);
  }
  return vertices;
}

PlyLines face_lines(OffLines& lines, const Header& header) {
  PlyLines faces;
  for (std::size_t i = 0; i < header.faces; ++i) {
    std::string_view line = lines.next("face " + std::to_string(i + 1) + " of " + std::to_string(header.faces));
    const auto count = number_in<std::uint32_t>(take_word(line));
    if (!count) lines.fail("expected the number of the face's corners");
    faces.text += std::to_string(*count);
    for (std::uint32_t c = 0; c < *count; ++c) {
      const auto index = number_in<std::uint32_t>(take_word(line));
      if (!index) lines.fail("expected the indices of the face's " + std::to_string(*count) + " corners");
      (faces.text += ' ') += std::to_string(*index);
    }
    const auto color = read_color(line);
    faces.have_colors = faces.have_colors || color;
    append_color(faces.text, color);
  }
  return faces;
}

/// Colors that no line has must not look like white ones: they get names that are not read.
std::string color_properties(bool have_colors) {
  return have_colors ? "property uchar red\nproperty uchar green\nproperty uchar blue\n"
                     : "property uchar skip1\nproperty uchar skip2\nproperty uchar skip3\n";
}

}  // namespace

Model load_off(std::string text, const std::string& name, ModelFolder& folder, const ImageReader& read_image,
               const ModelLimits& limits) {
  OffLines lines(text, name);
  const Header header = read_header(lines, limits);
  const PlyLines vertices = vertex_lines(lines, header);
  const PlyLines faces = face_lines(lines, header);
  std::string().swap(text);
  std::string ply = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(header.vertices) +
                    "\nproperty float x\nproperty float y\nproperty float z\n" +
                    color_properties(vertices.have_colors) + "element face " + std::to_string(header.faces) +
                    "\nproperty list int uint vertex_indices\n" + color_properties(faces.have_colors) + "end_header\n";
  ply += vertices.text;
  ply += faces.text;
  return load_ply(std::move(ply), name, folder, read_image, limits);
}

}  // namespace hilbrush
