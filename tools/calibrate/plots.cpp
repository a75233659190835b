// SPDX-License-Identifier: LGPL-2.1-or-later
#include "calibrate/plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/picture.h"
#include "calibrate/append.h"

namespace polyhull::calibrate_tool {
namespace {

using calibration::Calibration;
using calibration::View;
using calibration::ViewFit;

std::string base64(const std::vector<std::uint8_t>& bytes) {
  constexpr char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k)
      three = three << 8 | (i + k < bytes.size() ? bytes[i + k] : 0u);
    for (std::size_t k = 0; k < 4; ++k)
      out += i + k > bytes.size() ? '=' : letters[three >> (18 - 6 * k) & 63];
  }
  return out;
}

// Every factor-th pixel's neighbourhood averaged.
Picture shrink(const Picture& grey, int factor) {
  Picture out{grey.width / factor, grey.height / factor, 1, {}};
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      int sum = 0;
      for (int j = 0; j < factor; ++j)
        for (int i = 0; i < factor; ++i) sum += grey.row(y * factor + j)[x * factor + i];
      out.pixels.push_back(static_cast<std::uint8_t>(sum / (factor * factor)));
    }
  }
  return out;
}

// Calls back with every corner of the camera that took part.
template <class Visit>
void each_corner(const Calibration& calibration, std::size_t c, const Visit& visit) {
  for (std::size_t v = 0; v < calibration.take.views.size(); ++v) {
    const View& view = calibration.take.views[v];
    const ViewFit& fit = calibration.adjusted.views[v];
    if (view.camera != c || !fit.used) continue;
    for (std::size_t i = 0; i < view.corners.size(); ++i)
      if (fit.corner_used[i]) visit(view.corners[i], fit.residuals[i]);
  }
}

std::string svg_begin(const calibration::TakeCamera& camera, int width) {
  return fmt::format(
      "<svg width=\"{}\" viewBox=\"0 0 {} {}\"><rect width=\"100%\" height=\"100%\" "
      "fill=\"#f4f4f4\"/>",
      width, camera.width, camera.height);
}

}  // namespace

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '&')
      out += "&amp;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  }
  return out;
}

std::string colour_of(double pixels, double usual) {
  const double hue =
      120.0 * std::clamp(1.0 - (pixels / std::max(usual, 1e-9) - 0.7) / 2.3, 0.0, 1.0);
  return fmt::format("hsl({:.0f},65%,60%)", hue);
}

std::string coverage_plot(const Calibration& calibration, std::size_t c) {
  const calibration::TakeCamera& camera = calibration.take.cameras[c];
  std::string out = svg_begin(camera, 360);
  const double radius = camera.width / 250.0;
  append(out, "<g fill=\"#2266aa\" fill-opacity=\".5\">");
  each_corner(calibration, c, [&](const Vec2& corner, const Vec2&) {
    append(out, "<circle cx=\"{:.0f}\" cy=\"{:.0f}\" r=\"{:.1f}\"/>", corner.x, corner.y, radius);
  });
  return out + "</g></svg>";
}

std::string residual_cloud(const Calibration& calibration, std::size_t c) {
  const double scale = 40.0 / std::max(1e-6, calibration.adjusted.noise);  // a deviation: 40 units
  std::string out =
      "<svg width=\"200\" viewBox=\"-200 -200 400 400\"><rect x=\"-200\" y=\"-200\" width=\"400\" "
      "height=\"400\" fill=\"#f4f4f4\"/><path d=\"M-200 0H200M0-200V200\" stroke=\"#999\"/><g "
      "fill=\"#aa3322\" fill-opacity=\".35\">";
  each_corner(calibration, c, [&](const Vec2&, const Vec2& residual) {
    const Vec2 p = glm::clamp(scale * residual, -198.0, 198.0);
    append(out, "<circle cx=\"{:.0f}\" cy=\"{:.0f}\" r=\"3\"/>", p.x, p.y);
  });
  return out + "</g><circle r=\"40\" fill=\"none\" stroke=\"#000\" stroke-width=\"2\"/></svg>";
}

