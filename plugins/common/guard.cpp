// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/guard.h"

#include <new>

#include "base/error.h"

namespace polyhull::element {

std::string sentence(std::string text) {
  if (!text.empty() && text.back() != '.') text += '.';
  // Messages quote files and packets, and those who receive them take them for UTF-8.
  g_autofree gchar* valid = g_utf8_make_valid(text.data(), static_cast<gssize>(text.size()));
  return valid;
}

void post_error(GstElement* element, const std::exception& error) {
  const std::string text = sentence(error.what());
  const char* const what = text.c_str();
  if (const auto* known = dynamic_cast<const Error*>(&error)) {
    switch (known->kind()) {
      case Error::Kind::not_found:
        GST_ELEMENT_ERROR(element, RESOURCE, NOT_FOUND, ("%s", what), (nullptr));
        return;
      case Error::Kind::io:
        GST_ELEMENT_ERROR(element, RESOURCE, FAILED, ("%s", what), (nullptr));
        return;
      case Error::Kind::bad_input:
        GST_ELEMENT_ERROR(element, STREAM, FORMAT, ("%s", what), (nullptr));
        return;
      case Error::Kind::unsupported:
        GST_ELEMENT_ERROR(element, STREAM, NOT_IMPLEMENTED, ("%s", what), (nullptr));
        return;
    }
  }
  if (dynamic_cast<const std::bad_alloc*>(&error) != nullptr) {
    GST_ELEMENT_ERROR(element, RESOURCE, NO_SPACE_LEFT,
                      ("There is not enough memory for this stream. Use smaller pictures, or end "
                       "other programs."),
                      ("%s", what));
    return;
  }
  GST_ELEMENT_ERROR(element, LIBRARY, FAILED, ("%s", what), (nullptr));
}

}  // namespace polyhull::element
