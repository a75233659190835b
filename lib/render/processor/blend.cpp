// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/processor/blend.h"

#include <algorithm>
#include <cstring>
#include <numbers>
#include <utility>
#include <vector>

#include "base/srgb.h"
#include "base/stopwatch.h"
#include "render/fill.h"
#include "render/light_samples.h"
#include "render/processor/loops/loops.h"

namespace polyhull::processor {
namespace {

/// As if no mirror had any part in the pixels.
void clear_mirrors(BlendPixels& pixels) {
  std::fill_n(pixels.keep, BlendPixels::count, 1.0f);
  std::fill_n(pixels.covered, BlendPixels::count, 0.0f);
  for (int c = 0; c < 3; ++c)
    for (auto* values : {pixels.dimmed[c], pixels.gone[c], pixels.more[c]})
      std::fill_n(values, BlendPixels::count, 0.0f);
}

/// The background of \p part of a picture of \p width x \p height and of the pixels that share its
/// chroma. The calling thread's own, until the next call.
PixelRows background_rows(const std::uint8_t* background, std::ptrdiff_t stride,
                          const Rectangle& part, int width, int height) {
  thread_local std::vector<std::uint8_t> rows;
  const Rectangle all = yuv_part(part, width, height);
  const int left = std::max(all.x - 1, 0);
  const std::size_t row = 4 * static_cast<std::size_t>(all.x + all.width - left);
  rows.resize(row * static_cast<std::size_t>(all.height));
  for (int y = 0; y < all.height; ++y)
    std::memcpy(rows.data() + row * static_cast<std::size_t>(y),
                background + (all.y + y) * stride + 4 * left, row);
  return {rows.data(), static_cast<std::ptrdiff_t>(row), left, all.y};
}

/// Writes the columns \p touched of rows \p y (even) and y + 1 to \p target.
void write_rows(const PixelRows& rows, int y, const Touched& touched, const YuvPicture& target) {
  if (touched.left >= touched.right) return;
  const Rectangle part =
      yuv_part({touched.left, y, touched.right - touched.left, 2}, target.width, target.height);
  write_yuv({rows.pixels, rows.stride, rows.left, rows.top}, part, target);
}

}  // namespace

// Not inlined: the compiler would find the thread's own memory anew for each use, deep in the loops.
[[gnu::noinline]] Blend::Workspace& Blend::workspace() {
  thread_local Workspace own;
  return own;
}

Blend::Blend(Layers& layers, const RenderFrame& frame, const RenderPlan& plan,
             const RenderSettings& settings, const std::uint8_t* background, int background_stride,
             const PictureTarget& target)
    : layers_(layers),
      frame_(frame),
      plan_(plan),
      settings_(settings),
      changed_(plan.changed()),
      background_(background),
      background_stride_(background_stride),
      target_(target) {
  const auto power_of = [&](std::size_t light) {
    return light_power(frame.lights[light]) * (frame.exposure / std::numbers::pi_v<float>);
  };
  Vec3f all(0.0f);
  for (const std::size_t light : plan.blocked_lights) all += power_of(light);
  for (const ShadowLight& light : plan.lights)
    powers_.push_back(share_of(power_of(light.light), all));
  soft_power_ = share_of(frame.sky * (frame.exposure / std::numbers::pi_v<float>), all);
  for (int c = 0; c < 3; ++c) power_[c] = all[c];
  find_least_taken();
}

void Blend::draw(int band) {
  auto& [scratch, front, images] = workspace();
  const int top = std::max(changed_.y, band * band_rows);
  const int bottom = std::min(changed_.y + changed_.height, (band + 1) * band_rows);
  const bool scene = layers_.scene != nullptr;
  Stopwatch watch;
  front.part = layers_.front.paint(layers_.subjects, band, plan_.subject, layers_.direct, nullptr,
                                   scene, frame_.depth.get(), scratch, front.colours);
  seconds_subject += watch.lap();
  for (std::size_t i = 0; i < plan_.mirrors.size(); ++i) {
    const MirrorLayers& mirror = *layers_.mirrors[i];
    images[i].part =
        mirror.image.paint(layers_.subjects, band, plan_.mirrors[i].image, mirror.scene,
                           &*mirror.aperture, scene, nullptr, scratch, images[i].colours);
  }
  seconds_mirror += watch.lap();
  const Rectangle rows{changed_.x, top, changed_.width, bottom - top};
  const PixelRows out = target_.video ? background_rows(background_, background_stride_, rows,
                                                        frame_.width, frame_.height)
                                      : PixelRows{target_.pixels, target_.stride, 0, 0};
  Piece piece;
  Progress progress;
  for (int y = top; y < bottom; ++y) {
    Spans layers{row_of(front, y), {}};
    for (std::size_t i = 0; i < plan_.mirrors.size(); ++i) layers.images[i] = row_of(images[i], y);
    blend_row(y, layers, out, piece, progress);
    if (!target_.video || (y % 2 == 0 && y + 1 < bottom)) continue;
    write_rows(out, y & ~1, std::exchange(progress.touched, {}), *target_.video);
  }
  pixels_shaded += progress.shaded;
  pixels_changed += progress.changed;
  seconds_blend += watch.lap();
}

Blend::Span Blend::row_of(const Painted& painted, int y) {
  const Rectangle& part = painted.part;
  if (y < part.y || y >= part.y + part.height) return {};
  return {part.x, part.x + part.width,
          &painted.colours[static_cast<std::size_t>(y - part.y) * part.width]};
}

bool Blend::Span::any(int begin, int end) const {
  for (int x = std::max(begin, left); x < std::min(end, right); ++x)
    if (colours[x - left].a > 0.0f) return true;
  return false;
}

bool Blend::any_reaches(const Spans& layers, int begin, int end) const {
  bool any = layers.front.reaches(begin, end);
  for (std::size_t m = 0; m < plan_.mirrors.size(); ++m)
    any = any || layers.images[m].reaches(begin, end);
  return any;
}

/// Blends the changed part of row \p y into \p out, and counts.
void Blend::blend_row(int y, const Spans& layers, const PixelRows& out, Piece& piece,
                      Progress& progress) {
  AllMissing missing;
  const std::vector<Shadow> shadows = shadows_of(y, missing);
  const int right = changed_.x + changed_.width;
  for (int group = changed_.x & ~15; group < right; group += 16) {
    const bool reached = any_reaches(layers, group, group + 16);
    if (!reached && is_lost_unseen(group, y, shadows)) continue;
    const bool any = find_missing(group, y, shadows);
    if (!any && !reached) continue;
    for (int first = group; first < group + 16; first += BlendPixels::count) {
      const int x = std::max(first, changed_.x), end = std::min(first + BlendPixels::count, right);
      if (x < end) blend_piece(x, end, y, layers, missing, out, piece, progress);
    }
  }
}

/// Blends pixels \p x to \p end - 1, unless nothing reaches them.
void Blend::blend_piece(int x, int end, int y, const Spans& layers, const AllMissing& missing,
                        const PixelRows& out, Piece& piece, Progress& progress) {
  const int first = x & ~(BlendPixels::count - 1);
  const std::size_t mirrors = plan_.mirrors.size();
  bool shown[most_mirrors], reflected[most_mirrors], mirrored = false, reflects = false;
  Vec3f taken = missing.seen.most(x, end);
  const bool own = taken != Vec3f(0.0f);
  for (std::size_t m = 0; m < mirrors; ++m) {
    const Vec3f there = missing.in_mirrors[m].most(x, end);
    shown[m] = there != Vec3f(0.0f) && layers_.mirrors[m]->aperture->seen_in({x, y, end - x, 1});
    if (shown[m]) taken += there;
    reflected[m] = layers.images[m].any(x, end);
    reflects = reflects || reflected[m];
    mirrored = mirrored || shown[m] || reflected[m];
  }
  const bool covered = layers.front.any(x, end), others = covered || mirrored;
  const bool shadow_alone = !covered && !reflects;
  if (shadow_alone && taken == Vec3f(0.0f)) return;
  const std::uint32_t darkest = darkest_of(x, end, y);
  const bool opaque = settings_.alpha == AlphaCoding::ignored || darkest >> 24 == 255;
  if (shadow_alone && (opaque || !mirrored) && !is_seen(taken, darkest, opaque)) return;
  const bool seen = others ? own : is_seen(taken, 0, false);
  if (!seen && !others) return;
  BlendPixels& pixels = piece.pixels;
  fill_ground(x, end, y, seen ? missing.seen.taken : nullptr, pixels);
  if (covered || piece.has_subject) fill_subject(x, end, layers.front, pixels);
  piece.has_subject = covered;
  if (mirrored || piece.has_mirror) clear_mirrors(pixels);
  piece.has_mirror = mirrored;
  for (std::size_t m = 0; m < mirrors; ++m)
    if (shown[m] || reflected[m])
      add_mirror(m, x, end, y, layers, shown[m] ? missing.in_mirrors[m].taken : nullptr, pixels);
  pixels.layered = others;
  progress.touched.left = std::min(progress.touched.left, x);
  progress.touched.right = std::max(progress.touched.right, end);
  std::uint32_t made[BlendPixels::count];
  progress.changed += static_cast<std::uint64_t>(
      opaque ? Loops::best().blend(pixels, power_, srgb_to_linear_table(), srgb_lines(), made)
             : blend_translucent(x, end, y, piece, made));
  progress.shaded += static_cast<std::uint64_t>(end - x);
  if (end - x == BlendPixels::count)
    std::memcpy(out.at(x, y), made, sizeof made);
  else
    std::memcpy(out.at(x, y), made + (x - first), 4 * static_cast<std::size_t>(end - x));
}

/// As Loops::blend() where pixels \p x to \p end - 1 of row \p y are not all opaque: their fill and
/// key (fill.h).
int Blend::blend_translucent(int x, int end, int y, const Piece& piece, std::uint32_t* made) const {
  constexpr int count = BlendPixels::count;
  const int first = x & ~(count - 1);
  const BlendPixels& pixels = piece.pixels;
  const auto blend = [&](const BlendPixels& over, std::uint32_t* out) {
    Loops::best().blend(over, power_, srgb_to_linear_table(), srgb_lines(), out);
  };
  // What the shadow takes of the transparent share of each.
  float transparent[count];
  BlendPixels over = pixels;
  over.layered = true;
  for (int i = 0; i < count; ++i) {
    transparent[i] = 0.0f;
    const float alpha = static_cast<float>(pixels.background[i] >> 24) / 255.0f;
    const Vec3f taken(pixels.taken[0][i], pixels.taken[1][i], pixels.taken[2][i]);
    for (int c = 0; c < 3; ++c) over.taken[c][i] = alpha * taken[c];
    // Metal scatters nothing, so the shadow is not seen on it.
    if (taken != Vec3f(0.0f) && pixels.albedo[i] != 0 && alpha < 1.0f)
      transparent[i] = (1.0f - alpha) * share_taken(first + i, y, taken);
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

/// The background of pixels \p x to \p end - 1 and what it loses (Missing); null: nothing.
void Blend::fill_ground(int x, int end, int y, const float (*taken)[16], BlendPixels& pixels) {
  constexpr int count = BlendPixels::count;
  const int first = x & ~(count - 1);
  const std::uint8_t* coded = background_ + static_cast<std::ptrdiff_t>(y) * background_stride_;
  if (end - x == count) {
    std::memcpy(pixels.background, coded + 4 * x, sizeof pixels.background);
  } else {
    std::fill_n(pixels.background, count, 0u);
    std::memcpy(pixels.background + (x - first), coded + 4 * x,
                4 * static_cast<std::size_t>(end - x));
  }
  if (taken == nullptr) {
    for (float(&channel)[count] : pixels.taken) std::fill_n(channel, count, 0.0f);
    return;
  }
  for (int c = 0; c < 3; ++c) {
    std::copy_n(&taken[c][first & 15], count, pixels.taken[c]);
    for (int i = 0; end - x < count && i < count; ++i)
      if (first + i < x || first + i >= end) pixels.taken[c][i] = 0.0f;
  }
  const std::uint64_t* albedo =
      layers_.albedo.at(*layers_.scene, layers_.direct, first & ~15, y) + (first & 15);
  std::copy_n(albedo, count, pixels.albedo);
}

void Blend::fill_subject(int x, int end, const Span& over, BlendPixels& pixels) {
  for (int i = 0; i < BlendPixels::count; ++i) {
    const int column = (x & ~(BlendPixels::count - 1)) + i;
    const glm::vec4 colour = column >= x && column < end ? over.at(column) : glm::vec4(0.0f);
    pixels.red[i] = colour.r;
    pixels.green[i] = colour.g;
    pixels.blue[i] = colour.b;
    pixels.alpha[i] = colour.a;
  }
}

/// Adds what mirror \p number changes where no subject covers it, be it before the viewport or in a
/// mirror that shows this one. \p taken: of what it shows (Missing); null: nothing.
void Blend::add_mirror(std::size_t number, int x, int end, int y, const Spans& layers,
                       const float (*taken)[16], BlendPixels& pixels) {
  MirrorLayers& mirror = *layers_.mirrors[number];
  const bool plain = settings_.mirror == MirrorMode::plain;
  for (int column = x; column < end; ++column) {
    const int i = column & (BlendPixels::count - 1);
    if (pixels.alpha[i] >= 1.0f) continue;
    glm::vec4 image = layers.images[number].at(column);
    for (int m = plan_.mirrors[number].within; m >= 0; m = plan_.mirrors[m].within)
      image *= 1.0f - layers.images[m].at(column).a;
    Vec3f gone(0.0f), more(0.0f), dimmed(0.0f);
    if (taken != nullptr) {
      const int at = column & 15;
      const Vec3f lost(taken[0][at], taken[1][at], taken[2][at]);
      if (lost != Vec3f(0.0f)) dimmed = lost * mirror_dimming(mirror, column, y, image.a);
    }
    if (image.a > 0.0f) {
      pixels.covered[i] += image.a;
      if (plain) {
        pixels.keep[i] -= settings_.reflection_alpha * image.a;
        more = settings_.reflection_alpha * Vec3f(image);
      } else {
        const Vec3f share = mirror.view->share(column, y);
        more = share * Vec3f(image);
        // Of metal all light was what it showed.
        if (mirror.view->only_mirrors())
          pixels.keep[i] -= image.a;
        else
          gone = image.a * share * mirror.view->shown(column, y);
      }
    }
    for (int c = 0; c < 3; ++c) {
      pixels.dimmed[c][i] += dimmed[c];
      pixels.gone[c][i] += gone[c];
      pixels.more[c][i] += more[c];
    }
  }
}

}  // namespace polyhull::processor
