// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What hullbuild tells people about its cameras: each fault once, when it begins, with the
/// camera's name, numbers and what to do; not with every set.
#pragma once

#include <gst/gst.h>

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/nanoseconds.h"
#include "hull/subject_size.h"
#include "plugins/hullbuild/doubt_watch.h"
#include "plugins/hullbuild/set_builder.h"
#include "rig/rig.h"

namespace polyhull::element {

constexpr std::int64_t again_after = 60 * second;  ///< the same message may come, ns

/// Posts \p text as a warning of \p element.
void warn(GstElement* element, const std::string& text);

/// A camera that a set lacks.
struct AbsentCamera {
  std::string name;         ///< of the camera, or of its pad while it has none
  bool ended = false;       ///< its stream has ended
  bool known = false;       ///< it has sent something
  std::int64_t missed = 0;  ///< ns for which sets have lacked it
  std::int64_t silent = 0;  ///< ns since something came from it
};

/// Takes from cameras of \p rig a distortion that turns back within the picture, as no lens's does, and
/// warns of it: outlines would be tangled beyond use.
void take_out_lost_lenses(GstElement* element, Rig& rig);

/// Their names, with commas between them, and \p with_reasons why they are absent.
std::string list_of(const std::vector<AbsentCamera>& cameras, bool with_reasons);

/// A camera and how late its views come.
struct CameraLateness {
  std::string name;
  std::int64_t latest = 0;  ///< ns, of the last ten seconds
  bool too_late = false;    ///< later than can be waited for
};

/// Messages go out as warnings of the element. For one thread.
class HullWords {
 public:
  void reset() { *this = HullWords(); }

  /// A set at running time \p now (ns) was built from \p used cameras without \p absent (none: it
  /// was whole).
  void built(GstElement* element, std::int64_t now, std::size_t used,
             const std::vector<AbsentCamera>& absent);

  /// A set at running time \p now (ns) without \p absent was dropped for what it lacks, \p lack.
  void hidden(GstElement* element, std::int64_t now, const std::string& lack,
              const std::vector<AbsentCamera>& absent);

  /// Cameras that have ended, or sent nothing for a second, while others go on.
  void absent(GstElement* element, const std::vector<AbsentCamera>& cameras);

  /// A view came after its set had gone. \p wait: how long sets are waited for, ns; \p by_hand:
  /// max-wait says so.
  void late(GstElement* element, std::int64_t now, const std::string& camera,
            const std::vector<CameraLateness>& cameras, std::int64_t wait, bool by_hand);

  /// In a set at running time \p now (ns) \p repairs were made: a camera whose silhouette has been
  /// mended for seconds, but for moments, is named.
  void repaired(GstElement* element, std::int64_t now, const std::vector<CameraRepair>& repairs);

  /// In a set at running time \p now (ns) silhouettes contradict each other so: said once it has
  /// lasted for four tenths of a second, with the camera's name where that is known,
  /// or of the rig, and then of no camera until they agree again.
  void contradicted(GstElement* element, std::int64_t now, const Contradiction& contradiction);

  /// All \p used cameras of a set at running time \p now (ns) see a foreground; \p empty: yet its
  /// hull is. \p contradiction says why, where contradicted() has not said it yet, or \p elsewhere:
  /// where the silhouettes meet outside the bounds, if they do.
  void hull(GstElement* element, std::int64_t now, std::size_t used, bool empty,
            const Contradiction& contradiction,
            const std::function<std::optional<Bounds>()>& elsewhere);

  /// The hull of a set has \p size by \p rig. Said once of each rig; whether it is implausible.
  bool size(GstElement* element, const SubjectSize& size, const Rig& rig);

  /// The hull of a set was built by \p rig without bounds. Said once of each rig.
  void unbounded(GstElement* element, const Rig& rig);

  /// Sets by another rig follow, of which nothing has been said.
  void new_rig();

 private:
  std::string absent_;           // the names last said to be missing
  std::int64_t absent_at_ = -1;  // when
  std::map<std::string, bool> gone_;
  struct Mended {
    std::int64_t since = 0, last = 0;
    std::int64_t said_at = -1;
  };
  std::map<std::string, Mended> mended_;
  struct Contradicted {
    std::int64_t since = -1, said_at = -1;
    std::string camera;  // last said
    bool rig = false;    // that was the rig; cameras are blamed once the silhouettes agree again
    bool rig_said = false;
  } contradicted_;
  std::int64_t late_at_ = -1, few_at_ = -1;
  int empty_hulls_ = 0, odd_sizes_ = 0;              // in a row
  bool size_said_ = false, unbounded_said_ = false;  // of this rig
};

}  // namespace polyhull::element
