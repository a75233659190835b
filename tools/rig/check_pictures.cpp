// SPDX-License-Identifier: LGPL-2.1-or-later
#include "rig/check_pictures.h"

#include <algorithm>
#include <functional>
#include <glm/gtc/quaternion.hpp>
#include <numeric>
#include <span>

#include "base/error.h"
#include "hull/build/stage.h"
#include "hull/camera_contours.h"
#include "hull/repair/repair.h"
#include "hull/repair/ring_regions.h"
#include "hull/subject_size.h"
#include "mask_contours.h"
#include "rig/ray_cover.h"
#include "rig/undistort.h"

namespace polyhull {
namespace {

// Up to this share of a silhouette may be unexplained: keying that lost an arm, a shadow kept.
constexpr double tolerable = 0.04;
// Up to this share nothing has been taken away.
constexpr double explained = 0.01;
// An explanation must leave at most this part of what was unexplained.
constexpr double convincing = 0.4;

// The worst of the shares, and all of them together to tell explanations apart.
struct Score {
  double worst = 0.0, sum = 0.0;
  bool good(const Score& before) const {
    return worst <= tolerable && worst <= convincing * before.worst;
  }
};

struct Explanation {
  Score score;
  std::string sentence;
};

// Poses in another form than x_cam = R x + t, read as if they had it, and how to mend them.
void transpose(Camera& camera) {
  camera.R = glm::transpose(camera.R);
}
void take_for_centre(Camera& camera) {
  camera.t = -(camera.R * camera.t);
}
void invert(Camera& camera) {
  transpose(camera);
  take_for_centre(camera);
}
void turn_y_and_z(Camera& camera) {
  const Mat3 turn(1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0);
  camera.R = turn * camera.R;
  camera.t = turn * camera.t;
}
void put_w_last(Camera& camera) {
  const glm::dquat read = glm::quat_cast(camera.R);
  glm::dquat meant = read;
  meant.x = read.w, meant.y = read.x, meant.z = read.y, meant.w = read.z;
  camera.R = glm::mat3_cast(meant);
}

struct PoseForm {
  void (*mend)(Camera&);
  const char* sentence;
};
constexpr PoseForm pose_forms[] = {
    {transpose,
     "the rotations of all cameras look transposed, rows written for columns: their transposes "
     "make all agree"},
    {take_for_centre,
     "the translations look like the places of the cameras: with t = -R C instead of C all agree"},
    {invert,
     "the poses look like camera to world: their inverses (R transposed, t = -R^T t) make all "
     "agree"},
    {put_w_last,
     "the quaternions look like qx qy qz qw where qw qx qy qz, COLMAP's order, was read: turning "
     "them round makes all agree"},
    {turn_y_and_z,
     "the cameras look like OpenGL's or Blender's, y up and looking along -z: the second and the "
     "third row of [R | t] with the other sign make all agree"},
    {[](Camera& camera) {
       invert(camera);
       turn_y_and_z(camera);
     },
     "the poses look like camera to world of OpenGL's or Blender's cameras (y up, looking along "
     "-z), as in a transforms.json: their inverses, the second and the third row with the other "
     "sign, make all agree"},
};

class PictureCheck {
 public:
  PictureCheck(const Rig& rig, const std::vector<CameraPictureRings>& pictures)
      : rig_(rig), pictures_(pictures) {
    // The time grows with the square of the number of cameras, and so does that of an exchange.
    samples_ = static_cast<int>(std::clamp<std::size_t>(2000 / pictures.size(), 60, 400));
  }

  RigReport run();

 private:
  const Camera& camera(std::size_t i) const { return rig_.cameras[pictures_[i].camera]; }
  const std::string& name(std::size_t i) const { return camera(i).name; }

  // The views with picture \p from[i] given to the camera of picture i, changed by \p change.
  std::vector<SeenSubject> views(
      const std::vector<std::size_t>& from,
      const std::function<void(std::size_t, Rings&)>& change = {}) const {
    std::vector<SeenSubject> result;
    for (std::size_t i = 0; i < from.size(); ++i) {
      Rings rings = pictures_[from[i]].rings;
      if (change) change(i, rings);
      result.push_back({&camera(i), undistort_rings(camera(i), rings).rings});
    }
    return result;
  }
  std::vector<SeenSubject> as_given() const {
    std::vector<std::size_t> from(pictures_.size());
    std::iota(from.begin(), from.end(), 0u);
    return views(from);
  }
  Score score_of(const std::vector<SeenSubject>& views, const std::optional<Bounds>& bounds) const {
    Score score;
    for (const Unexplained& part : find_unexplained(views, bounds, samples_)) {
      score.worst = std::max(score.worst, part.share);
      score.sum += part.share;
    }
    return score;
  }
  Score without(std::size_t i) const {
    std::vector<SeenSubject> others = as_given();
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    return score_of(others, rig_.bounds);
  }

