#include "sampling/parametric/parametric.h"

namespace hilbrush {

const std::vector<std::string>& parametric_shape_names() {
  static const std::vector<std::string> names{"plane",
                                              "sphere",
                                              "monkey_saddle",
                                              "eight_surface",
                                              "whitney_umbrella",
                                              "super_ellipsoid",
                                              "super_ellipsoid_reparameterized",
                                              "equal_area_sphere"};
  return names;
}

const std::vector<std::string>& parametric_density_names() {
  static const std::vector<std::string> names{"constant", "u", "u+v", "mean_curvature", "gaussian_curvature"};
  return names;
}

const std::vector<std::string>& area_method_names() {
  static const std::vector<std::string> names{"triangle", "square", "first_fundamental_form"};
  return names;
}

}  // namespace hilbrush
