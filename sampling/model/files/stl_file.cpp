#include <OpenMesh/Core/IO/reader/STLReader.hh>
#include <cstring>

#include "sampling/base/input_error.h"
#include "sampling/model/files/mesh_file.h"
#include "sampling/model/files/openmesh_reading.h"
#include "sampling/model/files/polygon_importer.h"
#include "sampling/model/files/text_lines.h"

/// STL. OpenMesh believes the count of a binary file, and any line of an ASCII one that holds "outer"; a coordinate
/// that is not a number breaks the map it welds points with. So the text is put into plain form, and triangles that are
/// not finite are taken out.
namespace hilbrush {
namespace {

constexpr std::size_t kHeaderBytes = 80;
constexpr std::size_t kTriangleBytes = 50;

std::uint32_t count_of(const std::string& bytes) {
  std::uint32_t count = 0;
  for (int i = 3; i >= 0; --i)
    count = count << 8 | static_cast<unsigned char>(bytes[kHeaderBytes + static_cast<std::size_t>(i)]);
  return count;
}

/// Text begins with "solid" - and so do some binary files, whose size gives them away.
bool is_binary(const std::string& bytes) {
  if (bytes.size() < kHeaderBytes + 4) return false;
  if (bytes.size() == kHeaderBytes + 4 + kTriangleBytes * std::size_t{count_of(bytes)}) return true;
  std::string_view head(bytes);
  return lower_case(take_word(head)) != "solid";
}

/// Removes triangles that are not finite; returns how many.
std::size_t clean_binary(std::string& bytes, const std::string& name, const ModelLimits& limits) {
  const std::size_t count = count_of(bytes);
  const std::size_t there = (bytes.size() - kHeaderBytes - 4) / kTriangleBytes;
  if (count > there)
    throw InputError(
        name, "its header promises " + std::to_string(count) + " triangles, the file holds " + std::to_string(there));
  if (count > limits.triangles)
    throw InputError(name, "the model has more triangles than the limit of " + std::to_string(limits.triangles));
  std::size_t kept = 0;
  for (std::size_t t = 0; t < count; ++t) {
    const char* triangle = bytes.data() + kHeaderBytes + 4 + kTriangleBytes * t;
    std::array<float, 12> numbers{};
    std::memcpy(numbers.data(), triangle, sizeof numbers);
    bool is_finite = true;
    for (std::size_t i = 3; i < 12; ++i) is_finite = is_finite && std::isfinite(numbers[i]);
    if (!is_finite) continue;
    std::memmove(bytes.data() + kHeaderBytes + 4 + kTriangleBytes * kept, triangle, kTriangleBytes);
    ++kept;
  }
  bytes.resize(kHeaderBytes + 4 + kTriangleBytes * kept);
  for (std::size_t i = 0; i < 4; ++i) bytes[kHeaderBytes + i] = static_cast<char>(kept >> (8 * i) & 255u);
  return count - kept;
}

/// Puts an ASCII file into the form that OpenMesh looks for. Triangles that are not finite are left out and counted.
class AsciiStlReader {
 public:
  AsciiStlReader(std::string_view text, const std::string& name, const ModelLimits& limits)
      : text_(text), name_(name), limits_(limits) {}

  std::string read() {
    while (const auto line = take_line(text_)) {
      ++line_number_;
      read_line(*line);
    }
    if (corners_ > 0) fail("the file ends inside a facet");
    return std::move(plain_);
  }
  std::size_t dropped() const { return dropped_; }

 private:
  [[noreturn]] void fail(const std::string& sentence) const {
    throw InputError(name_ + ":" + std::to_string(line_number_), sentence);
  }

  void read_line(std::string_view line) {
    const std::string key = lower_case(take_word(line));
    if (key == "outer") {
      triangle_.clear();
      corners_ = 0;
      is_finite_ = true;
    } else if (key == "vertex") {
      add_corner(line);
    } else if (key == "endloop") {
      end_triangle();
    } else if (!key.empty() && key != "solid" && key != "facet" && key != "endfacet" && key != "endsolid") {
      fail("expected solid, facet, outer loop, vertex, endloop, endfacet or endsolid, found '" + key.substr(0, 40) +
           "'");
    }
  }

  void add_corner(std::string_view coordinates) {
    if (++corners_ > 3) fail("a facet has more than three corners");
    triangle_ += "vertex";
    for (int i = 0; i < 3; ++i) {
      const std::string_view word = take_word(coordinates);
      const auto value = number_in<double>(word);
      if (!value) fail("expected three coordinates after vertex");
      is_finite_ = is_finite_ && std::abs(*value) < kMaxCoordinate;
      (triangle_ += ' ').append(word);
    }
    triangle_ += '\n';
  }

  void end_triangle() {
    if (corners_ != 3) fail("a facet has " + std::to_string(corners_) + " corners, not three");
    corners_ = 0;
    if (!is_finite_) {
      ++dropped_;
      return;
    }
    if (++count_ > limits_.triangles)
      fail("the model has more triangles than the limit of " + std::to_string(limits_.triangles));
    (plain_ += "outer loop\n") += triangle_;
  }

  std::string_view text_;
  const std::string& name_;
  const ModelLimits& limits_;
  std::string plain_;
  std::string triangle_;
  std::size_t count_ = 0;
  std::size_t dropped_ = 0;
  int line_number_ = 0;
  int corners_ = 0;
  bool is_finite_ = true;
};

}  // namespace

Model load_stl(std::string text, const std::string& name, const ModelLimits& limits) {
  std::size_t not_finite = 0;
  const bool binary = is_binary(text);
  if (binary) {
    not_finite = clean_binary(text, name, limits);
  } else {
    AsciiStlReader reader(text, name, limits);
    text = reader.read();
    not_finite = reader.dropped();
  }

  PolygonImporter importer(name, limits);
  read_with_openmesh(std::move(text), name, binary, [&](std::istream& in) {
    OpenMesh::IO::Options options = binary ? OpenMesh::IO::Options::Binary : OpenMesh::IO::Options::Default;
    return OpenMesh::IO::STLReader().read(in, importer, options);
  });
  Model model;
  model.up = UpAxis::kZ;
  if (not_finite > 0)
    model.warnings.push_back(name + ": " + std::to_string(not_finite) +
                             " triangles with coordinates out of range were dropped");
  const FaceList faces = importer.take_polygons(1).faces;
  MeshBuilder builder(limits);
  builder.add(faces, Eigen::Affine3d::Identity(), Look());
  model.mesh = builder.finish(model.warnings);
  if (model.mesh.triangles.empty()) throw InputError(name, "there is no triangle with area in it");
  return model;
}

}  // namespace hilbrush
