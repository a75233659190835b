// SPDX-License-Identifier: LGPL-2.1-or-later
// Real boards: a stereo pair of cameras, and a board on the floor of a room with four.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <sstream>

#include "studio/calibration/calibrate.h"
#include "studio/calibration/find_board.h"

namespace polyhull::calibration {
namespace {

std::filesystem::path data(const std::string& name) {
  const char* folder = std::getenv("POLYHULL_DATA");
  return std::filesystem::path(folder ? folder : "") / name;
}

// Debian's cv::FileStorage would do, too; of the stored pair only the distance is wanted.
double stored_baseline(const std::filesystem::path& path) {
  std::ifstream in(path);
  std::stringstream all;
  all << in.rdbuf();
  std::string text = all.str();
  text = text.substr(text.find("\nT: "));
  text = text.substr(text.find('[') + 1);
  for (char& c : text)
    if (c == ',') c = ' ';
  std::istringstream numbers(text);
  Vec3 t;
  numbers >> t.x >> t.y >> t.z;
  return 1e-3 * glm::length(t);
}

TEST(RealBoards, StereoPair) {
  const std::filesystem::path folder = data("stereo_chessboard_ir");
  if (!std::filesystem::exists(folder / "left01.jpg"))
    GTEST_SKIP() << "the real pictures of " << folder << " are missing";
  const Target target{{9, 6, 0.024}, 0.75, ""};
  const BoardFinder finder(target);
  Take take;
  take.board = target.board;
  take.cameras = {{"left", 640, 512, {}}, {"right", 640, 512, {}}};
  for (int i = 1; i <= 25; ++i) {
    take.instants.push_back(fmt::format("{:02}", i));
    for (std::size_t c = 0; c < 2; ++c) {
      const auto file = folder / fmt::format("{}{:02}.jpg", take.cameras[c].name, i);
      auto view = finder.find(load_picture(file.string(), 1));
      if (!view) continue;
      view->camera = c;
      view->instant = take.instants.size() - 1;
      take.views.push_back(*view);
    }
  }
  const Calibration found = calibrate(take, {});
  std::vector<int> pairs(25, 0);
  double sum = 0.0, count = 0.0;
  for (std::size_t v = 0; v < found.take.views.size(); ++v) {
    const ViewFit& fit = found.adjusted.views[v];
    pairs[found.take.views[v].instant] += fit.used;
    // All corners of the views, none left out.
    for (const Vec2& r : fit.residuals) sum += fit.used ? glm::dot(r, r) : 0.0;
    count += fit.used ? static_cast<double>(fit.residuals.size()) : 0.0;
  }
  const double rms = std::sqrt(sum / count);
  const double baseline =
      glm::length(found.rig.cameras[0].centre() - found.rig.cameras[1].centre());
  std::printf("rms %.3f px, %zd pairs, baseline %.3f mm\n", rms,
              std::count(pairs.begin(), pairs.end(), 2), 1e3 * baseline);
  EXPECT_LE(rms, 0.25);
  EXPECT_GE(std::count(pairs.begin(), pairs.end(), 2), 24);
  EXPECT_NEAR(baseline / stored_baseline(folder / "extrinsics.yml"), 1.0, 0.005);
  EXPECT_EQ(found.faults({}), std::vector<std::string>{});
}

// One line of calibration_resolved.txt: name, K, distortion, R, t.
Camera read_camera(const std::filesystem::path& path, int index) {
  std::ifstream in(path);
  std::string line;
  for (int i = -1; i < index && std::getline(in, line);) i += !line.empty() && line[0] != '#';
  std::istringstream words(line);
  Camera camera;
  std::array<double, 9> K{}, R{};
  camera.distortion.resize(5);
  words >> camera.name;
  for (double& x : K) words >> x;
  for (double& x : camera.distortion) words >> x;
  for (double& x : R) words >> x;
  words >> camera.t.x >> camera.t.y >> camera.t.z;
  camera.K = from_rows(K);
  camera.R = from_rows(R);
  camera.width = 644;
  camera.height = 486;
  return camera;
}

// The corners near where a camera that stands in the board's frame sees them.
View guided_view(const cv::Mat& grey, const Board& board, const Camera& camera) {
  std::vector<cv::Point2f> corners;
  View view;
  for (int i = 0; i < board.count(); ++i) {
    const auto pixel = camera.project(1e3 * board.corner(i));
    if (!pixel) continue;
    view.ids.push_back(i);
    corners.emplace_back(static_cast<float>(pixel->x), static_cast<float>(pixel->y));
  }
  cv::cornerSubPix(grey, corners, {2, 2}, {-1, -1}, {cv::TermCriteria::COUNT, 60, 0.0});
  for (const cv::Point2f& p : corners) view.corners.emplace_back(p.x, p.y);
  return view;
}

TEST(RealBoards, FloorOfARoom) {
  const std::filesystem::path folder = data("utrecht_voxel");
  if (!std::filesystem::exists(folder / "calibration_resolved.txt"))
    GTEST_SKIP() << "the real pictures of " << folder << " are missing";
  const Target target{{8, 6, 0.115}, 0.75, ""};
  constexpr double bars[] = {0.97, 0.40, 0.32, 1.64};
  for (int c = 0; c < 4; ++c) {
    cv::VideoCapture video((folder / fmt::format("cam{}/checkerboard.avi", c + 1)).string());
    cv::Mat frame, grey;
    if (!video.read(frame)) GTEST_SKIP() << "the video of camera " << c + 1 << " cannot be read";
    cv::cvtColor(frame, grey, cv::COLOR_BGR2GRAY);
    const Picture picture{grey.cols, grey.rows, 1, std::vector(grey.datastart, grey.dataend)};
    auto view = BoardFinder(target).find(picture, true);
    const Camera known = read_camera(folder / "calibration_resolved.txt", c);
    // The last camera's board OpenCV does not find: its corners are looked for where they must be.
    if (c == 3 && !view) view = guided_view(grey, target.board, known);
    ASSERT_TRUE(view) << "camera " << c + 1;
    Take take;
    take.board = target.board;
    take.instants = {"floor"};
    take.cameras = {{known.name, known.width, known.height, known}};
    take.views = {*view};
    const Calibration found = calibrate(take, {});
    std::printf("%s: %.3f px\n", known.name.c_str(), found.cameras[0].rms);
    EXPECT_LE(found.cameras[0].rms, bars[c]);
    EXPECT_TRUE(found.adjusted.views[0].used);
  }
}

}  // namespace
}  // namespace polyhull::calibration
