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

constexpr double subject_variation =
    40.0;  // levels by which a subject's colours differ from those around

/// Screen and subject at the centres of a row's tiles, between rows of tiles.
struct RowColours {
  std::vector<Vec3f> screens, subjects;
  std::vector<std::uint8_t> has_subject;
};

/// \p in_light: their light, 0..255 as their levels.
void interpolate(const silhouette::LocalColours& colours, int y, bool in_light, RowColours& row) {
  const float v = (static_cast<float>(y) + 0.5f) / static_cast<float>(colours.size()) - 0.5f;
  const int above = static_cast<int>(std::floor(v));
  const float part = v - static_cast<float>(above);
  const int upper = std::clamp(above, 0, colours.down() - 1);
  const int lower = std::clamp(above + 1, 0, colours.down() - 1);
  row.screens.clear(), row.subjects.clear(), row.has_subject.clear();
  const auto light = [&](const Vec3f& c) {
    return in_light ? 255.0f * srgb_decoded(c / 255.0f) : c;
  };
  for (int i = 0; i < colours.across(); ++i) {
    const auto &a = colours.tile(i, upper), &b = colours.tile(i, lower);
    row.screens.push_back(light(glm::mix(a.screen, b.screen, part)));
    row.has_subject.push_back(a.has_subject || b.has_subject);
    row.subjects.push_back(light(a.has_subject && b.has_subject
                                     ? glm::mix(a.subject, b.subject, part)
                                 : a.has_subject ? a.subject
                                                 : b.subject));
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

void Keyer::State::unmix_row(int y, int x0, int x1, std::uint8_t* pixels) const {
  if (local) return unmix_plate_row(y, x0, x1, pixels);
  if (first_spans.empty()) return;
  static thread_local RowColours row;
  const bool in_light = mixing.in_light();
  interpolate(colours, y, in_light, row);
  Vec3f usual = silhouette::vector_of(samples.foreground);
  if (in_light) usual = 255.0f * srgb_decoded(usual / 255.0f);
  const float* const decode = srgb_to_linear_table();
  const std::uint8_t* const encode = linear_to_srgb_table();
  const float uncertain = doubt();
  const float size = static_cast<float>(colours.size());
  const BlockState* const states = keyed.state_row(y);
  const std::uint8_t* const alphas = keyed.row(y);
  for (int block = x0 / matte_block; block * matte_block < x1; ++block) {
    if (states[block] == block_full) continue;
    const bool empty = states[block] == block_empty;
    const int begin = std::max(block * matte_block, x0),
              end = std::min((block + 1) * matte_block, x1);
    const int tile = begin / colours.size();
    // Nothing far away from the subject is seen.
    const int left = std::max(tile - 1, 0), right = std::min(tile + 1, colours.across() - 1);
    if (empty && !row.has_subject[left] && !row.has_subject[tile] && !row.has_subject[right])
      continue;
    for (int x = begin; x < end; ++x) {
      const int a = empty ? 0 : alphas[x];
      if (a == 255) continue;
      const float u = (static_cast<float>(x) + 0.5f) / size - 0.5f;
      const int cell = static_cast<int>(std::floor(u));
      const float part = u - static_cast<float>(cell);
      const int one = std::clamp(cell, 0, colours.across() - 1);
      const int other = std::clamp(cell + 1, 0, colours.across() - 1);
      const Vec3f screen = glm::mix(row.screens[one], row.screens[other], part);
      const Vec3f near = row.has_subject[one] && row.has_subject[other]
                             ? glm::mix(row.subjects[one], row.subjects[other], part)
                         : row.has_subject[one]   ? row.subjects[one]
                         : row.has_subject[other] ? row.subjects[other]
                                                  : usual;
      const float alpha = static_cast<float>(a) / 255.0f;
      std::uint8_t* const p = pixels + 4 * static_cast<std::ptrdiff_t>(x - x0);
      const Vec3f pixel = in_light ? 255.0f * Vec3f(decode[p[0]], decode[p[1]], decode[p[2]])
                                   : Vec3f(p[0], p[1], p[2]);
      const Vec3f own = straight(pixel, alpha, screen, near, uncertain);
      for (int c = 0; c < 3; ++c)
        p[c] = in_light ? linear_to_srgb(own[c] / 255.0f, encode) : level_of(own[c]);
    }
  }
}

}  // namespace polyhull
