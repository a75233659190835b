// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/plan/surface.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <random>

#include "base/error.h"
#include "base/thread_pool.h"

namespace polyhull {
namespace {

/// The point of the triangle a, b, c that is nearest to p.
Vec3 nearest(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const double d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap);
  if (d1 <= 0.0 && d2 <= 0.0) return a;
  const double d3 = glm::dot(ab, bp), d4 = glm::dot(ac, bp);
  if (d3 >= 0.0 && d4 <= d3) return b;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return a + d1 / (d1 - d3) * ab;
  const double d5 = glm::dot(ab, cp), d6 = glm::dot(ac, cp);
  if (d6 >= 0.0 && d5 <= d6) return c;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return a + d2 / (d2 - d6) * ac;
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 >= d3 && d5 >= d6) return b + (d4 - d3) / (d4 - d3 + d5 - d6) * (c - b);
  return a + (vb * ab + vc * ac) / (va + vb + vc);
}

/// A surface that is asked for the points nearest to others; by many threads at once.
class NearestPoint {
 public:
  explicit NearestPoint(const TriangleSurface& surface) : surface_(surface) {
    device_.reset(rtcNewDevice(nullptr));
    if (!device_) throw Error(Error::Kind::unsupported, "Embree cannot start on this machine.");
    scene_.reset(rtcNewScene(device_.get()));
    rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
    RTCGeometry mesh = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* points = static_cast<Vec3f*>(rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0,
                                                               RTC_FORMAT_FLOAT3, sizeof(Vec3f),
                                                               surface.vertices.size()));
    std::copy(surface.vertices.begin(), surface.vertices.end(), points);
    auto* triangles = static_cast<std::array<std::uint32_t, 3>*>(
        rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                3 * sizeof(std::uint32_t), surface.triangles.size()));
    std::copy(surface.triangles.begin(), surface.triangles.end(), triangles);
    rtcCommitGeometry(mesh);
    rtcAttachGeometry(scene_.get(), mesh);
    rtcReleaseGeometry(mesh);
    rtcCommitScene(scene_.get());
  }

  double distance(const Vec3& p) const {
    Question question{&surface_, p, std::numeric_limits<double>::infinity()};
    RTCPointQuery query{};
    query.x = static_cast<float>(p.x);
    query.y = static_cast<float>(p.y);
    query.z = static_cast<float>(p.z);
    query.radius = std::numeric_limits<float>::infinity();
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(scene_.get(), &query, &context, look, &question);
    return question.distance;
  }

 private:
  struct Question {
    const TriangleSurface* surface;
    Vec3 at;
    double distance;
  };
  struct Release {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  };

  static bool look(RTCPointQueryFunctionArguments* arguments) {
    auto& question = *static_cast<Question*>(arguments->userPtr);
    const auto& v = question.surface->vertices;
    const auto& t = question.surface->triangles[arguments->primID];
    const double distance =
        glm::distance(question.at, nearest(question.at, v[t[0]], v[t[1]], v[t[2]]));
    if (!(distance < question.distance)) return false;
    question.distance = distance;
    // A little more than the distance: Embree's boxes are rounded.
    arguments->query->radius = static_cast<float>(distance * (1.0 + 1e-6) + 1e-7);
    return true;
  }

  const TriangleSurface& surface_;
  std::unique_ptr<RTCDeviceTy, Release> device_;
  std::unique_ptr<RTCSceneTy, Release> scene_;
};

std::vector<Vec3> spread(const TriangleSurface& surface, std::size_t count) {
  std::vector<double> areas;
  double sum = 0.0;
  for (const auto& t : surface.triangles) {
    const Vec3 &a = surface.vertices[t[0]], &b = surface.vertices[t[1]],
               &c = surface.vertices[t[2]];
    sum += glm::length(glm::cross(b - a, c - a));
    areas.push_back(sum);
  }
  std::mt19937_64 random(1);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  std::vector<Vec3> points;
  std::size_t at = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double place = (static_cast<double>(i) + unit()) / static_cast<double>(count) * sum;
    while (at + 1 < areas.size() && areas[at] <= place) ++at;
    const auto& t = surface.triangles[at];
    double u = unit(), v = unit();
    if (u + v > 1.0) {
      u = 1.0 - u;
      v = 1.0 - v;
    }
    const Vec3& a = surface.vertices[t[0]];
    points.push_back(a + u * (surface.vertices[t[1]] - a) + v * (surface.vertices[t[2]] - a));
  }
  return points;
}

}  // namespace

TriangleSurface surface_of(const Hull& hull) {
  TriangleSurface surface;
  for (const Vec3f& v : hull.vertices) surface.vertices.push_back(hull.origin + Vec3(v));
  for (std::size_t t = 0; t < hull.triangles.size(); t += 3) {
    surface.triangles.push_back({hull.triangles[t], hull.triangles[t + 1], hull.triangles[t + 2]});
  }
  return surface;
}

double volume_of(const TriangleSurface& surface) {
  double volume = 0.0;
  for (const auto& t : surface.triangles) {
    volume += glm::dot(surface.vertices[t[0]],
                       glm::cross(surface.vertices[t[1]], surface.vertices[t[2]])) /
              6.0;
  }
  return volume;
}

SurfaceDistance distance_between(const TriangleSurface& from, const TriangleSurface& to,
                                 std::size_t count) {
  SurfaceDistance result;
  if (from.triangles.empty() || count == 0) return result;
  std::vector<Vec3> points = spread(from, count);
  points.insert(points.end(), from.vertices.begin(), from.vertices.end());
  const NearestPoint other(to);
  std::vector<double> distances(points.size());
  parallel_each(points.size(), 256, 0,
                [&](std::size_t i) { distances[i] = other.distance(points[i]); });
  result.greatest = *std::max_element(distances.begin(), distances.end());
  distances.resize(count);
  for (const double d : distances) result.mean += d / static_cast<double>(count);
  const auto at = distances.begin() + static_cast<std::ptrdiff_t>(count * 95 / 100);
  std::nth_element(distances.begin(), at, distances.end());
  result.p95 = *at;
  return result;
}

}  // namespace polyhull
