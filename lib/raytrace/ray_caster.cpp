// SPDX-License-Identifier: LGPL-2.1-or-later
#include "raytrace/ray_caster.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "base/error.h"

namespace polyhull {
namespace {

constexpr std::size_t packet = 8;

Error embree_error(RTCDevice device, const char* doing) {
  const RTCError code = rtcGetDeviceError(device);
  const char* reason = code == RTC_ERROR_OUT_OF_MEMORY     ? "out of memory"
                       : code == RTC_ERROR_UNSUPPORTED_CPU ? "this processor is not supported"
                                                           : "unknown reason";
  return Error(Error::Kind::unsupported, "The ray tracing library Embree failed {} ({}).", doing,
               reason);
}

/// Rays in Embree's order: one array per component.
void load_packet(const Ray* rays, std::size_t count, RTCRay8& out, int* valid) {
  for (std::size_t k = 0; k < packet; ++k) {
    valid[k] = k < count ? -1 : 0;
    const Ray& ray = rays[std::min(k, count - 1)];
    out.org_x[k] = ray.origin.x;
    out.org_y[k] = ray.origin.y;
    out.org_z[k] = ray.origin.z;
    out.dir_x[k] = ray.direction.x;
    out.dir_y[k] = ray.direction.y;
    out.dir_z[k] = ray.direction.z;
    out.tnear[k] = ray.near;
    out.tfar[k] = ray.far;
    out.time[k] = 0.0f;
    out.mask[k] = 0xffffffffu;
    out.id[k] = 0;
    out.flags[k] = 0;
  }
}

RTCRay single_ray(const Ray& ray) {
  RTCRay out{};
  out.org_x = ray.origin.x;
  out.org_y = ray.origin.y;
  out.org_z = ray.origin.z;
  out.dir_x = ray.direction.x;
  out.dir_y = ray.direction.y;
  out.dir_z = ray.direction.z;
  out.tnear = ray.near;
  out.tfar = ray.far;
  out.mask = 0xffffffffu;
  return out;
}

RTCIntersectContext query_context(bool coherent) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags =
      coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  return context;
}

}  // namespace

struct RayCaster::State {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  std::vector<std::size_t> vertex_counts;  // by mesh number

  explicit State(For use) {
    device = rtcNewDevice(nullptr);
    if (!device) throw embree_error(nullptr, "to start");
    scene = rtcNewScene(device);
    if (!scene) {
      const Error error = embree_error(device, "to make a scene");
      rtcReleaseDevice(device);
      throw error;
    }
    // Without this flag rays slip through the seam between two triangles now and then.
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    if (use == For::one_frame) rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_LOW);
  }
  ~State() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  State(const State&) = delete;
};

RayCaster::RayCaster(For use) : state_(std::make_unique<State>(use)) {}
RayCaster::~RayCaster() = default;
RayCaster::RayCaster(RayCaster&&) noexcept = default;
RayCaster& RayCaster::operator=(RayCaster&&) noexcept = default;

std::uint32_t RayCaster::add_mesh(std::span<const Vec3f> positions,
                                  std::span<const std::uint32_t> triangles) {
  for (const std::uint32_t index : triangles) {
    if (index >= positions.size()) {
      throw Error(Error::Kind::bad_input,
                  "A mesh for ray tracing has vertex index {} but only {} vertices.", index,
                  positions.size());
    }
  }
  RTCGeometry geometry = rtcNewGeometry(state_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  // Embree allocates its own buffers, padded as it needs them; an empty mesh keeps one vertex.
  void* vertices =
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vec3f),
                              std::max<std::size_t>(positions.size(), 1));
  void* indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                          3 * sizeof(std::uint32_t), triangles.size() / 3);
  if (!vertices || (!indices && !triangles.empty())) {
    rtcReleaseGeometry(geometry);
    throw embree_error(state_->device, "to store a mesh");
  }
  std::memset(vertices, 0, sizeof(Vec3f));
  if (!positions.empty()) std::memcpy(vertices, positions.data(), positions.size_bytes());
  if (triangles.size() >= 3)
    std::memcpy(indices, triangles.data(), triangles.size() / 3 * 3 * sizeof(std::uint32_t));
  rtcCommitGeometry(geometry);
  const unsigned mesh = rtcAttachGeometry(state_->scene, geometry);
  rtcReleaseGeometry(geometry);
  if (state_->vertex_counts.size() <= mesh) state_->vertex_counts.resize(mesh + 1);
  state_->vertex_counts[mesh] = positions.size();
  return mesh;
}

