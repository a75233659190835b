// SPDX-License-Identifier: LGPL-2.1-or-later
#include <algorithm>
#include <numbers>

#include "base/srgb.h"
#include "render/fill.h"
#include "render/processor/blend.h"
#include "render/processor/loops.h"

namespace polyhull::processor {

/// The share of pixel (x, y)'s light that goes where \p taken does of the main lamp's.
float Blend::share_taken(int x, int y, float taken) const {
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
  constexpr Vec3f luminance(0.2126f, 0.7152f, 0.0722f);
  const Vec3f gone = std::numbers::pi_v<float> * taken * Vec3f(power_[0], power_[1], power_[2]);
  return std::min(glm::dot(luminance, gone) / std::max(glm::dot(luminance, all), 1e-30f), 1.0f);
}

/// As Loops::blend() where pixels \p x to \p end - 1 of row \p y are not all opaque: their fill and
/// key (fill.h).
int Blend::blend_translucent(int x, int end, int y, const Piece& piece, std::uint32_t* made) const {
  constexpr int count = BlendPixels::count;
  const int first = x & ~(count - 1);
  const BlendPixels& pixels = piece.pixels;
  const auto blend = [&](const BlendPixels& over, std::uint32_t* out) {
    loops().blend(over, power_, srgb_to_linear_table(), srgb_lines(), out);
  };
  // What the shadow takes of the transparent share of each.
  float transparent[count];
  BlendPixels over = pixels;
  for (int i = 0; i < count; ++i) {
    transparent[i] = 0.0f;
    const float alpha = static_cast<float>(pixels.background[i] >> 24) / 255.0f;
    over.taken[i] = alpha * pixels.taken[i];
    // Metal scatters nothing, so the shadow is not seen on it.
    if (pixels.taken[i] > 0.0f && pixels.albedo[i] != 0 && alpha < 1.0f)
      transparent[i] = (1.0f - alpha) * share_taken(first + i, y, pixels.taken[i]);
  }
  FillPixel fill[count];
  for (int k = 0; k < 3; ++k) {
    for (int i = 0; i < count; ++i) {
      over.background[i] = over_grey(pixels.background[i], fill_greys[k], settings_.alpha);
      fill[i].over[k] = over.background[i];
      for (int c = 0; c < 3; ++c)
        over.dimmed[c][i] =
            pixels.dimmed[c][i] +
            transparent[i] * srgb_to_linear(static_cast<std::uint8_t>(over.background[i] >> 8 * c));
    }
    std::uint32_t out[count];
    if (k == 1) {
      blend(over, out);
      for (int i = 0; i < count; ++i) fill[i].whole = out[i];
    }
    BlendPixels ground = over;
    for (float* channel : {ground.red, ground.green, ground.blue, ground.alpha})
      std::fill_n(channel, count, 0.0f);
    blend(ground, out);
    for (int i = 0; i < count; ++i) fill[i].ground[k] = out[i];
  }
  int changed = 0;
  for (int i = x - first; i < end - first; ++i) {
    FillPixel& pixel = fill[i];
    pixel.background = pixels.background[i];
    pixel.coverage = pixels.alpha[i];
    if (pixel.coverage > 0.0f) {
      const Vec3f light = Vec3f(pixels.red[i], pixels.green[i], pixels.blue[i]) / pixel.coverage;
      for (int c = 0; c < 3; ++c) pixel.colour[c] = srgb_encoded(std::clamp(light[c], 0.0f, 1.0f));
    }
    made[i] = fill_of(pixel, settings_.alpha);
    changed += made[i] != pixel.background;
  }
  return changed;
}

}  // namespace polyhull::processor
