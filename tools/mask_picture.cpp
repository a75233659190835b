// SPDX-License-Identifier: LGPL-2.1-or-later
#include "mask_picture.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "base/error.h"

namespace polyhull {
namespace {

using Colour = std::array<int, 3>;

// The largest difference of a channel.
int distance(const Colour& a, const Colour& b) {
  return std::max({std::abs(a[0] - b[0]), std::abs(a[1] - b[1]), std::abs(a[2] - b[2])});
}

Colour colour_at(const Picture& picture, std::size_t pixel) {
  const std::uint8_t* p = picture.pixels.data() + pixel * picture.channels;
  return {p[0], p[1], p[2]};
}

// Calls body(pixel) for each pixel of the border.
template <typename Body>
void each_of_border(const Picture& picture, const Body& body) {
  const std::size_t w = picture.width, h = picture.height;
  for (std::size_t x = 0; x < w; ++x) body(x), body((h - 1) * w + x);
  for (std::size_t y = 0; y < h; ++y) body(y * w), body(y * w + w - 1);
}

// Alpha that is nearly opaque all over tells nothing, nor does such that is the same everywhere.
bool alpha_tells(const DeepPicture& deep) {
  if (deep.channels != 2 && deep.channels != 4) return false;
  const std::size_t step = deep.channels;
  int least = deep.full, most = 0;
  for (std::size_t i = step - 1; i < deep.samples.size(); i += step) {
    least = std::min(least, int{deep.samples[i]});
    most = std::max(most, int{deep.samples[i]});
  }
  return least < most && 10 * least < 9 * deep.full;
}

bool is_coloured(const Picture& picture) {
  const std::size_t pixels = static_cast<std::size_t>(picture.width) * picture.height;
  std::size_t coloured = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    const auto [low, high] = std::ranges::minmax(colour_at(picture, i));
    coloured += high - low >= 32;
  }
  return coloured * 100 > pixels;
}

using ColourCounts = std::vector<std::pair<std::size_t, Colour>>;

// The colours of pixels, the most frequent first.
ColourCounts sorted(const std::map<Colour, std::size_t>& counts) {
  ColourCounts result;
  for (const auto& [colour, count] : counts) result.emplace_back(count, colour);
  std::ranges::sort(result, std::greater());
  return result;
}

// The colour that at least half of the border has and that no screen and no studio's wall has: near
// black, near white, of another hue than green and blue, or without any noise.
std::optional<Colour> background_of(const Picture& picture) {
  std::map<Colour, std::size_t> counts;
  each_of_border(picture, [&](std::size_t i) { ++counts[colour_at(picture, i)]; });
  const Colour colour = sorted(counts).front().second;
  std::size_t same = 0, equal = 0, all = 0;
  each_of_border(picture, [&](std::size_t i) {
    const int away = distance(colour_at(picture, i), colour);
    same += away <= 16;
    equal += away <= 2;
    ++all;
  });
  const auto [low, high] = std::ranges::minmax(colour);
  const bool screen = std::max(colour[1], colour[2]) - colour[0] >= 32 && high - low >= 48;
  // No camera shows a wall as one colour.
  const bool wall = high - low < 32 && high > 48 && low < 208 && 100 * equal < 95 * all;
  if (2 * same < all || screen || wall) return std::nullopt;
  return colour;
}

// A picture of a few flat colours as a mask of what is not background; nothing: it is no such
// picture. The nearest colour of many pixels counts as the subject's full level, so that the mixed
// colours of soft outlines keep their share.
std::optional<Picture> mask_of_flat_colours(const Picture& picture) {
  constexpr int off = 24, same = 3;  // levels
  const std::optional<Colour> background = background_of(picture);
  if (!background) return std::nullopt;
  std::map<Colour, std::size_t> counts;
  std::array<std::size_t, 256> distances{};
  std::size_t subject = 0;
  const std::size_t pixels = static_cast<std::size_t>(picture.width) * picture.height;
  for (std::size_t i = 0; i < pixels; ++i) {
    const Colour colour = colour_at(picture, i);
    const int away = distance(colour, *background);
    if (away <= off) continue;
    ++counts[colour];
    ++distances[away];
    ++subject;
  }
  std::vector<Colour> flat;
  std::size_t in_flat = 0;
  for (const auto& [count, colour] : sorted(counts)) {
    const bool near = std::ranges::any_of(
        flat, [&, c = colour](const Colour& each) { return distance(each, c) <= same; });
    if (!near && flat.size() < 8) flat.push_back(colour);
    if (near || flat.back() == colour) in_flat += count;
  }
  if (subject == 0 || 10 * in_flat < 7 * subject) return std::nullopt;
  int full = off + 1;
  for (int d = 255; d > off; --d) {
    std::size_t many = 0;
    for (int e = std::max(off + 1, d - 2); e <= std::min(255, d + 2); ++e) many += distances[e];
    if (20 * many >= subject && distances[d] > 0) full = d;
  }
  Picture mask{picture.width, picture.height, 1, {}};
  for (std::size_t i = 0; i < pixels; ++i)
    mask.pixels.push_back(static_cast<std::uint8_t>(
        std::min(255, distance(colour_at(picture, i), *background) * 255 / full)));
  return mask;
}

int level_at(const DeepPicture& deep, std::size_t pixel) {
  return deep.samples[pixel * deep.channels];
}

// Whether \p deep is of a few flat grey levels, some of which are too dark for a subject's: numbers
// of what each pixel shows, 255 often being a border that is left open. Noise is not flat, and soft
// edges are of many levels. Where white is most of what is lit, it is a matte with parts left open.
bool shows_labels(const DeepPicture& deep) {
  std::map<int, std::size_t> counts;
  std::size_t lit = 0, flat = 0;
  const std::size_t pixels = static_cast<std::size_t>(deep.width) * deep.height;
  for (std::size_t i = 0; i < pixels; ++i) {
    const int level = level_at(deep, i);
    if (level == 0) continue;
    ++counts[level];
    ++lit;
    flat += i > 0 && level_at(deep, i - 1) == level;
  }
  if (2 * counts[deep.full] > lit) return false;
  std::size_t levels = 0, in_levels = 0, dark = 0;
  for (const auto& [value, count] : counts) {
    if (500 * count < lit) continue;
    ++levels;
    in_levels += count;
    if (2 * value < deep.full) dark += count;
  }
  return levels > 1 && 50 * dark >= lit && 1000 * in_levels >= 999 * lit && 10 * flat >= 8 * lit;
}

// The level that the background has in a picture of labels: black, else what most of the border shows.
int background_label(const DeepPicture& deep, const std::map<int, std::size_t>& counts,
                     const std::string& path) {
  const std::size_t pixels = static_cast<std::size_t>(deep.width) * deep.height;
  if (const auto black = counts.find(0); black != counts.end() && 100 * black->second >= pixels)
    return 0;
  std::map<int, std::size_t> of_border;
  std::size_t border = 0;
  each_of_border({deep.width, deep.height, 1, {}}, [&](std::size_t i) {
    ++of_border[level_at(deep, i)];
    ++border;
  });
  for (const auto& [level, count] : of_border)
    if (2 * count > border) return level;
  throw Error(Error::Kind::bad_input,
              "{}: it is a picture of labels, a few flat grey levels, and nothing of it is black, "
              "nor is most of its border of one level, so the background is not known. Give a mask "
              "with the subject white and all else black.",
              path);
}

// Of a picture of labels all but the background. Of two levels, as of video's black and white, those
// between keep their share.
Picture mask_of_labels(const DeepPicture& deep, const std::string& path, std::string& note) {
  const std::size_t pixels = static_cast<std::size_t>(deep.width) * deep.height;
  std::map<int, std::size_t> counts;
  for (std::size_t i = 0; i < pixels; ++i) ++counts[level_at(deep, i)];
  const int background = background_label(deep, counts, path);
  const std::size_t empty = std::exchange(counts[background], 0);
  const auto [subject, count] =
      *std::ranges::max_element(counts, {}, [](auto& each) { return each.second; });
  const bool two = background > 0 && 100 * (empty + count) > 95 * pixels;
  Picture mask{deep.width, deep.height, 1, {}};
  for (std::size_t i = 0; i < pixels; ++i) {
    const int off = level_at(deep, i) - background;
    const int value =
        two ? std::clamp(255 * off / (subject - background), 0, 255) : (off != 0) * 255;
    mask.pixels.push_back(static_cast<std::uint8_t>(value));
  }
  note = fmt::format(
      "a picture of labels, a few flat grey levels: all but {} are taken for the subject",
      background == 0 ? "black" : fmt::format("{}, the background's,", background));
  return mask;
}

void refuse_inverted(const MaskPicture& mask, const std::string& path, const char* where) {
  const Picture& p = mask.picture;
  std::size_t border = 0, of_border = 0;
  each_of_border(p, [&](std::size_t i) {
    of_border += p.pixels[i] >= 128;
    ++border;
  });
  const auto covered = static_cast<std::size_t>(
      std::ranges::count_if(p.pixels, [](std::uint8_t v) { return v >= 128; }));
  if (4 * of_border < 3 * border || 4 * covered < p.pixels.size()) return;
  throw Error(Error::Kind::bad_input,
              "{}: the mask looks inverted: what its {} calls the subject covers {:.0f} % of the "
              "picture and {:.0f} % of its border. A mask shows the subject white (opaque) and the "
              "background black (transparent): invert it. A camera whose picture the subject "
              "fills says nothing: leave it out.",
              path, where, 100.0 * double(covered) / double(p.pixels.size()),
              100.0 * double(of_border) / double(border));
}

}  // namespace

