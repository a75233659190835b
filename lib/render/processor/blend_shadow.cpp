// SPDX-License-Identifier: LGPL-2.1-or-later
// What a picture's pixels lose of the light, and whether that is to be seen.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numbers>
#include <utility>

#include "base/srgb.h"
#include "render/light_samples.h"
#include "render/processor/blend.h"

namespace polyhull::processor {
namespace {

constexpr int sixteen = 16;

/// The most that each code of sRGB may lose, in linear light, and come out of Loops::blend() as it was. The
/// next code below begins half a step away; blend()'s lines are within a sixtieth of a step, and as much again
/// is for rounding.
std::array<float, 256> find_unseen() {
  constexpr double kept = 0.5 - 2.0 / 60.0;  // of a step
  std::array<float, 256> out;
  for (int code = 0; code < 256; ++code) {
    const double from = code / 255.0, to = (code - kept) / 255.0;
    // As srgb_to_linear(), to beyond 0.
    const auto linear = [](double c) {
      return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
    };
    out[static_cast<std::size_t>(code)] = static_cast<float>(linear(from) - linear(to));
  }
  return out;
}

}  // namespace

/// Finds for each code how much may be taken of all channels' light at most where nobody sees it; where nothing
/// is skipped, what is no change to blend().
void Blend::find_least_taken() {
  static const std::array<float, 256> unseen = find_unseen();
  const float most = std::max({power_[0], power_[1], power_[2]});
  no_change_ = 0.999f * BlendPixels::least_missing / std::max(most, 1e-30f);
  for (int c = 0; c < 3; ++c)
    for (std::size_t code = 0; code < unseen.size(); ++code)
      least_taken_[c][code] = settings_.skip
                                  ? std::max(no_change_, unseen[code] / std::max(power_[c], 1e-30f))
                                  : no_change_;
}

/// The least code of each channel of the background of pixels \p x to \p end - 1.
std::uint32_t Blend::darkest_of(int x, int end, int y) const {
  const std::uint8_t* codes =
      background_ + static_cast<std::ptrdiff_t>(y) * background_stride_ + 4 * x;
  using Byte16 = std::uint8_t __attribute__((vector_size(16)));
  Byte16 least = ~Byte16{};
  int left = end - x;
  for (; left >= 4; left -= 4, codes += sizeof(Byte16)) {
    Byte16 four;
    std::memcpy(&four, codes, sizeof four);
    least = four < least ? four : least;
  }
  if (left > 0) {
    Byte16 rest = ~Byte16{};
    std::memcpy(&rest, codes, 4 * static_cast<std::size_t>(left));
    least = rest < least ? rest : least;
  }
  std::uint8_t bytes[16], out[4];
  std::memcpy(bytes, &least, sizeof bytes);
  for (int c = 0; c < 4; ++c)
    out[c] = std::min({bytes[c], bytes[c + 4], bytes[c + 8], bytes[c + 12]});
  std::uint32_t word;
  std::memcpy(&word, out, sizeof word);
  return word;
}

/// Whether what is \p taken of white surfaces is to be seen where the background is nowhere darker than
/// \p darkest.
bool Blend::is_seen(const Vec3f& taken, std::uint32_t darkest, bool opaque) const {
  for (int c = 0; c < 3; ++c)
    if (taken[c] > (opaque ? least_taken_[c][darkest >> 8 * c & 255] : no_change_)) return true;
  return false;
}

/// The most that any of columns \p x to \p end - 1 misses.
Vec3f Blend::Missing::most(int x, int end) const {
  Vec3f out(0.0f);
  if (!any) return out;
  for (int c = 0; c < 3; ++c) {
    if (end - x == BlendPixels::count) {
      using Float4 = float __attribute__((vector_size(16)));
      Float4 first, second;
      std::memcpy(&first, taken[c] + (x & 15), sizeof first);
      std::memcpy(&second, taken[c] + (x & 15) + 4, sizeof second);
      first = first > second ? first : second;
      out[c] = std::max(std::max(first[0], first[1]), std::max(first[2], first[3]));
    } else {
      for (int i = x; i < end; ++i) out[c] = std::max(out[c], taken[c][i & 15]);
    }
  }
  return out;
}

/// The shadows that row \p y may have, directly and in mirrors, and what of \p missing each is added to.
std::vector<Blend::Shadow> Blend::shadows_of(int y, AllMissing& missing) const {
  const auto within = [y](const Rectangle& part) {
    return !part.empty() && y >= part.y && y < part.y + part.height;
  };
  std::vector<Shadow> shadows;
  for (std::size_t i = 0; i < plan_.lights.size(); ++i) {
    const ShadowLight& light = plan_.lights[i];
    const LightShadow& shadow = *layers_.shadows[i];
    if (within(light.seen))
      shadows.push_back({&shadow.seen, nullptr, &layers_.direct, powers_[i], &missing.seen});
    for (std::size_t m = 0; m < light.in_mirrors.size(); ++m)
      if (within(light.in_mirrors[m]))
        shadows.push_back({shadow.in_mirrors[m], nullptr, &layers_.mirrors[m]->scene, powers_[i],
                           &missing.in_mirrors[m]});
  }
  if (plan_.soft_lights == 0) return shadows;
  if (within(plan_.shadow))
    shadows.push_back({nullptr, &layers_.soft, &layers_.direct, soft_power_, &missing.seen});
  for (std::size_t m = 0; m < plan_.mirrors.size(); ++m)
    if (within(plan_.mirrors[m].shadow))
      shadows.push_back({nullptr, &layers_.mirrors[m]->soft, &layers_.mirrors[m]->scene,
                         soft_power_, &missing.in_mirrors[m]});
  return shadows;
}

/// Whether it is sure without a look at each that nobody sees what the sixteen pixels from column \p x on lose.
bool Blend::is_lost_unseen(int x, int y, const std::vector<Shadow>& shadows) const {
  if (!settings_.skip || plan_.soft_lights == 0) return false;
  Vec3f most(0.0f);
  for (const auto& [shadow, soft, layer, power, missing] : shadows) {
    if (shadow && shadow->reaches(x, y)) return false;
    if (soft && soft->reaches(x, y)) most += power * soft->most(x, y);
  }
  if (most == Vec3f(0.0f)) return true;
  const std::uint32_t darkest =
      darkest_of(std::max(x, changed_.x), std::min(x + sixteen, changed_.x + changed_.width), y);
  const bool opaque = settings_.alpha == AlphaCoding::ignored || darkest >> 24 == 255;
  return opaque && !is_seen(most, darkest, opaque);
}

/// Finds what the sixteen pixels from column \p x on, a multiple of 16, lose to \p shadows. Returns whether
/// any.
bool Blend::find_missing(int x, int y, const std::vector<Shadow>& shadows) {
  for (const Shadow& shadow : shadows) shadow.into->any = false;
  bool any = false;
  float taken[3][sixteen];
  for (const auto& [shadow, soft, layer, power, missing] : shadows) {
    if (shadow ? !shadow->reaches(x, y) || !shadow->taken(*layer, x, y, taken[0])
               : !soft->reaches(x, y) || !soft->taken(*layer, x, y, taken))
      continue;
    const bool first = !std::exchange(missing->any, true);
    any = true;
    for (int c = 0; c < 3; ++c) {
      const float* const lost = taken[shadow ? 0 : c];
      float* const into = missing->taken[c];
      const float share = power[c];
      if (first)
        for (int i = 0; i < sixteen; ++i) into[i] = share * lost[i];
      else
        for (int i = 0; i < sixteen; ++i) into[i] += share * lost[i];
    }
  }
  return any;
}

/// The share of pixel (x, y)'s light that goes where \p taken does of the lights'.
float Blend::share_taken(int x, int y, const Vec3f& taken) const {
  const RayHit hit = layers_.direct.hit(x, y);
  if (!hit.hit()) return 0.0f;
  const Vec3f eye(plan_.eye);
  Ray ray;
  ray.origin = eye;
  ray.direction = Vec3f(0.0f);
  const Surface surface = layers_.scene->plain_surface(ray, hit);
  const bool away = glm::dot(surface.normal, surface.point - eye) > 0.0f;
  constexpr float indirect = 0.25f;  // where a lamp hardly shines, others' light is what there is
  const Vec3f all =
      lamps_irradiance(frame_, surface.point, away ? -surface.normal : surface.normal, indirect);
  // Of a grey surface: on a coloured one it is the same, and black alone has no colour to say more.
  constexpr Vec3f luminance = luminance_weights<float>;
  const Vec3f gone = std::numbers::pi_v<float> * taken * Vec3f(power_[0], power_[1], power_[2]);
  return std::min(glm::dot(luminance, gone) / std::max(glm::dot(luminance, all), 1e-30f), 1.0f);
}

/// What pixel (x, y) of \p mirror, \p covered of which shows a subject, loses for each E that is taken
/// where it looks.
Vec3f Blend::mirror_dimming(MirrorLayers& mirror, int x, int y, float covered) {
  float seen = mirror.aperture->share(x, y);
  // Of other mirrors the covered part goes with what they showed there.
  if (!mirror.view->only_mirrors()) seen = std::max(seen - covered, 0.0f);
  if (seen == 0.0f) return Vec3f(0.0f);
  const std::uint64_t albedo = mirror.albedo.at(*layers_.scene, mirror.scene, x & ~15, y)[x & 15];
  const Vec3f scattered(static_cast<float>(albedo & 0xffff),
                        static_cast<float>(albedo >> 16 & 0xffff),
                        static_cast<float>(albedo >> 32 & 0xffff));
  return seen * mirror.view->share(x, y) * scattered / 65535.0f *
         Vec3f(power_[0], power_[1], power_[2]);
}

}  // namespace polyhull::processor
