// SPDX-License-Identifier: LGPL-2.1-or-later
#include "report/sheet.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "base/thread_pool.h"
#include "report/hull_caster.h"

namespace polyhull::report {
namespace {

constexpr int drawing_shift = 4;  // OpenCV draws with 1/16 pixel

cv::Point drawing_point(const Vec2& p) {
  constexpr double scale = 1 << drawing_shift;
  return {static_cast<int>(std::lround(std::clamp(p.x, -1e4, 1e4) * scale)),
          static_cast<int>(std::lround(std::clamp(p.y, -1e4, 1e4) * scale))};
}

cv::Mat as_mat(const Picture& picture) {
  cv::Mat view(picture.height, picture.width, CV_8UC(picture.channels),
               const_cast<std::uint8_t*>(picture.pixels.data()));
  cv::Mat rgb;
  if (picture.channels == 4)
    cv::cvtColor(view, rgb, cv::COLOR_RGBA2RGB);
  else if (picture.channels == 1)
    cv::cvtColor(view, rgb, cv::COLOR_GRAY2RGB);
  else
    rgb = view.clone();
  return rgb;
}

// The pixels of a view in their place in the full frame; what was not sent is dark.
cv::Mat camera_picture(const View& view) {
  cv::Mat frame(view.height, view.width, CV_8UC3, cv::Scalar(24, 24, 24));
  if (view.roi.empty() || view.pixels.empty()) return frame;
  const int type = view.format == PixelFormat::rgba ? CV_8UC4 : CV_8UC1;
  const cv::Mat roi(view.roi.height, view.roi.width, type,
                    const_cast<std::uint8_t*>(view.pixels.data()),
                    static_cast<std::size_t>(view.stride));
  cv::Mat rgb;
  cv::cvtColor(roi, rgb, type == CV_8UC4 ? cv::COLOR_RGBA2RGB : cv::COLOR_GRAY2RGB);
  rgb.copyTo(frame(cv::Rect(view.roi.x, view.roi.y, view.roi.width, view.roi.height)));
  return frame;
}

cv::Mat matte_picture(const View& view) {
  cv::Mat frame(view.height, view.width, CV_8UC3, cv::Scalar(0, 0, 0));
  if (view.roi.empty() || view.pixels.empty()) return frame;
  const int step = view.format == PixelFormat::rgba ? 4 : 1;
  for (int y = 0; y < view.roi.height; ++y) {
    const std::uint8_t* row = view.pixels.data() + static_cast<std::size_t>(y) * view.stride;
    auto* out = frame.ptr<cv::Vec3b>(view.roi.y + y) + view.roi.x;
    for (int x = 0; x < view.roi.width; ++x) {
      const std::uint8_t alpha = row[step * x + step - 1];
      out[x] = {alpha, alpha, alpha};
    }
  }
  return frame;
}

cv::Mat contour_picture(const View& view) {
  cv::Mat frame = camera_picture(view) * 0.45;
  for (std::size_t i = 0; i < view.contours.size(); ++i) {
    std::vector<cv::Point> ring;
    for (const Vec2f& p : view.contours.ring(i)) ring.push_back(drawing_point(p));
    cv::polylines(frame, ring, true, cv::Scalar(255, 210, 60), 2, cv::LINE_AA, drawing_shift);
    for (const cv::Point& p : ring) {
      cv::circle(frame, p, 2 << drawing_shift, cv::Scalar(255, 255, 255), cv::FILLED, cv::LINE_AA,
                 drawing_shift);
    }
  }
  return frame;
}

// The hull's polygons, hidden lines removed by shading the hull first and testing each edge's
// middle.
cv::Mat wire_picture(const Mesh& mesh, const HullCaster& caster, const Camera& camera) {
  cv::Mat frame(camera.height, camera.width, CV_8UC3, cv::Scalar(32, 34, 40));
  const HitPicture hits = caster.cast(camera);
  const Vec3 eye = camera.centre();
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const RayHit& hit = hits.at(x, y);
      if (!hit.hit()) continue;
      const Vec3 to_eye = glm::normalize(eye - caster.position(hit));
      const double shade =
          45.0 + 75.0 * std::abs(glm::dot(to_eye, glm::normalize(Vec3(hit.normal))));
      frame.at<cv::Vec3b>(y, x) = cv::Vec3b::all(static_cast<std::uint8_t>(shade));
    }
  }
  const Hull& hull = mesh.hull;
  for (std::size_t k = 0; k < hull.loop_ends.size(); ++k) {
    const std::uint32_t begin = k == 0 ? 0 : hull.loop_ends[k - 1];
    for (std::uint32_t i = begin; i < hull.loop_ends[k]; ++i) {
      const std::uint32_t next = i + 1 == hull.loop_ends[k] ? begin : i + 1;
      const std::uint32_t from = hull.loop_vertices[i], to = hull.loop_vertices[next];
      if (from > to) continue;  // each edge belongs to two faces
      const Vec3 a = hull.origin + Vec3(hull.vertices[from]);
      const Vec3 b = hull.origin + Vec3(hull.vertices[to]);
      const Vec3 middle = 0.5 * (a + b);
      if (caster.blocked(eye, middle + 0.004 * (eye - middle))) continue;
      const auto pa = camera.project(a), pb = camera.project(b);
      if (!pa || !pb) continue;
      cv::line(frame, drawing_point(*pa), drawing_point(*pb), cv::Scalar(120, 220, 255), 1,
               cv::LINE_AA, drawing_shift);
    }
  }
  return frame;
}

