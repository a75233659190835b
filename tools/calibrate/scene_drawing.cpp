// SPDX-License-Identifier: LGPL-2.1-or-later
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "calibrate/plots.h"

namespace polyhull::calibrate_tool {
namespace {

nlohmann::json array_of(const Vec3& p) {
  return {p.x, p.y, p.z};
}

// Turns and draws; the scene stands in `scene`.
constexpr const char* script = R"(
const canvas = document.getElementById('scene'), pen = canvas.getContext('2d');
let turn = .6, lean = .5, zoom = 1;
const up = scene.up, side = Math.abs(up[1]) > .5 ? [1, 0, 0] : [0, 1, 0];
const cross = (a, b) => [a[1]*b[2]-a[2]*b[1], a[2]*b[0]-a[0]*b[2], a[0]*b[1]-a[1]*b[0]];
const dot = (a, b) => a[0]*b[0] + a[1]*b[1] + a[2]*b[2];
const front = cross(side, up);
function place(p) {
  const d = p.map((x, i) => x - scene.middle[i]);
  const x = dot(d, side), y = dot(d, up), z = dot(d, front);
  const u = x * Math.cos(turn) + z * Math.sin(turn), w = z * Math.cos(turn) - x * Math.sin(turn);
  const v = y * Math.cos(lean) - w * Math.sin(lean);
  const s = zoom * canvas.height * .42 / scene.radius;
  return [canvas.width / 2 + s * u, canvas.height / 2 - s * v];
}
function line(points, colour, closed) {
  pen.strokeStyle = colour; pen.beginPath();
  points.forEach((p, i) => { const q = place(p); i ? pen.lineTo(...q) : pen.moveTo(...q); });
  if (closed) pen.closePath();
  pen.stroke();
}
function draw() {
  pen.clearRect(0, 0, canvas.width, canvas.height);
  scene.boards.forEach(b => line(b, 'rgba(40,110,170,.35)', true));
  if (scene.floor) for (let i = -4; i <= 4; ++i) {
    const r = scene.radius, k = i * r / 4;
    line([[k, 0, -r], [k, 0, r]], '#ddd'); line([[-r, 0, k], [r, 0, k]], '#ddd');
  }
  scene.cameras.forEach(c => {
    line(c.corners, '#b03020', true);
    c.corners.forEach(p => line([c.centre, p], '#b03020'));
    pen.fillStyle = '#000'; const q = place(c.centre); pen.fillText(c.name, q[0] + 6, q[1] - 6);
  });
  [['#d00', 0], ['#090', 1], ['#00d', 2]].forEach(([colour, i]) => {
    const end = [0, 0, 0]; end[i] = scene.radius / 6; pen.lineWidth = 2;
    line([[0, 0, 0], end], colour); pen.lineWidth = 1;
  });
}
canvas.onpointermove = e => { if (!e.buttons) return; turn += e.movementX / 150;
  lean = Math.max(-1.57, Math.min(1.57, lean + e.movementY / 150)); draw(); };
canvas.onwheel = e => { zoom *= Math.exp(-e.deltaY / 800); e.preventDefault(); draw(); };
draw();
)";

}  // namespace

std::string scene_drawing(const calibration::Calibration& calibration) {
  const calibration::Take& take = calibration.take;
  nlohmann::json scene;
  std::vector<bool> used(take.instants.size(), false);
  for (std::size_t v = 0; v < take.views.size(); ++v)
    if (calibration.adjusted.views[v].used) used[take.views[v].instant] = true;
  std::vector<Vec3> points;
  scene["boards"] = nlohmann::json::array();
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (!used[i]) continue;
    const int last = take.board.count() - 1, columns = take.board.columns;
    auto outline = nlohmann::json::array();
    for (const int id : {0, columns - 1, last, last - columns + 1}) {
      points.push_back(calibration.adjusted.boards[i](take.board.corner(id)));
      outline.push_back(array_of(points.back()));
    }
    scene["boards"].push_back(outline);
  }
  for (const Camera& camera : calibration.rig.cameras) points.push_back(camera.centre());
  Vec3 middle(0.0);
  for (const Vec3& p : points) middle += p / static_cast<double>(points.size());
  double radius = 1e-3;
  for (const Vec3& p : points) radius = std::max(radius, glm::length(p - middle));
  for (const Camera& camera : calibration.rig.cameras) {
    auto corners = nlohmann::json::array();
    for (const Vec2& pixel : {Vec2(0, 0), Vec2(camera.width, 0), Vec2(camera.width, camera.height),
                              Vec2(0, camera.height)})
      corners.push_back(array_of(camera.centre() + 0.08 * radius * camera.ray(pixel)));
    scene["cameras"].push_back(
        {{"name", camera.name}, {"centre", array_of(camera.centre())}, {"corners", corners}});
  }
  scene["middle"] = array_of(middle);
  scene["radius"] = radius;
  scene["up"] = array_of(calibration.rig.up);
  scene["floor"] = calibration.rig.up.y > 0.5;
  std::string text = scene.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  // No name may end the script, or begin a comment in it.
  for (std::size_t at = 0; (at = text.find('<', at)) != std::string::npos; at += 6)
    text.replace(at, 1, "\\u003c");
  return "<canvas id=\"scene\" width=\"900\" height=\"560\"></canvas><script>const scene=" + text +
         ";" + script + "</script>";
}

}  // namespace polyhull::calibrate_tool
