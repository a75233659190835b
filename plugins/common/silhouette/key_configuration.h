// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// From the properties of chromamatte and silhouette to the keyer's settings: reads the files they
/// name, once each.
#pragma once

#include <gst/gst.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "plugins/common/silhouette/key_properties.h"
#include "plugins/common/statistics.h"
#include "silhouette/key/key.h"

namespace polyhull::element {

class KeyConfiguration {
 public:
  /// Makes settings of \p values for frames of \p width x \p height from \p camera (a name in the
  /// rig file; used only where a rig is set) and hands them to \p accept if anything changed since
  /// the last call. Files are read again only when their path or the frames' size changes.
  ///
  /// What cannot be used (a file that is missing or of another size, values that contradict each
  /// other) is reported as a warning on \p element, once, and the settings of before stay in force.
  /// Where there are none for this size, it throws Error.
  void apply(GstElement* element, Statistics& statistics, const KeyValues& values,
             const std::string& camera, int width, int height,
             const std::function<void(const KeySettings&)>& accept);

  /// Counts a frame; true when screen and foreground are to be sampled again with it.
  bool due_for_sampling(int resample);

 private:
  struct Request {
    KeyValues values;
    std::string camera;
    int width = 0;
    int height = 0;
    bool operator==(const Request&) const = default;
  };
  KeySettings settings_for(const Request& request) const;
  std::shared_ptr<const Picture> outside_mask(const Request& request, Rings& outside) const;

  std::optional<Request> in_force_;
  std::optional<Request> refused_;
  KeySettings settings_;
  int frames_since_sampling_ = 0;
};

/// Makes the key's entries appear in `stats`.
void declare_key_statistics(Statistics& statistics);

/// Writes what the keyer measured to `stats`, and warns on \p element of what it lacks.
void report_calibration(const KeyCalibration& calibration, GstElement* element,
                        Statistics& statistics);

}  // namespace polyhull::element
