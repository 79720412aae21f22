#include "tests/pipeline/painting.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "config/cell_file.h"
#include "daemon/execution/executor.h"
#include "daemon/pipeline/pipeline.h"
#include "planner/cell_model/program_file.h"
#include "sampling/images/image_file.h"
#include "sampling/model/placement.h"
#include "sim/devices/sim_cell.h"
#include "tests/support/shell.h"
#include "tests/support/temporary_folder.h"

namespace hilbrush::testing_pipeline {
namespace fs = std::filesystem;

fs::path test_data(const std::string& name) {
  return fs::path(HILBRUSH_SOURCE_DIR) / "tests/data" / name;
}

namespace {

std::vector<Emission> run_on_simulated_cell(const ExposureProgram& program,
                                            const CellDescription& description) {
  SimCell sim(description);
  std::vector<Emission> emissions;
  sim.set_emission_sink([&](const Emission& emission) { emissions.push_back(emission); });
  const Cell cell = sim.cell();
  bring_up(cell);
  Journal journal = Journal::in_memory(program.exposures.size());
  ExecutionControl control;
  const ExecutionResult result = execute(program, {}, cell, description, journal, control);
  cell.laser.disable();
  EXPECT_EQ(result.outcome, ExecutionOutcome::kFinished) << result.reason;
  return emissions;
}

}  // namespace

Painting paint_model(const fs::path& model, const JobSettings& settings) {
  const testing_support::TemporaryFolder folder;
  PipelineRequest request{model, settings, find_cell(settings.cell), folder.path()};
  Painting painting;
  painting.report = run_plan(request, {});
  painting.cell = load_cell(request.cell_file);
  painting.cell.simulation.time_scale = 0;
  painting.program = read_program(folder.path() / "program.ply");
  painting.emissions = run_on_simulated_cell(painting.program, painting.cell);
  return painting;
}

FileToObject file_to_object(const fs::path& file, const JobSettings& settings) {
  const Model model = load_model(file, load_image_file);
  PlacementOptions options;
  if (settings.size_mm) options.size_m = *settings.size_mm * 1e-3;
  if (settings.up) options.up = *settings.up == "y" ? UpAxis::kY : UpAxis::kZ;
  const TexturedMesh placed = place_on_table(model, options);

  const auto count = static_cast<Eigen::Index>(model.mesh.vertices.size());
  EXPECT_EQ(placed.vertices.size(), model.mesh.vertices.size());
  Eigen::Matrix3Xd from(3, count), to(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    from.col(i) = model.mesh.vertices[static_cast<std::size_t>(i)];
    to.col(i) = placed.vertices[static_cast<std::size_t>(i)];
  }
  const Eigen::Matrix4d X_OF = Eigen::umeyama(from, to);
  const Eigen::Matrix3d linear = X_OF.topLeftCorner<3, 3>();
  FileToObject result;
  result.scale = std::cbrt(linear.determinant());
  result.R_OF = linear / result.scale;
  const Eigen::Matrix3Xd residual = (linear * from).colwise() + X_OF.topRightCorner<3, 1>() - to;
  EXPECT_LT(residual.cwiseAbs().maxCoeff(), 1e-9) << "placement must turn, scale and move, nothing else";
  EXPECT_GT(result.scale, 0) << "placement must not mirror";
  return result;
}

TexturedMesh plain_box(const Eigen::Vector3d& size_m) {
  TexturedMesh mesh;
  const Eigen::Vector3d half = size_m / 2;
  for (int i = 0; i < 8; ++i)
    mesh.vertices.emplace_back(i & 1 ? half.x() : -half.x(), i & 2 ? half.y() : -half.y(),
                               i & 4 ? size_m.z() : 0.);
  const std::array<std::array<std::uint32_t, 4>, 6> quads{
      {{1, 3, 7, 5}, {0, 4, 6, 2}, {2, 6, 7, 3}, {0, 1, 5, 4}, {4, 5, 7, 6}, {0, 2, 3, 1}}};
  for (const auto& q : quads) {
    mesh.triangles.push_back({q[0], q[1], q[2]});
    mesh.triangles.push_back({q[0], q[2], q[3]});
  }
  mesh.corner_uv.resize(12, {Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()});
  mesh.corner_luminance.resize(12, {1.f, 1.f, 1.f});
  mesh.material_index.resize(12, 0);
  mesh.materials.resize(1);
  return mesh;
}

SurfacePoint nearest_point(const TexturedMesh& mesh, const Eigen::Vector3d& p_O) {
  SurfacePoint nearest;
  double smallest = std::numeric_limits<double>::max();
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
    Eigen::Matrix3d corners;
    for (int c = 0; c < 3; ++c) corners.col(c) = mesh.corner(t, c);
    // Of the point's foot on the triangle's plane, pushed into the triangle.
    const Eigen::Vector3d normal = mesh.area_vector(t).normalized();
    const Eigen::Vector3d foot = p_O - normal * normal.dot(p_O - corners.col(0));
    Eigen::Matrix<double, 4, 3> system;
    system << corners, Eigen::RowVector3d::Ones();
    const Eigen::Vector4d right(foot.x(), foot.y(), foot.z(), 1);
    Eigen::Vector3d barycentric = system.colPivHouseholderQr().solve(right).cwiseMax(0.);
    barycentric /= barycentric.sum();
    const double distance = (corners * barycentric - p_O).norm();
    if (distance < smallest) {
      smallest = distance;
      nearest = {static_cast<std::uint32_t>(t), barycentric};
    }
  }
  return nearest;
}

}  // namespace hilbrush::testing_pipeline