  SubjectSize size() const;
  void try_pieces(const std::vector<Unexplained>& parts);
  void try_bounds();
  void try_exchanges(const std::vector<std::size_t>& suspects);
  void try_turning(const std::vector<std::size_t>& suspects);
  void try_leaving_out();
  void try_pose_forms();
  void keep(const Score& score, std::string sentence) {
    if (score.good(before_)) found_.push_back({score, std::move(sentence)});
  }

  const Rig& rig_;
  const std::vector<CameraPictureRings>& pictures_;
  int samples_ = 0;
  Score before_;
  std::vector<Explanation> found_;
};

// Of the hull of all pictures.
SubjectSize PictureCheck::size() const {
  HullStage stage;
  HullOptions options;
  options.bounds = rig_.bounds;
  options.unseen = rig_.bounds ? Unseen::keep : Unseen::carve;
  std::vector<CameraContours> contours;
  std::vector<Vec3> centres;
  for (std::size_t i = 0; i < pictures_.size(); ++i) {
    contours.push_back({&camera(i), &pictures_[i].rings});
    centres.push_back(camera(i).centre());
  }
  return subject_size(stage.build(contours, options, 0.0), centres, rig_.up, rig_.metres_per_unit(),
                      rig_.bounds.has_value());
}

// Without the pieces of silhouettes that the others do not explain.
void PictureCheck::try_pieces(const std::vector<Unexplained>& parts) {
  const std::vector<SeenSubject> given = as_given();
  std::vector<SeenSubject> rest = given;
  std::string where;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (parts[i].share <= explained) continue;
    const std::vector<hull::RingRegion> regions = hull::regions_of(given[i].rings);
    std::vector<std::size_t> piece_of(regions.size());  // of a hole the ring around it
    std::vector<PicturePart> pieces(regions.size(), {i, {}});
    for (std::size_t r = 0; r < regions.size(); ++r) {
      piece_of[r] = regions[r].area < 0.0 && regions[r].parent >= 0
                        ? static_cast<std::size_t>(regions[r].parent)
                        : r;
      Rings& piece = pieces[piece_of[r]].rings;
      const std::span<const Vec2f> ring = given[i].rings.ring(r);
      piece.points.insert(piece.points.end(), ring.begin(), ring.end());
      piece.ends.push_back(static_cast<std::uint32_t>(piece.points.size()));
    }
    const std::vector<Unexplained> found = find_unexplained(given, pieces, rig_.bounds, samples_);
    std::vector<std::uint32_t> leave_out;
    for (std::uint32_t r = 0; r < regions.size(); ++r)
      if (found[piece_of[r]].share >= 0.5) leave_out.push_back(r);
    if (leave_out.empty()) continue;
    const std::uint32_t largest =
        *std::ranges::max_element(leave_out, {}, [&](std::uint32_t r) { return regions[r].area; });
    const Vec2 low = camera(i).distort(found[largest].low),
               high = camera(i).distort(found[largest].high);
    rest[i].rings = without_rings(given[i].rings, leave_out);
    if (rest[i].rings.empty()) return;  // what would be left agrees with everything
    where += fmt::format("{}{} (from {:.0f}, {:.0f} to {:.0f}, {:.0f} px)",
                         where.empty() ? "" : ", ", name(i), low.x, low.y, high.x, high.y);
  }
  if (where.empty()) return;
  keep(score_of(rest, rig_.bounds),
       fmt::format("{} shows something beside the subject that no other picture has: background "
                   "that the key or the mask let through, a shadow, or somebody who stands outside "
                   "of the others. The calibration is not at fault: without it all agree",
                   where));
}

void PictureCheck::try_bounds() {
  if (!rig_.bounds) return;
  keep(score_of(as_given(), std::nullopt),
       "the pictures agree with each other but not with the bounds: the subject stands outside of "
       "them, or they are in another unit or axes than the cameras");
}

void PictureCheck::try_exchanges(const std::vector<std::size_t>& suspects) {
  for (std::size_t a = 0; a < suspects.size(); ++a)
    for (std::size_t b = a + 1; b < suspects.size(); ++b) {
      const std::size_t i = std::min(suspects[a], suspects[b]),
                        k = std::max(suspects[a], suspects[b]);
      if (camera(i).width != camera(k).width || camera(i).height != camera(k).height) continue;
      std::vector<std::size_t> from(pictures_.size());
      std::iota(from.begin(), from.end(), 0u);
      std::swap(from[i], from[k]);
      keep(score_of(views(from), rig_.bounds),
           fmt::format("{} and {} look swapped: exchanging their pictures makes all agree", name(i),
                       name(k)));
    }
}

void PictureCheck::try_turning(const std::vector<std::size_t>& suspects) {
  std::vector<std::size_t> from(pictures_.size());
  std::iota(from.begin(), from.end(), 0u);
  for (const std::size_t i : suspects)
    for (const bool turned : {false, true}) {
      const auto change = [&](std::size_t which, Rings& rings) {
        if (which != i) return;
        for (Vec2f& p : rings.points) {
          p.x = static_cast<float>(camera(i).width - 1) - p.x;
          if (turned) p.y = static_cast<float>(camera(i).height - 1) - p.y;
        }
      };
      keep(score_of(views(from, change), rig_.bounds),
           fmt::format("the picture of {} looks {}: {} it makes all agree", name(i),
                       turned ? "upside down" : "mirrored",
                       turned ? "turning it by 180 degrees" : "mirroring it from left to right"));
    }
}

void PictureCheck::try_pose_forms() {
  const std::vector<SeenSubject> given = as_given();
  for (const PoseForm& form : pose_forms) {
    std::vector<Camera> cameras;
    for (const SeenSubject& view : given) form.mend(cameras.emplace_back(*view.camera));
    std::vector<SeenSubject> views = given;  // the lens, and so the rings, stay as they are
    for (std::size_t i = 0; i < views.size(); ++i) views[i].camera = &cameras[i];
    // Within bounds what no camera sees may be subject: cameras that look away explain all.
    if (rig_.bounds && !score_of(views, std::nullopt).good(before_)) continue;
    keep(score_of(views, rig_.bounds), form.sentence);
  }
}

void PictureCheck::try_leaving_out() {
  // Any two pictures nearly agree, so what is left says something from three on.
  if (pictures_.size() < 4) return;
  for (std::size_t i = 0; i < pictures_.size(); ++i)
    keep(without(i),
         fmt::format("{} contradicts the others, which agree among themselves: its calibration (or "
                     "its unit), its picture or the instant of it is wrong",
                     name(i)));
}

RigReport PictureCheck::run() {
  RigReport report;
  const std::vector<Unexplained> parts = find_unexplained(as_given(), rig_.bounds, samples_);
  report.table =
      "pictures: the part of each silhouette that the hull of the other cameras does not "
      "explain\n";
  for (std::size_t i = 0; i < parts.size(); ++i) {
    report.table += fmt::format("{:14} {:6.2f} %\n", name(i), 100.0 * parts[i].share);
    before_.worst = std::max(before_.worst, parts[i].share);
    before_.sum += parts[i].share;
  }
  const SubjectSize size = this->size();
  if (size.known)
    report.table +=
        fmt::format("the hull of all is {:.4g} m high, {:.4g} m away from the cameras\n",
                    size.height, size.distance);
  if (is_implausible(size)) report.warnings.push_back(about_size(size, rig_.unit));
  if (before_.worst <= tolerable) return report;
  // The cameras without which the rest agrees best are the ones to suspect; all of a few.
  constexpr std::size_t most = 8;
  std::vector<std::size_t> suspects(pictures_.size());
  std::iota(suspects.begin(), suspects.end(), 0u);
  if (suspects.size() > most) {
    std::vector<double> rest;
    for (const std::size_t i : suspects) rest.push_back(without(i).sum);
    std::stable_sort(suspects.begin(), suspects.end(),
                     [&](std::size_t a, std::size_t b) { return rest[a] < rest[b]; });
    suspects.resize(most);
  }
  try_pieces(parts);
  if (found_.empty()) try_bounds();
  if (found_.empty()) {
    try_exchanges(suspects);
    try_turning(suspects);
    try_pose_forms();
  }
  if (found_.empty()) try_leaving_out();

  const std::string contradiction =
      fmt::format("the pictures contradict each other (up to {:.1f} % of a silhouette): ",
                  100.0 * before_.worst);
  std::sort(found_.begin(), found_.end(),
            [](const Explanation& a, const Explanation& b) { return a.score.sum < b.score.sum; });
  if (found_.empty()) {
    report.warnings.push_back(
        contradiction +
        "no single exchange, mirroring, camera or other form of the poses explains "
        "it; check that all "
        "show the same instant, "
        "and that the masks show the subject only (--keep-largest 1 leaves "
        "out what else there is), "
        "then the calibration");
    return report;
  }
  std::string sentence = contradiction + found_.front().sentence;
  // Others that explain it nearly as well are named, too.
  for (std::size_t i = 1; i < found_.size(); ++i)
    if (found_[i].score.sum < 2.0 * found_.front().score.sum + 0.005)
      sentence += "; or " + found_[i].sentence;
  report.warnings.push_back(std::move(sentence));
  return report;
}

}  // namespace

RigReport examine_pictures(const Rig& rig, const std::vector<CameraPictureRings>& pictures) {
  if (pictures.size() < 2)
    throw Error(Error::Kind::bad_input,
                "Comparing pictures takes at least two cameras' pictures, {} were given.",
                pictures.size());
  return PictureCheck(rig, pictures).run();
}

}  // namespace polyhull
