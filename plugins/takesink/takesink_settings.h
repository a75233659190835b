// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What can be set at takesink.
#pragma once

#include <span>
#include <string>

#include "plugins/common/element.h"
#include "take/packing.h"
#include "take/take_writer.h"

namespace polyhull::element {

struct TakeSinkSettings {
  std::string location;
  TakeWriter::Existing existing = TakeWriter::Existing::refuse;
  std::string rig;
  std::string settings;
  Packing compression = Packing::none;
  std::uint32_t key_interval = PackingSettings().key_interval;
  double precision = PackingSettings().precision;
  int quantizer = PackingSettings().quantizer;
};

std::span<const Property<TakeSinkSettings>> takesink_properties();

/// How packets are packed by these.
PackingSettings packing_of(const TakeSinkSettings& settings);

/// What is kept in the take of the files that are named.
struct TakeTexts {
  std::string rig, settings;
};

/// Throws Error: not_found where one cannot be read, bad_input where the take that is to be added to
/// keeps another rig.
TakeTexts read_texts(const TakeSinkSettings& settings);

}  // namespace polyhull::element
