// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The edge between C++ and GStreamer: no exception crosses a virtual function of an element.
#pragma once

#include <gst/gst.h>

#include <exception>
#include <string>
#include <type_traits>
#include <utility>

namespace polyhull::element {

/// \p text, which may come from the library as a part of a sentence, with a full stop at its end; bytes
/// that are no UTF-8 are replaced.
std::string sentence(std::string text);

/// Posts one error message on \p element for \p error: polyhull::Error by its kind, std::bad_alloc
/// as lack of memory, anything else as a failure of the library. The sentence for people is what().
void post_error(GstElement* element, const std::exception& error);

/// Calls \p body. If it throws, posts one error message on \p element and returns \p failure
/// (FALSE, GST_FLOW_ERROR, nullptr ...).
template <class Body, class Result = std::invoke_result_t<Body>>
Result guarded(GstElement* element, std::type_identity_t<Result> failure, Body&& body) {
  try {
    return std::forward<Body>(body)();
  } catch (const std::exception& error) {
    post_error(element, error);
    return failure;
  }
}

}  // namespace polyhull::element
