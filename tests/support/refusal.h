// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Errors that a test expects, and what they say.
#pragma once

#include <gtest/gtest.h>

#include <initializer_list>
#include <optional>
#include <string>

#include "base/error.h"

namespace polyhull::test {

/// What the Error says that \p action throws; "" where it throws none.
template <class Action>
std::string refusal_of(Action&& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

/// Expects \p action to throw an Error, of \p kind where one is given, with all \p words in its sentence.
template <class Action>
void expect_refused(Action&& action, std::initializer_list<std::string> words,
                    std::optional<Error::Kind> kind = {}) {
  try {
    action();
    ADD_FAILURE() << "no error, instead of one with " << *words.begin();
  } catch (const Error& error) {
    if (kind) {
      EXPECT_EQ(error.kind(), *kind) << error.what();
    }
    for (const std::string& part : words)
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos)
          << part << " is not in: " << error.what();
  }
}

template <class Action>
void expect_refused(Action&& action, const std::string& words) {
  expect_refused(action, {words});
}

}  // namespace polyhull::test