std::string residual_field(const Calibration& calibration, std::size_t c) {
  constexpr int columns = 16, rows = 9;
  const calibration::TakeCamera& camera = calibration.take.cameras[c];
  std::vector<Vec2> sums(static_cast<std::size_t>(columns) * rows, Vec2(0.0));
  std::vector<int> counts(sums.size(), 0);
  each_corner(calibration, c, [&](const Vec2& corner, const Vec2& residual) {
    const int x = std::clamp(static_cast<int>(columns * corner.x / camera.width), 0, columns - 1);
    const int y = std::clamp(static_cast<int>(rows * corner.y / camera.height), 0, rows - 1);
    sums[y * columns + x] += residual;
    ++counts[y * columns + x];
  });
  std::string out = svg_begin(camera, 360);
  const double cell = static_cast<double>(camera.width) / columns;
  const double scale = cell / std::max(1e-6, calibration.adjusted.noise);
  for (int i = 0; i < columns * rows; ++i) {
    if (counts[i] == 0) continue;
    const Vec2 from((i % columns + 0.5) * cell, (i / columns + 0.5) * camera.height / rows);
    const Vec2 mean = sums[i] / static_cast<double>(counts[i]);
    const Vec2 to = from + scale * mean;
    // What is left of so many corners' noise is nothing to see in.
    const bool sure = glm::length(mean) > 3.0 * calibration.adjusted.noise / std::sqrt(counts[i]);
    append(out,
           "<line x1=\"{:.0f}\" y1=\"{:.0f}\" x2=\"{:.0f}\" y2=\"{:.0f}\" stroke=\"{}\" "
           "stroke-width=\"{:.1f}\"/><circle cx=\"{:.0f}\" cy=\"{:.0f}\" r=\"{:.1f}\"/>",
           from.x, from.y, to.x, to.y, sure ? "#cc2211" : "#2266aa", camera.width / 300.0, from.x,
           from.y, camera.width / 400.0);
  }
  return out + "</svg>";
}

std::string view_picture(const Calibration& calibration, const Pictures& pictures, std::size_t v) {
  const View& view = calibration.take.views[v];
  const ViewFit& fit = calibration.adjusted.views[v];
  const calibration::TakeCamera& camera = calibration.take.cameras[view.camera];
  const std::string& file = pictures.files[view.camera][view.instant];
  if (file.empty()) return "";  // detections without pictures
  const Picture grey = load_picture(file, 1);
  const Picture small = shrink(grey, std::max(1, (grey.width + 479) / 480));
  std::string out = fmt::format(
      "<figure><svg width=\"480\" viewBox=\"-.5 -.5 {} {}\"><image x=\"-.5\" y=\"-.5\" "
      "width=\"{}\" height=\"{}\" preserveAspectRatio=\"none\" "
      "href=\"data:image/jpeg;base64,{}\"/>",
      camera.width, camera.height, camera.width, camera.height, base64(encode_jpeg(small, 80)));
  constexpr double longer = 50.0;
  for (std::size_t i = 0; i < view.corners.size(); ++i) {
    const Vec2& at = view.corners[i];
    const Vec2 to = at + glm::clamp(longer * fit.residuals[i], -1e4, 1e4);
    append(out,
           "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" fill=\"{}\"/><line x1=\"{:.1f}\" "
           "y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"#ff3322\" stroke-width=\"{:.1f}\"/>",
           at.x, at.y, camera.width / 250.0, view.ids[i] == 0 ? "#ffdd00" : "#22cc55", at.x, at.y,
           to.x, to.y, camera.width / 400.0);
  }
  append(
      out,
      "</svg><figcaption>{}, {}: {:.2f} px{}; residuals {:.0f} times as long</figcaption></figure>",
      escaped(camera.name), escaped(calibration.take.instants[view.instant]), fit.rms,
      fit.used ? "" : ", left out", longer);
  return out;
}

}  // namespace polyhull::calibrate_tool
