// SPDX-License-Identifier: LGPL-2.1-or-later
#include "live/lateness_window.h"

#include <algorithm>

namespace polyhull {

void LatenessWindow::add(std::int64_t now, std::int64_t value) {
  const std::int64_t number = std::max<std::int64_t>(now, 0) / width_;
  Slot& slot = newest_[static_cast<std::size_t>(number % slots)];
  slot = {number, slot.number == number ? std::max(slot.largest, value) : value};
}

std::optional<std::int64_t> LatenessWindow::largest(std::int64_t now) const {
  const std::int64_t newest = std::max<std::int64_t>(now, 0) / width_;
  std::optional<std::int64_t> result;
  for (const Slot& slot : newest_) {
    // A slot from the future is one of before a clock was set back.
    if (slot.number < 0 || slot.number > newest || slot.number <= newest - slots) continue;
    result = std::max(result.value_or(slot.largest), slot.largest);
  }
  return result;
}

}  // namespace polyhull
