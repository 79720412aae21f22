#include "sim/film/surface_index.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <limits>

#include "sampling/base/check.h"

namespace hilbrush {

struct SurfaceIndex::Implementation {
  const TexturedMesh& mesh;
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;

  explicit Implementation(const TexturedMesh& m) : mesh(m) {
    device = rtcNewDevice(nullptr);
    CHECK(device != nullptr);
    scene = rtcNewScene(device);
    // Robust: a ray aimed at an edge or vertex must not slip through.
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    fill(geometry);
    rtcSetGeometryPointQueryFunction(geometry, collect);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene);
  }
  ~Implementation() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;

  void fill(RTCGeometry geometry) const {
    auto* vertices = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                std::max<std::size_t>(mesh.vertices.size(), 1)));
    auto* indices = static_cast<std::uint32_t*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                3 * sizeof(std::uint32_t), mesh.triangle_count()));
    CHECK(vertices != nullptr && indices != nullptr);
    for (const Eigen::Vector3d& vertex : mesh.vertices)
      for (int k = 0; k < 3; ++k) *vertices++ = static_cast<float>(vertex[k]);
    for (const auto& triangle : mesh.triangles)
      indices = std::copy(triangle.begin(), triangle.end(), indices);
  }

  static bool collect(RTCPointQueryFunctionArguments* arguments) {
    static_cast<std::vector<std::uint32_t>*>(arguments->userPtr)->push_back(arguments->primID);
    return false;  // the radius stays as it is
  }
};

SurfaceIndex::SurfaceIndex(const TexturedMesh& mesh)
    : implementation_(std::make_unique<Implementation>(mesh)) {}
SurfaceIndex::~SurfaceIndex() = default;
SurfaceIndex::SurfaceIndex(SurfaceIndex&&) noexcept = default;

std::optional<SurfaceIndex::RayHit> SurfaceIndex::cast(const Eigen::Vector3d& origin_O,
                                                       const Eigen::Vector3d& direction_O) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query{};
  const Eigen::Vector3f origin = origin_O.cast<float>();
  const Eigen::Vector3f direction = direction_O.cast<float>();
  query.ray.org_x = origin.x(), query.ray.org_y = origin.y(), query.ray.org_z = origin.z();
  query.ray.dir_x = direction.x(), query.ray.dir_y = direction.y(), query.ray.dir_z = direction.z();
  query.ray.tfar = std::numeric_limits<float>::infinity();
  query.ray.mask = ~0u;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(implementation_->scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;

  const TexturedMesh& mesh = implementation_->mesh;
  const std::uint32_t t = query.hit.primID;
  const Eigen::Vector3d e1 = mesh.corner(t, 1) - mesh.corner(t, 0);
  const Eigen::Vector3d e2 = mesh.corner(t, 2) - mesh.corner(t, 0);
  // Moeller and Trumbore 1997, in double. A ray within the triangle's plane keeps Embree's answer.
  const Eigen::Vector3d p = direction_O.cross(e2);
  const Eigen::Vector3d s = origin_O - mesh.corner(t, 0);
  const Eigen::Vector3d q = s.cross(e1);
  const double determinant = p.dot(e1);
  RayHit hit{{t, {1. - query.hit.u - query.hit.v, query.hit.u, query.hit.v}}, query.ray.tfar};
  if (determinant != 0) {
    const double u = p.dot(s) / determinant;
    const double v = q.dot(direction_O) / determinant;
    hit = {{t, {1 - u - v, u, v}}, q.dot(e2) / determinant};
  }
  return hit;
}

void SurfaceIndex::triangles_near(const Eigen::Vector3d& center_O, double radius_m,
                                  std::vector<std::uint32_t>& triangles) const {
  triangles.clear();
  RTCPointQuery query{};
  query.x = static_cast<float>(center_O.x()), query.y = static_cast<float>(center_O.y()),
  query.z = static_cast<float>(center_O.z());
  query.radius = static_cast<float>(radius_m);
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(implementation_->scene, &query, &context, nullptr, &triangles);
  std::sort(triangles.begin(), triangles.end());
}

}  // namespace hilbrush
