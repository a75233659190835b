// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A scene's light while its lamps are dimmed and coloured one by one. Light is linear:
///   E = E_0 + sum over lamps (L - L_0) K
/// E_0 the light under the lamps' radiances L_0, K the light of a lamp alone with radiance 1. K is
/// computed when its lamp is first changed, and kept: from then on a change costs a sum over the light's
/// points.
#pragma once

#include <map>
#include <memory>
#include <vector>

#include "raytrace/light_cache.h"

namespace polyhull {

class GradualLight;

class LampMix {
 public:
  LampMix();
  ~LampMix();

  /// Forgets all lamps: the scene's geometry or the light has become another.
  void forget();
  /// Whether no lamp is known.
  bool empty() const { return lamps_.empty(); }

  /// Makes \p light, the exact one of \p scene with \p options under some lights or what this has made of it,
  /// that under lights whose radiances differ from those by \p differences. False where that would keep
  /// too much memory: then it is unchanged. With \p gradual a lamp's light is coarse at first, and
  /// better with each advance().
  bool show(const TracedScene& scene, const LightCacheOptions& options, bool gradual,
            const std::vector<Vec3f>& differences, LightCache& light);

  /// Brings the lamps' light a frame further; true if \p light has changed.
  bool advance(const TracedScene& scene, const LightCacheOptions& options, LightCache& light);

  /// Whether no lamp's light is on its way.
  bool is_exact() const;

 private:
  struct Lamp;
  void begin_next(const TracedScene& scene, const LightCacheOptions& options);
  void mix(LightCache& light) const;

  std::map<std::size_t, std::unique_ptr<Lamp>> lamps_;  // by number
  std::shared_ptr<const LightValues> base_;  // E_0; null: no lamp differs, the light has it
  std::vector<Vec3f> differences_;
};

}  // namespace polyhull
