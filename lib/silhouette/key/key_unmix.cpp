// SPDX-License-Identifier: LGPL-2.1-or-later
// Straight colours. A pixel C that shows the subject's colour F with the share alpha before the screen
// S is C = alpha F + (1 - alpha) S. Noise makes F = (C - (1 - alpha) S) / alpha uncertain where alpha is
// small; there the subject's colour in the neighbourhood, G, says more. With the noise's variance v and
// that of F about G, w, the most probable F is G + alpha (C - alpha G - (1 - alpha) S) / (alpha^2 + v / w).
#include <algorithm>
#include <cmath>

#include "base/srgb.h"
#include "silhouette/key/key_state.h"

namespace polyhull {
namespace {

using silhouette::Mixture;

// Pixels beside the matte that get the subject's colour, for mattes that are blurred later: fewer
// rows than Keyer::rows_below().
constexpr int fill_reach = 4;
constexpr double subject_variation =
    40.0;  // levels by which a subject's colours differ from those around

/// Screen and subject at the centres of a row's tiles, between rows of tiles.
struct RowColours {
  std::vector<Mixture> mixtures;
  std::vector<std::uint8_t> has_subject;
};

/// Of tiles [from, to).
void interpolate(const silhouette::LocalColours& colours, const std::vector<Mixture>& mixtures,
                 int y, int from, int to, RowColours& row) {
  const float v = (static_cast<float>(y) + 0.5f) / static_cast<float>(colours.size()) - 0.5f;
  const int above = static_cast<int>(std::floor(v));
  const float part = v - static_cast<float>(above);
  const int upper = std::clamp(above, 0, colours.down() - 1);
  const int lower = std::clamp(above + 1, 0, colours.down() - 1);
  const auto across = static_cast<std::size_t>(colours.across());
  row.mixtures.resize(across);
  row.has_subject.resize(across);
  for (int i = from; i < to; ++i) {
    const bool a_has = colours.tile(i, upper).has_subject;
    const bool b_has = colours.tile(i, lower).has_subject;
    const Mixture& a = mixtures[static_cast<std::size_t>(upper) * across + i];
    const Mixture& b = mixtures[static_cast<std::size_t>(lower) * across + i];
    row.has_subject[i] = a_has || b_has;
    row.mixtures[i] = {glm::mix(a.screen, b.screen, part),
                       a_has && b_has ? glm::mix(a.subject, b.subject, part)
                       : a_has        ? a.subject
                                      : b.subject};
  }
}

/// The most probable colour of the subject; see above.
Vec3f straight(const Vec3f& pixel, float alpha, const Vec3f& screen, const Vec3f& near,
               float doubt) {
  const Vec3f rest = pixel - alpha * near - (1.0f - alpha) * screen;
  return near + alpha / (alpha * alpha + doubt) * rest;
}

std::uint8_t level_of(float v) {
  return static_cast<std::uint8_t>(std::clamp(v + 0.5f, 0.0f, 255.0f));
}

constexpr double alpha_off =
    4.5;  // levels: alpha is off by .03 where the subject has several colours

}  // namespace

void Keyer::State::unmix_plate_row(int y, int x0, int x1, std::uint8_t* pixels) const {
  const Vec3f usual = silhouette::vector_of(samples.foreground);
  const std::uint8_t* const behind = &plate[4 * row_length() * static_cast<std::size_t>(y)];
  for (int x = x0; x < x1; ++x) {
    if (keyed.state_row(y)[x / matte_block] != block_mixed) continue;
    const int a = keyed.row(y)[x];
    if (a == 0 || a == 255) continue;
    const std::uint8_t* const from = behind + 4 * static_cast<std::ptrdiff_t>(x);
    std::uint8_t* const p = pixels + 4 * static_cast<std::ptrdiff_t>(x - x0);
    const Vec3f own = straight({p[0], p[1], p[2]}, static_cast<float>(a) / 255.0f,
                               {from[0], from[1], from[2]}, usual, doubt());
    for (int c = 0; c < 3; ++c) p[c] = level_of(own[c]);
  }
}

float Keyer::State::doubt() const {
  return static_cast<float>(std::max(noise * noise, alpha_off * alpha_off) /
                            (subject_variation * subject_variation));
}

void Keyer::State::find_mixed(int y, std::vector<std::uint8_t>& counts) const {
  const auto blocks = static_cast<std::size_t>(blocks_across(width));
  const BlockState* const __restrict own = keyed.state_row(y);
  counts.resize(blocks);
  std::uint8_t* const __restrict to = counts.data();
  for (std::size_t b = 0; b < blocks; ++b) to[b] = own[b] == block_mixed;
  if (local) return;
  // What closes and grows the matte needs all rows, and so they are known.
  const int reach =
      fill_reach + static_cast<int>(std::ceil(settings.close + std::max(-settings.choke, 0.0)));
  const std::size_t beside = static_cast<std::size_t>((reach - 1) / matte_block) + 1;  // blocks
  static thread_local std::vector<std::uint8_t> memory;
  memory.assign(blocks + 2 * beside, 0);
  std::uint8_t* const __restrict around = memory.data();  // asked for once: loops that ask are slow
  for (int row = std::max(y - reach, 0); row <= std::min(y + reach, height - 1); ++row) {
    const BlockState* const other = keyed.state_row(row);
    std::uint8_t* const shown = around + beside;  // 0 beside the picture
    for (std::size_t b = 0; b < blocks; ++b) shown[b] |= other[b] != block_empty;
  }
  for (std::size_t k = 0; k <= 2 * beside; ++k)
    for (std::size_t b = 0; b < blocks; ++b) to[b] |= (own[b] == block_empty) & around[b + k];
}

void Keyer::State::unmix_row(int y, int x0, int x1, std::uint8_t* pixels) const {
  if (local) return unmix_plate_row(y, x0, x1, pixels);
  if (first_spans.empty()) return;
  static thread_local RowColours memory;
  RowColours& row = memory;
  const bool in_light = mixing.in_light();
  interpolate(colours, mixtures, y, std::max(x0 / colours.size() - 1, 0),
              std::min((x1 - 1) / colours.size() + 2, colours.across()), row);
  Vec3f usual = silhouette::vector_of(samples.foreground);
  if (in_light) usual = 255.0f * srgb_decoded(usual / 255.0f);
  const float* const decode = srgb_to_linear_table();
  const std::uint8_t* const encode = linear_to_srgb_table();
  const float uncertain = doubt();
  const float size = static_cast<float>(colours.size());
  const auto write = [&](const Vec3f& colour, std::uint8_t* p) {
    for (int c = 0; c < 3; ++c)
      p[c] = in_light ? linear_to_srgb(colour[c] / 255.0f, encode) : level_of(colour[c]);
  };
  const auto mixture_at = [&](float x) -> Mixture {
    const float u = x / size - 0.5f;
    const int cell = static_cast<int>(std::floor(u));
    const float part = u - static_cast<float>(cell);
    const int one = std::clamp(cell, 0, colours.across() - 1);
    const int other = std::clamp(cell + 1, 0, colours.across() - 1);
    const Mixture &a = row.mixtures[one], &b = row.mixtures[other];
    const bool a_has = row.has_subject[one] != 0, b_has = row.has_subject[other] != 0;
    return {glm::mix(a.screen, b.screen, part), a_has && b_has
                                                    ? glm::mix(a.subject, b.subject, part)
                                                : a_has ? a.subject
                                                : b_has ? b.subject
                                                        : usual};
  };
  const BlockState* const states = keyed.state_row(y);
  const std::uint8_t* const alphas = keyed.row(y);
  for (int block = x0 / matte_block; block * matte_block < x1; ++block) {
    if (states[block] == block_full) continue;
    const bool empty = states[block] == block_empty;
    const int tile = block * matte_block / colours.size();
    if (empty && row.has_subject[tile] == 0) continue;
    const int begin = std::max(block * matte_block, x0),
              end = std::min((block + 1) * matte_block, x1);
    // Linear within the block.
    const float first = static_cast<float>(block * matte_block);
    const Mixture from = mixture_at(first), to = mixture_at(first + matte_block);
    const Vec3f screen_step = (to.screen - from.screen) / static_cast<float>(matte_block);
    const Vec3f subject_step = (to.subject - from.subject) / static_cast<float>(matte_block);
    // Where nothing of the subject is, its colour around: one for the block.
    std::uint8_t around[3];
    write(0.5f * (from.subject + to.subject), around);
    for (int x = begin; x < end; ++x) {
      const int a = empty ? 0 : alphas[x];
      if (a == 255) continue;
      std::uint8_t* const p = pixels + 4 * static_cast<std::ptrdiff_t>(x - x0);
      if (a == 0) {
        std::copy_n(around, 3, p);
        continue;
      }
      const float along = static_cast<float>(x) + 0.5f - first;
      const Vec3f pixel = in_light ? 255.0f * Vec3f(decode[p[0]], decode[p[1]], decode[p[2]])
                                   : Vec3f(p[0], p[1], p[2]);
      write(straight(pixel, static_cast<float>(a) / 255.0f, from.screen + along * screen_step,
                     from.subject + along * subject_step, uncertain),
            p);
    }
  }
}

}  // namespace polyhull