// Bilinear colour of a view at a real pixel; false where it was not sent or is not foreground.
bool sample(const View& view, const Vec2& pixel, Vec3& colour) {
  if (view.format != PixelFormat::rgba || view.pixels.empty()) return false;
  const double x = pixel.x - view.roi.x, y = pixel.y - view.roi.y;
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  if (x0 < 0 || y0 < 0 || x0 + 1 >= view.roi.width || y0 + 1 >= view.roi.height) return false;
  const double fx = x - x0, fy = y - y0;
  colour = Vec3(0.0);
  double weight = 0.0;
  for (int dy = 0; dy < 2; ++dy) {
    for (int dx = 0; dx < 2; ++dx) {
      const std::uint8_t* p =
          view.pixels.data() + static_cast<std::size_t>(y0 + dy) * view.stride + 4 * (x0 + dx);
      const double w = (dx ? fx : 1 - fx) * (dy ? fy : 1 - fy) * p[3];
      colour += w * Vec3(p[0], p[1], p[2]);
      weight += w;
    }
  }
  if (weight < 64.0) return false;
  colour /= weight;
  return true;
}

// Cameras nearer to the surface normal count more (power 4), occluded ones not at all.
Vec3 surface_colour(const Mesh& mesh, const HullCaster& caster, const RayHit& hit) {
  const Vec3 position = caster.position(hit);
  const Vec3 normal = glm::normalize(Vec3(hit.normal));
  Vec3 sum(0.0);
  double total = 0.0;
  for (const MeshView& view : mesh.views) {
    const Vec3 to_camera = view.calibration.centre() - position;
    const double cosine = glm::dot(normal, to_camera) / glm::length(to_camera);
    if (cosine <= 0.05) continue;
    Vec3 colour;
    const auto pixel = view.calibration.project(position);
    if (!pixel || !sample(view.view, *pixel, colour)) continue;
    if (caster.blocked(position + 0.004 * to_camera, view.calibration.centre())) continue;
    const double weight = std::pow(cosine, 4.0);
    sum += weight * colour;
    total += weight;
  }
  return total > 0.0 ? sum / total : Vec3(128.0);
}

cv::Mat textured_picture(const Mesh& mesh, const HullCaster& caster, const Camera& camera) {
  cv::Mat frame(camera.height, camera.width, CV_8UC3, cv::Scalar(32, 34, 40));
  const HitPicture hits = caster.cast(camera);
  parallel_each(camera.height, 16, 0, [&](int y) {
    for (int x = 0; x < camera.width; ++x) {
      if (!hits.at(x, y).hit()) continue;
      const Vec3 colour = surface_colour(mesh, caster, hits.at(x, y));
      frame.at<cv::Vec3b>(y, x) = {static_cast<std::uint8_t>(colour.x),
                                   static_cast<std::uint8_t>(colour.y),
                                   static_cast<std::uint8_t>(colour.z)};
    }
  });
  return frame;
}

Vec3 hull_centre(const Hull& hull) {
  Vec3f low(INFINITY), high(-INFINITY);
  for (const Vec3f& v : hull.vertices) {
    low = glm::min(low, v);
    high = glm::max(high, v);
  }
  return hull.empty() ? hull.origin : hull.origin + 0.5 * Vec3(low + high);
}

// The camera turned by \p degrees around the upright axis through \p centre, without distortion.
Camera beside(const Camera& camera, const Vec3& centre, const Vec3& up, double degrees) {
  const double angle = glm::radians(degrees);
  const Vec3 axis = glm::normalize(up);
  auto turn = [&](const Vec3& v) {
    return v * std::cos(angle) + glm::cross(axis, v) * std::sin(angle) +
           axis * glm::dot(axis, v) * (1.0 - std::cos(angle));
  };
  const Mat3 axes = glm::transpose(camera.R);
  Camera turned = camera;
  turned.distortion.clear();
  turned.R = glm::transpose(Mat3(turn(axes[0]), turn(axes[1]), turn(axes[2])));
  turned.t = -(turned.R * (centre + turn(camera.centre() - centre)));
  return turned;
}

// The part of a frame to show: \p subject and some room around it, in the tile's shape.
cv::Rect cropped(cv::Rect subject, const cv::Size& tile, const cv::Size& frame) {
  if (subject.empty()) return {0, 0, frame.width, frame.height};
  const double aspect = static_cast<double>(tile.width) / tile.height;
  double height = 1.15 * std::max<double>(subject.height, subject.width / aspect);
  height = std::min({height, static_cast<double>(frame.height), frame.width / aspect});
  const int h = std::max(2, static_cast<int>(height));
  const int w = std::max(2, static_cast<int>(height * aspect));
  const int x = std::clamp(subject.x + (subject.width - w) / 2, 0, std::max(0, frame.width - w));
  const int y = std::clamp(subject.y + (subject.height - h) / 2, 0, std::max(0, frame.height - h));
  return cv::Rect(x, y, w, h) & cv::Rect(0, 0, frame.width, frame.height);
}