void RayCaster::move_mesh(std::uint32_t mesh, std::span<const Vec3f> positions) {
  if (mesh >= state_->vertex_counts.size() || positions.size() != state_->vertex_counts[mesh]) {
    throw Error(Error::Kind::bad_input,
                "A mesh for ray tracing was to be moved with {} vertices; give as many as it was "
                "made with.",
                positions.size());
  }
  if (positions.empty()) return;
  RTCGeometry geometry = rtcGetGeometry(state_->scene, mesh);
  std::memcpy(rtcGetGeometryBufferData(geometry, RTC_BUFFER_TYPE_VERTEX, 0), positions.data(),
              positions.size_bytes());
  rtcUpdateGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0);
  rtcCommitGeometry(geometry);
}

void RayCaster::remove_mesh(std::uint32_t mesh) {
  rtcDetachGeometry(state_->scene, mesh);
}

void RayCaster::commit() {
  rtcCommitScene(state_->scene);
  if (rtcGetDeviceError(state_->device) != RTC_ERROR_NONE) {
    throw Error(Error::Kind::unsupported,
                "The ray tracing library Embree could not build its tree: too little memory?");
  }
}

RayHit RayCaster::intersect(const Ray& ray) const {
  RTCIntersectContext context = query_context(false);
  RTCRayHit query{};
  query.ray = single_ray(ray);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(state_->scene, &context, &query);
  RayHit hit;
  if (query.hit.geomID != RTC_INVALID_GEOMETRY_ID) {
    hit = {query.ray.tfar, query.hit.geomID, query.hit.primID,
           query.hit.u,    query.hit.v,      Vec3f(query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z)};
  }
  return hit;
}

bool RayCaster::occluded(const Ray& ray) const {
  RTCIntersectContext context = query_context(false);
  RTCRay query = single_ray(ray);
  rtcOccluded1(state_->scene, &context, &query);
  return query.tfar < 0.0f;
}

void RayCaster::intersect(std::span<const Ray> rays, std::span<RayHit> hits, bool coherent) const {
  RTCIntersectContext context = query_context(coherent);
  alignas(32) RTCRayHit8 query;
  alignas(32) int valid[packet];
  for (std::size_t first = 0; first < rays.size(); first += packet) {
    const std::size_t count = std::min(packet, rays.size() - first);
    load_packet(&rays[first], count, query.ray, valid);
    for (std::size_t k = 0; k < packet; ++k) {
      query.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
      query.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
    }
    rtcIntersect8(valid, state_->scene, &context, &query);
    for (std::size_t k = 0; k < count; ++k) {
      RayHit hit;
      if (query.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID) {
        hit = {query.ray.tfar[k],   query.hit.geomID[k],
               query.hit.primID[k], query.hit.u[k],
               query.hit.v[k],      Vec3f(query.hit.Ng_x[k], query.hit.Ng_y[k], query.hit.Ng_z[k])};
      }
      hits[first + k] = hit;
    }
  }
}

void RayCaster::occluded(std::span<const Ray> rays, std::span<std::uint8_t> blocked,
                         bool coherent) const {
  RTCIntersectContext context = query_context(coherent);
  alignas(32) RTCRay8 query;
  alignas(32) int valid[packet];
  for (std::size_t first = 0; first < rays.size(); first += packet) {
    const std::size_t count = std::min(packet, rays.size() - first);
    load_packet(&rays[first], count, query, valid);
    rtcOccluded8(valid, state_->scene, &context, &query);
    for (std::size_t k = 0; k < count; ++k) blocked[first + k] = query.tfar[k] < 0.0f ? 1 : 0;
  }
}

}  // namespace polyhull
