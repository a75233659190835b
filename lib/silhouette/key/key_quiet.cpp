// SPDX-License-Identifier: LGPL-2.1-or-later
// Silencing where whole blocks are not silent: the same without the blocks' outlines.
#include <algorithm>
#include <bit>
#include <cstring>

#include "silhouette/key/key_state.h"

namespace polyhull::silhouette {
namespace {

// Pixels beside an edge that keep their exact ramp, and those over which the silence then grows to
// its full strength. The first is the width of a ramp in 4:2:0 after a film's compression.
constexpr int exact = 4;
constexpr int growing = 4;

// Levels of alpha: the step that is left where this much is silenced in whole blocks is not worth
// the time. A quiet screen and a subject that is solid throughout have no larger one.
constexpr int unseen = 8;

// What is looked at: a block, and how far edges reach into it on both sides.
constexpr int margin = exact + growing;
constexpr int window = matte_block + 2 * margin;
static_assert(window == 32, "one bit of a word per pixel");

// Bit i: whether flags[i] is 1; the others are 0.
std::uint32_t bits_of(const std::uint8_t* flags) {
  std::uint32_t bits = 0;
  for (int i = 0; i < window; i += 8) {
    std::uint64_t eight;
    std::memcpy(&eight, flags + i, 8);
    bits |= static_cast<std::uint32_t>(eight * 0x0102040810204080u >> 56) << i;
  }
  return bits;
}

struct MixedBlocks {
  std::vector<std::uint16_t> list;
};

// The pixels of one side that are to change, by how far from its ends they lie.
struct Change {
  std::uint32_t weaker[growing];  // [i]: at least exact + 1 + i pixels from an edge
  std::uint32_t any;
};

// \p side: who is on the side, \p needed: who of them has not yet the side's last value.
Change change_of(std::uint32_t side, std::uint32_t needed) {
  constexpr std::uint32_t block = 0xffffu << margin;
  Change change{};
  std::uint32_t inside = side;
  for (int i = 0; i < exact; ++i) inside &= inside << 1 & inside >> 1;
  for (std::uint32_t& weaker : change.weaker) weaker = inside &= inside << 1 & inside >> 1;
  change.any = change.weaker[0] & needed & block;
  return change;
}

}  // namespace

Quiet quiet_for(std::uint8_t low, std::uint8_t high) {
  Quiet quiet;
  // Up to twice as far from the end as what is silenced in whole blocks, but never near the half
  // level, where contours are.
  const int dark = std::min(2 * low, 96);
  const int bright = std::max(2 * high - 255, 160);
  quiet.dark = static_cast<std::uint8_t>(dark);
  quiet.bright = static_cast<std::uint8_t>(bright);
  quiet.active = low > unseen || high < 255 - unseen;
  for (int v = 0; v < 256; ++v) {
    quiet.value[v] = static_cast<std::uint8_t>(
        v <= dark     ? (v <= low ? 0 : (v - low) * dark / (dark - low))
        : v >= bright ? (v >= high ? 255 : bright + (v - bright) * (255 - bright) / (high - bright))
                      : v);
  }
  return quiet;
}

void quieten_row(const Quiet& quiet, int begin, int end, std::uint8_t* alpha, BlockState* states) {
  if (!quiet.active) return;
  const std::uint8_t dark = quiet.dark, bright = quiet.bright;
  auto& list = kept_by_thread<MixedBlocks>().list;
  const int first = begin / matte_block, blocks = blocks_across(end) - first;
  list.resize(static_cast<std::size_t>(blocks) + 1);
  const int mixed = kernels().mixed_blocks(states + first, blocks, list.data());
  for (int k = 0; k < mixed; ++k) {
    const int x = begin + list[static_cast<std::size_t>(k)] * matte_block;
    // Beside the row its ends go on.
    std::uint8_t pixels[window];
    if (x - margin >= begin && x + matte_block + margin <= end)
      std::memcpy(pixels, alpha + x - margin, window);
    else
      for (int i = 0; i < window; ++i)
        pixels[i] = alpha[std::clamp(x - margin + i, begin, end - 1)];
    std::uint8_t at_dark[window], at_bright[window], between[window];
    for (int i = 0; i < window; ++i) {
      at_dark[i] = pixels[i] <= dark;
      at_bright[i] = pixels[i] >= bright;
      between[i] = static_cast<std::uint8_t>(pixels[i] + 1) > 1;
    }
    const std::uint32_t needed = bits_of(between);
    const Change to_dark = change_of(bits_of(at_dark), needed);
    const Change to_bright = change_of(bits_of(at_bright), needed);
    std::uint32_t any = to_dark.any | to_bright.any;
    if (any == 0) continue;
    for (; any != 0; any &= any - 1) {
      const int i = std::countr_zero(any);
      int weight = 0;
      for (int l = 0; l < growing; ++l)
        weight += static_cast<int>((to_dark.weaker[l] | to_bright.weaker[l]) >> i & 1u);
      const int v = pixels[i];
      if (x - margin + i < end)
        alpha[x - margin + i] =
            static_cast<std::uint8_t>(v + (quiet.value[v] - v) * weight / growing);
    }
    find_states(alpha + x, std::min(matte_block, end - x), states + x / matte_block);
  }
}

}  // namespace polyhull::silhouette
