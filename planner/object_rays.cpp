#include "planner/object_rays.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <limits>

#include "sampling/check.h"

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
  const Eigen::Vector3f from = from_O.cast<float>(), direction = direction_O.cast<float>();
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
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                               3 * sizeof(float), mesh.vertices.size()));
  auto* triangles = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                   3 * sizeof(unsigned), mesh.triangle_count()));
  CHECK(mesh.triangle_count() == 0 || (vertices != nullptr && triangles != nullptr));
  for (const auto& p : mesh.vertices)
    for (int i = 0; i < 3; ++i) *vertices++ = static_cast<float>(p[i]);
  for (const auto& triangle : mesh.triangles) triangles = std::copy(triangle.begin(), triangle.end(), triangles);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene_->scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene_->scene);
}

ObjectRays::~ObjectRays() = default;
ObjectRays::ObjectRays(ObjectRays&&) noexcept = default;

double ObjectRays::free_length_m(const Eigen::Vector3d& from_O, const Eigen::Vector3d& direction_O, double near_m,
                                 double far_m) const {
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

}  // namespace hilbrush
