// SPDX-License-Identifier: LGPL-2.1-or-later
#include "view/gradual_light.h"

#include <algorithm>
#include <exception>

#include "base/thread_pool.h"

namespace polyhull {
namespace {

/// How much coarser than the exact light one is: the distances between points are longer, and ways
/// and directions fewer.
struct Step {
  float spacing, bounce_spacing;
  int first_samples, samples;
};
// In the built-in room 38 and 44 dB from the exact light's picture, for 1/40 and 1/9 of its time.
constexpr Step first_step{6.0f, 4.0f, 6, 16};
constexpr Step next_step{2.0f, 2.0f, 2, 4};

LightCacheOptions coarser(LightCacheOptions options, const Step& step) {
  const auto fewer = [](int count, int by) { return std::max(count / by, 1); };
  options.spacing *= step.spacing;
  options.bounce_spacing *= step.bounce_spacing;
  options.first_samples = fewer(options.first_samples, step.first_samples);
  options.light_samples = fewer(options.light_samples, step.samples);
  options.bounce_samples = fewer(options.bounce_samples, step.samples);
  options.borders = false;
  options.divided.reset();
  return options;
}

LightValues mixed(LightValues from, const LightValues& to, float share) {
  for (std::size_t side = 0; side < from.sides.size(); ++side)
    for (std::size_t i = 0; i < from.sides[side].size(); ++i)
      from.sides[side][i] += share * (to.sides[side][i] - from.sides[side][i]);
  from.mean_bounced = glm::mix(from.mean_bounced, to.mean_bounced, share);
  return from;
}

}  // namespace

GradualLight::GradualLight(const Scene& scene, const LightCacheOptions& options, Finished finished)
    : options_(options),
      finished_(std::move(finished)),
      thread_([this, copy = scene]() mutable { work(std::move(copy)); }) {}

GradualLight::~GradualLight() {
  stop_ = true;
  thread_.join();
}

std::unique_ptr<LightCache> GradualLight::first(const TracedScene& scene,
                                                const LightCacheOptions& options) {
  const LightCache coarse(scene, coarser(options, first_step));
  auto light = std::make_unique<LightCache>(scene, options, coarse.values_for(scene, options));
  light->count_rays(coarse.rays());
  return light;
}

/// Of a copy of the scene, whose lights may move meanwhile.
void GradualLight::work(Scene copy) {
  try {
    if (stop_) return;
    const TracedScene scene(std::move(copy));
    if (stop_) return;
    LightCacheOptions options = options_;
    // Half of the threads are left to the pictures.
    options.threads = std::max((options.threads > 0 ? options.threads : pool_threads()) / 2, 1);
    const auto offer = [&](LightValues values, bool exact) {
      const std::lock_guard lock(mutex_);
      next_ = std::move(values);
      next_is_exact_ = exact;
    };
    {
      const LightCache better(scene, coarser(options, next_step), &stop_);
      if (stop_) return;
      rays_ += better.rays();
      offer(better.values_for(scene, options), false);
    }
    const LightCache exact(scene, options, &stop_);
    if (stop_) return;
    rays_ += exact.rays();
    offer(exact.all_values(), true);
    finished_(scene, exact);
  } catch (const std::exception& e) {
    const std::lock_guard lock(mutex_);
    failure_ = e.what();
  }
}

std::string GradualLight::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

bool GradualLight::advance(LightCache& light) {
  if (frame_ == 0) {
    const std::lock_guard lock(mutex_);
    if (!next_) return false;
    to_ = std::move(*next_);
    next_.reset();
    to_exact_ = next_is_exact_;
    from_ = light.divided_as(to_);
  }
  if (++frame_ < fade_frames) {
    light.set_values(mixed(from_, to_, static_cast<float>(frame_) / fade_frames));
    return true;
  }
  light.set_values(std::move(to_));
  frame_ = 0;
  exact_ = to_exact_;
  return true;
}

}  // namespace polyhull
