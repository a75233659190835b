// SPDX-License-Identifier: LGPL-2.1-or-later
#include "rig/plausible.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "base/median.h"
#include "hull/subject_size.h"

namespace polyhull {
namespace {

constexpr double farthest_pair = 200.0, nearest_pair = 0.001;  // metres between two cameras

Vec3 middle_of(const Bounds& bounds) {
  return 0.5 * (bounds.min + bounds.max);
}

// What to do about a length that is usually so many metres.
std::string unit_advice(const Rig& rig, double units, double usual) {
  const std::string likely = likely_unit(units, usual);
  if (likely == rig.unit)
    return "check the translations (x_cam = R X + t) and the unit of the calibration";
  Rig other;
  other.unit = likely;
  return fmt::format(
      "if the calibration is in {}, that is {:.4g} m: import it with --unit {}, or write \"unit\": "
      "\"{}\" into the rig file",
      likely, units * other.metres_per_unit(), likely, likely);
}

void examine_distances(const Rig& rig, const std::vector<double>& distances,
                       std::vector<std::string>& notes) {
  const double metres = rig.metres_per_unit();
  const auto [least, most] = std::minmax_element(distances.begin(), distances.end());
  const double typical = median(distances);
  if (typical * metres > farthest_stage || typical * metres < nearest_stage)
    notes.push_back(fmt::format("the cameras stand {:.4g} to {:.4g} m from the middle of the "
                                "stage, which is too {} for a stage; ",
                                *least * metres, *most * metres,
                                typical * metres > farthest_stage ? "far" : "near") +
                    unit_advice(rig, typical, 3.0));
  for (std::size_t i = 0; i < distances.size() && distances.size() > 2; ++i) {
    const double ratio = distances[i] / typical;
    if (ratio < 10.0 && ratio > 0.1) continue;
    notes.push_back(
        fmt::format("{} stands {:.4g} m from the middle of the stage, {:.3g} times as far as the "
                    "others ({:.4g} m): its translation is probably in another unit than theirs",
                    rig.cameras[i].name, distances[i] * metres, ratio, typical * metres));
  }
}

void examine_spacing(const Rig& rig, std::vector<std::string>& notes) {
  double most = 0.0;
  for (const Camera& a : rig.cameras)
    for (const Camera& b : rig.cameras) most = std::max(most, glm::length(a.centre() - b.centre()));
  const double metres = most * rig.metres_per_unit();
  if (rig.cameras.size() > 1 && (metres > farthest_pair || metres < nearest_pair))
    notes.push_back(
        fmt::format("the cameras stand up to {:.4g} m apart, which is too {} for a stage; ", metres,
                    metres > farthest_pair ? "far" : "near") +
        unit_advice(rig, most, 1.0));
}

// Where the optical axes meet, if they do so within a fifth of the cameras' distance and at an
// angle that says how far away.
std::optional<Vec3> meeting_point(const Rig& rig) {
  const std::optional<Vec3> point = common_point(rig);
  if (!point) return std::nullopt;
  Mat3 across(0.0);
  std::vector<double> misses, reaches;
  for (const Camera& camera : rig.cameras) {
    const Vec3 axis = glm::transpose(camera.R) * Vec3(0, 0, 1), to = *point - camera.centre();
    if (glm::dot(to, axis) <= 0.0) return std::nullopt;
    across += (Mat3(1.0) - glm::outerProduct(axis, axis)) / double(rig.cameras.size());
    misses.push_back(glm::length(to - glm::dot(to, axis) * axis));
    reaches.push_back(glm::length(to));
  }
  if (glm::determinant(across) < 0.005 || median(misses) > 0.2 * median(reaches))
    return std::nullopt;
  return point;
}

void examine_bounds(const Rig& rig, const std::vector<double>& distances,
                    const std::optional<Vec3>& meeting, std::vector<std::string>& notes) {
  const double metres = rig.metres_per_unit(), typical = median(distances);
  const Vec3 size = rig.bounds->max - rig.bounds->min;
  const double ratio = glm::length(size) / typical;
  if (ratio > 5.0 || ratio < 0.02) {
    notes.push_back(
        fmt::format("the bounds are {:.4g} x {:.4g} x {:.4g} m, which is too {} for cameras that "
                    "stand {:.4g} m away: they are probably in another unit than the cameras",
                    size.x * metres, size.y * metres, size.z * metres,
                    ratio > 5.0 ? "large" : "small", typical * metres));
    return;
  }
  if (!meeting) return;
  const double off = glm::length(*meeting - middle_of(*rig.bounds));
  if (off < 0.5 * typical + 0.5 * glm::length(size)) return;
  notes.push_back(
      fmt::format("the middle of the bounds lies {:.4g} m from the point at which the cameras look "
                  "({:.4g}, {:.4g}, {:.4g}), {:.4g} m in front of them: the bounds are probably in "
                  "another unit or axes than the cameras",
                  off * metres, meeting->x, meeting->y, meeting->z, typical * metres));
}

void examine_heights(const Rig& rig, const std::vector<double>& distances,
                     std::vector<std::string>& notes) {
  const Vec3 up = glm::normalize(rig.up);
  const double metres = rig.metres_per_unit();
  Vec3 picture_up(0.0);
  for (const Camera& camera : rig.cameras)
    picture_up -= glm::transpose(camera.R) * Vec3(0, 1, 0) / double(rig.cameras.size());
  // Cameras that agree on an upward direction, which is another than that of the rig.
  const double agreement = glm::length(picture_up);
  if (rig.cameras.size() > 1 && agreement > 0.7 && glm::dot(picture_up, up) < 0.5 * agreement) {
    Vec3 axis(0.0);
    int k = 0;
    for (int i = 1; i < 3; ++i)
      if (std::abs(picture_up[i]) > std::abs(picture_up[k])) k = i;
    axis[k] = picture_up[k] > 0.0 ? 1.0 : -1.0;
    notes.push_back(
        fmt::format("the pictures are upright along ({:.2f}, {:.2f}, {:.2f}), but the rig's up is "
                    "({:g}, {:g}, {:g}): unless the cameras are turned, up is probably {:g} {:g} "
                    "{:g} (--up, or \"up\" in the rig file)",
                    picture_up.x / agreement, picture_up.y / agreement, picture_up.z / agreement,
                    rig.up.x, rig.up.y, rig.up.z, axis.x, axis.y, axis.z));
    return;  // heights along a wrong direction say nothing
  }
  if (!rig.bounds) return;
  double floor = INFINITY;
  for (int corner = 0; corner < 8; ++corner)
    floor = std::min(floor, glm::dot(up, Vec3(corner & 1 ? rig.bounds->max.x : rig.bounds->min.x,
                                              corner & 2 ? rig.bounds->max.y : rig.bounds->min.y,
                                              corner & 4 ? rig.bounds->max.z : rig.bounds->min.z)));
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const double height = glm::dot(up, rig.cameras[i].centre()) - floor;
    if (height < -0.25 * distances[i])
      notes.push_back(
          fmt::format("{} stands {:.4g} m below the floor of the bounds: unless it looks up "
                      "through a glass floor, the bounds or up are wrong",
                      rig.cameras[i].name, -height * metres));
  }
}

}  // namespace

