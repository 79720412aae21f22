#pragma once
#include <filesystem>
#include <string>

#include "sampling/base/input_error.h"
#include "sampling/model/model_file.h"
#include "tests/support/temporary_folder.h"

/// Models that tests write themselves.
namespace hilbrush {

/// A folder of the test's own, removed at its end.
class ModelOnDisk {
 public:
  ModelOnDisk() { std::filesystem::create_directories(folder()); }

  std::filesystem::path folder() const { return outer() / "model"; }
  std::filesystem::path outer() const { return outer_.path(); }
  std::filesystem::path write(const std::string& name, const std::string& bytes) const {
    return outer_.write("model/" + name, bytes);
  }
  Model load(const std::string& name, const std::string& bytes, const ModelLimits& limits = {}) const {
    return load_model(write(name, bytes), fake_image, limits);
  }
  /// VRML 2.0 with its header.
  Model load_vrml(const std::string& body, const ModelLimits& limits = {}) const {
    return load("model.wrl", "#VRML V2.0 utf8\n" + body, limits);
  }
  /// The message of the refusal, with file and line; empty if the model was read.
  std::string refusal(const std::string& name, const std::string& bytes,
                      const ModelLimits& limits = {}) const {
    try {
      load(name, bytes, limits);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
  std::string vrml_refusal(const std::string& body, const ModelLimits& limits = {}) const {
    return refusal("model.wrl", "#VRML V2.0 utf8\n" + body, limits);
  }

  /// Any existing file is a picture: 2 x 1 texels, dark and light; "gray" in its name makes it one channel.
  static Result<Texture> fake_image(const std::filesystem::path& file, std::size_t) {
    if (!std::filesystem::exists(file)) return Failure{"there is no such file"};
    Texture texture{2, 1, 3, {.25f, .75f}, {}, file.filename().string()};
    if (texture.name.find("gray") != std::string::npos) texture.channels = 1;
    return texture;
  }

 private:
  testing_support::TemporaryFolder outer_;
};

/// Of a closed mesh; positive if its triangles run counter-clockwise seen from outside.
inline double signed_volume(const TexturedMesh& mesh) {
  double volume = 0;
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t)
    volume += mesh.corner(t, 0).dot(mesh.corner(t, 1).cross(mesh.corner(t, 2))) / 6;
  return volume;
}

inline double area(const TexturedMesh& mesh) {
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t) sum += mesh.area_vector(t).norm();
  return sum;
}

/// True if a warning holds `words`.
inline bool warns(const Model& model, const std::string& words) {
  for (const std::string& warning : model.warnings)
    if (warning.find(words) != std::string::npos) return true;
  return false;
}

/// The texture coordinates at a point of the surface: those of the nearest triangle whose plane contains it.
inline Eigen::Vector2d uv_at(const TexturedMesh& mesh, const Eigen::Vector3d& point) {
  double nearest = 1e300;
  Eigen::Vector2d found(-1e9, -1e9);
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
    const Eigen::Vector3d normal = mesh.area_vector(t);
    Eigen::Vector3d b;
    for (int c = 0; c < 3; ++c)
      b[c] = .5 *
             (mesh.corner(t, (c + 1) % 3) - point).cross(mesh.corner(t, (c + 2) % 3) - point).dot(normal) /
             normal.squaredNorm();
    const double distance =
        std::abs((point - mesh.corner(t, 0)).dot(normal.normalized())) + 10 * std::max(0., -b.minCoeff());
    if (distance >= nearest) continue;
    nearest = distance;
    found = b[0] * mesh.corner_uv[t][0] + b[1] * mesh.corner_uv[t][1] + b[2] * mesh.corner_uv[t][2];
  }
  return found;
}

}  // namespace hilbrush
