// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/calibration/find_light.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace polyhull::calibration {
namespace {

constexpr int least_contrast = 40;

struct Light {
  Vec2 place;
  double sum;
};

// Around the pixels in \p box with as much of the fall-off as the box's own size.
Light weigh(const Picture& grey, const cv::Rect& box, int background) {
  const int x_margin = box.width / 2 + 2, y_margin = box.height / 2 + 2;
  Light out{Vec2(0.0), 0.0};
  for (int y = std::max(0, box.y - y_margin);
       y < std::min(grey.height, box.y + box.height + y_margin); ++y)
    for (int x = std::max(0, box.x - x_margin);
         x < std::min(grey.width, box.x + box.width + x_margin); ++x) {
      // What is hardly above the background is its noise.
      const double weight = grey.row(y)[x] - background - least_contrast / 10.0;
      if (weight <= 0.0) continue;
      out.place += weight * Vec2(x, y);
      out.sum += weight;
    }
  out.place /= out.sum;
  return out;
}

}  // namespace

Lights find_lights(const Picture& grey, int count) {
  std::vector<std::uint8_t> sorted = grey.pixels;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  const int background = *middle;
  const int brightest = *std::ranges::max_element(grey.pixels);
  const auto pixels = static_cast<std::ptrdiff_t>(grey.pixels.size());
  if (20 * std::ranges::count_if(grey.pixels, [](int v) { return v >= 250; }) > pixels)
    return {LightFault::too_bright, {}};
  if (brightest - background < least_contrast) return {LightFault::dark, {}};
  const cv::Mat picture(grey.height, grey.width, CV_8U,
                        const_cast<std::uint8_t*>(grey.pixels.data()));
  cv::Mat labels, boxes, centres;
  // Of two ends of a wand one is fainter.
  const double part = count > 1 ? 0.25 : 0.5;
  const cv::Mat lit = picture > background + std::max<double>(least_contrast / 2.0,
                                                              part * (brightest - background));
  const int found = cv::connectedComponentsWithStats(lit, labels, boxes, centres) - 1;
  if (found < count) return {LightFault::dark, {}};
  if (found > count) return {LightFault::several, {}};
  std::vector<Light> lights;
  for (int i = 1; i <= found; ++i) {
    if (200 * static_cast<std::ptrdiff_t>(boxes.at<int>(i, cv::CC_STAT_AREA)) > pixels)
      return {LightFault::too_large, {}};
    lights.push_back(
        weigh(grey,
              {boxes.at<int>(i, cv::CC_STAT_LEFT), boxes.at<int>(i, cv::CC_STAT_TOP),
               boxes.at<int>(i, cv::CC_STAT_WIDTH), boxes.at<int>(i, cv::CC_STAT_HEIGHT)},
              background));
  }
  std::ranges::sort(lights, std::greater{}, &Light::sum);
  Lights out;
  for (const Light& light : lights) out.places.push_back(light.place);
  return out;
}

}  // namespace polyhull::calibration