std::optional<Vec3> common_point(const Rig& rig) {
  Mat3 sum(0.0);
  Vec3 right(0.0);
  for (const Camera& camera : rig.cameras) {
    const Vec3 axis = glm::transpose(camera.R) * Vec3(0, 0, 1);
    const Mat3 across = Mat3(1.0) - glm::outerProduct(axis, axis);
    sum += across;
    right += across * camera.centre();
  }
  const double count = static_cast<double>(rig.cameras.size());
  if (rig.cameras.size() < 2 || !(glm::determinant(sum) > 1e-9 * count * count * count))
    return std::nullopt;
  return glm::inverse(sum) * right;
}

std::vector<std::string> implausible_sizes(const Rig& rig) {
  std::vector<std::string> notes;
  // Where the cameras look says more than bounds, which may be the ones that are wrong.
  const std::optional<Vec3> meeting = meeting_point(rig);
  const std::optional<Vec3> stage = meeting      ? meeting
                                    : rig.bounds ? middle_of(*rig.bounds)
                                                 : common_point(rig);
  if (rig.cameras.empty() || !stage) {
    examine_spacing(rig, notes);
    return notes;
  }
  std::vector<double> distances;
  for (const Camera& camera : rig.cameras)
    distances.push_back(glm::length(*stage - camera.centre()));
  examine_distances(rig, distances, notes);
  // Cameras side by side look at a common point far away, so it is their spacing that tells.
  if (notes.empty()) examine_spacing(rig, notes);
  if (rig.bounds) examine_bounds(rig, distances, meeting, notes);
  examine_heights(rig, distances, notes);
  return notes;
}

}  // namespace polyhull
