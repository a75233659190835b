// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How a subject fades: where it cannot be shown any more the last picture of it stands still for a
/// moment and fades out; once it can, it fades in again.
#pragma once

#include <cstdint>
#include <optional>

namespace polyhull {

/// Times are running times in ns, rising; INT64_MIN: none, and then nothing fades. For one thread.
class Fade {
 public:
  static constexpr std::int64_t duration = 300'000'000;  ///< from all to nothing, and back
  /// For so long a picture that stands still is nearer to the truth than none (docs/missing-camera.md).
  static constexpr std::int64_t still = 500'000'000;

  void reset() { *this = Fade(); }

  /// The instant \p time is looked at: opacity may change by what has passed since the one before.
  void pass(std::int64_t time);

  /// The opacity (0..1) of that instant, if it is shown.
  float opacity() const;
  /// It has been shown.
  void shown();

  /// It cannot be shown, and the last picture has to stand still for \p hold, or `still`, in all. The
  /// opacity of that from now on; none: it stays as it is, or is gone.
  std::optional<float> hide(std::int64_t hold);

 private:
  static constexpr std::int64_t none = INT64_MIN;
  std::int64_t now_ = none, shown_at_ = none;
  double step_ = 1.0;     // by which opacity may change now
  double opacity_ = 1.0;  // as it was last told
};

}  // namespace polyhull
