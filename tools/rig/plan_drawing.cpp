// SPDX-License-Identifier: LGPL-2.1-or-later
#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "rig/plan.h"

namespace polyhull {
namespace {

constexpr double size = 640.0, margin = 60.0, line = 18.0;  // px

/// Metres on the floor to the drawing: x to the right, z downwards, as seen from above.
struct Paper {
  double scale = 1.0;
  double x(double metres) const { return 0.5 * size + scale * metres; }
  double y(double metres) const { return 0.5 * size + scale * metres; }
};

Paper paper_for(const std::vector<Camera>& cameras, const Stage& stage,
                const std::optional<Vec2>& room) {
  double most = 0.5 * std::max(stage.width, stage.depth);
  if (room) most = 0.5 * std::max(room->x, room->y);
  for (const Camera& camera : cameras) most = std::max(most, distance_of(camera));
  return {(0.5 * size - margin) / most};
}

/// What the camera sees at the height of its own axis, as a triangle that ends behind the stage.
std::string field_of(const Camera& camera, const Paper& paper, const char* colour) {
  const Vec3 centre = camera.centre();
  const double far = 1.25 * distance_of(camera);
  std::string points = fmt::format("{:.1f},{:.1f}", paper.x(centre.x), paper.y(centre.z));
  for (const double edge : {-0.5, camera.width - 0.5}) {
    const Vec3 ray = camera.ray({edge, camera.K[2][1]});
    const double along = std::hypot(ray.x, ray.z);
    points += fmt::format(" {:.1f},{:.1f}", paper.x(centre.x + ray.x / along * far),
                          paper.y(centre.z + ray.z / along * far));
  }
  return fmt::format(
      "<polygon points=\"{}\" fill=\"{}\" fill-opacity=\"0.08\" stroke=\"{}\" "
      "stroke-opacity=\"0.4\"/>\n",
      points, colour, colour);
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '<')
      out += "&lt;";
    else if (c == '&')
      out += "&amp;";
    else
      out += c;
  }
  return out;
}

/// Around the middle, in metres.
std::string rectangle(const Paper& paper, double width, double depth, const char* stroke) {
  return fmt::format(
      "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"none\" "
      "stroke=\"{}\" stroke-width=\"1.5\"/>\n",
      paper.x(-0.5 * width), paper.y(-0.5 * depth), paper.scale * width, paper.scale * depth,
      stroke);
}

std::string label_of(const Camera& camera, const Paper& paper, const char* colour) {
  const Vec3 centre = camera.centre();
  const double out = 16.0 / std::max(distance_of(camera), 1e-6);
  const double x = paper.x(centre.x), y = paper.y(centre.z);
  return fmt::format(
      "<circle cx=\"{0:.1f}\" cy=\"{1:.1f}\" r=\"6\" fill=\"{2}\"/>\n"
      "<text x=\"{3:.1f}\" y=\"{4:.1f}\" text-anchor=\"middle\">{5}</text>\n"
      "<text x=\"{3:.1f}\" y=\"{6:.1f}\" text-anchor=\"middle\" fill=\"#666\">{7:.2f} m "
      "high</text>\n",
      x, y, colour, x + 1.6 * out * centre.x, y + 1.4 * out * centre.z, escaped(camera.name),
      y + 1.4 * out * centre.z + 13.0, centre.y);
}

}  // namespace

std::string plan_drawing(const std::vector<Camera>& cameras, const Stage& stage,
                         const std::optional<Vec2>& room, const std::string& text) {
  constexpr const char* colours[] = {"#1f77b4", "#d62728", "#2ca02c", "#ff7f0e",
                                     "#9467bd", "#8c564b", "#17becf", "#7f7f7f"};
  const Paper paper = paper_for(cameras, stage, room);
  const auto lines = std::count(text.begin(), text.end(), '\n');
  const double height = size + line * (static_cast<double>(lines) + 2.0);
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:g}\" height=\"{1:g}\" "
      "viewBox=\"0 0 {0:g} {1:g}\" font-family=\"sans-serif\" font-size=\"12\">\n"
      "<rect width=\"{0:g}\" height=\"{1:g}\" fill=\"white\"/>\n",
      size, height);
  for (std::size_t k = 0; k < cameras.size(); ++k) {
    out += field_of(cameras[k], paper, colours[k % std::size(colours)]);
  }
  if (room) out += rectangle(paper, room->x, room->y, "#999");
  out += rectangle(paper, stage.width, stage.depth, "black");
  out += fmt::format(
      "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{:g} x {:g} x {:g} m</text>\n"
      "<text x=\"12\" y=\"20\" fill=\"#666\">from above; x to the right, z downwards</text>\n",
      paper.x(0.0), paper.y(0.0), stage.width, stage.depth, stage.height);
  for (std::size_t k = 0; k < cameras.size(); ++k) {
    out += label_of(cameras[k], paper, colours[k % std::size(colours)]);
  }
  double y = size + line;
  for (std::size_t at = 0; at < text.size(); y += line) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    out += fmt::format("<text x=\"24\" y=\"{:.1f}\" xml:space=\"preserve\">{}</text>\n", y,
                       escaped(text.substr(at, end - at)));
    at = end + 1;
  }
  return out + "</svg>\n";
}

}  // namespace polyhull
