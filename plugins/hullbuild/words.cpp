// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/hullbuild/words.h"

#include <fmt/core.h>

#include <algorithm>

#include "plugins/common/guard.h"

namespace polyhull::element {
namespace {

constexpr std::int64_t silence = second;      // that is worth a word
constexpr std::int64_t lasting = 3 * second;  // a silhouette that is mended for so long
constexpr std::int64_t moment = second;       // without it in between

std::string milliseconds(std::int64_t time) {
  return fmt::format("{:.0f} ms", static_cast<double>(time) * 1e-6);
}

std::string seconds(std::int64_t time) {
  return fmt::format("{:.1f} s", static_cast<double>(time) * 1e-9);
}

std::string reason(const AbsentCamera& camera) {
  if (camera.ended) return "has ended";
  if (!camera.known) return "has not sent anything yet";
  if (camera.silent < camera.missed / 2)
    return "has sent nothing in time for " + seconds(camera.missed);
  return "has sent nothing for " + seconds(camera.silent);
}

/// What to do where \p cameras are absent: an end of stream was sent, so no cable is loose.
std::string advice(const std::vector<AbsentCamera>& cameras) {
  const auto ended = [](const AbsentCamera& camera) { return camera.ended; };
  return !cameras.empty() && std::all_of(cameras.begin(), cameras.end(), ended)
             ? "They have sent the end of their stream, so no camera is lost: where it comes too "
               "early, look at num-buffers or the length of the file."
             : "Look after these cameras.";
}

}  // namespace

std::string list_of(const std::vector<AbsentCamera>& cameras, bool with_reasons) {
  std::string text;
  for (const AbsentCamera& camera : cameras) {
    text += (text.empty() ? "" : ", ") + camera.name;
    if (with_reasons) text += " (" + reason(camera) + ")";
  }
  return text;
}

void warn(GstElement* element, const std::string& text) {
  GST_ELEMENT_WARNING(element, STREAM, FAILED, ("%s", sentence(text).c_str()), (nullptr));
}

void HullWords::built(GstElement* element, std::int64_t now, std::size_t used,
                      const std::vector<AbsentCamera>& absent) {
  if (absent.empty()) return;
  const std::string names = list_of(absent, false);
  if (names == absent_ && now - absent_at_ < again_after) return;
  absent_ = names;
  absent_at_ = now;
  for (const AbsentCamera& camera : absent) gone_[camera.name] = true;
  warn(element,
       fmt::format("The hull is built from {} cameras, without {}: it is larger than the subject "
                   "where they would have cut it. {} missing-camera=drop-set keeps the last whole "
                   "hull instead, min-cameras says how many are too few.",
                   used, list_of(absent, true), advice(absent)));
}

void HullWords::hidden(GstElement* element, std::int64_t now, const std::string& lack,
                       const std::vector<AbsentCamera>& absent) {
  if (few_at_ >= 0 && now - few_at_ < again_after) return;
  few_at_ = now;
  const std::string names = absent.empty() ? "more cameras" : list_of(absent, true);
  warn(element, fmt::format("The subject is hidden until there are {}: {}. {} min-cameras sets how "
                            "many are enough.",
                            names, lack, advice(absent)));
}

void HullWords::absent(GstElement* element, const std::vector<AbsentCamera>& cameras) {
  for (const AbsentCamera& camera : cameras) {
    bool& said = gone_[camera.name];
    const bool gone = camera.ended || (camera.known && camera.silent > silence);
    if (gone && !said)
      warn(element,
           fmt::format("Camera {} {} while the others go on. {}", camera.name, reason(camera),
                       camera.ended
                           ? "Its source has sent the end of its stream (num-buffers, a shorter "
                             "file, a program that was closed), so it is not lost. Cameras of the "
                             "same num-buffers end apart where the machine is busy."
                           : "Look for its cable, its trigger, and what stands between it and "
                             "hullbuild."));
    said = gone || (said && camera.missed > silence);
  }
}

void HullWords::late(GstElement* element, std::int64_t now, const std::string& camera,
                     const std::vector<CameraLateness>& cameras, std::int64_t wait, bool by_hand) {
  if (late_at_ >= 0 && now - late_at_ < again_after) return;
  late_at_ = now;
  std::string list;
  bool too_late = false;
  for (const CameraLateness& entry : cameras) {
    list += (list.empty() ? "" : ", ") + entry.name + " " + milliseconds(entry.latest);
    too_late = too_late || entry.too_late;
  }
  std::string remedy = fmt::format("The wait follows by itself, now {}.", milliseconds(wait));
  if (by_hand) {
    remedy = fmt::format(
        "max-wait makes it {}; raise it, or leave it unset and the wait fits itself to the "
        "cameras.",
        milliseconds(wait));
  } else if (too_late) {
    remedy =
        "That is beyond max-latency: raise it, or look for what holds the camera up (a full "
        "queue, the network, a machine that cannot keep up).";
  }
  warn(element, fmt::format("A view of camera {} came after its set had gone, and its instant is "
                            "lost. Views come at most so late after their instant: {}. {}",
                            camera, list, remedy));
}

void HullWords::repaired(GstElement* element, std::int64_t now,
                         const std::vector<CameraRepair>& repairs) {
  if (now == no_time) return;
  for (const CameraRepair& repair : repairs) {
    Mended& mended = mended_.try_emplace(repair.camera, Mended{now, now}).first->second;
    if (now - mended.last > moment || now < mended.last) mended.since = now;
    mended.last = now;
    const std::int64_t time = now - mended.since;
    if (time < lasting || (mended.said_at >= 0 && now - mended.said_at < again_after)) continue;
    mended.said_at = now;
    warn(element,
         fmt::format("The silhouette of camera {} has contradicted the other cameras for {}: {} "
                     "holes are filled, {} pieces dropped in this set. Look at its matte: what "
                     "wears or mirrors the screen's colour tears holes, what stands beside the "
                     "screen makes pieces.",
                     repair.camera, seconds(time), repair.holes, repair.pieces));
  }
}

}  // namespace polyhull::element
