#pragma once
#include <Eigen/Core>

#include "planner/cell_model/cell_description.h"

/// Where the light goes, from joint values alone. Written from the frames described in
/// planner/cell_model/cell_description.h and sharing no code with the planner's kinematics, so that it
/// detects their faults.
namespace hilbrush {

struct Beam {
  Eigen::Vector3d focus_O;
  Eigen::Vector3d direction_O;  ///< unit, in the direction of the light
};

Beam beam_from_joints(const CellDescription& cell, const Joints& joints);

/// 1/e2 radius at `defocus_m` from a focus of radius `waist_m`: a multimode blue diode, whose radius grows by
/// sqrt(2) over pi w0^2 / (M2 lambda) (Siegman 1990): 22 mm for a spot of .36 mm, 2.4 mm for one of .12 mm.
double beam_radius_m(double waist_m, double defocus_m);

}  // namespace hilbrush
