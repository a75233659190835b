// SPDX-License-Identifier: LGPL-2.1-or-later
#include "calibrate/report.h"

#include <fmt/format.h>

#include <algorithm>

#include "calibrate/append.h"
#include "calibrate/plots.h"
#include "rig/floor.h"

namespace polyhull::calibrate_tool {
namespace {

using calibration::Calibration;
using calibration::CameraFit;

constexpr const char* style = R"(<style>
body{font:15px/1.4 sans-serif;margin:2em;max-width:1500px}table{border-collapse:collapse}
td,th{padding:2px 8px;text-align:right;border-bottom:1px solid #ddd;white-space:nowrap}
.good{background:#d8f3d8;padding:.6em}.bad{background:#fbdcd6;padding:.6em}
.views td{padding:0;border:1px solid #fff;min-width:9px;height:18px}.out{outline:2px solid #000;outline-offset:-2px}
figure{display:inline-block;margin:6px}canvas{background:#fafafa;touch-action:none}svg{margin:4px}
figcaption{font-size:12px}</style>)";

// The nth of the camera's numbers with its deviation.
std::string number(double value, double sigma, int digits) {
  return fmt::format("{:.{}f} ± {:.{}f}", value, digits, sigma, digits);
}

void add_cameras(std::string& out, const Calibration& calibration) {
  out +=
      "<h2>Cameras</h2><table><tr><th>camera<th>views<th>left out<th>rms, px<th>covered<th>fx, "
      "px<th>fy, px<th>cx, px<th>cy, px<th>k1<th>k2<th>p1<th>p2<th>k3<th>centre, m<th>centre ±, "
      "mm<th>rotation ±, °</tr>";
  for (std::size_t c = 0; c < calibration.cameras.size(); ++c) {
    const CameraFit& fit = calibration.cameras[c];
    const Camera& camera = calibration.rig.cameras[c];
    const auto& sigma = calibration.adjusted.uncertainties[c].lens;
    const Vec3 centre = camera.centre();
    append(out, "<tr><td>{}<td>{}<td>{}<td>{:.3f}<td>{:.0f} %<td>{}<td>{}<td>{}<td>{}",
           escaped(camera.name), fit.views, fit.left_out, fit.rms, 1e2 * fit.coverage,
           number(camera.K[0][0], sigma[0], 2), number(camera.K[1][1], sigma[1], 2),
           number(camera.K[2][0], sigma[2], 2), number(camera.K[2][1], sigma[3], 2));
    for (std::size_t i = 0; i < 5; ++i) {
      const bool has = i < camera.distortion.size();
      out += "<td>" + (has ? number(camera.distortion[i], sigma[4 + i], 4) : std::string("–"));
    }
    append(out, "<td>{:.4f} {:.4f} {:.4f}<td>{:.2f}<td>{:.4f}</tr>", centre.x, centre.y, centre.z,
           1e3 * fit.centre_sigma, fit.rotation_sigma);
  }
  out +=
      "</table><p>± is one standard deviation by the adjustment's covariances, of poses against "
      "the "
      "rig as a whole; rms is the root mean square distance between corners seen and computed.</p>";
}

void add_views(std::string& out, const Calibration& calibration) {
  const calibration::Take& take = calibration.take;
  std::vector<std::vector<std::string>> cells(
      take.cameras.size(), std::vector<std::string>(take.instants.size(), "<td>"));
  for (std::size_t v = 0; v < take.views.size(); ++v) {
    const auto& [camera, instant, ids, corners] = take.views[v];
    const calibration::ViewFit& fit = calibration.adjusted.views[v];
    cells[camera][instant] =
        fmt::format("<td{} style=\"background:{}\" title=\"{}, {}: {:.3f} px{}\">",
                    fit.used ? "" : " class=out", colour_of(fit.rms, calibration.adjusted.rms),
                    escaped(take.cameras[camera].name), escaped(take.instants[instant]), fit.rms,
                    fit.used ? "" : ", left out");
  }
  out +=
      "<h2>Views</h2><p>One row per camera, one column per instant; green: as good as the mean, "
      "red: "
      "three times as far off; framed: left out.</p><table class=views>";
  for (std::size_t c = 0; c < cells.size(); ++c) {
    out += "<tr><th>" + escaped(take.cameras[c].name);
    for (const std::string& cell : cells[c]) out += cell;
    out += "</tr>";
  }
  out += "</table>";
  std::string left_out;
  for (std::size_t v = 0; v < take.views.size(); ++v)
    if (!calibration.adjusted.views[v].used)
      append(left_out, "<li>{}, {}: {:.2f} px</li>",
             escaped(take.cameras[take.views[v].camera].name),
             escaped(take.instants[take.views[v].instant]), calibration.adjusted.views[v].rms);
  if (!left_out.empty()) out += "<p>Left out:</p><ul>" + left_out + "</ul>";
}

// The camera's best view and its two worst.
std::vector<std::size_t> shown_views(const Calibration& calibration, std::size_t c) {
  std::vector<std::size_t> own;
  for (std::size_t v = 0; v < calibration.take.views.size(); ++v)
    if (calibration.take.views[v].camera == c) own.push_back(v);
  std::ranges::stable_sort(own, std::greater{},
                           [&](std::size_t v) { return calibration.adjusted.views[v].rms; });
  if (own.size() > 3) own = {own[0], own[1], own.back()};
  return own;
}

}  // namespace

std::string report_page(const Calibration& calibration, const Pictures& pictures,
                        const std::vector<std::string>& faults) {
  std::string out = "<!doctype html><html lang=en><meta charset=utf-8><title>Calibration</title>";
  out += style;
  append(out, "<h1>Calibration of {} cameras</h1><div class={}>{}", calibration.cameras.size(),
         faults.empty() ? "good" : "bad", faults.empty() ? "Good." : "Not good:<ul>");
  for (const std::string& fault : faults) out += "<li>" + escaped(fault) + "</li>";
  append(
      out,
      "{}</div><p>{} views at {} instants; corners are {:.3f} px (root mean square) from where the "
      "model has them, which is a noise of {:.3f} px in each coordinate.{}</p>",
      faults.empty() ? "" : "</ul>", calibration.take.views.size(),
      calibration.take.instants.size(), calibration.adjusted.rms, calibration.adjusted.noise,
      calibration.take.board.square > 0.0
          ? fmt::format(" Squares of {:.3f} mm.", 1e3 * calibration.take.board.square)
          : "");
  add_cameras(out, calibration);
  out += "<h2>In space</h2><p>Drag to turn, wheel to zoom. Axes: x red, y green, z blue.</p>";
  out += scene_drawing(calibration);
  add_views(out, calibration);
  for (std::size_t c = 0; c < calibration.cameras.size(); ++c) {
    append(
        out,
        "<h2>{}</h2><p>Where corners were seen; their residuals (circle: the noise); the mean "
        "residual "
        "by place (a cell's width: the noise; red: more than chance), where a lens shows that the "
        "model "
        "does not fit.</p>{}{}{}<br>",
        escaped(calibration.take.cameras[c].name), coverage_plot(calibration, c),
        residual_cloud(calibration, c), residual_field(calibration, c));
    for (const std::size_t v : shown_views(calibration, c))
      out += view_picture(calibration, pictures, v);
  }
  return out + "</html>\n";
}

std::string no_floor_note(const Rig& rig, const std::string& options) {
  const Camera* camera = world_camera(rig);
  return fmt::format(
      "note: without {} the floor and what is up are unknown: the world is that of {}, and up is "
      "only "
      "how that camera is held. `polyhull-rig level` puts both into the rig file.\n",
      options, camera ? "'" + camera->name + "'" : "one camera");
}

std::string report_table(const Calibration& calibration) {
  std::string out = fmt::format("{:12} {:>5} {:>8} {:>7} {:>7} {:>19} {:>25} {:>9} {:>10}\n",
                                "camera", "views", "left out", "rms px", "covered",
                                "focal length px", "centre m", "± mm", "rotation ±");
  for (std::size_t c = 0; c < calibration.cameras.size(); ++c) {
    const CameraFit& fit = calibration.cameras[c];
    const Camera& camera = calibration.rig.cameras[c];
    const Vec3 p = camera.centre();
    append(out, "{:12} {:5} {:8} {:7.3f} {:6.0f}% {:>19} {:>25} {:9.3f} {:9.4f}°\n", camera.name,
           fit.views, fit.left_out, fit.rms, 1e2 * fit.coverage,
           number(camera.K[0][0], calibration.adjusted.uncertainties[c].lens[0], 2),
           fmt::format("{:.4f} {:.4f} {:.4f}", p.x, p.y, p.z), 1e3 * fit.centre_sigma,
           fit.rotation_sigma);
  }
  return out;
}

}  // namespace polyhull::calibrate_tool
