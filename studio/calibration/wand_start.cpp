// SPDX-License-Identifier: LGPL-2.1-or-later
#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/calib3d.hpp>

#include "base/error.h"
#include "studio/calibration/median.h"
#include "studio/calibration/wand.h"

namespace polyhull::calibration {
namespace {

// px: a guessed lens is some per cent off.
double limit_of(const Take& take, std::size_t c) {
  return take.cameras[c].known ? 4.0 : 12.0;
}

Pose pose_of(const cv::Mat& R, const cv::Mat& t) {
  Pose out;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) out.R[c][r] = R.at<double>(r, c);
    out.t[r] = t.at<double>(r);
  }
  return out;
}

// Places cameras one after the other.
class Placer {
 public:
  Placer(const Take& take, const std::vector<Camera>& lenses)
      : take_(take), cameras_(lenses), placed_(lenses.size(), false), seen_(lenses.size()) {
    for (const View& view : take.views) {
      const Camera& camera = cameras_[view.camera];
      const Vec3 ray = glm::inverse(camera.K) * Vec3(camera.undistort(view.corners[0]), 1.0);
      seen_[view.camera].emplace(view.instant, cv::Point2d(ray.x, ray.y));
    }
  }

  Placement run() {
    place_pair();
    while (add_camera()) {
    }
    require_all();
    std::vector<bool> used;
    Placement out;
    for (const Vec3& x : triangulate_points(take_, cameras_, placed_, 30.0, &used))
      out.boards.push_back({Mat3(1.0), x});
    for (const Camera& camera : cameras_) out.cameras.push_back({camera.R, camera.t});
    out.first = first_;
    return out;
  }

 private:
  // A pair's worth: how many points agree with it, and how wide their rays part.
  void place_pair() {
    double best = 0.0;
    for (std::size_t a = 0; a < seen_.size(); ++a) {
      for (std::size_t b = a + 1; b < seen_.size(); ++b) {
        std::vector<cv::Point2d> one, other;
        for (const auto& [instant, point] : seen_[a]) {
          const auto at = seen_[b].find(instant);
          if (at == seen_[b].end()) continue;
          one.push_back(point);
          other.push_back(at->second);
        }
        if (one.size() < least_points) continue;
        const double limit =
            std::max(limit_of(take_, a), limit_of(take_, b)) / (2.0 * cameras_[a].K[0][0]);
        cv::Mat mask, R, t, points;
        const cv::Mat E = cv::findEssentialMat(one, other, cv::Mat::eye(3, 3, CV_64F), cv::RANSAC,
                                               .999, limit, mask);
        if (E.rows != 3) continue;
        cv::recoverPose(E, one, other, cv::Mat::eye(3, 3, CV_64F), R, t, 1e6, mask, points);
        const Pose pose = pose_of(R, t);
        std::vector<double> angles;
        for (std::size_t i = 0; i < one.size(); ++i) {
          if (!mask.at<std::uint8_t>(static_cast<int>(i))) continue;
          const Vec3 p = glm::normalize(pose.R * Vec3(one[i].x, one[i].y, 1.0));
          const Vec3 q = glm::normalize(Vec3(other[i].x, other[i].y, 1.0));
          angles.push_back(glm::length(glm::cross(p, q)));
        }
        const double worth = static_cast<double>(angles.size()) * median(angles);
        if (angles.size() < least_points / 2 || worth <= best) continue;
        best = worth;
        first_ = a;
        second_ = b;
        between_ = pose;
      }
    }
    if (best == 0.0)
      throw Error(Error::Kind::bad_input,
                  "No two cameras share {} points or more that agree; check that pictures of one "
                  "name are of one instant, and move the light where several cameras see it.",
                  least_points);
    set(first_, Pose{});
    set(second_, between_);
  }

  void set(std::size_t c, const Pose& pose) {
    cameras_[c].R = pose.R;
    cameras_[c].t = pose.t;
    placed_[c] = true;
  }

  // The camera that sees most points that are placed.
  bool add_camera() {
    std::vector<bool> used;
    const std::vector<Vec3> points = triangulate_points(take_, cameras_, placed_, 20.0, &used);
    std::vector<bool> known(points.size(), false);
    for (std::size_t v = 0; v < used.size(); ++v)
      if (used[v]) known[take_.views[v].instant] = true;
    std::vector<std::pair<std::size_t, std::size_t>> order;
    for (std::size_t c = 0; c < seen_.size(); ++c)
      if (!placed_[c])
        order.emplace_back(
            std::ranges::count_if(seen_[c], [&](const auto& point) { return known[point.first]; }),
            c);
    std::ranges::sort(order, std::greater{});
    for (const auto& [count, c] : order)
      if (count >= least_points / 2 && resect(c, points, known)) return true;
    return false;
  }

