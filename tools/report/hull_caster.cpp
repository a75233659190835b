// SPDX-License-Identifier: LGPL-2.1-or-later
#include "report/hull_caster.h"

#include <cstring>
#include <limits>

#include "base/thread_pool.h"

namespace polyhull::report {
namespace {

RTCRayHit make_ray(const Vec3& origin, const Vec3& direction, double far) {
  RTCRayHit ray{};
  ray.ray.org_x = static_cast<float>(origin.x);
  ray.ray.org_y = static_cast<float>(origin.y);
  ray.ray.org_z = static_cast<float>(origin.z);
  ray.ray.dir_x = static_cast<float>(direction.x);
  ray.ray.dir_y = static_cast<float>(direction.y);
  ray.ray.dir_z = static_cast<float>(direction.z);
  ray.ray.tfar = static_cast<float>(far);
  ray.ray.mask = ~0u;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  return ray;
}

}  // namespace

HullCaster::HullCaster(const Hull& hull) : hull_(hull) {
  device_ = rtcNewDevice("threads=1");
  scene_ = rtcNewScene(device_);
  rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
  if (!hull.empty()) {
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                             sizeof(Vec3f), hull.vertices.size());
    std::memcpy(vertices, hull.vertices.data(), hull.vertices.size() * sizeof(Vec3f));
    void* indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                            3 * sizeof(std::uint32_t), hull.triangles.size() / 3);
    std::memcpy(indices, hull.triangles.data(), hull.triangles.size() * sizeof(std::uint32_t));
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
  }
  rtcCommitScene(scene_);
}

HullCaster::~HullCaster() {
  rtcReleaseScene(scene_);
  rtcReleaseDevice(device_);
}

HitPicture HullCaster::cast(const Camera& camera) const {
  HitPicture picture{camera.width, camera.height, {}};
  picture.hits.resize(static_cast<std::size_t>(camera.width) * camera.height);
  const Vec3 origin = camera.centre() - hull_.origin;
  parallel_for(camera.height, 16, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        const Vec3 direction = camera.ray(camera.undistort(Vec2(x, static_cast<double>(y))));
        RTCRayHit ray = make_ray(origin, direction, std::numeric_limits<float>::infinity());
        rtcIntersect1(scene_, &context, &ray);
        if (ray.hit.geomID != RTC_INVALID_GEOMETRY_ID) {
          picture.hits[y * camera.width + x] = {static_cast<std::int32_t>(ray.hit.primID),
                                                ray.hit.u, ray.hit.v};
        }
      }
    }
  });
  return picture;
}

Vec3 HullCaster::position(const Hit& hit) const {
  const std::uint32_t* corner = &hull_.triangles[3 * static_cast<std::size_t>(hit.triangle)];
  const Vec3 a = hull_.vertices[corner[0]];
  const Vec3 b = hull_.vertices[corner[1]];
  const Vec3 c = hull_.vertices[corner[2]];
  return hull_.origin + (1.0 - hit.u - hit.v) * a + static_cast<double>(hit.u) * b +
         static_cast<double>(hit.v) * c;
}

Vec3 HullCaster::normal(std::int32_t triangle) const {
  const std::uint32_t* corner = &hull_.triangles[3 * static_cast<std::size_t>(triangle)];
  const Vec3 a = hull_.vertices[corner[0]];
  const Vec3 n =
      glm::cross(Vec3(hull_.vertices[corner[1]]) - a, Vec3(hull_.vertices[corner[2]]) - a);
  const double length = glm::length(n);
  return length > 0.0 ? n / length : Vec3(0.0);
}

bool HullCaster::blocked(const Vec3& from, const Vec3& to) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit ray = make_ray(from - hull_.origin, to - from, 1.0);
  rtcOccluded1(scene_, &context, &ray.ray);
  return ray.ray.tfar < 0.0f;
}

}  // namespace polyhull::report
