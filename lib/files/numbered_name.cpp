// SPDX-License-Identifier: LGPL-2.1-or-later
#include "files/numbered_name.h"

#include "base/error.h"

namespace polyhull {

NumberedName::NumberedName(const std::string& pattern) {
  constexpr std::size_t widest = 20;
  for (std::size_t i = 0; i < pattern.size(); ++i) {
    std::string& target = numbered_ ? after_ : before_;
    if (pattern[i] != '%') {
      target += pattern[i];
      continue;
    }
    if (++i < pattern.size() && pattern[i] == '%') {
      target += '%';
      continue;
    }
    bool zeros = false;
    std::size_t width = 0;
    if (i < pattern.size() && pattern[i] == '0') zeros = true;
    for (; i < pattern.size() && pattern[i] >= '0' && pattern[i] <= '9' && width <= widest; ++i)
      width = 10 * width + (pattern[i] - '0');
    if (numbered_ || width > widest || i >= pattern.size() || pattern[i] != 'd')
      throw Error(Error::Kind::bad_input,
                  "The file name '{}' cannot be numbered; use one %d, or one such as %05d, and %% "
                  "for a percent sign.",
                  pattern);
    numbered_ = true;
    zeros_ = zeros;
    width_ = width;
  }
}

std::string NumberedName::name(std::uint64_t number) const {
  if (!numbered_) return before_;
  std::string digits = std::to_string(number);
  if (digits.size() < width_) digits.insert(0, width_ - digits.size(), zeros_ ? '0' : ' ');
  return before_ + digits + after_;
}

}  // namespace polyhull
