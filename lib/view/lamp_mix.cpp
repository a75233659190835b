// SPDX-License-Identifier: LGPL-2.1-or-later
#include "view/lamp_mix.h"

#include <algorithm>
#include <utility>

#include "base/thread_pool.h"
#include "view/gradual_light.h"

namespace polyhull {
namespace {

constexpr std::size_t most_bytes = 256u << 20u;  // of all lamps' lights together
constexpr std::size_t grain = 4096;

std::size_t bytes_of(const LightCache& light) {
  return light.side(0).size_bytes() + light.side(1).size_bytes();
}

LightCacheOptions alone(LightCacheOptions options, std::size_t lamp,
                        std::shared_ptr<const LightValues> divided) {
  options.lamp = static_cast<int>(lamp);
  options.divided = std::move(divided);
  return options;
}

}  // namespace

struct LampMix::Lamp {
  std::unique_ptr<LightCache> light;  // null once it is exact
  LightValues values;                 // of the same cells as the base's
  std::unique_ptr<GradualLight> better;
  bool waits = false;  // for its turn to become better

  void take(const LightValues& base) {
    values = light->all_values();
    const bool divided = values.sides[0].size() == base.sides[0].size() &&
                         values.sides[1].size() == base.sides[1].size();
    if (!divided) values = light->divided_as(base);
  }
};

LampMix::LampMix() = default;
LampMix::~LampMix() = default;

void LampMix::forget() {
  lamps_.clear();
  base_.reset();
}

bool LampMix::is_exact() const {
  return std::none_of(lamps_.begin(), lamps_.end(), [](const auto& lamp) {
    return lamp.second->waits || lamp.second->better != nullptr;
  });
}

bool LampMix::show(const TracedScene& scene, const LightCacheOptions& options, bool gradual,
                   const std::vector<Vec3f>& differences, LightCache& light) {
  const auto differs = [](const Vec3f& difference) { return difference != Vec3f(0.0f); };
  if (std::none_of(differences.begin(), differences.end(), differs)) {
    if (base_ && std::any_of(differences_.begin(), differences_.end(), differs))
      light.set_values(*base_);
    differences_ = differences;
    return true;
  }
  std::vector<std::size_t> missing;
  for (std::size_t i = 0; i < differences.size(); ++i)
    if (differs(differences[i]) && !lamps_.contains(i)) missing.push_back(i);
  if ((lamps_.size() + missing.size()) * bytes_of(light) > most_bytes) return false;
  if (!base_) base_ = std::make_shared<const LightValues>(light.all_values());
  differences_ = differences;
  for (const std::size_t i : missing) {
    auto lamp = std::make_unique<Lamp>();
    const LightCacheOptions own = alone(options, i, base_);
    lamp->light =
        gradual ? GradualLight::first(scene, own) : std::make_unique<LightCache>(scene, own);
    lamp->take(*base_);
    light.count_rays(lamp->light->rays());
    lamp->waits = gradual;
    if (!gradual) lamp->light.reset();
    lamps_.emplace(i, std::move(lamp));
  }
  begin_next(scene, options);
  mix(light);
  return true;
}

/// One lamp's light is computed at a time.
void LampMix::begin_next(const TracedScene& scene, const LightCacheOptions& options) {
  for (const auto& [i, lamp] : lamps_)
    if (lamp->better) return;
  for (const auto& [i, lamp] : lamps_) {
    if (!lamp->waits) continue;
    lamp->waits = false;
    lamp->better = std::make_unique<GradualLight>(scene.scene(), alone(options, i, base_),
                                                  [](const TracedScene&, const LightCache&) {});
    return;
  }
}

bool LampMix::advance(const TracedScene& scene, const LightCacheOptions& options,
                      LightCache& light) {
  bool changed = false;
  for (const auto& [i, lamp] : lamps_) {
    if (!lamp->better) continue;
    const bool shown = differences_[i] != Vec3f(0.0f);
    if (lamp->better->advance(*lamp->light)) {
      lamp->take(*base_);
      changed |= shown;
    }
    if (lamp->better->is_exact()) light.count_rays(lamp->better->rays());
    if (!lamp->better->is_exact() && lamp->better->failure().empty()) continue;
    lamp->better.reset();  // where it failed the last one stays
    lamp->light.reset();
    begin_next(scene, options);
    break;
  }
  if (changed) mix(light);
  return changed;
}

void LampMix::mix(LightCache& light) const {
  LightValues values = *base_;
  for (const auto& [i, lamp] : lamps_) {
    const Vec3f& by = differences_[i];
    if (by == Vec3f(0.0f)) continue;
    values.mean_bounced += by * lamp->values.mean_bounced;
    for (std::size_t side = 0; side < values.sides.size(); ++side) {
      std::vector<Float4>& sum = values.sides[side];
      const std::vector<Float4>& own = lamp->values.sides[side];
      const Float4 factor{by.x, by.y, by.z, 0.0f};  // the fourth number is no light
      parallel_for(sum.size(), grain, 0, [&](std::size_t begin, std::size_t end) {
        for (std::size_t n = begin; n < end; ++n) sum[n] += factor * own[n];
      });
    }
  }
  // A lamp that is switched off takes no more than it gave, but for rounding.
  values.mean_bounced = glm::max(values.mean_bounced, Vec3f(0.0f));
  for (std::vector<Float4>& side : values.sides)
    parallel_for(side.size(), grain, 0, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n)
        for (int k = 0; k < 3; ++k) side[n][k] = std::max(side[n][k], 0.0f);
    });
  light.set_values(std::move(values));
}

}  // namespace polyhull
