// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Looking around in the pipeline that an element stands in.
#pragma once

#include <functional>
#include <string>

#include "plugins/common/elements_in.h"

namespace polyhull::element {

/// The element of the whole pipeline around \p seeker for which \p suits holds; with \p name not
/// empty, that of this name. Throws Error where there is none, or more than one of any name;
/// \p what says in the message what was looked for, as "serialtrigger"; \p property, which property
/// names it.
Ref<GstElement> find_in_pipeline(GstElement* seeker, const std::string& name, const char* property,
                                 const char* what, const std::function<bool(GstElement*)>& suits);

}  // namespace polyhull::element
