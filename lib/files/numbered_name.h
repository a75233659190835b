// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// File names with a number in them, as users write them: "hull-%05d.glb".
#pragma once

#include <cstdint>
#include <string>

namespace polyhull {

/// A file name with at most one integer conversion (%d, %5d, %05d; %% is a percent sign).
class NumberedName {
 public:
  /// Throws Error for other conversions, and for widths above 20: the pattern comes from users and
  /// must not reach printf.
  explicit NumberedName(const std::string& pattern);

  /// Whether the name has a number in it.
  bool numbered() const { return numbered_; }

  /// The name for \p number.
  std::string name(std::uint64_t number) const;

 private:
  std::string before_, after_;
  bool numbered_ = false;
  bool zeros_ = false;
  std::size_t width_ = 0;
};

}  // namespace polyhull
