// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How punctual one input of several is: what all wait for depends on the latest.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>

#include "live/lateness_window.h"

namespace polyhull {

/// How late what one input brings comes, and what its sources say of it. May be used by any thread.
class Punctuality {
 public:
  /// Notes something of running time \p time that comes at \p now (ns). One that is later than
  /// the limit is no measure for the others.
  void note(std::int64_t now, std::int64_t time);
  /// The largest lateness that latest() counts, ns.
  void set_limit(std::int64_t limit);
  /// Notes the least latency that the sources report, ns.
  void note_reported(std::int64_t latency);

  /// How late it came at most in the last ten seconds, ns; none: none came.
  std::optional<std::int64_t> latest(std::int64_t now) const;
  /// The same with those beyond the limit.
  std::optional<std::int64_t> latest_of_all(std::int64_t now) const;
  /// Running time when the last came, ns; none: none came.
  std::optional<std::int64_t> last_arrival() const;
  /// What note_reported() was told, ns; 0: nothing.
  std::int64_t reported() const;
  /// Forgets what came; the limit and what the sources report stay.
  void reset();

 private:
  mutable std::mutex mutex_;  // protects all below
  LatenessWindow window_, all_;
  std::optional<std::int64_t> last_arrival_;
  std::int64_t limit_ = INT64_MAX;
  std::int64_t reported_ = 0;
};

}  // namespace polyhull
