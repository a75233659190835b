// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Which frames of a live stream are wanted when not all can be worked on.
///
/// Frames left out here and there by each camera for itself part the cameras: no instant is whole.
/// So one place decides for all: of a stream with the time T between frames, those at
/// anchor + k step T (k any integer, step a power of two). A frame belongs to the point
/// anchor + j T that is nearest to it, which is wanted where step divides j. A camera that runs up
/// to half a frame apart from the others thereby leaves out the same instants as they do.
#pragma once

#include <cstdint>

namespace polyhull {

struct FrameGrid {
  std::int64_t anchor = 0;    ///< running time of an instant that is wanted, ns
  std::int64_t interval = 0;  ///< between frames, ns; 0: every frame is wanted
  std::int64_t step = 1;      ///< every step-th frame is wanted

  /// Whether the frame at running time \p time (ns) is wanted; one without a time (INT64_MIN) is.
  bool wanted(std::int64_t time) const;

  /// Time between wanted frames, ns.
  std::int64_t period() const { return interval * step; }

  bool operator==(const FrameGrid&) const = default;
};

/// A grid and the one that will follow it. All who leave frames out change at the same instant,
/// not at the moment when they hear of it.
class FrameGrids {
 public:
  /// From running time \p from (ns) on \p grid holds.
  void change(const FrameGrid& grid, std::int64_t from);

  /// The grid that holds at running time \p time (ns).
  const FrameGrid& at(std::int64_t time) const { return time < from_ ? before_ : after_; }
  bool wanted(std::int64_t time) const { return at(time).wanted(time); }
  void reset() { *this = FrameGrids(); }

 private:
  FrameGrid before_, after_;
  std::int64_t from_ = 0;
};

}  // namespace polyhull
