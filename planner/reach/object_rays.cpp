#include "planner/reach/object_rays.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <limits>

#include "sampling/base/check.h"

namespace hilbrush {

/// Owns Embree's device and scene.
struct ObjectRays::Scene {
  Scene() : device(rtcNewDevice("threads=1")), scene(nullptr) {
    CHECK(device != nullptr);
    scene = rtcNewScene(device);
  }
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;
  ~Scene() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }

  RTCDevice device;
  RTCScene scene;
};

namespace {

void set_ray(RTCRay& ray, const Eigen::Vector3d& from_O, const Eigen::Vector3d& direction_O, double near_m,
             double far_m) {
  const Eigen::Vector3f from = from_O.cast<float>();
  const Eigen::Vector3f direction = direction_O.cast<float>();
  ray.org_x = from.x();
  ray.org_y = from.y();
  ray.org_z = from.z();
  ray.dir_x = direction.x();
  ray.dir_y = direction.y();
  ray.dir_z = direction.z();
  ray.tnear = static_cast<float>(near_m);
  ray.tfar = static_cast<float>(far_m);
  ray.time = 0;
  ray.mask = std::numeric_limits<unsigned>::max();
  ray.id = 0;
  ray.flags = 0;
}

}  // namespace

ObjectRays::ObjectRays(const TexturedMesh& mesh) : scene_(std::make_unique<Scene>()) {
  rtcSetSceneFlags(scene_->scene, RTC_SCENE_FLAG_ROBUST);
  RTCGeometry geometry = rtcNewGeometry(scene_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.vertices.size()));
  auto* triangles = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), mesh.triangle_count()));
  CHECK(mesh.triangle_count() == 0 || (vertices != nullptr && triangles != nullptr));
  for (const auto& p : mesh.vertices)
    for (int i = 0; i < 3; ++i) *vertices++ = static_cast<float>(p[i]);
  for (const auto& triangle : mesh.triangles)
    triangles = std::copy(triangle.begin(), triangle.end(), triangles);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene_->scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene_->scene);
}

ObjectRays::~ObjectRays() = default;
ObjectRays::ObjectRays(ObjectRays&&) noexcept = default;

double ObjectRays::free_length_m(const Eigen::Vector3d& from_O, const Eigen::Vector3d& direction_O,
                                 double near_m, double far_m) const {
  RTCRayHit ray;
  set_ray(ray.ray, from_O, direction_O, near_m, far_m);
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene_->scene, &context, &ray);
  return ray.hit.geomID == RTC_INVALID_GEOMETRY_ID ? far_m : static_cast<double>(ray.ray.tfar);
}

bool ObjectRays::is_blocked(const Eigen::Vector3d& from_O, const Eigen::Vector3d& direction_O, double near_m,
                            double far_m) const {
  RTCRay ray;
  set_ray(ray, from_O, direction_O, near_m, far_m);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene_->scene, &context, &ray);
  return ray.tfar < 0;
}

bool ObjectRays::is_beam_blocked(const Eigen::Vector3d& from_O, const Eigen::Vector3d& direction_O,
                                 const std::array<Eigen::Vector3d, 3>& aside_O, double near_m,
                                 double side_near_m, double far_m) const {
  alignas(16) RTCRay4 rays;
  alignas(16) const int valid[4] = {-1, -1, -1, -1};
  const Eigen::Vector3f direction = direction_O.cast<float>();
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector3f from = (i == 0 ? from_O : Eigen::Vector3d(from_O + aside_O[i - 1])).cast<float>();
    rays.org_x[i] = from.x();
    rays.org_y[i] = from.y();
    rays.org_z[i] = from.z();
    rays.dir_x[i] = direction.x();
    rays.dir_y[i] = direction.y();
    rays.dir_z[i] = direction.z();
    rays.tnear[i] = static_cast<float>(i == 0 ? near_m : side_near_m);
    rays.tfar[i] = static_cast<float>(far_m);
    rays.time[i] = 0;
    rays.mask[i] = std::numeric_limits<unsigned>::max();
    rays.id[i] = 0;
    rays.flags[i] = 0;
  }
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcOccluded4(valid, scene_->scene, &context, &rays);
  return std::any_of(std::begin(rays.tfar), std::end(rays.tfar), [](float t) { return t < 0; });
}

}  // namespace hilbrush
