// SPDX-License-Identifier: LGPL-2.1-or-later
#include "rig/level.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/error.h"
#include "base/median.h"
#include "base/rings.h"
#include "hull/repair/tangency.h"
#include "rig/floor.h"
#include "rig/plausible.h"
#include "rig/undistort.h"

namespace polyhull {
namespace {

constexpr double of_distance = 0.7;     // the stage that is assumed, to each side
constexpr double most_apart = 2.0;      // px by which two outlines may miss one plane
constexpr double within_outline = 1.5;  // px: a point of the subject is in all silhouettes

std::vector<Vec3> centres_of(const Rig& rig) {
  std::vector<Vec3> centres;
  for (const Camera& camera : rig.cameras) centres.push_back(camera.centre());
  return centres;
}

Vec3 middle_of_stage(const Rig& rig) {
  if (rig.bounds) return 0.5 * (rig.bounds->min + rig.bounds->max);
  if (const std::optional<Vec3> point = common_point(rig)) return *point;
  throw Error(Error::Kind::bad_input,
              "The optical axes meet nowhere, so that the middle of the stage is unknown. Say the "
              "world's origin by --origin X Y Z.");
}

/// y is up, x as near to the old one as it can be, the origin below \p above.
Frame frame_at(const Vec3& up, double height, const Vec3& above) {
  const Vec3 old = std::abs(up.x) < 0.9 ? Vec3(1, 0, 0) : Vec3(0, 0, 1);
  const Vec3 x = glm::normalize(old - glm::dot(old, up) * up);
  const Mat3 R = glm::transpose(Mat3(x, up, glm::cross(x, up)));
  const Vec3 origin = above + (height - glm::dot(above, up)) * up;
  return {R, -(R * origin)};
}

/// In the rig's unit, in the new world.
Bounds stage_of(const Rig& rig, const std::string& stage) {
  const double metres = rig.metres_per_unit();
  double width = 0.0, depth = 0.0, height = 0.0;
  if (!stage.empty()) {
    char rest = 0;
    if (std::sscanf(stage.c_str(), "%lfx%lfx%lf%c", &width, &depth, &height, &rest) != 3 ||
        !(width > 0.0) || !(depth > 0.0) || !(height > 0.0) ||
        !std::isfinite(width + depth + height))
      throw Error(Error::Kind::bad_input,
                  "--stage is '{}'; expected WIDTHxDEPTHxHEIGHT in metres, such as 2.4x2.4x2.3.",
                  stage);
    width /= metres, depth /= metres, height /= metres;
  } else {
    std::vector<double> distances;
    for (const Vec3& centre : centres_of(rig))
      distances.push_back(glm::length(Vec2(centre.x, centre.z)));
    width = depth = 2.0 * of_distance * median(distances);
    height = median(distances);
    if (!(height > 0.0))
      throw Error(Error::Kind::bad_input,
                  "The cameras stand over the origin; say how large the stage is by --stage "
                  "WIDTHxDEPTHxHEIGHT, in metres.");
  }
  return {Vec3(-0.5 * width, 0.0, -0.5 * depth), Vec3(0.5 * width, height, 0.5 * depth)};
}

/// Whether \p p lies in \p rings or at most within_outline px outside.
bool sees(const Rings& rings, const Vec2& p) {
  for (std::size_t r = 0; r < rings.size(); ++r) {
    Vec2 a(rings.ring(r).back());
    for (const Vec2f& point : rings.ring(r)) {
      const Vec2 b(point), along = b - a;
      const double length = glm::dot(along, along);
      const double at = length > 0.0 ? std::clamp(glm::dot(p - a, along) / length, 0.0, 1.0) : 0.0;
      if (glm::distance(p, a + at * along) <= within_outline) return true;
      a = b;
    }
  }
  return is_inside(rings, p);
}

bool in_picture(const Camera& camera, const Vec2& p) {
  return p.x >= 0.0 && p.y >= 0.0 && p.x <= camera.width - 1.0 && p.y <= camera.height - 1.0;
}

/// The farthest of \p points from the floor of the frame.
double unevenness(const std::vector<Vec3>& points, const Frame& frame) {
  double most = 0.0;
  for (const Vec3& point : points) most = std::max(most, std::abs((frame.R * point + frame.t).y));
  return most;
}

}  // namespace

double lowest_point(const Rig& rig, const std::vector<CameraPictureRings>& pictures) {
  const Vec3 up = glm::normalize(rig.up);
  Rig pinhole;  // of the cameras with pictures
  std::vector<Rings> rings;
  for (const CameraPictureRings& picture : pictures) {
    const Camera& camera = rig.cameras[picture.camera];
    pinhole.cameras.push_back(camera);
    rings.push_back(undistort_rings(camera, picture.rings).rings);
  }
  std::vector<Silhouette> silhouettes;
  for (std::size_t i = 0; i < rings.size(); ++i)
    silhouettes.push_back({&rig.cameras[pictures[i].camera], &rings[i]});
  for (Camera& camera : pinhole.cameras) camera.distortion.clear();
  double lowest = INFINITY;
  for (const Tangency& tangency : find_tangencies(silhouettes)) {
    if (std::abs(tangency.error) > most_apart) continue;
    const std::pair<std::size_t, Vec2> seen[] = {{tangency.first, tangency.at_first},
                                                 {tangency.second, tangency.at_second}};
    const Camera &a = pinhole.cameras[tangency.first], &b = pinhole.cameras[tangency.second];
    const double cosine = glm::dot(glm::normalize(a.ray(tangency.at_first)),
                                   glm::normalize(b.ray(tangency.at_second)));
    if (std::abs(cosine) > 0.97) continue;  // 14 degrees: a pixel is far along the rays
    const Vec3 point = triangulate(pinhole, seen);
    // Where one camera's outline has touched the left foot and the other's the right one.
    bool in_all = true;
    for (std::size_t i = 0; i < rings.size() && in_all; ++i) {
      const Camera& camera = *silhouettes[i].camera;
      const std::optional<Vec2> pixel = pinhole.cameras[i].project(point);
      in_all = pixel && (sees(rings[i], *pixel) || !in_picture(camera, camera.distort(*pixel)));
    }
    if (in_all) lowest = std::min(lowest, glm::dot(up, point));
  }
  if (!std::isfinite(lowest))
    throw Error(
        Error::Kind::bad_input,
        "No two cameras see the lowest point of who stands there: the silhouettes leave the "
        "pictures below, or contradict each other (`polyhull-rig check RIG --pictures`).");
  return lowest;
}

LevelledRig level_rig(const Rig& rig, const LevelRequest& request) {
  const int ways = !request.points.empty() + request.height.has_value() +
                   request.board.has_value() + !request.standing.empty();
  if (ways != 1)
    throw Error(
        Error::Kind::bad_input,
        "Say where the floor is in one way, {} were given: --floor-points FILE, --points, "
        "--floor HEIGHT, --board with --pictures of it on the floor, or --pictures of somebody "
        "who stands on it.",
        ways);
  Rig from = rig;
  if (!request.unit.empty()) from.unit = request.unit;
  const double metres = from.metres_per_unit();
  if (request.up) from.up = *request.up;
  if (!(glm::length(from.up) > 0.0) || !std::isfinite(glm::length(from.up)))
    throw Error(Error::Kind::bad_input, "--up must be a direction: three numbers, not all zero.");
  LevelledRig result;
  Frame frame;
  if (!request.points.empty()) {
    std::vector<Vec3> above = centres_of(from);
    // What is given counts more than where the cameras are.
    if (request.up)
      for (Vec3& centre : above) centre = request.points[0] + from.up;
    frame = floor_frame(request.points, above);
    result.text =
        fmt::format("the floor lies through {} points, up to {:.1f} mm beside them\n",
                    request.points.size(), 1e3 * metres * unevenness(request.points, frame));
  } else if (request.board) {
    frame = *request.board;
  } else {
    const double height = request.height ? *request.height : lowest_point(from, request.standing);
    result.text = fmt::format("the floor is at {:.6g} along the rig's up\n", height);
    frame = frame_at(glm::normalize(from.up), height,
                     request.origin ? *request.origin : middle_of_stage(from));
  }
  if (request.origin) {
    const Vec3 moved = frame.R * *request.origin + frame.t;
    frame.t -= Vec3(moved.x, 0.0, moved.z);
  }
  result.rig = moved_rig(from, frame);
  result.rig.bounds = stage_of(result.rig, request.stage);
  const Vec3 size = (result.rig.bounds->max - result.rig.bounds->min) * metres;
  result.text +=
      fmt::format("bounds {:.4g} x {:.4g} x {:.4g} m from the floor up\n", size.x, size.z, size.y);
  for (const Camera& camera : result.rig.cameras)
    result.text +=
        fmt::format("{:14} {:.4g} m above the floor\n", camera.name, camera.centre().y * metres);
  validate_rig(result.rig, "the levelled rig");
  return result;
}

}  // namespace polyhull
