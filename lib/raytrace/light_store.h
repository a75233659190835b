// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The light of scenes, kept in files from one run to the next: it takes seconds to compute and
/// milliseconds to read.
///
/// A file is named after a hash of all that the light depends on (the scene's surfaces, materials,
/// textures and lights, and LightCacheOptions), and holds a hash of its content: what was cut off,
/// changed or made by another version is not used, and is written anew. A file in use is mapped, and only ever
/// replaced or removed as a whole here; should another program cut it off in place, or its disk fail, SIGBUS ends
/// the process.
#pragma once

#include <filesystem>
#include <memory>

#include "raytrace/light_cache.h"

namespace polyhull {

/// The light of \p scene as store_light() left it in \p folder; null where it is not there or not
/// usable. \p scene must outlive it.
std::unique_ptr<LightCache> load_light(const TracedScene& scene, const LightCacheOptions& options,
                                       const std::filesystem::path& folder);

/// Writes \p light, which was made of \p scene as it is now with \p options, into \p folder, which
/// is made if it is not there, and removes the files that were not used for the longest time but
/// for sixteen. Several processes may do so at once. Throws Error where it cannot be written.
void store_light(const LightCache& light, const TracedScene& scene,
                 const LightCacheOptions& options, const std::filesystem::path& folder);

}  // namespace polyhull
