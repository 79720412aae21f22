#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <functional>
#include <unordered_map>

#include "sampling/base/input_error.h"
#include "sampling/model/files/face_list.h"
#include "sampling/model/files/mesh_file.h"
#include "sampling/model/files/text_lines.h"

/// STL. A binary file's count is checked against its size; triangles that are not finite are left out and
/// counted.
namespace hilbrush {
namespace {

constexpr std::size_t kHeaderBytes = 80;
constexpr std::size_t kTriangleBytes = 50;
constexpr std::size_t kNormalBytes = 12;

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

/// Gathers triangles. Every corner has coordinates of its own in the file: equal ones become one point.
class TriangleList {
 public:
  using Corners = std::array<Eigen::Vector3d, 3>;

  void add(const Corners& corners) {
    const auto is_usable = [](const Eigen::Vector3d& p) {
      return p.allFinite() && p.cwiseAbs().maxCoeff() < kMaxCoordinate;
    };
    if (!std::ranges::all_of(corners, is_usable)) {
      ++dropped_;
      return;
    }
    for (const Eigen::Vector3d& p : corners) faces_.corners.push_back(index_of(p));
    faces_.end_face();
  }
  std::size_t count() const { return faces_.face_ends.size() + dropped_; }
  std::size_t dropped() const { return dropped_; }
  FaceList take(const std::string& name) {
    faces_.at = name;
    return std::move(faces_);
  }

 private:
  struct Hash {
    std::size_t operator()(const std::array<double, 3>& p) const {
      return std::hash<std::string_view>()({reinterpret_cast<const char*>(p.data()), sizeof p});
    }
  };

  std::uint32_t index_of(const Eigen::Vector3d& p) {
    const Eigen::Vector3d unsigned_zero = p + Eigen::Vector3d::Zero();  // -0 becomes +0
    const auto [found, is_new] = index_.try_emplace({unsigned_zero.x(), unsigned_zero.y(), unsigned_zero.z()},
                                                    static_cast<std::uint32_t>(faces_.points.size()));
    if (is_new) faces_.points.push_back(p);
    return found->second;
  }

  FaceList faces_;
  std::unordered_map<std::array<double, 3>, std::uint32_t, Hash> index_;
  std::size_t dropped_ = 0;
};

float float_at(const char* bytes) {
  std::uint32_t bits = 0;
  for (int i = 3; i >= 0; --i) bits = bits << 8 | static_cast<unsigned char>(bytes[i]);
  return std::bit_cast<float>(bits);
}

void read_binary(const std::string& bytes, const std::string& name, const ModelLimits& limits,
                 TriangleList& list) {
  const std::size_t count = count_of(bytes);
  const std::size_t there = (bytes.size() - kHeaderBytes - 4) / kTriangleBytes;
  if (count > there)
    throw InputError(name, "its header promises " + std::to_string(count) + " triangles, the file holds " +
                               std::to_string(there));
  if (count > limits.triangles)
    throw InputError(name,
                     "the model has more triangles than the limit of " + std::to_string(limits.triangles));
  for (std::size_t t = 0; t < count; ++t) {
    const char* corner = bytes.data() + kHeaderBytes + 4 + kTriangleBytes * t + kNormalBytes;
    TriangleList::Corners corners;
    for (Eigen::Vector3d& p : corners) {
      p = {float_at(corner), float_at(corner + 4), float_at(corner + 8)};
      corner += 12;
    }
    list.add(corners);
  }
}

/// Reads an ASCII file.
class AsciiStlReader {
 public:
  AsciiStlReader(std::string_view text, const std::string& name, const ModelLimits& limits,
                 TriangleList& list)
      : text_(text), name_(name), limits_(limits), list_(list) {}

  void read() {
    while (const auto line = take_line(text_)) {
      ++line_number_;
      read_line(*line);
    }
    if (corners_ > 0) fail("the file ends inside a facet");
  }

 private:
  [[noreturn]] void fail(const std::string& sentence) const {
    throw InputError(name_ + ":" + std::to_string(line_number_), sentence);
  }

  void read_line(std::string_view line) {
    const std::string key = lower_case(take_word(line));
    if (key == "outer") {
      corners_ = 0;
    } else if (key == "vertex") {
      add_corner(line);
    } else if (key == "endloop") {
      end_triangle();
    } else if (!key.empty() && key != "solid" && key != "facet" && key != "endfacet" && key != "endsolid") {
      fail("expected solid, facet, outer loop, vertex, endloop, endfacet or endsolid, found '" +
           key.substr(0, 40) + "'");
    }
  }

  void add_corner(std::string_view coordinates) {
    if (corners_ == 3) fail("a facet has more than three corners");
    for (int axis = 0; axis < 3; ++axis) {
      const auto value = number_in<double>(take_word(coordinates));
      if (!value) fail("expected three coordinates after vertex");
      triangle_[corners_][axis] = *value;
    }
    ++corners_;
  }

  void end_triangle() {
    if (corners_ != 3) fail("a facet has " + std::to_string(corners_) + " corners, not three");
    corners_ = 0;
    if (list_.count() >= limits_.triangles)
      fail("the model has more triangles than the limit of " + std::to_string(limits_.triangles));
    list_.add(triangle_);
  }

  std::string_view text_;
  const std::string& name_;
  const ModelLimits& limits_;
  TriangleList& list_;
  TriangleList::Corners triangle_;
  std::size_t corners_ = 0;
  int line_number_ = 0;
};

}  // namespace

Model load_stl(std::string text, const std::string& name, const ModelLimits& limits) {
  TriangleList list;
  if (is_binary(text))
    read_binary(text, name, limits, list);
  else
    AsciiStlReader(text, name, limits, list).read();
  std::string().swap(text);
  Model model;
  model.up = UpAxis::kZ;
  if (list.dropped() > 0)
    model.warnings.push_back(name + ": " + std::to_string(list.dropped()) +
                             " triangles with coordinates out of range were dropped");
  const FaceList faces = list.take(name);
  MeshBuilder builder(limits);
  builder.add(faces, Eigen::Affine3d::Identity(), Look());
  model.mesh = builder.finish(model.warnings);
  if (model.mesh.triangles.empty()) throw InputError(name, "there is no triangle with area in it");
  return model;
}

}  // namespace hilbrush
