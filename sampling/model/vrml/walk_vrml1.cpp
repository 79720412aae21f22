#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "sampling/model/vrml/primitives.h"
#include "sampling/model/vrml/reading.h"
#include "sampling/model/vrml/surfaces.h"

/// The walk over a VRML 1.0 tree. Properties are nodes here, not fields of shapes: they change a state that
/// later shapes use, until the enclosing Separator ends.
namespace hilbrush::vrml {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

struct State {
  Context context;
  Reference coordinates;
  Reference texture_coordinates;
  Reference material;
  std::string material_binding = "OVERALL";
  int texture = -1;
  bool repeat_u = true;
  bool repeat_v = true;
  Eigen::Affine2d X_uv = Eigen::Affine2d::Identity();
  bool is_clockwise = false;
};

bool is_group(const std::string& type) {
  return type == "Group" || type == "Separator" || type == "TransformSeparator" || type == "WWWAnchor";
}

/// VRML 1.0, Texture2Transform: scaled and turned about the center, then moved.
Eigen::Affine2d vrml1_texture_transform(const Reference& node) {
  const Vector2d center = vector2_of(node, "center", Vector2d::Zero());
  return Eigen::Translation2d(vector2_of(node, "translation", Vector2d::Zero()) + center) *
         Eigen::Rotation2Dd(number_of(node, "rotation", 0)) *
         Eigen::Scaling(vector2_of(node, "scaleFactor", Vector2d::Ones())) * Eigen::Translation2d(-center);
}

Eigen::Affine3d matrix_of(const Reference& node) {
  const std::vector<double>& m = numbers_of(node, "matrix");
  Eigen::Affine3d X = Eigen::Affine3d::Identity();
  if (m.size() < 16) return X;
  // Written row by row, for row vectors.
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column)
      X(row, column) = m[std::size_t{4} * static_cast<std::size_t>(column) + static_cast<std::size_t>(row)];
  return X;
}

Parts parts_of(const Reference& node) {
  const BoundValue bound = find(node, "parts");
  if (!bound || bound.value->strings.empty()) return {};
  const std::vector<std::string>& words = bound.value->strings;
  const auto has = [&](const char* word) {
    return std::find(words.begin(), words.end(), word) != words.end() ||
           std::find(words.begin(), words.end(), "ALL") != words.end();
  };
  return {has("SIDES"), has("TOP"), has("BOTTOM")};
}

class Vrml1Walker {
 public:
  explicit Vrml1Walker(Reading& reading) : reading_(reading) {}

  void walk_node(const Reference& start, State& state) {
    const Reference node = reading_.resolve(start);
    if (!node) return;
    const std::string& type = node.node->type;
    if (is_group(type) || type == "Switch" || type == "LOD") return walk_group(node, state);
    if (set_transform(node, state) || set_property(node, state)) return;
    if (type == "WWWInline") {
      const BoundValue name = find(node, "name");
      const Context context = deeper(reading_, state.context, *node.node);
      walk_inline(reading_, *node.node, name ? name.value->strings : std::vector<std::string>(), context);
      return;
    }
    add_shape(node, state);
  }

 private:
  void walk_group(const Reference& node, State& state) {
    const std::string& type = node.node->type;
    State inner = state;
    inner.context = deeper(reading_, state.context, *node.node);
    const std::vector<NodePointer>& children = node.node->children;
    if (type == "Switch" || type == "LOD") {
      const double which = type == "LOD" ? 0 : number_of(node, "whichChild", -1);
      constexpr double kAll = -3;
      for (std::size_t i = 0; i < children.size(); ++i)
        if (which == kAll || which == static_cast<double>(i))
          walk_node({children[i].get(), node.frame}, inner);
    } else {
      for (const NodePointer& child : children) walk_node({child.get(), node.frame}, inner);
    }
    // What a Group or Switch sets stays set; a TransformSeparator holds back only the transform.
    if (type == "Separator" || type == "LOD" || type == "WWWAnchor") return;
    if (type != "TransformSeparator") state.context.X = inner.context.X;
    inner.context = state.context;
    state = inner;
  }

  bool set_transform(const Reference& node, State& state) {
    const std::string& type = node.node->type;
    Eigen::Affine3d& X = state.context.X;
    if (type == "Translation")
      X = X * Eigen::Translation3d(vector3_of(node, "translation", Vector3d::Zero()));
    else if (type == "Rotation")
      X = X * rotation_matrix(rotation_of(node, "rotation", Eigen::Vector4d(0, 0, 1, 0)));
    else if (type == "Scale")
      X = X * Eigen::Scaling(vector3_of(node, "scaleFactor", Vector3d::Ones()));
    else if (type == "Transform")
      X = X * transform_of(node, "scaleFactor");
    else if (type == "MatrixTransform")
      X = X * matrix_of(node);
    else
      return false;
    return true;
  }

  bool set_property(const Reference& node, State& state) {
    const std::string& type = node.node->type;
    if (type == "Coordinate3") {
      state.coordinates = node;
    } else if (type == "TextureCoordinate2") {
      state.texture_coordinates = node;
    } else if (type == "Material") {
      state.material = node;
    } else if (type == "MaterialBinding") {
      state.material_binding = word_of(node, "value", "DEFAULT");
    } else if (type == "Texture2") {
      set_texture(node, state);
    } else if (type == "Texture2Transform") {
      state.X_uv = vrml1_texture_transform(node);
    } else if (type == "ShapeHints") {
      state.is_clockwise = word_of(node, "vertexOrdering", "UNKNOWN_ORDERING") == "CLOCKWISE";
    } else {
      return false;
    }
    return true;
  }

