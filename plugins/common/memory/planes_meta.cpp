// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/memory/planes_meta.h"

#include <utility>

#include "plugins/common/memory/shared_meta.h"

namespace polyhull::element {
namespace {

struct PlanesTraits {
  using Value = ScenePlanes;
  static constexpr char api_name[] = "PolyhullPlanesMetaAPI";
  static constexpr char meta_name[] = "PolyhullPlanesMeta";
};
using PlanesMeta = SharedMeta<PlanesTraits>;

}  // namespace

void set_planes(GstBuffer* buffer, std::shared_ptr<const ScenePlanes> planes) {
  PlanesMeta::set(buffer, std::move(planes));
}

std::shared_ptr<const ScenePlanes> attached_planes(GstBuffer* buffer) {
  return PlanesMeta::get(buffer);
}

}  // namespace polyhull::element
