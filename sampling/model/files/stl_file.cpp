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

constexpr std::size_t kHeaderBytes = 80, kTriangleBytes = 50;

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
    std::memmove(bytes.data() + kHeaderBytes + 4 + kTriangleBytes * kept++, triangle, kTriangleBytes);
  }
  bytes.resize(kHeaderBytes + 4 + kTriangleBytes * kept);
  for (std::size_t i = 0; i < 4; ++i) bytes[kHeaderBytes + i] = static_cast<char>(kept >> (8 * i) & 255u);
  return count - kept;
}

/// The triangles of an ASCII file in the form that OpenMesh looks for; what is not finite is counted in `dropped`.
std::string clean_text(std::string_view text, const std::string& name, const ModelLimits& limits,
                       std::size_t& dropped) {
  std::string plain, triangle;
  std::size_t count = 0;
  int corners = 0, number = 0;
  bool is_finite = true;
  while (const auto line = take_line(text)) {
    ++number;
    std::string_view rest = *line;
    const std::string key = lower_case(take_word(rest));
    const std::string at = name + ":" + std::to_string(number);
    if (key == "outer") {
      triangle.clear();
      corners = 0;
      is_finite = true;
    } else if (key == "vertex") {
      if (++corners > 3) throw InputError(at, "a facet has more than three corners");
      triangle += "vertex";
      for (int i = 0; i < 3; ++i) {
        const std::string_view word = take_word(rest);
        const auto value = number_in<double>(word);
        if (!value) throw InputError(at, "expected three coordinates after vertex");
        is_finite = is_finite && std::abs(*value) < 1e30;
        (triangle += ' ').append(word);
      }
      triangle += '\n';
    } else if (key == "endloop") {
      if (corners != 3) throw InputError(at, "a facet has " + std::to_string(corners) + " corners, not three");
      corners = 0;
      if (!is_finite) {
        ++dropped;
        continue;
      }
      if (++count > limits.triangles)
        throw InputError(at, "the model has more triangles than the limit of " + std::to_string(limits.triangles));
      (plain += "outer loop\n") += triangle;
    } else if (!key.empty() && key != "solid" && key != "facet" && key != "endfacet" && key != "endsolid") {
      throw InputError(at, "expected solid, facet, outer loop, vertex, endloop, endfacet or endsolid, found '" +
                               key.substr(0, 40) + "'");
    }
  }
  if (corners > 0) throw InputError(name + ":" + std::to_string(number), "the file ends inside a facet");
  return plain;
}

}  // namespace

Model load_stl(std::string text, const std::string& name, const ModelLimits& limits) {
  std::size_t not_finite = 0;
  const bool binary = is_binary(text);
  if (binary)
    not_finite = clean_binary(text, name, limits);
  else
    text = clean_text(text, name, limits, not_finite);

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
  std::size_t dropped = 0;
  std::vector<std::size_t> kept;
  const FaceList faces = importer.take_faces(1, dropped, kept);
  MeshBuilder builder(limits);
  builder.add(faces, Eigen::Affine3d::Identity(), Look());
  model.mesh = builder.finish(model.warnings);
  if (model.mesh.triangles.empty()) throw InputError(name, "there is no triangle with area in it");
  return model;
}

}  // namespace hilbrush
