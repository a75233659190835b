// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A scene's light that is there at once and exact some seconds later.
///
/// The first light has a sixth of the points along each direction and a sixteenth of the ways to
/// the lamps, which costs a fortieth of the exact light. Better ones are computed on another thread
/// meanwhile; each is faded in over some frames, so that nothing jumps. All are kept on the exact
/// light's grid: what shows them need not know. The last one is the exact light to the bit.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "raytrace/light_cache.h"

namespace polyhull {

class GradualLight {
 public:
  /// Over how many frames a better light is faded in.
  static constexpr int fade_frames = 12;

  /// Called on the other thread with the exact light and the scene that it is of.
  using Finished = std::function<void(const TracedScene& scene, const LightCache& light)>;

  /// Begins to compute better lights of \p scene, which is copied, with \p options. What
  /// \p finished throws is lost.
  GradualLight(const Scene& scene, const LightCacheOptions& options, Finished finished);
  /// Ends the work, finished or not.
  ~GradualLight();

  /// The first light, computed here and now; \p scene must outlive it.
  static std::unique_ptr<LightCache> first(const TracedScene& scene,
                                           const LightCacheOptions& options);

  /// Brings \p light, which first() gave, a frame further; true if it has changed.
  bool advance(LightCache& light);

  /// Computes nothing further: advance() goes on to what there is. Does not wait.
  void stop() { stop_ = true; }

  /// Whether the light is the exact one.
  bool is_exact() const { return exact_; }

  /// Why no better light than the last will come; empty: one may, or it is the exact one.
  std::string failure() const;

  /// Rays by now for the lights on the other thread.
  std::uint64_t rays() const { return rays_; }

 private:
  void work(Scene scene);

  const LightCacheOptions options_;
  const Finished finished_;
  mutable std::mutex mutex_;
  std::string failure_;  // as the next two: under the mutex
  std::optional<LightValues> next_;
  bool next_is_exact_ = false;
  std::atomic<std::uint64_t> rays_ = 0;
  std::atomic<bool> stop_ = false;
  LightValues from_, to_;
  int frame_ = 0;  // of the fade; 0: none
  bool to_exact_ = false, exact_ = false;
  std::thread thread_;  // last: it uses the others
};

}  // namespace polyhull
