#include <Eigen/Geometry>
#include <cmath>

#include "sampling/base/input_error.h"
#include "sampling/model/vrml/primitives.h"
#include "sampling/model/vrml/reading.h"
#include "sampling/model/vrml/surfaces.h"

/// The walk over a VRML 2.0 tree: groups and transforms down to shapes.
namespace hilbrush::vrml {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// VRML97, 6.49: Tc' = -C x S x R x C x T x Tc.
Eigen::Affine2d vrml2_texture_transform(const Reference& node) {
  const Vector2d center = vector2_of(node, "center", Vector2d::Zero());
  const Vector2d scale = vector2_of(node, "scale", Vector2d::Ones());
  const Vector2d translation = vector2_of(node, "translation", Vector2d::Zero());
  return Eigen::Translation2d(-center) * Eigen::Scaling(scale) *
         Eigen::Rotation2Dd(number_of(node, "rotation", 0)) * Eigen::Translation2d(center + translation);
}

class Vrml2Walker {
 public:
  explicit Vrml2Walker(Reading& reading) : reading_(reading) {}

  void walk_node(const Reference& start, const Context& outer) {
    const Reference node = reading_.resolve(start);
    if (!node) return;
    const std::string& type = node.node->type;
    if (type == "Shape") return add_shape(node, outer);
    const Context context = deeper(reading_, outer, *node.node);
    if (type == "Transform") {
      Context moved = context;
      moved.X = context.X * transform_of(node, "scale");
      walk_children(node, "children", moved);
    } else if (type == "Group" || type == "Anchor" || type == "Billboard" || type == "Collision") {
      walk_children(node, "children", context);
    } else if (type == "Switch") {
      walk_choice(node, "choice", number_of(node, "whichChoice", -1), context);
    } else if (type == "LOD") {
      walk_choice(node, "level", 0, context);  // the finest
    } else if (type == "Inline") {
      const BoundValue url = find(node, "url");
      walk_inline(reading_, *node.node, url ? url.value->strings : std::vector<std::string>(), context);
    } else {
      reading_.ignore(*node.node);
    }
  }

 private:
  void walk_children(const Reference& node, const char* field, const Context& context) {
    if (const BoundValue children = find(node, field))
      for (const NodePointer& child : children.value->nodes)
        walk_node({child.get(), children.frame}, context);
    for (const NodePointer& child : node.node->children) walk_node({child.get(), node.frame}, context);
  }

  void walk_choice(const Reference& node, const char* field, double choice, const Context& context) {
    const BoundValue choices = find(node, field);
    if (!choices || choice < 0 || choice >= static_cast<double>(choices.value->nodes.size())) return;
    walk_node({choices.value->nodes[static_cast<std::size_t>(choice)].get(), choices.frame}, context);
  }

  Reference resolved_field(const Reference& node, const char* field) {
    return reading_.resolve(node_of(node, field));
  }

  Look look_of(const Reference& shape) {
    Look look;
    const Reference appearance = resolved_field(shape, "appearance");
    if (!appearance) return look;
    if (const Reference material = resolved_field(appearance, "material")) {
      const Vector3d diffuse = vector3_of(material, "diffuseColor", Vector3d::Constant(.8));
      look.source = ColorSource::kMaterial;
      look.luminance = luminance_of_srgb(diffuse.x(), diffuse.y(), diffuse.z());
      look.opacity = 1 - std::clamp(number_of(material, "transparency", 0), 0., 1.);
    }
    if (const Reference texture = resolved_field(appearance, "texture")) add_texture(texture, look);
    if (look.texture >= 0)
      if (const Reference transform = resolved_field(appearance, "textureTransform"))
        look.X_uv = vrml2_texture_transform(transform);
    return look;
  }

  void add_texture(const Reference& node, Look& look) {
    if (node.node->type == "ImageTexture") {
      const BoundValue url = find(node, "url");
      if (url && !url.value->strings.empty())
        look.texture = reading_.open_image(*node.node, url.value->strings);
    } else if (node.node->type == "PixelTexture") {
      if (const BoundValue image = find(node, "image"))
        look.texture = reading_.pixel_texture(*node.node, image.value->numbers);
    } else {
      reading_.ignore(*node.node);
    }
    look.repeat_u = flag_of(node, "repeatS", true);
    look.repeat_v = flag_of(node, "repeatT", true);
    // An image with an alpha channel brings its own transparency (VRML97, table 4.6).
    if (look.texture >= 0 &&
        reading_.builder.mesh().textures[static_cast<std::size_t>(look.texture)].channels % 2 == 0)
      look.opacity = 1;
  }

  void add_shape(const Reference& shape, const Context& context) {
    const Reference geometry = resolved_field(shape, "geometry");
    if (!geometry) return;
    const Look look = look_of(shape);
    FaceList faces = faces_of(geometry, look.luminance);
    if (faces.at.empty()) faces.at = at(*geometry.node);
    if (!faces.face_ends.empty()) reading_.builder.add(faces, context.X, look);
  }

  FaceList faces_of(const Reference& node, float luminance) {
    const std::string& type = node.node->type;
    if (type == "IndexedFaceSet" || type == "ElevationGrid" || type == "Extrusion")
      return surface_of(node, luminance);
    if (type == "Box") return box(vector3_of(node, "size", Vector3d::Constant(2)));
    if (type == "Sphere") return sphere(number_of(node, "radius", 1));
    const Parts parts{flag_of(node, "side", true), flag_of(node, "top", true), flag_of(node, "bottom", true)};
    if (type == "Cylinder")
      return cylinder(number_of(node, "radius", 1), number_of(node, "height", 2), parts);
    if (type == "Cone") return cone(number_of(node, "bottomRadius", 1), number_of(node, "height", 2), parts);
    reading_.ignore(*node.node);
    return {};
  }

  FaceList surface_of(const Reference& node, float luminance) {
    const SurfaceParts parts{resolved_field(node, "coord"), resolved_field(node, "color"),
                             resolved_field(node, "texCoord")};
    for (const char* field : {"coordIndex", "texCoordIndex", "colorIndex", "height", "spine", "crossSection",
                              "scale", "orientation"})
      reading_.spend(numbers_of(node, field).size(), *node.node);
    for (const auto& [part, field] : {std::pair{parts.coordinates, "point"},
                                      {parts.colors, "color"},
                                      {parts.texture_coordinates, "point"}})
      if (part) reading_.spend(numbers_of(part, field).size(), *node.node);
    std::vector<std::string> warnings;
    FaceList faces = node.node->type == "IndexedFaceSet"  ? indexed_face_set(node, parts, luminance, warnings)
                     : node.node->type == "ElevationGrid" ? elevation_grid(node, parts, luminance, warnings)
                                                          : extrusion(node, reading_.limits());
    reading_.warn(warnings);
    reading_.spend(faces.corners.size(), *node.node);
    return faces;
  }

  Reading& reading_;
};

}  // namespace

void walk_vrml2(Reading& reading, const Scene& scene, const Context& context) {
  Vrml2Walker walker(reading);
  for (const NodePointer& root : scene.roots) walker.walk_node({root.get(), nullptr}, context);
}

}  // namespace hilbrush::vrml
