// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The properties of gaussblur, which silhouette has too.
#pragma once

#include <span>

#include "plugins/common/property_table.h"
#include "silhouette/blur/blur.h"

namespace polyhull::element {

/// One row per property of BlurSettings.
std::span<const Property<BlurSettings>> blur_properties();

}  // namespace polyhull::element
