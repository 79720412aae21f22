#pragma once
#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <vector>

#include "config/job_settings.h"
#include "planner/cell_model/cell_description.h"
#include "planner/cell_model/exposure_program.h"
#include "sim/devices/emission_record.h"
#include "sim/film/film.h"

/// Shared by the tests of the whole pipeline: a model painted on the simulated cell, and a plain box of which
/// the test, not the reader, knows every coordinate, to look at the film on.
namespace hilbrush::testing_pipeline {

/// tests/data/<name>.
std::filesystem::path test_data(const std::string& name);

struct Painting {
  CellDescription cell;
  ExposureProgram program;
  std::vector<Emission> emissions;
  std::string report;  ///< the text of report.json
};

/// Plans the model as `hilbrush plan` does and runs the program file on the simulated cell in virtual time.
Painting paint_model(const std::filesystem::path& model, const JobSettings& settings);

/// From the file's frame F to the object frame O, found by comparing the vertices that were read with the
/// vertices that were placed. A rotation, a scale and a translation, or the test fails.
struct FileToObject {
  Eigen::Matrix3d R_OF;
  double scale = 0;
};
FileToObject file_to_object(const std::filesystem::path& model, const JobSettings& settings);

/// A box standing on z = 0, centered on the z axis; no texture. Triangles 2k and 2k + 1 are face k: +x, -x,
/// +y, -y, +z, -z.
TexturedMesh plain_box(const Eigen::Vector3d& size_m);

/// The place on the mesh's surface that is nearest to p_O. Brute force: for meshes of a few triangles.
SurfacePoint nearest_point(const TexturedMesh& mesh, const Eigen::Vector3d& p_O);

}  // namespace hilbrush::testing_pipeline