  bool resect(std::size_t c, const std::vector<Vec3>& points, const std::vector<bool>& known) {
    std::vector<cv::Point3d> space;
    std::vector<cv::Point2d> picture;
    for (const auto& [instant, point] : seen_[c]) {
      if (!known[instant]) continue;
      space.emplace_back(points[instant].x, points[instant].y, points[instant].z);
      picture.push_back(point);
    }
    cv::Mat turn, t, R;
    std::vector<int> inliers;
    const float limit = static_cast<float>(2.0 * limit_of(take_, c) / cameras_[c].K[0][0]);
    if (!cv::solvePnPRansac(space, picture, cv::Mat::eye(3, 3, CV_64F), cv::noArray(), turn, t,
                            false, 300, limit, .999, inliers, cv::SOLVEPNP_EPNP) ||
        2 * inliers.size() < space.size() || inliers.size() < least_points / 2)
      return false;
    cv::Rodrigues(turn, R);
    set(c, pose_of(R, t));
    return true;
  }

  void require_all() const {
    std::string names;
    for (std::size_t c = 0; c < placed_.size(); ++c)
      if (!placed_[c]) names += (names.empty() ? "'" : ", '") + take_.cameras[c].name + "'";
    if (!names.empty())
      throw Error(Error::Kind::bad_input,
                  "Too few points that agree are shared with the other cameras by {}; move the "
                  "light where these cameras and others see it, at one instant.",
                  names);
  }

  const Take& take_;
  std::vector<Camera> cameras_;
  std::vector<bool> placed_;
  std::vector<std::map<std::size_t, cv::Point2d>> seen_;  ///< per camera, by instant: K^-1 x
  std::size_t first_ = 0, second_ = 0;
  Pose between_;
};

// One sight of a point: a ray in the world.
struct Sight {
  std::size_t view;
  const Camera* camera;
  Vec2 ideal;
  Vec3 centre, along;
};

Vec3 nearest(const std::vector<Sight>& sights, const std::vector<std::size_t>& which) {
  Mat3 normal(0.0);
  Vec3 right(0.0);
  for (const std::size_t s : which) {
    const Mat3 across = Mat3(1.0) - glm::outerProduct(sights[s].along, sights[s].along);
    normal += across;
    right += across * sights[s].centre;
  }
  return std::abs(glm::determinant(normal)) > 1e-9 ? glm::inverse(normal) * right : Vec3(NAN);
}

std::vector<std::size_t> agreeing(const std::vector<Sight>& sights, const Vec3& x, double limit) {
  std::vector<std::size_t> out;
  for (std::size_t s = 0; s < sights.size(); ++s) {
    const auto pixel = sights[s].camera->project_ideal(x);
    if (pixel && glm::length(*pixel - sights[s].ideal) <= limit) out.push_back(s);
  }
  return out;
}

}  // namespace

std::vector<Vec3> triangulate_points(const Take& take, const std::vector<Camera>& cameras,
                                     const std::vector<bool>& placed, double limit,
                                     std::vector<bool>* used) {
  std::vector<std::vector<Sight>> sights(take.instants.size());
  for (std::size_t v = 0; v < take.views.size(); ++v) {
    const View& view = take.views[v];
    const Camera& camera = cameras[view.camera];
    if (!placed[view.camera]) continue;
    const Vec2 ideal = camera.undistort(view.corners[0]);
    sights[view.instant].push_back(
        {v, &camera, ideal, camera.centre(), glm::normalize(camera.ray(ideal))});
  }
  used->assign(take.views.size(), false);
  std::vector<Vec3> out(take.instants.size(), Vec3(0.0));
  for (std::size_t i = 0; i < sights.size(); ++i) {
    const std::vector<Sight>& own = sights[i];
    std::vector<std::size_t> best;
    for (std::size_t a = 0; a < own.size(); ++a)
      for (std::size_t b = a + 1; b < own.size(); ++b)
        if (auto agree = agreeing(own, nearest(own, {a, b}), limit); agree.size() > best.size())
          best = std::move(agree);
    if (best.size() < 2) continue;
    best = agreeing(own, nearest(own, best), limit);
    if (best.size() < 2) continue;
    out[i] = nearest(own, best);
    for (const std::size_t s : best) (*used)[own[s].view] = true;
  }
  return out;
}

Placement place_by_points(const Take& take, const std::vector<Camera>& lenses) {
  return Placer(take, lenses).run();
}

}  // namespace polyhull::calibration
