// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Sentences with numbers in them.
#pragma once

#include <cstdarg>
#include <cstdio>
#include <string>

namespace polyhull {

/// What printf would print, at most 1023 bytes of it.
__attribute__((format(printf, 1, 2))) inline std::string format(const char* pattern, ...) {
  char text[1024];
  va_list arguments;
  va_start(arguments, pattern);
  std::vsnprintf(text, sizeof text, pattern, arguments);
  va_end(arguments);
  return text;
}

}  // namespace polyhull