MaskPicture load_mask_picture(const std::string& path) {
  const DeepPicture deep = load_deep_picture(path);
  MaskPicture mask;
  const bool alpha = alpha_tells(deep);
  if (!alpha && deep.channels >= 3) {
    mask.picture = load_picture(path, 3);
    if (is_coloured(mask.picture)) {
      const std::optional<Picture> flat = mask_of_flat_colours(mask.picture);
      mask.to_key = !flat;
      if (!flat) return mask;
      mask.picture = *flat;
      mask.note = "a mask of flat colours: what differs from its border's colour is the subject";
      return mask;
    }
  }
  MaskLevels levels = mask_levels(deep, alpha ? deep.channels - 1 : 0);
  for (int c = 1; !alpha && levels.largest == 0 && c < std::min(deep.channels, 3); ++c)
    if (deep.channels >= 3) levels = mask_levels(deep, c);
  mask.picture = std::move(levels.picture);
  const char* what = alpha ? "alpha" : "brightness";
  if (!alpha && shows_labels(deep))
    mask.picture = mask_of_labels(deep, path, mask.note);
  else if (levels.by_own)
    mask.note = fmt::format("its largest {} is {} of {}: taken for the subject's", what,
                            levels.largest, deep.full);
  else if (levels.largest > 0 && 2 * levels.largest < deep.full)
    mask.note =
        fmt::format("its largest {} is {} of {}, and few pixels have it: it shows no subject", what,
                    levels.largest, deep.full);
  refuse_inverted(mask, path, what);
  return mask;
}

}  // namespace polyhull
