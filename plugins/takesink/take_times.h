// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// When takesink's buffers come, counted from the take's begin.
#pragma once

#include <gst/gst.h>

#include <cstdint>
#include <optional>

namespace polyhull::element {

/// The take begins at running time 0, or ten seconds before its first buffer where that comes later: a
/// pipeline that has run for hours, or by another machine's clock, makes no take of hours, and what other
/// pads took before the first buffer may come after it.
class TakeTimes {
 public:
  struct Time {
    std::int64_t time = 0;  ///< ns, 0 or above
    bool early = false;     ///< it was before the begin, to which it was moved
  };
  /// Time of \p buffer in \p segment; none: it has no running time.
  std::optional<Time> of(const GstSegment& segment, GstBuffer* buffer);

 private:
  std::optional<std::int64_t> origin_;  // the running time at which the take begins
};

}  // namespace polyhull::element
