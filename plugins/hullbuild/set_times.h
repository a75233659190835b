// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What hullbuild tells of its sets' times: their spread, cameras beside the others, by what views
/// are matched.
#pragma once

#include <gst/gst.h>

#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "mesh/set_spread.h"

namespace polyhull::element {

/// Warnings go out as messages of the element. tell() may be called by any thread, the rest by one.
class SetTimes {
 public:
  /// By what a set's views were matched.
  enum class By {
    trigger,
    capture_time,
    running_time,
    file_time,  ///< running times of files that say no others: where they are in the file
  };

  /// Notes a set: its views' times, what they were matched by (running_time: which is said once), and
  /// how far apart they may be (ns). Names a camera that is steadily beside
  /// the others, except of sets by trigger: their views may be any time apart.
  void note(GstElement* element, const std::vector<CameraTime>& set, By by, std::int64_t tolerance);

  /// Adds to \p stats: spread-minimum-us, -median-us, -maximum-us, and of each camera
  /// offset-us-NAME.
  void tell(GstStructure* stats) const;

  /// Whether it is time for a message about the sets: once a second of sets, or a hundred of them.
  bool due();

  void reset();

 private:
  void judge(GstElement* element, std::int64_t now, std::int64_t tolerance);

  mutable std::mutex mutex_;  // protects the next
  SetSpread spread_;
  struct Beside {
    std::int64_t since = -1, said_at = -1;
  };
  std::map<std::string, Beside> beside_;
  std::int64_t judged_at_ = -GST_SECOND;
  bool said_running_ = false;
  std::int64_t told_at_ = 0;  // monotonic µs
  int sets_ = 0;              // since then
};

}  // namespace polyhull::element
