// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/plan/stage.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/error.h"
#include "scene/scene.h"
#include "studio/cameras/coverage_raster.h"
#include "studio/figure/subject.h"

namespace polyhull {
namespace {

struct Pose {
  double seconds;
  double side_x, side_z;  ///< towards which corner
};
constexpr Pose poses[] = {
    {0.0, 0.0, 0.0}, {3.0, 0.0, 0.0}, {7.0, 0.0, 0.0}, {1.5, 1.0, -1.0}, {5.0, -1.0, 1.0}};

/// How far a body that reaches from \p min to \p max moves to touch the stage's wall at \p side.
double shift(float min, float max, double size, double side) {
  const double middle = 0.5 * (static_cast<double>(min) + max);
  const double room = 0.5 * (size - (static_cast<double>(max) - min));
  return side * std::max(room, 0.0) - middle;
}

StageBody body_at(const Subject& subject, const Pose& pose, double turn, double spread,
                  const Stage& stage) {
  SubjectFrame frame;
  subject.pose(pose.seconds, frame);
  const Vec3f x_to(std::cos(turn), 0.0, -std::sin(turn)), z_to(std::sin(turn), 0.0, std::cos(turn));
  const glm::mat3 turned(x_to, Vec3f(0.0f, 1.0f, 0.0f), z_to);
  Vec3f min(std::numeric_limits<float>::infinity()), max(-min);
  for (std::size_t i = 0; i < frame.positions.size(); ++i) {
    frame.positions[i] = turned * frame.positions[i];
    frame.normals[i] = turned * frame.normals[i];
    min = glm::min(min, frame.positions[i]);
    max = glm::max(max, frame.positions[i]);
  }
  const Vec3f size = max - min;
  if (size.x > stage.width || size.z > stage.depth || max.y > stage.height) {
    throw Error(Error::Kind::bad_input,
                "The stage is {:g} x {:g} x {:g} m (width, depth, height); a person who moves "
                "needs 1.2 x 1.2 x 2 m at least.",
                stage.width, stage.depth, stage.height);
  }
  const Vec3f by(shift(min.x, max.x, stage.width, spread * pose.side_x), 0.0f,
                 shift(min.z, max.z, stage.depth, spread * pose.side_z));
  for (Vec3f& p : frame.positions) p += by;
  return {std::move(frame.positions), std::move(frame.normals), subject.triangles()};
}

}  // namespace

Bounds Stage::bounds() const {
  return {Vec3(-0.5 * width, 0.0, -0.5 * depth), Vec3(0.5 * width, height, 0.5 * depth)};
}

TriangleSurface StageBody::surface() const {
  TriangleSurface out;
  out.vertices.assign(positions.begin(), positions.end());
  for (std::size_t t = 0; t < triangles.size(); t += 3) {
    out.triangles.push_back({triangles[t], triangles[t + 1], triangles[t + 2]});
  }
  return out;
}

std::vector<StageBody> stage_bodies(const Stage& stage, double spread) {
  const auto subject = open_subject("figure");
  std::vector<StageBody> bodies;
  for (const Pose& pose : poses) {
    const double turn =
        2.0 * std::numbers::pi * static_cast<double>(bodies.size()) / std::size(poses);
    bodies.push_back(body_at(*subject, pose, turn, spread, stage));
  }
  return bodies;
}

bool holds(const Camera& camera, const StageBody& body) {
  return std::all_of(body.positions.begin(), body.positions.end(), [&](const Vec3f& p) {
    const auto pixel = camera.project(Vec3(p));
    return pixel && pixel->x >= 0.0 && pixel->y >= 0.0 && pixel->x <= camera.width - 1.0 &&
           pixel->y <= camera.height - 1.0;
  });
}

double spread_for(const std::vector<Camera>& cameras, const Stage& stage) {
  for (const double spread : {1.0, 0.75, 0.5, 0.25}) {
    const std::vector<StageBody> bodies = stage_bodies(stage, spread);
    const bool all = std::all_of(cameras.begin(), cameras.end(), [&](const Camera& camera) {
      return std::all_of(bodies.begin(), bodies.end(),
                         [&](const StageBody& body) { return holds(camera, body); });
    });
    if (all) return spread;
  }
  return 0.0;
}

StagedRig staged_rig(const Rig& rig) {
  if (!rig.bounds) {
    throw Error(Error::Kind::bad_input,
                "The rig has no bounds, so where its stage is is not known; add \"bounds\" to it.");
  }
  // Only the turn and the scale of where subjects stand: the stage is the bounds' middle.
  const Mat3 linear = placement_for(rig).linear;
  const double scale = std::cbrt(glm::determinant(linear));  // units of the rig in a metre
  const Mat3 back = glm::transpose(linear) / (scale * scale);
  Vec3 min(std::numeric_limits<double>::infinity()), max(-min);
  for (int corner = 0; corner < 8; ++corner) {
    const Bounds& b = *rig.bounds;
    const Vec3 p = back * Vec3(corner & 1 ? b.max.x : b.min.x, corner & 2 ? b.max.y : b.min.y,
                               corner & 4 ? b.max.z : b.min.z);
    min = glm::min(min, p);
    max = glm::max(max, p);
  }
  StagedRig out;
  out.stage = {max.x - min.x, max.z - min.z, max.y - min.y};
  out.linear = linear;
  out.origin = linear * Vec3(0.5 * (min.x + max.x), min.y, 0.5 * (min.z + max.z));
  for (Camera camera : rig.cameras) {
    camera.t = (camera.R * out.origin + camera.t) / scale;
    camera.R = camera.R * linear / scale;
    out.cameras.push_back(std::move(camera));
  }
  return out;
}

double azimuth_of(const Camera& camera) {
  const Vec3 centre = camera.centre();
  const double degrees = std::atan2(centre.x, centre.z) * 180.0 / std::numbers::pi;
  return degrees < -1e-9 ? degrees + 360.0 : std::abs(degrees);
}

double distance_of(const Camera& camera) {
  const Vec3 centre = camera.centre();
  return std::hypot(centre.x, centre.z);
}

Camera aimed(const Camera& like, const Vec3& centre, const Vec3& target) {
  const Camera posed = look_at(centre, target, 50.0, like.width, like.height);
  Camera camera = like;
  camera.R = posed.R;
  camera.t = posed.t;
  return camera;
}

std::vector<Camera> coarse(std::vector<Camera> cameras, int longest_side) {
  for (Camera& camera : cameras) {
    const int shrink = (std::max(camera.width, camera.height) + longest_side - 1) / longest_side;
    camera.width /= shrink;
    camera.height /= shrink;
    const double by = 1.0 / shrink;
    camera.K[0][0] *= by;
    camera.K[1][0] *= by;
    camera.K[1][1] *= by;
    camera.K[2][0] = by * (camera.K[2][0] + 0.5) - 0.5;
    camera.K[2][1] = by * (camera.K[2][1] + 0.5) - 0.5;
  }
  return cameras;
}

Picture coverage_of(const std::vector<Vec3f>& positions,
                    const std::vector<std::uint32_t>& triangles, const Camera& camera) {
  Picture out{camera.width, camera.height, 1, {}};
  out.pixels.resize(static_cast<std::size_t>(out.width) * out.height);
  CoverageRaster::Mesh mesh;
  mesh.positions = positions;
  mesh.triangles = triangles;
  CoverageRaster().draw(camera, mesh, [&](int y, std::span<const CoveredPixel> pixels) {
    for (const CoveredPixel& pixel : pixels) {
      out.row(y)[pixel.x] = static_cast<std::uint8_t>(std::lround(255.0f * pixel.coverage));
    }
  });
  return out;
}

}  // namespace polyhull
