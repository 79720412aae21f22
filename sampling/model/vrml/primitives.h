#pragma once
#include <Eigen/Core>

#include "sampling/model/files/face_list.h"

/// VRML's solids as polygons with their texture mapping (VRML97, 6.6, 6.11, 6.14, 6.42). Round ones have
/// `kSegments` sides: within .1 % of the radius of the true surface.
namespace hilbrush::vrml {

constexpr int kSegments = 72;

/// Which parts of a cone or cylinder there are.
struct Parts {
  bool side = true;
  bool top = true;
  bool bottom = true;
};

FaceList box(const Eigen::Vector3d& size);
FaceList sphere(double radius);
FaceList cylinder(double radius, double height, const Parts& parts);
FaceList cone(double radius, double height, const Parts& parts);

}  // namespace hilbrush::vrml
