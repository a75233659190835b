// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/calibration/lens_start.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>

#include "base/error.h"
#include "base/median.h"
#include "rig/lens.h"

namespace polyhull::calibration {
namespace {

// More views make the start slower, not better: the adjustment takes all of them.
constexpr std::size_t most_views = 20;

std::vector<cv::Point3f> board_points(const Board& board, const View& view) {
  std::vector<cv::Point3f> out;
  for (const int id : view.ids) {
    const Vec3 x = board.corner(id);
    out.emplace_back(static_cast<float>(x.x), static_cast<float>(x.y), 0.0f);
  }
  return out;
}

std::vector<cv::Point2f> picture_points(const View& view) {
  std::vector<cv::Point2f> out;
  for (const Vec2& p : view.corners)
    out.emplace_back(static_cast<float>(p.x), static_cast<float>(p.y));
  return out;
}

cv::Mat matrix_of(const Camera& camera) {
  const auto k = to_rows(camera.K);
  return (cv::Mat_<double>(3, 3) << k[0], k[1], k[2], k[3], k[4], k[5], k[6], k[7], k[8]);
}

Pose pose_of(const cv::Mat& rotation, const cv::Mat& translation) {
  double parameters[6];
  for (int i = 0; i < 3; ++i) {
    parameters[i] = rotation.at<double>(i);
    parameters[3 + i] = translation.at<double>(i);
  }
  return from_parameters(parameters);
}

// At most `most_views` of the numbered views, evenly.
std::vector<std::size_t> some_of(const std::vector<std::size_t>& all) {
  if (all.size() <= most_views) return all;
  std::vector<std::size_t> some;
  for (std::size_t i = 0; i < most_views; ++i) some.push_back(all[i * all.size() / most_views]);
  return some;
}

struct Zhang {
  Camera camera;
  double focal_sigma = 0.0;  // of the focal length, as a part of it
};

Zhang calibrate(const Take& take, std::size_t c, const std::vector<View>& views,
                const std::vector<std::size_t>& chosen, LensModel model) {
  const TakeCamera& given = take.cameras[c];
  std::vector<std::vector<cv::Point3f>> boards;
  std::vector<std::vector<cv::Point2f>> pictures;
  for (const std::size_t v : chosen) {
    boards.push_back(board_points(take.board, views[v]));
    pictures.push_back(picture_points(views[v]));
  }
  int flags = 0;
  if (model == LensModel::pinhole)
    flags = cv::CALIB_ZERO_TANGENT_DIST | cv::CALIB_FIX_K1 | cv::CALIB_FIX_K2;
  if (model != LensModel::five) flags |= cv::CALIB_FIX_K3;
  cv::Mat K, distortion;
  std::vector<cv::Mat> rotations, translations;
  cv::Mat lens_sigma, pose_sigma, errors;
  try {
    cv::calibrateCamera(
        boards, pictures, cv::Size(given.width, given.height), K, distortion, rotations,
        translations, lens_sigma, pose_sigma, errors, flags,
        cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 30, 1e-6));
  } catch (const cv::Exception& error) {
    throw Error(Error::Kind::bad_input, "The views of camera '{}' do not determine its lens ({}).",
                given.name, error.err);
  }
  Zhang out;
  out.camera.name = given.name;
  out.camera.width = given.width;
  out.camera.height = given.height;
  std::array<double, 9> k{};
  for (int i = 0; i < 9; ++i) k[i] = K.at<double>(i / 3, i % 3);
  out.camera.K = from_rows(k);
  for (int i = 0; i < 5; ++i) out.camera.distortion.push_back(distortion.at<double>(i));
  out.focal_sigma = lens_sigma.at<double>(0) / k[0];
  if (!(k[0] > 0.0) || !(k[4] > 0.0) || !std::isfinite(k[0] + k[4]))
    out.focal_sigma = std::numeric_limits<double>::infinity();
  return out;
}

// Largest angle between two boards' normals, degrees.
double tilt(const std::vector<Pose>& poses, const std::vector<std::size_t>& chosen) {
  double least = 1.0;
  for (const std::size_t a : chosen)
    for (const std::size_t b : chosen)
      least = std::min(least, glm::dot(poses[a].R[2], poses[b].R[2]));
  return glm::degrees(std::acos(std::clamp(least, -1.0, 1.0)));
}

void place_boards(const Take& take, const std::vector<View>& views, LensStart& start) {
  start.poses.assign(views.size(), {});
  start.rms.assign(views.size(), 0.0);
  for (std::size_t v = 0; v < views.size(); ++v)
    start.poses[v] = board_pose(take.board, views[v], start.camera, &start.rms[v]);
}

[[noreturn]] void refuse_parallel(const std::string& camera) {
  throw Error(
      Error::Kind::bad_input,
      "The views of camera '{}' do not determine its focal length: the board stands parallel "
      "in all of them. Tilt it by 20 to 45 degrees, each time another way.",
      camera);
}

}  // namespace

