// SPDX-License-Identifier: LGPL-2.1-or-later
// A second opinion: COLMAP's bundle adjustment of the same corners, of which it does not know that
// they lie on boards, from poses and points that were shaken before.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <sstream>

#include "base/thread_pool.h"
#include "rig/export.h"
#include "rig/import.h"
#include "support/calibration_takes.h"
#include "support/folder.h"
#include "text_file.h"

namespace polyhull::calibration {
namespace {

// The take with the corners that are found in rendered pictures.
Take found_in_pictures(const TrueTake& truth) {
  const BoardFinder finder({truth.take.board, 0.75, ""});
  const Picture drawing = finder.draw(60);
  Take take = truth.take;
  parallel_for(take.views.size(), 1, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      View& view = take.views[v];
      const auto found = finder.find(render_board(drawing, take.board, truth.boards[view.instant],
                                                  truth.cameras[view.camera]));
      view.ids = found ? found->ids : std::vector<int>{};
      view.corners = found ? found->corners : std::vector<Vec2>{};
    }
  });
  std::erase_if(take.views, [](const View& view) { return view.ids.empty(); });
  return take;
}

// A corner at an instant, which every board puts elsewhere, and in which pictures it is.
struct Point {
  Vec3 place{0.0};
  std::vector<std::pair<std::size_t, Vec2>> seen;  // camera, pixel
};

// Those that two cameras or more saw.
std::vector<Point> points_of(const Calibration& calibration) {
  std::map<std::pair<std::size_t, int>, Point> all;
  for (std::size_t v = 0; v < calibration.take.views.size(); ++v) {
    const View& view = calibration.take.views[v];
    if (!calibration.adjusted.views[v].used) continue;
    for (std::size_t i = 0; i < view.ids.size(); ++i) {
      Point& point = all[{view.instant, view.ids[i]}];
      point.place =
          calibration.adjusted.boards[view.instant](calibration.take.board.corner(view.ids[i]));
      point.seen.emplace_back(view.camera, view.corners[i]);
    }
  }
  std::vector<Point> points;
  for (const auto& [key, point] : all)
    if (point.seen.size() > 1) points.push_back(point);
  return points;
}

void shake(std::vector<Camera>& cameras, std::vector<Point>& points) {
  std::mt19937 random(7);
  std::normal_distribution<double> gauss(0.0, 1.0);
  const auto by = [&](double size) {
    const double x = gauss(random), y = gauss(random), z = gauss(random);
    return size * Vec3(x, y, z);
  };
  for (Camera& camera : cameras) {
    const Vec3 turn = by(0.005);
    const Mat3 R = from_parameters(std::array{turn.x, turn.y, turn.z, 0.0, 0.0, 0.0}.data()).R;
    camera.t = R * camera.t + by(0.02);
    camera.R = R * camera.R;
  }
  for (Point& point : points) point.place += by(0.02);
}

// COLMAP's text model with points; its pixels count from the corner of the first one.
void write_model(const std::vector<Camera>& cameras, const std::vector<Point>& points,
                 const std::string& folder) {
  Rig rig;
  rig.cameras = cameras;
  exported::colmap(rig, folder);
  std::vector<std::string> pixels(cameras.size());
  std::vector<std::size_t> count(cameras.size(), 0);
  std::string text;
  for (std::size_t p = 0; p < points.size(); ++p) {
    const Vec3& place = points[p].place;
    text += fmt::format("{} {} {} {} 128 128 128 0", p + 1, place.x, place.y, place.z);
    for (const auto& [camera, pixel] : points[p].seen) {
      text += fmt::format(" {} {}", camera + 1, count[camera]++);
      pixels[camera] += fmt::format("{} {} {} ", pixel.x + 0.5, pixel.y + 0.5, p + 1);
    }
    text += "\n";
  }
  write_text(text, folder + "/points3D.txt");
  std::istringstream images(read_text(folder + "/images.txt"));
  std::string with_points, line;
  std::size_t camera = 0;
  while (std::getline(images, line)) with_points += (line.empty() ? pixels[camera++] : line) + "\n";
  write_text(with_points, folder + "/images.txt");
}

