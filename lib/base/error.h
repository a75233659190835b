// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The one exception type of the core library.
#pragma once

#include <fmt/core.h>

#include <stdexcept>
#include <utility>

namespace polyhull {

/// What went wrong, where (file, line, camera, property), what was expected and what to do, in a
/// sentence for people. Elements turn it into one GST_ELEMENT_ERROR, tools print it and
/// exit with 1.
class Error : public std::runtime_error {
 public:
  enum class Kind {
    not_found,    ///< a file or device is missing
    io,           ///< reading or writing failed
    bad_input,    ///< the content is not what its format promises
    unsupported,  ///< valid, but beyond what this build or machine does
  };
  /// \p format is libfmt's, held against \p values when it is compiled.
  template <typename... Values>
  Error(Kind kind, fmt::format_string<Values...> format, Values&&... values)
      : std::runtime_error(fmt::format(format, std::forward<Values>(values)...)), kind_(kind) {}
  Kind kind() const { return kind_; }

 private:
  Kind kind_;
};

}  // namespace polyhull