double view_error(const Board& board, const View& view, const Camera& camera, const Pose& pose) {
  const Distortion lens(camera);
  double sum = 0.0;
  for (std::size_t i = 0; i < view.ids.size(); ++i) {
    const Vec3 x = pose(board.corner(view.ids[i]));
    if (!(x.z > 0.0)) return std::numeric_limits<double>::infinity();
    const Vec3 ideal = camera.K * (x / x.z);
    const Vec2 d = lens.distort(Vec2(ideal)) - view.corners[i];
    sum += glm::dot(d, d);
  }
  return std::sqrt(sum / static_cast<double>(view.ids.size()));
}

Pose board_pose(const Board& board, const View& view, const Camera& camera, double* rms) {
  const std::vector<cv::Point3f> points = board_points(board, view);
  const std::vector<cv::Point2f> pixels = picture_points(view);
  const cv::Mat K = matrix_of(camera);
  const cv::Mat distortion(camera.distortion, true);
  // A flat board seen from afar fits two poses nearly as well: both are refined, the better stays.
  std::vector<cv::Mat> rotations, translations;
  Pose best;
  *rms = std::numeric_limits<double>::infinity();
  try {
    cv::solvePnPGeneric(points, pixels, K, distortion, rotations, translations, false,
                        cv::SOLVEPNP_IPPE);
    for (std::size_t i = 0; i < rotations.size(); ++i) {
      cv::Mat rotation = rotations[i], translation = translations[i];
      cv::solvePnPRefineLM(points, pixels, K, distortion, rotation, translation);
      const Pose pose = pose_of(rotation, translation);
      const double error = view_error(board, view, camera, pose);
      if (error < *rms) {
        *rms = error;
        best = pose;
      }
    }
  } catch (const cv::Exception&) {
    // Corners on a line: no pose.
  }
  return best;
}

LensStart start_lens(const Take& take, std::size_t c, const std::vector<View>& views,
                     LensModel model) {
  LensStart start;
  const TakeCamera& given = take.cameras[c];
  if (given.known) {
    start.camera = *given.known;
    place_boards(take, views, start);
    return start;
  }
  std::vector<std::size_t> good(views.size());
  for (std::size_t v = 0; v < good.size(); ++v) good[v] = v;
  // Twice, the second time without what the first did not explain.
  for (int round = 0; round < 2; ++round) {
    const std::vector<std::size_t> chosen = some_of(good);
    const Zhang zhang = calibrate(take, c, views, chosen, model);
    start.camera = zhang.camera;
    if (!std::isfinite(zhang.focal_sigma)) refuse_parallel(given.name);
    place_boards(take, views, start);
    const double limit = std::max(1.0, 3.0 * median(start.rms));
    std::vector<std::size_t> kept;
    for (const std::size_t v : good)
      if (start.rms[v] <= limit) kept.push_back(v);
    if (kept.size() == good.size() || round == 1) {
      if (zhang.focal_sigma > 0.05 || tilt(start.poses, kept) < 10.0) refuse_parallel(given.name);
      break;
    }
    good = kept;
    if (good.size() < least_views)
      throw Error(
          Error::Kind::bad_input,
          "The views of camera '{}' contradict each other: no lens explains more than {} of "
          "them.",
          given.name, good.size());
  }
  return start;
}

}  // namespace polyhull::calibration
