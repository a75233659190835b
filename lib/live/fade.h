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

  /// Nothing has been shown.
  void reset() { *this = Fade(); }

  /// The instant \p time is looked at: opacity may change by what has passed since the one before. One
  /// that is earlier begins another stream: what is shown then does not fade in.
  void pass(std::int64_t time);

  /// The opacity (0..1) of that instant, if it is shown.
  float opacity() const;
  /// It has been shown.
  void shown();

  /// The last picture is no longer to be had, though it still stands.
  void lose_picture() { shown_at_ = none; }

  /// It cannot be shown, and the last picture has to stand still for \p hold, or `still`, in all. The
  /// opacity of that from now on, 0 at once where it is not to be had; none: it stays as it is, or is
  /// gone.
  std::optional<float> hide(std::int64_t hold);

  /// Whether it is neither all there nor gone.
  bool half_way() const { return now_ != none && opacity_ > 0.0 && opacity_ < 1.0; }
  /// No instant comes to go on with: ends a fade that is half way. The opacity of the last picture from
  /// now on; none: it stays as it is.
  std::optional<float> settle();

  /// Of the instant that was looked at last.
  std::int64_t time() const { return now_; }

 private:
  static constexpr std::int64_t none = INT64_MIN;
  std::int64_t now_ = none, shown_at_ = none;
  double step_ = 1.0;     // by which opacity may change now
  double opacity_ = 0.0;  // as it was last told
};

}  // namespace polyhull
