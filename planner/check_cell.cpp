#include "planner/check_cell.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include "sampling/check.h"

namespace hilbrush {
namespace {

constexpr int kRimRays = 15, kBundleRays = 16;  // one packet: the rim, and the axis
constexpr double kQuillLengthM = .2;
constexpr double kMillimetre = 1e-3;

std::string millimetres(double length_m) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g mm", length_m / kMillimetre);
  return text;
}

}  // namespace

struct CheckCell::Rays {
  explicit Rays(const TexturedMesh& mesh) : device(rtcNewDevice("threads=1")) {
    CHECK(device != nullptr);
    scene = rtcNewScene(device);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                             sizeof(Eigen::Vector3f), mesh.vertices.size());
    void* triangles = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                              sizeof(mesh.triangles[0]), mesh.triangles.size());
    CHECK(vertices != nullptr && triangles != nullptr);
    std::transform(mesh.vertices.begin(), mesh.vertices.end(), static_cast<Eigen::Vector3f*>(vertices),
                   [](const Eigen::Vector3d& p) { return Eigen::Vector3f(p.cast<float>()); });
    std::memcpy(triangles, mesh.triangles.data(), mesh.triangles.size() * sizeof(mesh.triangles[0]));
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene);
  }
  Rays(const Rays&) = delete;
  Rays& operator=(const Rays&) = delete;
  ~Rays() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }

  RTCDevice device;
  RTCScene scene = nullptr;
};

CheckCell::CheckCell(const TexturedMesh& mesh, const CellDescription& cell)
    : cell_(cell),
      beam_F_(std::cos(cell.arm.beam_depression), 0, -std::sin(cell.arm.beam_depression)),
      rays_(std::make_unique<Rays>(mesh)) {
  const double focus_m = cell.arm.flange_to_focus_m;
  lens_ = {(focus_m - cell.lens.far_m) * beam_F_, beam_F_, cell.lens.far_m - cell.lens.near_m, cell.lens.radius_m};
  quill_ = {Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ(), kQuillLengthM, cell.arm.quill_radius_m};
  reach_m_ = std::hypot(cell.table.plate_radius_m, cell.fixture.post_height_m + cell.table.plate_thickness_m);
  for (const auto& p : mesh.vertices) reach_m_ = std::max(reach_m_, p.norm());
}

CheckCell::~CheckCell() = default;

Eigen::Isometry3d CheckCell::X_OF(const Joints& joints) const {
  using Eigen::AngleAxisd, Eigen::Translation3d, Eigen::Vector3d;
  const Eigen::Isometry3d X_WF =
      AngleAxisd(joints[kJ1], Vector3d::UnitZ()) * Translation3d(cell_.arm.upper_arm_m, 0, 0) *
      AngleAxisd(joints[kJ2], Vector3d::UnitZ()) * Translation3d(cell_.arm.forearm_m, 0, joints[kJ3]) *
      AngleAxisd(joints[kJ4], Vector3d::UnitZ());
  const double top_m = cell_.table.plate_height_m + cell_.fixture.post_height_m;
  const Eigen::Isometry3d X_WO = Translation3d(cell_.table.tilt_axis_W) *
                                 AngleAxisd(joints[kTilt], -Vector3d::UnitY()) * Translation3d(0, 0, top_m) *
                                 AngleAxisd(joints[kRotation], Vector3d::UnitZ());
  return X_WO.inverse() * X_WF;
}

/// How far before the focus the first surface is that a ray from the lens, `aside_O` of the beam, meets; nothing if it
/// meets none.
std::optional<double> CheckCell::lands_short_m(const Eigen::Vector3d& focus_O, const Eigen::Vector3d& beam_O,
                                               const Eigen::Vector3d& aside_O, double beyond_m) const {
  const double length_m = cell_.lens.far_m;
  const Eigen::Vector3f from = (focus_O + aside_O - length_m * beam_O).cast<float>(), along = beam_O.cast<float>();
  RTCRayHit ray{};
  ray.ray.org_x = from.x();
  ray.ray.org_y = from.y();
  ray.ray.org_z = from.z();
  ray.ray.dir_x = along.x();
  ray.ray.dir_y = along.y();
  ray.ray.dir_z = along.z();
  ray.ray.tfar = static_cast<float>(length_m + beyond_m);
  ray.ray.mask = ~0u;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(rays_->scene, &context, &ray);
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return length_m - static_cast<double>(ray.ray.tfar);
}

std::string CheckCell::beam_fault(const Eigen::Isometry3d& X_OF, double tolerance_m) const {
  const Eigen::Vector3d focus = focus_O(X_OF), beam = beam_O(X_OF);
  const double length_m = cell_.lens.far_m;
  const auto lands = [&](const std::optional<double>& short_m) { return short_m && std::abs(*short_m) <= tolerance_m; };
  const auto short_m = lands_short_m(focus, beam, Eigen::Vector3d::Zero(), 1.5 * tolerance_m);
  if (!lands(short_m)) {
    // A dot on an edge is met or missed by rounding: then one of the rays close by decides.
    const Eigen::Vector3d u = .3 * tolerance_m * beam.unitOrthogonal(), v = beam.cross(u);
    bool is_met = false;
    for (const Eigen::Vector3d& aside : {u, v, Eigen::Vector3d(-u), Eigen::Vector3d(-v)})
      is_met = is_met || lands(lands_short_m(focus, beam, aside, 1.5 * tolerance_m));
    if (!is_met && !short_m) return "the beam misses the object";
    if (!is_met) return "the object blocks the beam " + millimetres(*short_m) + " before the dot";
  }
  for (int i = 1; i <= 100; ++i)
    if (is_in_table(focus - (.01 * i * length_m) * beam)) return "the table blocks the beam";
  return {};
}

