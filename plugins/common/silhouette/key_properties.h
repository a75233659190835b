// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The properties of chromamatte, which silhouette has too.
#pragma once

#include <span>
#include <string>

#include "plugins/common/property_table.h"
#include "plugins/common/statistics.h"
#include "silhouette/key/key_configuration.h"
#include "silhouette/key/key_score.h"

namespace polyhull::element {

/// One row per property of KeyValues.
std::span<const Property<KeyValues>> key_properties();

/// What chromamatte shows on its output; silhouette has no such property.
struct KeyViewValues {
  KeyView view = KeyView::composite;
};

/// One row per property of KeyViewValues.
std::span<const Property<KeyViewValues>> key_view_properties();

/// As KeyConfiguration::apply() of \p configuration; what cannot be used is a warning on
/// \p element, once, if there are settings to go on with, else it throws Error.
void configure_key(KeyConfiguration& configuration, GstElement* element, Statistics& statistics,
                   const KeyValues& values, const std::string& camera, int width, int height,
                   const std::function<void(const KeySettings&)>& accept);

/// Makes the key's entries appear in `stats`.
void declare_key_statistics(Statistics& statistics);

/// Writes what the keyer measured to `stats`, and warns on \p element of what it lacks.
void report_calibration(const KeyCalibration& calibration, GstElement* element,
                        Statistics& statistics);

/// Writes how clear a matte is to `stats`.
void report_score(const KeyScore& score, Statistics& statistics);

}  // namespace polyhull::element
