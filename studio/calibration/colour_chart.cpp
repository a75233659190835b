// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/calibration/colour_chart.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/srgb.h"

namespace polyhull {
namespace {

struct Patch {
  const char* name;
  int red, green, blue;
};

constexpr std::array<Patch, chart_patches> published{{
    {"dark skin", 115, 82, 68},   {"light skin", 194, 150, 130},  {"blue sky", 98, 122, 157},
    {"foliage", 87, 108, 67},     {"blue flower", 133, 128, 177}, {"bluish green", 103, 189, 170},
    {"orange", 214, 126, 44},     {"purplish blue", 80, 91, 166}, {"moderate red", 193, 90, 99},
    {"purple", 94, 60, 108},      {"yellow green", 157, 188, 64}, {"orange yellow", 224, 163, 46},
    {"blue", 56, 61, 150},        {"green", 70, 148, 73},         {"red", 175, 54, 60},
    {"yellow", 231, 199, 31},     {"magenta", 187, 86, 149},      {"cyan", 8, 133, 161},
    {"white", 243, 243, 242},     {"neutral 8", 200, 200, 200},   {"neutral 6.5", 160, 160, 160},
    {"neutral 5", 122, 122, 121}, {"neutral 3.5", 85, 85, 85},    {"black", 52, 52, 52},
}};

// The homography from the unit square to \p corners (Heckbert 1989, section 2.2.3).
Mat3 from_square(const std::array<Vec2, 4>& corners) {
  const auto& [p0, p1, p2, p3] = corners;
  const Vec2 d1 = p1 - p2, d2 = p3 - p2, sum = p0 - p1 + p2 - p3;
  const double area = cross(d1, d2), g = cross(sum, d2) / area, h = cross(d1, sum) / area;
  const Vec2 x = p1 - p0 + g * p1, y = p3 - p0 + h * p3;
  return from_rows({x.x, y.x, p0.x, x.y, y.y, p0.y, g, h, 1.0});
}

void check_corners(const Picture& picture, const std::array<Vec2, 4>& corners,
                   const std::string& camera) {
  double turn = 0.0;
  for (int i = 0; i < 4; ++i) {
    const Vec2 p = corners[i], next = corners[(i + 1) % 4], after = corners[(i + 2) % 4];
    if (!(p.x >= 0.0 && p.y >= 0.0 && p.x <= picture.width - 1 && p.y <= picture.height - 1))
      throw Error(Error::Kind::bad_input,
                  "Camera '{}': the chart's corner ({}, {}) lies outside of its picture of {}x{} "
                  "pixels.",
                  camera, p.x, p.y, picture.width, picture.height);
    const double here = cross(next - p, after - next);
    if (here == 0.0 || here * turn < 0.0)
      throw Error(Error::Kind::bad_input,
                  "Camera '{}': the chart's corners do not go round a convex figure; give those at "
                  "dark skin, bluish green, black and white, in this order.",
                  camera);
    turn = here;
    const int patches = i % 2 == 0 ? chart_columns : chart_rows;
    if (glm::length(next - p) < 8.0 * patches)
      throw Error(Error::Kind::bad_input,
                  "Camera '{}': the chart's patches are less than 8 pixels wide; bring it nearer.",
                  camera);
  }
}

}  // namespace

ChartColours read_chart(const Picture& picture, const std::array<Vec2, 4>& corners,
                        const std::string& camera) {
  check_corners(picture, corners, camera);
  const Mat3 to_picture = from_square(corners);
  constexpr int steps = 15;  // samples a side, of the middle half of a patch
  ChartColours colours;
  for (int patch = 0; patch < chart_patches; ++patch) {
    Vec3 sum(0.0);
    int clipped = 0;
    for (int i = 0; i < steps * steps; ++i) {
      const Vec2 within = 0.25 + 0.5 * Vec2(i % steps, i / steps) / (steps - 1.0);
      const Vec3 at = to_picture * Vec3((patch % chart_columns + within.x) / chart_columns,
                                        (patch / chart_columns + within.y) / chart_rows, 1.0);
      const std::uint8_t* pixel =
          picture.row(static_cast<int>(std::lround(at.y / at.z))) + 3 * std::lround(at.x / at.z);
      bool lost = false;
      for (int c = 0; c < 3; ++c) {
        sum[c] += srgb_to_linear(pixel[c]);
        lost = lost || pixel[c] == 0 || pixel[c] >= 254;
      }
      clipped += lost;
    }
    colours.linear[patch] = sum / static_cast<double>(steps * steps);
    colours.clipped[patch] = clipped * 100 >= steps * steps;
  }
  return colours;
}

Vec3 read_card(const Picture& picture, const Vec2& from, const Vec2& to,
               const std::string& camera) {
  const Vec2 low = glm::ceil(glm::min(from, to)), high = glm::floor(glm::max(from, to));
  if (!(low.x >= 0 && low.y >= 0 && high.x < picture.width && high.y < picture.height))
    throw Error(
        Error::Kind::bad_input,
        "The grey card's rectangle of camera '{}' is not within its picture of {}x{} pixels.",
        camera, picture.width, picture.height);
  const double area = (high.x - low.x + 1) * (high.y - low.y + 1);
  if (!(area >= 64))
    throw Error(
        Error::Kind::bad_input,
        "The grey card's rectangle of camera '{}' has fewer than 64 pixels; take a larger one.",
        camera);
  Vec3 sum(0.0);
  double clipped = 0.0;
  for (int y = static_cast<int>(low.y); y <= static_cast<int>(high.y); ++y)
    for (int x = static_cast<int>(low.x); x <= static_cast<int>(high.x); ++x) {
      const std::uint8_t* pixel = picture.row(y) + 3 * x;
      for (int c = 0; c < 3; ++c) sum[c] += srgb_to_linear(pixel[c]);
      clipped += std::any_of(pixel, pixel + 3, [](int code) { return code == 0 || code >= 254; });
    }
  if (clipped * 100 >= area)
    throw Error(Error::Kind::bad_input,
                "Camera '{}' sees the grey card over- or underexposed; mend its exposure.", camera);
  return sum / area;
}

const std::array<Vec3, chart_patches>& published_chart() {
  static const std::array<Vec3, chart_patches> linear = [] {
    std::array<Vec3, chart_patches> result;
    for (int i = 0; i < chart_patches; ++i)
      result[i] =
          srgb_decoded(Vec3(published[i].red, published[i].green, published[i].blue) / 255.0);
    return result;
  }();
  return linear;
}

const char* chart_patch_name(int patch) {
  return published[patch].name;
}

Mat3 colour_matrix(std::span<const Vec3> seen, std::span<const Vec3> wanted) {
  // Of w_0: a hundred-thousandth of the data's own weight, so that it decides only where they
  // leave open.
  constexpr double share = 1e-5;
  Mat3 seen_seen(0.0), wanted_seen(0.0);
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const double Y = glm::dot(wanted[i], Vec3(0.2126729, 0.7151522, 0.0721750));
    const double weight = std::pow(std::max(Y, 0.0) + 0.02, -4.0 / 3.0);
    seen_seen += weight * glm::outerProduct(seen[i], seen[i]);
    wanted_seen += weight * glm::outerProduct(wanted[i], seen[i]);
  }
  const double power = seen_seen[0][0] + seen_seen[1][1] + seen_seen[2][2];
  if (!(power > 0.0)) return Mat3(1.0);
  const double gain = (wanted_seen[0][0] + wanted_seen[1][1] + wanted_seen[2][2]) / power;
  const Mat3 pull(share * power);
  return (wanted_seen + gain * pull) * glm::inverse(seen_seen + pull);
}

}  // namespace polyhull
