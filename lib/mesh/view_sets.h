// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Which views of several cameras belong together.
///
/// Each camera delivers views in order; the heads of these queues are looked at together. A set is
/// formed around the earliest head: by trigger number where all heads have one, else by running
/// time. A view that comes after its set has gone is late and never joins another. When trigger
/// numbers start again (a camera or trigger was restarted) while time goes on, that round is
/// matched by time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/view.h"

namespace polyhull {

/// The front of one camera's queue.
struct ViewHead {
  enum class State {
    waiting,  ///< nothing there, more may come
    ended,    ///< nothing there, nothing will come
    gap,      ///< the camera says that it has nothing until gap_end
    view,
  };
  State state = State::waiting;
  std::uint64_t trigger = no_trigger;
  std::int64_t time = no_time;     ///< running time, ns
  std::int64_t gap_end = no_time;  ///< of a gap: running time, ns
  bool repeated = false;           ///< its trigger number or time is that of this queue's last view
};

/// What to do next.
struct ViewDecision {
  enum class Kind {
    wait,            ///< for the cameras that have nothing there
    end,             ///< all cameras have ended
    drop_gaps,       ///< remove these gaps and ask again
    drop_late,       ///< remove these views, whose set has gone, and ask again
    drop_duplicate,  ///< remove these views, which came twice, and ask again
    set,             ///< these views form the next set; the others are missing
  };
  Kind kind = Kind::wait;
  std::vector<std::size_t> heads;      ///< indices, rising
  std::int64_t time = no_time;         ///< of a set: its earliest running time, ns
  std::uint64_t trigger = no_trigger;  ///< of a set
};

class ViewSets {
 public:
  /// Decides about \p heads. \p tolerance (ns): how far running times of one set may differ.
  /// \p deadline_passed: do not wait any longer for cameras that have nothing there. A decision for
  /// a set counts as carried out.
  ViewDecision next(std::span<const ViewHead> heads, std::int64_t tolerance, bool deadline_passed);

  /// Forgets the last set: after a flush or a change of state.
  void reset() { *this = ViewSets(); }

 private:
  bool restarted(const ViewHead& head, std::int64_t tolerance) const;
  bool late(const ViewHead& head, std::int64_t tolerance) const;
  std::vector<std::size_t> members(std::span<const ViewHead> heads, std::int64_t tolerance) const;

  std::uint64_t last_trigger_ = no_trigger;
  std::int64_t last_time_ = no_time;
};

}  // namespace polyhull