bool CheckCell::is_in_table(const Eigen::Vector3d& p_O) const {
  const double r = p_O.head<2>().norm(), post = cell_.fixture.post_height_m;
  if (p_O.z() >= 0 || p_O.z() < -post - cell_.table.plate_thickness_m) return false;
  return r < (p_O.z() > -post ? cell_.fixture.post_radius_m : cell_.table.plate_radius_m);
}

/// A packet of rays along the body: those of its mantle and its axis.
bool CheckCell::touches_object(const Cylinder& body, const Eigen::Isometry3d& X_OF) const {
  alignas(64) RTCRay16 rays{};
  alignas(64) int valid[kBundleRays];
  const Eigen::Vector3d u = body.axis_F.unitOrthogonal(), v = body.axis_F.cross(u);
  const Eigen::Vector3f along = (X_OF.linear() * body.axis_F).cast<float>();
  for (int i = 0; i < kBundleRays; ++i) {
    const double angle = 2 * std::numbers::pi * i / kRimRays;
    Eigen::Vector3d from_F = body.from_F;
    if (i < kRimRays) from_F += body.radius_m * (std::cos(angle) * u + std::sin(angle) * v);
    const Eigen::Vector3f from = (X_OF * from_F).cast<float>();
    rays.org_x[i] = from.x();
    rays.org_y[i] = from.y();
    rays.org_z[i] = from.z();
    rays.dir_x[i] = along.x();
    rays.dir_y[i] = along.y();
    rays.dir_z[i] = along.z();
    rays.tfar[i] = static_cast<float>(body.length_m);
    rays.mask[i] = ~0u;
    valid[i] = -1;
  }
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcOccluded16(valid, rays_->scene, &context, &rays);
  return std::any_of(std::begin(rays.tfar), std::end(rays.tfar), [](float t) { return t < 0; });
}

/// The body's mantle against plate and post, and the plate's rim and the post's axis against the body.
bool CheckCell::touches_table(const Cylinder& body, const Eigen::Isometry3d& X_OF) const {
  const Eigen::Vector3d from_O = X_OF * body.from_F, axis_O = X_OF.linear() * body.axis_F;
  const double post = cell_.fixture.post_height_m, thickness = cell_.table.plate_thickness_m;
  const auto is_in_body = [&](const Eigen::Vector3d& p_O) {
    const double along = axis_O.dot(p_O - from_O);
    if (along < 0 || along > body.length_m) return false;
    return (p_O - from_O - along * axis_O).norm() < body.radius_m;
  };
  constexpr int kRimPoints = 36, kMantleLines = 12, kAxisPoints = 20;
  for (int i = 0; i < kRimPoints; ++i) {
    const double angle = 2 * std::numbers::pi * i / kRimPoints, r = cell_.table.plate_radius_m;
    const Eigen::Vector3d rim(r * std::cos(angle), r * std::sin(angle), -post);
    if (is_in_body(rim) || is_in_body(rim - thickness * Eigen::Vector3d::UnitZ())) return true;
  }
  for (int i = 0; i <= kAxisPoints; ++i)
    if (is_in_body({0, 0, -post * i / kAxisPoints})) return true;
  const Eigen::Vector3d u = axis_O.unitOrthogonal(), v = axis_O.cross(u);
  for (int i = 0; i < kMantleLines; ++i) {
    const double angle = 2 * std::numbers::pi * i / kMantleLines;
    const Eigen::Vector3d rim_O = from_O + body.radius_m * (std::cos(angle) * u + std::sin(angle) * v);
    for (int k = 0; k <= kAxisPoints; ++k)
      if (is_in_table(rim_O + (body.length_m * k / kAxisPoints) * axis_O)) return true;
  }
  return false;
}

std::string CheckCell::body_fault(const Eigen::Isometry3d& X_OF) const {
  for (const auto& [body, name] : {std::pair{&lens_, "the lens body"}, std::pair{&quill_, "the quill"}}) {
    // Nothing can touch if the ball around the body is clear of the ball around everything else.
    const Eigen::Vector3d middle_O = X_OF * (body->from_F + .5 * body->length_m * body->axis_F);
    if (middle_O.norm() > reach_m_ + std::hypot(.5 * body->length_m, body->radius_m)) continue;
    if (touches_object(*body, X_OF)) return std::string(name) + " touches the object";
    if (middle_O.z() < std::hypot(.5 * body->length_m, body->radius_m) && touches_table(*body, X_OF))
      return std::string(name) + " touches the table";
  }
  return {};
}

double CheckCell::travel_m(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) const {
  const Eigen::Vector3d far_F = lens_.from_F, near_F = lens_.from_F + lens_.length_m * lens_.axis_F;
  return std::max((a * far_F - b * far_F).norm(), (a * near_F - b * near_F).norm());
}

}  // namespace hilbrush
