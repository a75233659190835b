// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A subject at one instant, computed once for all cameras of a process that see it.
#pragma once

#include <mutex>
#include <optional>

#include "studio/figure/floor_shadow.h"
#include "studio/figure/subject.h"

namespace polyhull {

/// From Subject::instant(). Lives no longer than its subject. Safe to use from several threads: the
/// first that asks computes, the others wait for it.
class SubjectInstant {
 public:
  SubjectInstant(const Subject& subject, double seconds) : subject_(subject), seconds_(seconds) {}

  double seconds() const { return seconds_; }
  const SubjectFrame& surface() const;
  const FloorShadow& shadow() const;

 private:
  const Subject& subject_;
  double seconds_;
  mutable std::once_flag posed_, cast_;
  mutable SubjectFrame surface_;
  mutable std::optional<FloorShadow> shadow_;
};

}  // namespace polyhull
