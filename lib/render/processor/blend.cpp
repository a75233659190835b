// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/processor/blend.h"

#include <algorithm>
#include <cstring>
#include <numbers>
#include <utility>

#include "base/srgb.h"
#include "base/stopwatch.h"
#include "render/processor/loops.h"

namespace polyhull::processor {

Blend::Blend(Layers& layers, const RenderFrame& frame, const RenderPlan& plan,
             const RenderSettings& settings, const MirrorView* mirror,
             const std::uint8_t* background, int background_stride, const PictureTarget& target)
    : layers_(layers),
      frame_(frame),
      plan_(plan),
      settings_(settings),
      mirror_(mirror),
      changed_(plan.changed()),
      background_(background),
      background_stride_(background_stride),
      target_(target) {
  if (plan.light < 0) return;
  const Vec3f power = light_power(frame.lights[static_cast<std::size_t>(plan.light)]) *
                      (frame.exposure / std::numbers::pi_v<float>);
  for (int c = 0; c < 3; ++c) power_[c] = power[c];
}

void Blend::draw(int band) {
  thread_local SubjectLayer::Scratch scratch;
  thread_local std::vector<glm::vec4> front, image;
  const int top = std::max(changed_.y, band * band_rows);
  const int bottom = std::min(changed_.y + changed_.height, (band + 1) * band_rows);
  const auto reaches = [&](const Rectangle& part) {
    return !part.empty() && part.y < bottom && part.y + part.height > top;
  };
  const bool scene = layers_.scene.has_value();
  Stopwatch watch;
  if (reaches(plan_.subject))
    layers_.front.paint(layers_.subjects, band, plan_.subject, layers_.direct, nullptr, scene,
                        scratch, front);
  seconds_subject += watch.lap();
  if (reaches(plan_.mirror))
    layers_.image.paint(layers_.subjects, band, plan_.mirror, layers_.mirrored, &layers_.direct,
                        scene, scratch, image);
  seconds_mirror += watch.lap();
  const Rectangle rows{changed_.x, top, changed_.width, bottom - top};
  const PixelRows out = target_.video ? background_rows(background_, background_stride_, rows,
                                                        frame_.width, frame_.height)
                                      : PixelRows{target_.pixels, target_.stride, 0, 0};
  Piece piece;
  Touched touched;  // of two rows that share their chroma
  for (int y = top; y < bottom; ++y) {
    blend_row(y, row_of(plan_.subject, front, band, y), row_of(plan_.mirror, image, band, y),
              {reaches(plan_.shadow), reaches(plan_.mirror_shadow)}, out, piece, touched);
    if (!target_.video || (y % 2 == 0 && y + 1 < bottom)) continue;
    write_rows(out, y & ~1, std::exchange(touched, {}), *target_.video);
  }
  seconds_blend += watch.lap();
}

Blend::Span Blend::row_of(const Rectangle& part, const std::vector<glm::vec4>& layer, int band,
                          int y) {
  const int top = std::max(part.y, band * band_rows);
  if (part.empty() || y < top || y >= part.y + part.height) return {};
  return {part.x, part.x + part.width, &layer[static_cast<std::size_t>(y - top) * part.width]};
}

/// Blends the changed part of row \p y into \p out.
void Blend::blend_row(int y, const Span& over, const Span& mirrored, const Shaded& shaded,
                      const PixelRows& out, Piece& piece, Touched& touched) {
  for (int x = changed_.x; x < changed_.x + changed_.width;) {
    // Those that nothing reaches at once.
    const int end = std::min((x | 15) + 1, changed_.x + changed_.width);
    const bool seen = shaded.seen && layers_.shadow.reaches(x, y) &&
                      layers_.shadow.taken(layers_.direct, x & ~15, y, piece.pixels.taken);
    const bool shown = shaded.mirrored && layers_.mirror_shadow.reaches(x, y) &&
                       layers_.mirror_shadow.taken(layers_.mirrored, x & ~15, y, piece.in_mirror);
    const bool covered = over.meets(x, end), reflected = mirrored.meets(x, end);
    if (seen || shown || covered || reflected) {
      fill_ground(x, end, y, seen, piece.pixels);
      if (covered || piece.has_subject) fill_subject(x, end, over, piece.pixels);
      piece.has_subject = covered;
      if (!shown) std::fill_n(piece.in_mirror, 16, 0.0f);
      if (shown || reflected || piece.has_mirror) fill_mirror(x, end, y, mirrored, piece);
      piece.has_mirror = shown || reflected;
      touched.left = std::min(touched.left, x);
      touched.right = std::max(touched.right, end);
      std::uint32_t made[16];
      loops().blend(piece.pixels, power_, srgb_to_linear_table(), srgb_lines(), made);
      std::memcpy(out.at(x, y), made + (x & 15), 4 * static_cast<std::size_t>(end - x));
    }
    x = end;
  }
}

/// The background of pixels \p x to \p end - 1 and, where \p seen, what it loses.
void Blend::fill_ground(int x, int end, int y, bool seen, BlendPixels& pixels) {
  const int first = x & ~15;
  const std::uint8_t* coded = background_ + static_cast<std::ptrdiff_t>(y) * background_stride_;
  if (end - x < 16) std::fill_n(pixels.background, 16, 0u);
  std::memcpy(pixels.background + (x - first), coded + 4 * x,
              4 * static_cast<std::size_t>(end - x));
  if (!seen) {
    std::fill_n(pixels.taken, 16, 0.0f);
    return;
  }
  for (int i = 0; i < 16; ++i)
    if (first + i < x || first + i >= end) pixels.taken[i] = 0.0f;
  const std::uint64_t* albedo = layers_.albedo.at(*layers_.scene, layers_.direct, first, y);
  for (int i = 0; i < 16; ++i) pixels.albedo[i] = pixels.taken[i] > 0.0f ? albedo[i] : 0;
}

void Blend::fill_subject(int x, int end, const Span& over, BlendPixels& pixels) {
  for (int i = 0; i < 16; ++i) {
    const int column = (x & ~15) + i;
    const glm::vec4 colour = column >= x && column < end ? over.at(column) : glm::vec4(0.0f);
    pixels.red[i] = colour.r;
    pixels.green[i] = colour.g;
    pixels.blue[i] = colour.b;
    pixels.alpha[i] = colour.a;
  }
}

/// What the mirror changes where the subject does not cover it.
void Blend::fill_mirror(int x, int end, int y, const Span& mirrored, Piece& piece) {
  BlendPixels& pixels = piece.pixels;
  for (int i = 0; i < 16; ++i) {
    const int column = (x & ~15) + i;
    const bool open = column >= x && column < end && pixels.alpha[i] < 1.0f;
    const glm::vec4 image = open ? mirrored.at(column) : glm::vec4(0.0f);
    pixels.keep[i] = 1.0f;
    pixels.covered[i] = image.a;
    Vec3f gone(0.0f), more(0.0f), dimmed(0.0f);
    if (open && piece.in_mirror[i] > 0.0f)
      dimmed = piece.in_mirror[i] * mirror_dimming(column, y, image.a);
    if (image.a > 0.0f) {
      if (settings_.mirror == MirrorMode::plain) {
        pixels.keep[i] = 1.0f - settings_.reflection_alpha * image.a;
        more = settings_.reflection_alpha * Vec3f(image);
      } else {
        const Vec3f share = mirror_->share(column, y);
        more = share * Vec3f(image);
        // Of metal all light was what it showed.
        if (mirror_->only_mirrors())
          pixels.keep[i] = 1.0f - image.a;
        else
          gone = image.a * share * mirror_->shown(column, y);
      }
    }
    for (int c = 0; c < 3; ++c) {
      pixels.dimmed[c][i] = dimmed[c];
      pixels.gone[c][i] = gone[c];
      pixels.more[c][i] = more[c];
    }
  }
}

/// What pixel (x, y) of the mirror, \p covered of which shows the subject, loses for each E that
/// is taken where it looks.
Vec3f Blend::mirror_dimming(int x, int y, float covered) {
  float seen = layers_.direct.mirror_at(x, y);
  // Of other mirrors the covered part goes with what they showed there.
  if (!mirror_->only_mirrors()) seen = std::max(seen - covered, 0.0f);
  if (seen == 0.0f) return Vec3f(0.0f);
  const std::uint64_t albedo =
      layers_.mirror_albedo.at(*layers_.scene, layers_.mirrored, x & ~15, y)[x & 15];
  const Vec3f scattered(static_cast<float>(albedo & 0xffff),
                        static_cast<float>(albedo >> 16 & 0xffff),
                        static_cast<float>(albedo >> 32 & 0xffff));
  return seen * mirror_->share(x, y) * scattered / 65535.0f *
         Vec3f(power_[0], power_[1], power_[2]);
}

}  // namespace polyhull::processor