// What COLMAP makes of it, in the order of \p cameras; its scale is free and becomes theirs.
std::vector<Camera> adjusted_by_colmap(const std::vector<Camera>& cameras,
                                       const std::string& folder) {
  std::filesystem::create_directories(folder + "/out");
  const std::string command = fmt::format(
      "colmap bundle_adjuster --input_path {0} --output_path {0}/out "
      "--BundleAdjustment.max_num_iterations 200 --BundleAdjustment.refine_focal_length 0 "
      "--BundleAdjustment.refine_extra_params 0 >{0}/log 2>&1 && colmap model_converter "
      "--input_path {0}/out --output_path {0}/out --output_type TXT >>{0}/log 2>&1",
      folder);
  if (std::system(command.c_str()) != 0) {
    ADD_FAILURE() << read_text(folder + "/log");
    return cameras;
  }
  const Rig rig = import::colmap(folder + "/out", {});
  std::vector<Camera> found;
  Vec3 our_middle(0.0), middle(0.0);
  const double n = static_cast<double>(cameras.size());
  for (const Camera& camera : cameras) {
    found.push_back(*rig.find(camera.name));
    our_middle += camera.centre() / n;
    middle += found.back().centre() / n;
  }
  double ours = 0.0, theirs = 0.0;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    ours += glm::dot(cameras[c].centre() - our_middle, cameras[c].centre() - our_middle);
    theirs += glm::dot(found[c].centre() - middle, found[c].centre() - middle);
  }
  for (Camera& camera : found) camera.t *= std::sqrt(ours / theirs);
  return found;
}

TEST(Colmap, FindsTheSamePoses) {
  if (std::system("command -v colmap >/dev/null 2>&1") != 0) GTEST_SKIP() << "there is no colmap";
  RingSettings settings;
  settings.cameras = 6;
  settings.instants = 90;
  settings.near_views = 8;
  settings.board = {7, 6, 0.12};
  settings.width = 960;
  settings.height = 540;
  const TrueTake truth = make_ring(settings);
  Settings four;
  four.model = LensModel::four;  // COLMAP's OPENCV
  const Calibration ours = calibrate(found_in_pictures(truth), four);
  std::vector<Camera> shaken = ours.rig.cameras;
  std::vector<Point> points = points_of(ours);
  ASSERT_GT(points.size(), 500u);
  shake(shaken, points);
  const test::Folder folder;
  write_model(shaken, points, folder.path);
  const std::vector<Camera> theirs = adjusted_by_colmap(ours.rig.cameras, folder.path);

  const auto apart = errors_of(ours.rig.cameras, theirs);
  const auto ours_off = errors_of(ours.rig.cameras, truth.cameras);
  const auto theirs_off = errors_of(theirs, truth.cameras);
  const auto print = [](const char* what, const CameraError& error) {
    std::printf("  %s %.3f mm, %.4f degrees", what, 1e3 * glm::length(error.centre),
                glm::degrees(glm::length(error.rotation)));
  };
  std::printf("%zu views, %zu points in two cameras or more, %.3f px rms\n", ours.take.views.size(),
              points.size(), ours.adjusted.rms);
  for (std::size_t c = 0; c < apart.size(); ++c) {
    std::printf("%s", truth.cameras[c].name.c_str());
    print("apart", apart[c]);
    print("from the truth: ours", ours_off[c]);
    print("COLMAP's", theirs_off[c]);
    std::printf("\n");
    EXPECT_LT(glm::length(apart[c].centre), 0.5e-3);
    EXPECT_LT(glm::degrees(glm::length(apart[c].rotation)), 0.01);
  }
  // What it started from was far off.
  double most = 0.0;
  for (const CameraError& error : errors_of(shaken, truth.cameras))
    most = std::max(most, glm::length(error.centre));
  EXPECT_GT(most, 0.01);
}

}  // namespace
}  // namespace polyhull::calibration