cv::Rect around(const Rings& rings) {
  std::vector<cv::Point> points;
  for (const Vec2f& p : rings.points) points.emplace_back(cvRound(p.x), cvRound(p.y));
  return points.empty() ? cv::Rect() : cv::boundingRect(points);
}

cv::Rect around(const HullCaster& caster, const Camera& camera) {
  const HitPicture hits = caster.cast(camera);
  std::vector<cv::Point> points;
  for (int y = 0; y < hits.height; ++y) {
    for (int x = 0; x < hits.width; ++x)
      if (hits.at(x, y).hit()) points.emplace_back(x, y);
  }
  return points.empty() ? cv::Rect() : cv::boundingRect(points);
}

void place(cv::Mat& sheet, const cv::Mat& tile, const cv::Rect& where, const std::string& label) {
  cv::Mat scaled;
  cv::resize(tile, scaled, where.size(), 0, 0, cv::INTER_AREA);
  scaled.copyTo(sheet(where));
  const cv::Point at(where.x + 8, where.y + 20);
  cv::putText(sheet, label, at, cv::FONT_HERSHEY_SIMPLEX, 0.5, cv::Scalar(0, 0, 0), 3, cv::LINE_AA);
  cv::putText(sheet, label, at, cv::FONT_HERSHEY_SIMPLEX, 0.5, cv::Scalar(255, 255, 255), 1,
              cv::LINE_AA);
}

Picture as_picture(const cv::Mat& mat) {
  Picture picture{mat.cols, mat.rows, 3, {}};
  picture.pixels.assign(mat.datastart, mat.dataend);
  return picture;
}

}  // namespace

Picture draw_sheet(const Mesh& mesh, const SheetSettings& settings) {
  constexpr int gap = 4;
  constexpr double beside_degrees = 25.0;
  const int columns = std::clamp(settings.columns, 1, std::max<int>(1, mesh.views.size()));
  const int tile_width = settings.tile_width;
  int tile_height = 0;
  for (const MeshView& view : mesh.views) {
    tile_height =
        std::max(tile_height, tile_width * view.view.height / std::max(1, view.view.width));
  }
  const int width = columns * tile_width + (columns - 1) * gap;
  const int composite_columns = std::min<int>(2, settings.composites.size());
  const int composite_width =
      composite_columns ? (width - (composite_columns - 1) * gap) / composite_columns : 0;
  int height = mesh.views.empty() ? 0 : 5 * (tile_height + gap);
  std::vector<cv::Rect> composite_places;
  for (std::size_t i = 0; i < settings.composites.size(); ++i) {
    const Picture& picture = settings.composites[i];
    const int h = composite_width * picture.height / std::max(1, picture.width);
    const int column = static_cast<int>(i) % composite_columns;
    composite_places.emplace_back(column * (composite_width + gap), height, composite_width, h);
    if (column == composite_columns - 1 || i + 1 == settings.composites.size()) height += h + gap;
  }
  cv::Mat sheet(std::max(height - gap, 1), width, CV_8UC3, cv::Scalar(12, 12, 12));

  const HullCaster caster(mesh.hull);
  const Vec3 centre = hull_centre(mesh.hull);
  for (int column = 0; column < columns && !mesh.views.empty(); ++column) {
    const MeshView& view =
        mesh.views[static_cast<std::size_t>(column) * mesh.views.size() / columns];
    const Camera novel = beside(view.calibration, centre, mesh.up, beside_degrees);
    const std::string& name = view.calibration.name;
    const cv::Size tile(tile_width, tile_height);
    const cv::Size frame(view.view.width, view.view.height);
    const cv::Rect seen = cropped(around(view.view.contours), tile, frame);
    const cv::Rect turned = cropped(around(caster, novel), tile, frame);
    auto put = [&](int row, const cv::Mat& picture, const cv::Rect& part,
                   const std::string& label) {
      const cv::Rect where(column * (tile_width + gap), row * (tile_height + gap), tile_width,
                           tile_height);
      place(sheet, picture(part), where, label);
    };
    put(0, camera_picture(view.view), seen, name + ": picture sent");
    put(1, matte_picture(view.view), seen, name + ": matte");
    put(2, contour_picture(view.view), seen,
        name + ": " + std::to_string(view.view.contours.points.size()) + " contour vertices");
    put(3, wire_picture(mesh, caster, novel), turned, "hull, 25 degrees beside " + name);
    put(4, textured_picture(mesh, caster, novel), turned, "textured, 25 degrees beside " + name);
  }
  for (std::size_t i = 0; i < settings.composites.size(); ++i)
    place(sheet, as_mat(settings.composites[i]), composite_places[i], "composite");
  return as_picture(sheet);
}

}  // namespace polyhull::report
