#include "planner/mounting.h"

#include <Eigen/Geometry>

namespace hilbrush {

CellDescription with_fixture(CellDescription cell, const MountingOptions& mounting) {
  cell.fixture.post_height_m = mounting.post_height_m.value_or(cell.fixture.post_height_m);
  cell.fixture.post_radius_m = mounting.post_radius_m.value_or(cell.fixture.post_radius_m);
  cell.table.plate_radius_m = mounting.plate_radius_m.value_or(cell.table.plate_radius_m);
  return cell;
}

TexturedMesh mounted(TexturedMesh mesh, const MountingOptions& mounting) {
  const Eigen::Vector3d offset_O(mounting.offset_m[0], mounting.offset_m[1], mounting.offset_m[2]);
  if (mounting.turn == 0 && offset_O.isZero(0)) return mesh;
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(mounting.turn, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  for (Eigen::Vector3d& p_O : mesh.vertices) p_O = turn * p_O + offset_O;
  return mesh;
}

}  // namespace hilbrush