  void set_texture(const Reference& node, State& state) {
    state.texture = -1;
    const BoundValue file = find(node, "filename");
    if (file && !file.value->strings.empty() && !file.value->strings[0].empty()) {
      state.texture = reading_.open_image(*node.node, file.value->strings);
    } else if (const BoundValue image = find(node, "image")) {
      state.texture = reading_.pixel_texture(*node.node, image.value->numbers);
    }
    state.repeat_u = word_of(node, "wrapS", "REPEAT") != "CLAMP";
    state.repeat_v = word_of(node, "wrapT", "REPEAT") != "CLAMP";
  }

  Look look_of(const State& state) {
    // Without a Material its defaults hold.
    Look look;
    look.source = ColorSource::kMaterial;
    look.luminance = luminance_of_srgb(.8, .8, .8);
    if (state.material) {
      const std::vector<double>& diffuse = numbers_of(state.material, "diffuseColor");
      look.luminance = diffuse.size() < 3 ? luminance_of_srgb(.8, .8, .8)
                                          : luminance_of_srgb(diffuse[0], diffuse[1], diffuse[2]);
      const std::vector<double>& transparency = numbers_of(state.material, "transparency");
      if (!transparency.empty()) look.opacity = 1 - std::clamp(transparency[0], 0., 1.);
    }
    look.texture = state.texture;
    look.repeat_u = state.repeat_u;
    look.repeat_v = state.repeat_v;
    look.X_uv = state.X_uv;
    return look;
  }

  void add_shape(const Reference& node, const State& state) {
    const Look look = look_of(state);
    FaceList faces;
    const std::string& type = node.node->type;
    if (type == "IndexedFaceSet")
      faces = face_set(node, state);
    else if (type == "Cube")
      faces = box({number_of(node, "width", 2), number_of(node, "height", 2), number_of(node, "depth", 2)});
    else if (type == "Sphere")
      faces = sphere(number_of(node, "radius", 1));
    else if (type == "Cylinder")
      faces = cylinder(number_of(node, "radius", 1), number_of(node, "height", 2), parts_of(node));
    else if (type == "Cone")
      faces = cone(number_of(node, "bottomRadius", 1), number_of(node, "height", 2), parts_of(node));
    else
      return reading_.ignore(*node.node);
    faces.at = at(*node.node);
    if (!faces.face_ends.empty()) reading_.builder.add(faces, state.context.X, look);
  }

  static void add_field(Node& node, const char* name, std::vector<double> numbers) {
    Field field;
    field.name = name;
    field.value.numbers = std::move(numbers);
    node.fields.push_back(std::move(field));
  }

  /// Adds the fields that bind the material's colors to `surface`, and the colors to `colors`; without a
  /// binding neither.
  static void bind_colors(const Reference& node, const State& state, Node& surface, Node& colors) {
    const std::string& binding = state.material_binding;
    const bool is_per_vertex = binding.starts_with("PER_VERTEX");
    const bool is_per_face = binding.starts_with("PER_FACE") || binding.starts_with("PER_PART");
    const bool is_indexed = binding.size() > 8 && binding.ends_with("_INDEXED");
    if (!state.material || !(is_per_vertex || is_per_face)) return;
    add_field(colors, "color", numbers_of(state.material, "diffuseColor"));
    add_field(surface, "colorPerVertex", {is_per_vertex ? 1. : 0.});
    if (is_indexed)
      add_field(surface, "colorIndex", numbers_of(node, "materialIndex"));
    else if (is_per_vertex)
      add_field(surface, "colorIndex", running_index(numbers_of(node, "coordIndex")));
  }

  /// As a VRML 2.0 face set of the same numbers: only their fields and the binding of colors differ.
  FaceList face_set(const Reference& node, const State& state) {
    for (const char* field : {"coordIndex", "textureCoordIndex", "materialIndex"})
      reading_.spend(numbers_of(node, field).size(), *node.node);
    for (const auto& [property, field] : {std::pair{state.coordinates, "point"},
                                          {state.texture_coordinates, "point"},
                                          {state.material, "diffuseColor"}})
      if (property) reading_.spend(numbers_of(property, field).size(), *node.node);
    Node surface;
    surface.type = node.node->type;
    surface.file = node.node->file;
    surface.line = node.node->line;
    add_field(surface, "coordIndex", numbers_of(node, "coordIndex"));
    add_field(surface, "texCoordIndex", numbers_of(node, "textureCoordIndex"));
    add_field(surface, "ccw", {state.is_clockwise ? 0. : 1.});
    Node colors;
    bind_colors(node, state, surface, colors);
    SurfaceParts parts{state.coordinates, {}, state.texture_coordinates};
    if (!colors.fields.empty() && colors.fields[0].value.numbers.size() > 3)
      parts.colors = {&colors, nullptr};
    std::vector<std::string> warnings;
    FaceList faces = indexed_face_set({&surface, nullptr}, parts, look_of(state).luminance, warnings);
    reading_.warn(warnings);
    reading_.spend(faces.corners.size(), *node.node);
    return faces;
  }

  /// One material after another, corner by corner.
  static std::vector<double> running_index(const std::vector<double>& coord_index) {
    std::vector<double> index;
    double next = 0;
    for (const double i : coord_index) index.push_back(i < 0 ? -1 : next++);
    return index;
  }

  Reading& reading_;
};

}  // namespace

void walk_vrml1(Reading& reading, const Scene& scene, const Context& context) {
  Vrml1Walker walker(reading);
  State state;
  state.context = context;
  for (const NodePointer& root : scene.roots) walker.walk_node({root.get(), nullptr}, state);
}

}  // namespace hilbrush::vrml
