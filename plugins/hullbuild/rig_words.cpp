// SPDX-License-Identifier: LGPL-2.1-or-later
// What hullbuild says of a rig, or a camera of it, that the silhouettes contradict.
#include <fmt/core.h>

#include "plugins/hullbuild/words.h"
#include "rig/floor.h"
#include "rig/lens.h"

namespace polyhull::element {
namespace {

constexpr std::int64_t shortly = 2 * second / 5;  // for which silhouettes contradict each other
constexpr int empty_in_a_row = 5;                 // one may be a subject that has just left
constexpr double sound = 1.0;    // px by which outlines of sound cameras miss each other
constexpr int odd_in_a_row = 5;  // one may be a matte's fault

constexpr const char* look_closer = " `polyhull-rig check RIG --pictures` looks closer.";

/// Who is wrong, and what may have happened.
std::string cause_of(const Contradiction& contradiction) {
  if (contradiction.rig)
    return fmt::format(
        "It is the rig, not one camera: of {} cameras {} agree. The rig file is that of another "
        "stage or of other cameras, cameras are swapped, the unit of some is wrong, several have "
        "been "
        "moved, or their frames are of different instants.",
        contradiction.cameras,
        contradiction.agreeing > 1 ? fmt::format("at most {}", contradiction.agreeing) : "no two");
  std::string who = contradiction.camera.empty()
                        ? "Which camera is wrong cannot be told"
                        : fmt::format("It is most likely camera {}", contradiction.camera);
  // Planes through two cameras that touch the subject.
  if (contradiction.tangency > 0.0)
    who += fmt::format(
        ", whose outlines lie {:.1f} px beside where the others have them ({:.1f} px "
        "among each other)",
        contradiction.tangency, contradiction.others);
  return who +
         ": it has been moved, its calibration is another camera's, its frames are of another "
         "instant, its matte is wrong, or the subject leaves its picture.";
}

/// The cameras that see what no other does; empty: there are none, or more is wrong.
std::string background_of(const Contradiction& contradiction) {
  std::string who;
  if (contradiction.rig || !contradiction.camera.empty()) return who;
  for (const Background& background : contradiction.background)
    who += fmt::format("{}{} near ({:.0f}, {:.0f})", who.empty() ? "" : ", ", background.camera,
                       background.pixel.x, background.pixel.y);
  return who;
}

std::string text_of(const Bounds& bounds) {
  return fmt::format("({:.3g}, {:.3g}, {:.3g}) to ({:.3g}, {:.3g}, {:.3g})", bounds.min.x,
                     bounds.min.y, bounds.min.z, bounds.max.x, bounds.max.y, bounds.max.z);
}

}  // namespace

void take_out_lost_lenses(GstElement* element, Rig& rig) {
  std::string cameras;
  for (Camera& camera : rig.cameras)
    if (const double share = lost_share(camera); share > most_lost) {
      cameras += fmt::format("{}{} ({:.0f} % of its picture)", cameras.empty() ? "" : ", ",
                             camera.name, 100.0 * share);
      camera.distortion.clear();
    }
  if (!cameras.empty())
    warn(element,
         fmt::format(
             "The rig's distortion is no lens's, as it turns back within the picture, of {}: "
             "they are taken for cameras without distortion. Calibrate them again, or look "
             "at the order of the coefficients (k1 k2 p1 p2 k3 …).",
             cameras));
}

void HullWords::contradicted(GstElement* element, std::int64_t now,
                             const Contradiction& contradiction) {
  Contradicted& known = contradicted_;
  const std::string background = background_of(contradiction);
  if (contradiction.share < contradictory && contradiction.camera.empty() && !contradiction.rig &&
      background.empty()) {
    known.since = -1;
    known.rig = false;
    return;
  }
  if (known.since < 0 || now < known.since) known.since = now;
  // What a wrong rig makes of single cameras changes from moment to moment.
  if (known.rig && !contradiction.rig) return;
  const bool said = known.said_at >= 0 && now >= known.said_at && now - known.said_at < again_after;
  const bool news = contradiction.rig
                        ? !known.rig_said
                        : !contradiction.camera.empty() && contradiction.camera != known.camera;
  if (now - known.since < shortly) return;
  known.rig = contradiction.rig;
  if (said && !news) return;
  known.said_at = now;
  known.camera = contradiction.camera;
  known.rig_said = known.rig_said || contradiction.rig;
  if (!background.empty()) {
    warn(
        element,
        fmt::format("The silhouette of camera {} (pixels) has something that no other camera sees. "
                    "It is background that the key lets through, a shadow, or somebody outside of "
                    "the other cameras' pictures, and no error of the calibration, for nothing of "
                    "what the others see is cut away. Look at the matte (chromamatte view=split); "
                    "roi-x to roi-height and outside-polygon rule places out, repair=both drops "
                    "what does not touch the subject.",
                    background));
    return;
  }
  // Of fewer than four cameras nobody knows what is cut away.
  const std::string how =
      contradiction.share > 0.0
          ? fmt::format(
                ": {:.0f} % of their outlines are cut away by other cameras, which makes the "
                "hull smaller than the subject",
                100.0 * contradiction.share)
          : "";
  warn(element, fmt::format("The silhouettes contradict each other{}. {}{}", how,
                            cause_of(contradiction), look_closer));
}

void HullWords::hull(GstElement* element, std::int64_t now, std::size_t used, bool empty,
                     const Contradiction& contradiction,
                     const std::function<std::optional<Bounds>()>& elsewhere) {
  if (!empty) {
    empty_hulls_ = 0;
    return;
  }
  if (++empty_hulls_ != empty_in_a_row) return;
  Contradicted& known = contradicted_;
  if (known.since >= 0 && known.said_at >= known.since) return;
  const std::string what = fmt::format(
      "All {} cameras see a foreground, but their silhouettes have no point of space in common",
      used);
  // Where more is wrong than one camera it is the rig.
  const bool camera =
      !contradiction.camera.empty() && contradiction.tangency > 0.0 && contradiction.others < sound;
  const auto said = [&] {
    if (now != no_time) known.said_at = now;
    known.camera = camera ? contradiction.camera : "";
    known.rig = !camera;
    known.rig_said = known.rig_said || known.rig;
  };
  if (contradiction.rig || camera) {
    said();
    warn(element,
         fmt::format("{}: the hull is empty. {}{}", what, cause_of(contradiction), look_closer));
  } else if (const std::optional<Bounds> place = elsewhere()) {
    warn(element,
         fmt::format("{} within the rig's bounds: the hull is empty. They meet outside, at {}. The "
                     "bounds are in another unit or other axes than the cameras, or the subject "
                     "stands outside. Correct \"bounds\" in the rig file; use-bounds=false leaves "
                     "them out.",
                     what, text_of(*place)));
  } else {
    said();
    warn(element,
         fmt::format(
             "{}: the hull is empty. Most likely the rig file is that of another set-up, the "
             "unit of some cameras is wrong (millimetres read as metres), or two cameras are "
             "swapped. `polyhull-rig check RIG --pictures` finds which.",
             what));
  }
}

bool HullWords::size(GstElement* element, const SubjectSize& size, const Rig& rig) {
  if (!size.known) return false;
  const bool odd = is_implausible(size);
  odd_sizes_ = odd ? odd_sizes_ + 1 : 0;
  if (odd_sizes_ == odd_in_a_row && !size_said_) {
    size_said_ = true;
    warn(element, about_size(size, rig.unit) + " `polyhull-rig check RIG` looks closer.");
  }
  return odd;
}

void HullWords::unbounded(GstElement* element, const Rig& rig) {
  if (unbounded_said_ || !looks_down(rig)) return;
  unbounded_said_ = true;
  warn(element,
       "All cameras look down and the rig has no bounds, so nothing says where the floor is: the "
       "hull reaches some centimetres below the feet, into it. `polyhull-rig level RIG` puts the "
       "floor and the bounds into the rig file.");
}

void HullWords::new_rig() {
  contradicted_ = {};
  odd_sizes_ = 0;
  size_said_ = unbounded_said_ = false;
}

}  // namespace polyhull::element
