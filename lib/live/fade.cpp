// SPDX-License-Identifier: LGPL-2.1-or-later
#include "live/fade.h"

#include <algorithm>

namespace polyhull {

void Fade::pass(std::int64_t time) {
  const bool known = time != none && now_ != none && time >= now_;
  step_ = known ? static_cast<double>(time - now_) / duration : 1.0;
  if (!known) lose_picture();
  now_ = time;
}

float Fade::opacity() const {
  return static_cast<float>(std::min(opacity_ + step_, 1.0));
}

void Fade::shown() {
  opacity_ = std::min(opacity_ + step_, 1.0);
  shown_at_ = now_;
}

std::optional<float> Fade::hide(std::int64_t hold) {
  if (now_ == none || opacity_ <= 0.0) return std::nullopt;
  const bool lost = shown_at_ == none;
  if (!lost && now_ - shown_at_ <= std::max(hold, still)) return std::nullopt;
  opacity_ = lost ? 0.0 : std::max(opacity_ - step_, 0.0);
  return static_cast<float>(opacity_);
}

std::optional<float> Fade::settle() {
  if (!half_way()) return std::nullopt;
  opacity_ = shown_at_ == now_ ? 1.0 : 0.0;
  return static_cast<float>(opacity_);
}

}  // namespace polyhull
