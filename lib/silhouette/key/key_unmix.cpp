// SPDX-License-Identifier: LGPL-2.1-or-later
// Straight colours. A pixel C that shows the subject's colour F with the share alpha before the screen
// S is C = alpha F + (1 - alpha) S. Noise makes F = (C - (1 - alpha) S) / alpha uncertain where alpha is
// small; there the subject's colour in the neighbourhood, G, says more. With the noise's variance v and
// that of F about G, w, the most probable F is G + alpha (C - alpha G - (1 - alpha) S) / (alpha^2 + v / w).
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

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

/// Which blocks of a row find_mixed() has found, and whether columns of blocks around show anything.
struct BlocksAround {
  std::vector<std::uint8_t> mixed, shown;
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

/// Levels as they are.
struct InLevels {
  Vec3f decoded(const std::uint8_t* p) const { return {p[0], p[1], p[2]}; }
  std::uint8_t encoded(float v) const {
    return static_cast<std::uint8_t>(std::clamp(v + 0.5f, 0.0f, 255.0f));
  }
};

/// As the light that they stand for, in numbers 0..255.
struct InLight {
  const float* decode = srgb_to_linear_table();
  const std::uint8_t* encode = linear_to_srgb_table();
  Vec3f decoded(const std::uint8_t* p) const {
    return 255.0f * Vec3f(decode[p[0]], decode[p[1]], decode[p[2]]);
  }
  std::uint8_t encoded(float v) const { return linear_to_srgb(v / 255.0f, encode); }
};

constexpr double alpha_off =
    4.5;  // levels: alpha is off by .03 where the subject has several colours

}  // namespace

void Keyer::State::unmix_plate_row(int y, int x0, int x1, std::uint8_t* pixels) const {
  constexpr InLevels levels;
  const Vec3f usual = silhouette::vector_of(samples.foreground);
  const std::uint8_t* const behind = &plate[4 * row_length() * static_cast<std::size_t>(y)];
  for (int x = x0; x < x1; ++x) {
    if (keyed.state_row(y)[x / matte_block] != block_mixed) continue;
    const int a = keyed.row(y)[x];
    if (a == 0 || a == 255) continue;
    const std::uint8_t* const from = behind + 4 * static_cast<std::ptrdiff_t>(x);
    std::uint8_t* const p = pixels + 4 * static_cast<std::ptrdiff_t>(x - x0);
    const Vec3f own = straight(levels.decoded(p), static_cast<float>(a) / 255.0f,
                               {from[0], from[1], from[2]}, usual, doubt());
    for (int c = 0; c < 3; ++c) p[c] = levels.encoded(own[c]);
  }
}

float Keyer::State::doubt() const {
  return static_cast<float>(std::max(noise * noise, alpha_off * alpha_off) /
                            (subject_variation * subject_variation));
}

void Keyer::State::find_mixed(int y, int begin, int end, std::vector<std::uint8_t>& counts) const {
  constexpr std::uint64_t bytes = 0x0101010101010101u;
  const BlockState* const own = keyed.state_row(y) + begin;
  const int blocks = end - begin;
  // Eight at a time: all rows have that room.
  counts.resize(static_cast<std::size_t>(blocks) + 8);
  std::uint8_t* const to = counts.data();
  const auto store = [](std::uint8_t* at, std::uint64_t eight) { std::memcpy(at, &eight, 8); };
  // Bit 0 of each byte; states are sets of two bits.
  const auto mixed = [&](std::uint64_t states) { return states & states >> 1 & bytes; };
  if (local) {
    for (int b = 0; b < blocks; b += 8) store(to + b, mixed(eight_states(own + b)));
    return;
  }
  // What closes and grows the matte needs all rows, and so they are known.
  const int reach =
      fill_reach + static_cast<int>(std::ceil(settings.close + std::max(-settings.choke, 0.0)));
  const int beside = (reach - 1) / matte_block + 1;  // blocks
  // Whether columns of blocks from `begin - beside` on show anything in these rows; 0 beside the picture.
  auto& around = silhouette::kept_by_thread<BlocksAround>().shown;
  around.assign(static_cast<std::size_t>(blocks + 2 * beside) + 8, 0);
  const int first = std::max(begin - beside, 0),
            last = std::min(end + beside, blocks_across(width));
  std::uint8_t* const shown = around.data() + (first - (begin - beside));
  const int top = std::max(y - reach, 0), bottom = std::min(y + reach, height - 1);
  const BlockState* const upper = keyed.state_row(top) + first;
  for (int b = 0; b < last - first; b += 8) {
    std::uint64_t any = 0;
    for (int row = top; row <= bottom; ++row)
      any |= eight_states(upper + (row - top) * blocks_across(width) + b);
    store(shown + b, any & bytes * block_full);
  }
  std::fill_n(shown + (last - first), 8, std::uint8_t{0});
  for (int b = 0; b < blocks; b += 8) {
    const std::uint64_t states = eight_states(own + b);
    std::uint64_t near = 0;
    for (int k = 0; k <= 2 * beside; ++k) near |= eight_states(around.data() + b + k);
    store(to + b, mixed(states) | (near & ~states & bytes));
  }
}

