// SPDX-License-Identifier: LGPL-2.1-or-later
#include "live/lateness_window.h"

#include <algorithm>

namespace polyhull {

void LatenessWindow::add(std::int64_t now, std::int64_t value) {
  const std::int64_t number = std::max<std::int64_t>(now, 0) / width_;
  Slot& slot = newest_[static_cast<std::size_t>(number % slots)];
  slot = {number, slot.number == number ? std::max(slot.largest, value) : value};
}

LatenessWindow::Top LatenessWindow::top(std::int64_t now) const {
  const std::int64_t newest = std::max<std::int64_t>(now, 0) / width_;
  Top top;
  for (const Slot& slot : newest_) {
    // A slot from the future is one of before a clock was set back.
    if (slot.number < 0 || slot.number > newest || slot.number <= newest - slots) continue;
    if (!top.largest || slot.largest > *top.largest) {
      top.second = top.largest;
      top.largest = slot.largest;
    } else {
      top.second = std::max(top.second.value_or(slot.largest), slot.largest);
    }
  }
  return top;
}

}  // namespace polyhull
