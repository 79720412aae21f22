#include "planner/check/check_cell.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "sampling/base/angles.h"
#include "sampling/base/check.h"
#include "sampling/base/text.h"

namespace hilbrush {
namespace {

constexpr int kRimRays = 15, kBundleRays = 16;  // one packet: the rim, and the axis
constexpr std::size_t kWitnesses = 48;
constexpr double kMillimeter = 1e-3;

std::string length_text(double length_m) {
  return number(length_m / kMillimeter, 3) + " mm";
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
  lens_ = {(focus_m - cell.lens.far_m) * beam_F_, beam_F_, cell.lens.far_m - cell.lens.near_m,
           cell.lens.radius_m};
  quill_ = {Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ(), cell.arm.quill_length_m,
            cell.arm.quill_radius_m};
  reach_m_ = std::hypot(cell.table.plate_radius_m, cell.fixture.post_height_m + cell.table.plate_thickness_m);
  for (const auto& p : mesh.vertices) reach_m_ = std::max(reach_m_, p.norm());
  const std::size_t stride = std::max<std::size_t>(1, mesh.vertices.size() / kWitnesses);
  for (std::size_t i = 0; i < mesh.vertices.size(); i += stride) witnesses_O_.push_back(mesh.vertices[i]);
}

CheckCell::~CheckCell() = default;

Eigen::Isometry3d CheckCell::X_WF(const Joints& joints) const {
  using Eigen::AngleAxisd, Eigen::Translation3d, Eigen::Vector3d;
  return AngleAxisd(joints[kJ1], Vector3d::UnitZ()) * Translation3d(cell_.arm.upper_arm_m, 0, 0) *
         AngleAxisd(joints[kJ2], Vector3d::UnitZ()) * Translation3d(cell_.arm.forearm_m, 0, joints[kJ3]) *
         AngleAxisd(joints[kJ4], Vector3d::UnitZ());
}

Eigen::Isometry3d CheckCell::X_WO(const Joints& joints) const {
  using Eigen::AngleAxisd, Eigen::Translation3d, Eigen::Vector3d;
  const double top_m = cell_.table.plate_height_m + cell_.fixture.post_height_m;
  return Translation3d(cell_.table.tilt_axis_W) * AngleAxisd(joints[kTilt], -Vector3d::UnitY()) *
         Translation3d(0, 0, top_m) * AngleAxisd(joints[kRotation], Vector3d::UnitZ());
}

Eigen::Isometry3d CheckCell::X_OF(const Joints& joints) const {
  return X_WO(joints).inverse() * X_WF(joints);
}

/// How far before the focus a ray from the lens, `aside_O` beside the beam, meets the first surface; nothing
/// if it meets none.
std::optional<double> CheckCell::lands_short_m(const Eigen::Vector3d& focus_O, const Eigen::Vector3d& beam_O,
                                               const Eigen::Vector3d& aside_O, double beyond_m) const {
  const double length_m = cell_.lens.far_m;
  const Eigen::Vector3f from = (focus_O + aside_O - length_m * beam_O).cast<float>();
  const Eigen::Vector3f along = beam_O.cast<float>();
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
  const Eigen::Vector3d focus = focus_O(X_OF);
  const Eigen::Vector3d beam = beam_O(X_OF);
  const double length_m = cell_.lens.far_m;
  const auto lands = [&](const std::optional<double>& short_m) {
    return short_m && std::abs(*short_m) <= tolerance_m;
  };
  const auto short_m = lands_short_m(focus, beam, Eigen::Vector3d::Zero(), 1.5 * tolerance_m);
  if (!lands(short_m)) {
    // A dot on an edge is met or missed by rounding: then one of the rays close by decides.
    const Eigen::Vector3d u = .3 * tolerance_m * beam.unitOrthogonal();
    const Eigen::Vector3d v = beam.cross(u);
    bool is_met = false;
    for (const Eigen::Vector3d& aside : {u, v, Eigen::Vector3d(-u), Eigen::Vector3d(-v)})
      is_met = is_met || lands(lands_short_m(focus, beam, aside, 1.5 * tolerance_m));
    if (!is_met && !short_m) return "the beam misses the object";
    if (!is_met) return "the object blocks the beam " + length_text(*short_m) + " before the dot";
  }
  for (int i = 1; i <= 100; ++i)
    if (is_in_table(focus - (.01 * i * length_m) * beam)) return "the table blocks the beam";
  return {};
}

bool CheckCell::is_in_table(const Eigen::Vector3d& p_O) const {
  const double r = p_O.head<2>().norm();
  const double post = cell_.fixture.post_height_m;
  if (p_O.z() >= 0 || p_O.z() < -post - cell_.table.plate_thickness_m) return false;
  return r < (p_O.z() > -post ? cell_.fixture.post_radius_m : cell_.table.plate_radius_m);
}

bool CheckCell::is_any_blocked(const std::array<Eigen::Vector3d, 16>& from_O,
                               const std::array<Eigen::Vector3d, 16>& along_O, double length_m) const {
  alignas(64) RTCRay16 rays{};
  alignas(64) int valid[kBundleRays];
  for (std::size_t i = 0; i < kBundleRays; ++i) {
    const Eigen::Vector3f from = from_O[i].cast<float>();
    const Eigen::Vector3f along = along_O[i].cast<float>();
    rays.org_x[i] = from.x();
    rays.org_y[i] = from.y();
    rays.org_z[i] = from.z();
    rays.dir_x[i] = along.x();
    rays.dir_y[i] = along.y();
    rays.dir_z[i] = along.z();
    rays.tfar[i] = static_cast<float>(length_m);
    rays.mask[i] = ~0u;
    valid[i] = -1;
  }
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcOccluded16(valid, rays_->scene, &context, &rays);
  return std::any_of(std::begin(rays.tfar), std::end(rays.tfar), [](float t) { return t < 0; });
}

/// A packet of rays along the mantle of the body and its axis; and vertices of the object inside it, for
/// bodies that are wide enough for all rays to miss the object.
bool CheckCell::touches_object(const Cylinder& body, const Eigen::Isometry3d& X_OB) const {
  const Eigen::Vector3d u = body.axis_F.unitOrthogonal();
  const Eigen::Vector3d v = body.axis_F.cross(u);
  std::array<Eigen::Vector3d, kBundleRays> from_O, along_O;
  along_O.fill(X_OB.linear() * body.axis_F);
  for (std::size_t i = 0; i < kBundleRays; ++i) {
    const double angle = kTurn * static_cast<double>(i) / kRimRays;
    Eigen::Vector3d from_F = body.from_F;
    if (i < kRimRays) from_F += body.radius_m * (std::cos(angle) * u + std::sin(angle) * v);
    from_O[i] = X_OB * from_F;
  }
  if (is_any_blocked(from_O, along_O, body.length_m)) return true;
  const Eigen::Isometry3d X_BO = X_OB.inverse();
  return std::any_of(witnesses_O_.begin(), witnesses_O_.end(), [&](const Eigen::Vector3d& p_O) {
    const Eigen::Vector3d p_B = X_BO * p_O - body.from_F;
    const double along_m = body.axis_F.dot(p_B);
    return along_m > 0 && along_m < body.length_m &&
           (p_B - along_m * body.axis_F).squaredNorm() < body.radius_m * body.radius_m;
  });
}

/// The body's mantle against plate and post, and the plate's rim and the post's axis against the body.
bool CheckCell::touches_table(const Cylinder& body, const Eigen::Isometry3d& X_OF) const {
  const Eigen::Vector3d from_O = X_OF * body.from_F;
  const Eigen::Vector3d axis_O = X_OF.linear() * body.axis_F;
  const double post = cell_.fixture.post_height_m;
  const double thickness = cell_.table.plate_thickness_m;
  const auto is_in_body = [&](const Eigen::Vector3d& p_O) {
    const double along = axis_O.dot(p_O - from_O);
    if (along < 0 || along > body.length_m) return false;
    return (p_O - from_O - along * axis_O).norm() < body.radius_m;
  };
  constexpr int kRimPoints = 36, kMantleLines = 12, kAxisPoints = 20;
  for (int i = 0; i < kRimPoints; ++i) {
    const double angle = kTurn * i / kRimPoints;
    const double r = cell_.table.plate_radius_m;
    const Eigen::Vector3d rim(r * std::cos(angle), r * std::sin(angle), -post);
    if (is_in_body(rim) || is_in_body(rim - thickness * Eigen::Vector3d::UnitZ())) return true;
  }
  for (int i = 0; i <= kAxisPoints; ++i)
    if (is_in_body({0, 0, -post * i / kAxisPoints})) return true;
  const Eigen::Vector3d u = axis_O.unitOrthogonal();
  const Eigen::Vector3d v = axis_O.cross(u);
  for (int i = 0; i < kMantleLines; ++i) {
    const double angle = kTurn * i / kMantleLines;
    const Eigen::Vector3d rim_O = from_O + body.radius_m * (std::cos(angle) * u + std::sin(angle) * v);
    for (int k = 0; k <= kAxisPoints; ++k)
      if (is_in_table(rim_O + (body.length_m * k / kAxisPoints) * axis_O)) return true;
  }
  return false;
}

std::string CheckCell::body_fault(const Cylinder& body, const char* name,
                                  const Eigen::Isometry3d& X_OB) const {
  // Nothing touches if the ball around the body is clear of the ball around everything else.
  const double ball_m = std::hypot(.5 * body.length_m, body.radius_m);
  const Eigen::Vector3d middle_O = X_OB * (body.from_F + .5 * body.length_m * body.axis_F);
  if (middle_O.norm() > reach_m_ + ball_m) return {};
  if (touches_object(body, X_OB)) return std::string(name) + " touches the object";
  if (middle_O.z() < ball_m && touches_table(body, X_OB)) return std::string(name) + " touches the table";
  return {};
}

std::string CheckCell::body_fault(const Eigen::Isometry3d& X_OF) const {
  std::string fault = body_fault(lens_, "the lens body", X_OF);
  return fault.empty() ? body_fault(quill_, "the quill", X_OF) : fault;
}

/// The link lies along x of its frame, whose origin is at its first joint. Its rounded ends are checked by
/// rays from their centers.
std::string CheckCell::link_fault(const CellDescription::Arm::Link& link, double length_m, const char* name,
                                  const Eigen::Isometry3d& X_WB, const Eigen::Isometry3d& X_WF,
                                  const Eigen::Isometry3d& X_OW) const {
  if (link.radius_m <= 0) return {};
  const Cylinder body{Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitX(), length_m, link.radius_m};
  const Eigen::Isometry3d X_OB = X_OW * X_WB;
  if (std::string fault = body_fault(body, name, X_OB); !fault.empty()) return fault;
  for (const double end_m : {0., length_m}) {
    const Eigen::Vector3d middle_O = X_OB * Eigen::Vector3d(end_m, 0, 0);
    if (middle_O.norm() > reach_m_ + link.radius_m) continue;
    std::array<Eigen::Vector3d, kBundleRays> from_O, along_O;
    from_O.fill(middle_O);
    for (std::size_t i = 0; i < kBundleRays; ++i) {  // evenly over the ball, by the golden angle
      const double z = 1 - (2 * static_cast<double>(i) + 1) / kBundleRays;
      const double turn = 2.399963 * static_cast<double>(i);
      const double r = std::sqrt(1 - z * z);
      along_O[i] = {r * std::cos(turn), r * std::sin(turn), z};
    }
    if (is_any_blocked(from_O, along_O, link.radius_m)) return std::string(name) + " touches the object";
  }
  const Eigen::Isometry3d X_BF = X_WB.inverse() * X_WF;
  constexpr int kLensPoints = 20;
  for (int i = 0; i <= kLensPoints; ++i) {
    const Eigen::Vector3d p_B = X_BF * (lens_.from_F + (lens_.length_m * i / kLensPoints) * lens_.axis_F);
    const Eigen::Vector3d nearest_B(std::clamp(p_B.x(), 0., length_m), 0, 0);
    if ((p_B - nearest_B).norm() < link.radius_m + lens_.radius_m)
      return std::string(name) + " touches the lens body";
  }
  return {};
}

/// The column against the table's side as any other body; points along the axes of lens, quill and forearm
/// against it.
std::string CheckCell::column_fault(const Eigen::Isometry3d& X_WF, const Eigen::Isometry3d& X_W_fore,
                                    const Eigen::Isometry3d& X_OW) const {
  const auto& column = cell_.arm.column;
  if (column.radius_m <= 0) return {};
  const Eigen::Vector3d object_W = X_OW.inverse().translation();
  if (object_W.head<2>().norm() < reach_m_ + column.radius_m) {
    const Cylinder body{Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ(), column.height_m, column.radius_m};
    if (std::string fault = body_fault(body, "the robot's column", X_OW); !fault.empty()) return fault;
  }
  const auto is_near = [&](const Eigen::Vector3d& p_W, double radius_m) {
    const double beside_m = std::max(0., p_W.head<2>().norm() - column.radius_m);
    const double above_m = std::max(0., std::max(p_W.z() - column.height_m, -p_W.z()));
    return std::hypot(beside_m, above_m) < radius_m;
  };
  const auto touches = [&](const Cylinder& body, const Eigen::Isometry3d& X_WB) {
    constexpr int kPoints = 24;
    for (int i = 0; i <= kPoints; ++i)
      if (is_near(X_WB * (body.from_F + (body.length_m * i / kPoints) * body.axis_F), body.radius_m))
        return true;
    return false;
  };
  if (touches(lens_, X_WF)) return "the lens body touches the robot's column";
  if (touches(quill_, X_WF)) return "the quill touches the robot's column";
  const Cylinder fore{Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitX(), cell_.arm.forearm_m,
                      cell_.arm.fore_link.radius_m};
  if (fore.radius_m > 0 && touches(fore, X_W_fore)) return "the forearm touches the robot's column";
  return {};
}

std::string CheckCell::body_fault(const Joints& joints) const {
  using Eigen::AngleAxisd, Eigen::Translation3d, Eigen::Vector3d;
  const Eigen::Isometry3d X_WF_now = X_WF(joints);
  const Eigen::Isometry3d X_OW = X_WO(joints).inverse();
  if (std::string fault = body_fault(X_OW * X_WF_now); !fault.empty()) return fault;
  const auto& arm = cell_.arm;
  const Eigen::Isometry3d upper =
      Translation3d(0, 0, arm.upper_link.height_m) * AngleAxisd(joints[kJ1], Vector3d::UnitZ());
  const Eigen::Isometry3d fore =
      AngleAxisd(joints[kJ1], Vector3d::UnitZ()) * Translation3d(arm.upper_arm_m, 0, 0) *
      AngleAxisd(joints[kJ2], Vector3d::UnitZ()) * Translation3d(0, 0, arm.fore_link.height_m);
  std::string fault = link_fault(arm.fore_link, arm.forearm_m, "the forearm", fore, X_WF_now, X_OW);
  if (!fault.empty()) return fault;
  fault = link_fault(arm.upper_link, arm.upper_arm_m, "the upper arm", upper, X_WF_now, X_OW);
  return fault.empty() ? column_fault(X_WF_now, fore, X_OW) : fault;
}

double CheckCell::travel_m(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) const {
  const Eigen::Vector3d far_F = lens_.from_F;
  const Eigen::Vector3d near_F = lens_.from_F + lens_.length_m * lens_.axis_F;
  return std::max((a * far_F - b * far_F).norm(), (a * near_F - b * near_F).norm());
}

}  // namespace hilbrush