void Keyer::State::unmix_row(int y, int x0, int x1, std::uint8_t* pixels) const {
  if (!straightens()) return;
  auto& mixed = silhouette::kept_by_thread<BlocksAround>().mixed;
  const int begin = x0 / matte_block, last = (x1 - 1) / matte_block;
  find_mixed(y, begin, last + 1, mixed);
  for (int block = begin; block <= last; ++block) {
    if (mixed[block - begin] == 0) continue;
    const int first = block;
    while (block < last && mixed[block + 1 - begin] != 0) ++block;
    const int from = std::max(first * matte_block, x0);
    unmix_stretch(y, from, std::min((block + 1) * matte_block, x1),
                  pixels + 4 * static_cast<std::ptrdiff_t>(from - x0));
  }
}

void Keyer::State::unmix_stretch(int y, int x0, int x1, std::uint8_t* pixels) const {
  if (local) return unmix_plate_row(y, x0, x1, pixels);
  if (first_spans.empty()) return;
  if (mixing.in_light())
    unmix_local_row(InLight(), y, x0, x1, pixels);
  else
    unmix_local_row(InLevels(), y, x0, x1, pixels);
}

template <class Coding>
void Keyer::State::unmix_local_row(const Coding& coding, int y, int x0, int x1,
                                   std::uint8_t* pixels) const {
  auto& row = silhouette::kept_by_thread<RowColours>();
  interpolate(colours, mixtures, y, std::max(x0 / colours.size() - 1, 0),
              std::min((x1 - 1) / colours.size() + 2, colours.across()), row);
  Vec3f usual = silhouette::vector_of(samples.foreground);
  if (mixing.in_light()) usual = 255.0f * srgb_decoded(usual / 255.0f);
  const float uncertain = doubt();
  const int size = colours.size(), shift = std::countr_zero(static_cast<unsigned>(size));
  const auto mixture_at = [&](int x) -> Mixture {
    const int from_centre = x - size / 2, cell = from_centre >> shift;
    const float part = static_cast<float>(from_centre - (cell << shift)) / static_cast<float>(size);
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
  int known = -1;  // the column whose mixture is `last`
  Mixture last{};
  for (int block = x0 / matte_block; block * matte_block < x1; ++block) {
    if (states[block] == block_full) continue;
    const bool empty = states[block] == block_empty;
    const int first = block * matte_block;
    if (empty && row.has_subject[first / colours.size()] == 0) continue;
    const Mixture from = known == first ? last : mixture_at(first);
    const Mixture to = last = mixture_at(first + matte_block);
    known = first + matte_block;
    const auto pixel = [&](int i) {
      return pixels + 4 * static_cast<std::ptrdiff_t>(first + i - x0);
    };
    // Where nothing of the subject is, its colour around: one for the block.
    std::uint8_t around[4] = {0, 0, 0, 255};
    for (int c = 0; c < 3; ++c)
      around[c] = coding.encoded(0.5f * (from.subject[c] + to.subject[c]));
    const int begin = std::max(x0 - first, 0), end = std::min(matte_block, x1 - first);
    if (empty) {
      for (int i = begin; i < end; ++i) std::memcpy(pixel(i), around, 4);
      continue;
    }
    const Vec3f screen_step = (to.screen - from.screen) / static_cast<float>(matte_block);
    const Vec3f subject_step = (to.subject - from.subject) / static_cast<float>(matte_block);
    for (int i = begin; i < end; ++i) {
      const int a = alphas[first + i];
      if (a == 0) std::memcpy(pixel(i), around, 4);
      if (a == 0 || a == 255) continue;
      const float along = static_cast<float>(i) + 0.5f;
      const Vec3f own = straight(coding.decoded(pixel(i)), static_cast<float>(a) / 255.0f,
                                 from.screen + along * screen_step,
                                 from.subject + along * subject_step, uncertain);
      for (int c = 0; c < 3; ++c) pixel(i)[c] = coding.encoded(own[c]);
    }
  }
}

}  // namespace polyhull
