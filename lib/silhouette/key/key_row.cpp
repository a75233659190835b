// SPDX-License-Identifier: LGPL-2.1-or-later
// Keying of one row, from each kind of format.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "silhouette/key/key_state.h"

namespace polyhull {

using silhouette::kernels;

// Working memory of one thread, kept between rows.
struct Keyer::State::RowMemory {
  std::vector<std::uint8_t> pixels;
  // Of the row of pixels or of chroma under way, for all of its spans: begin_chroma().
  silhouette::ChromaRows rows;
  const std::uint8_t *near_row = nullptr, *far_row = nullptr;  // interleaved pairs
  // Each row of chroma serves up to four of luma; its neighbour lies in the other slot.
  struct Gathered {
    std::vector<std::uint8_t> pairs;
    std::uint64_t frame = 0;
    int row = -1;
  } gathered[2];
  // What screen_of_chroma() found of the last rows of chroma, for the tiles of one row of them; likewise.
  struct Screen {
    std::vector<BlockState> states;
    std::uint64_t frame = 0;
    int row = -1;
    std::size_t tiles = 0;
  } screens[2];
  std::vector<BlockState> screen;  // of both rows of chroma of a row of pixels
  std::vector<std::uint16_t> others;
  std::vector<std::int16_t> half, signal;
  // Of chroma_row() for columns from `begin` on.
  const std::int16_t* begun = nullptr;
  int begin = 0;

  // Of this thread, for rows of \p length pixels.
  static RowMemory& of_thread(std::size_t length) {
    auto& memory = silhouette::kept_by_thread<RowMemory>();
    memory.fit(length);
    return memory;
  }
  void fit(std::size_t length) {
    if (signal.size() >= length + 64) return;
    pixels.resize(4 * length);
    for (Gathered& slot : gathered) slot.pairs.resize(length + 64), slot.row = -1;
    for (Screen& slot : screens) slot.states.resize(length / matte_block), slot.row = -1;
    screen.resize(length / matte_block);
    others.resize(length / matte_block + 1);
    half.resize(length + 64);
    signal.resize(length + 64);
  }
};

namespace {

// A row's \p count chroma samples as interleaved pairs.
void gather_chroma(const FrameView& frame, int row, int count, std::uint8_t* __restrict pairs) {
  if (frame.format == FrameFormat::i420) {
    const std::uint8_t* __restrict cb = frame.row(1, row);
    const std::uint8_t* __restrict cr = frame.row(2, row);
    for (int i = 0; i < count; ++i) pairs[2 * i] = cb[i], pairs[2 * i + 1] = cr[i];
    return;
  }
  const std::uint8_t* from = frame.row(0, row) + (frame.format == FrameFormat::yuy2 ? 1 : 0);
  for (int i = 0; i < 2 * count; ++i) pairs[i] = from[2 * i];
}

// Signals of `count` pairs of columns from those of their chroma samples.
void double_row(ChromaSite site, const std::int16_t* from, int count, std::int16_t* out) {
  if (!silhouette::between_columns(site)) return kernels().double_left(from, count, out);
  for (int i = 0; i < count; ++i) {
    out[2 * i] = static_cast<std::int16_t>((from[i - 1] + 3 * from[i] + 2) >> 2);
    out[2 * i + 1] = static_cast<std::int16_t>((3 * from[i] + from[i + 1] + 2) >> 2);
  }
}

// The prototype's rule: background where the signal is above the strength, unless the pixel is
// bright.
void prototype_alpha(const std::uint8_t* pixels, const std::int16_t* signal, int count,
                     int strength, const int sum_weights[3], int bright, std::uint8_t* alpha) {
  for (int x = 0; x < count; ++x) {
    const std::uint8_t* p = pixels + 4 * x;
    const int sum = p[0] * sum_weights[0] + p[1] * sum_weights[1] + p[2] * sum_weights[2];
    alpha[x] = signal[x] <= strength || sum > bright ? 255 : 0;
  }
}

}  // namespace

// Rows of chroma: NV12's own memory, or gathered.
void Keyer::State::begin_chroma(const FrameView& frame, const silhouette::ChromaRows& rows,
                                RowMemory& memory) const {
  memory.rows = rows;
  const auto pairs = [&](int row) -> const std::uint8_t* {
    if (frame.format == FrameFormat::nv12) return frame.row(1, row);
    RowMemory::Gathered& slot = memory.gathered[row & 1];
    if (slot.frame != frame_number || slot.row != row) {
      gather_chroma(frame, row, silhouette::chroma_width(frame), slot.pairs.data());
      slot.frame = frame_number, slot.row = row;
    }
    return slot.pairs.data();
  };
  memory.near_row = pairs(rows.near_row);
  memory.far_row = pairs(rows.far_row);
}

// Signals of the chroma samples of columns [x0, x1) of the row begun, x0 even: one for two columns, the
// ends of the row repeated beside it.
const std::int16_t* Keyer::State::chroma_row(const FrameView& frame,
                                             const silhouette::ChromaForms& forms, int x0, int x1,
                                             RowMemory& memory) {
  const int available = silhouette::chroma_width(frame);
  // One more sample on each side for the interpolation.
  const int c0 = std::max(x0 / 2 - 1, 0), c1 = std::min((x1 + 1) / 2 + 1, available);
  std::int16_t* half = memory.half.data() + 8;
  kernels().chroma_signal(memory.near_row + 2 * c0, memory.far_row + 2 * c0,
                          memory.rows.near_weight, memory.rows.far_weight, c1 - c0, forms.weights,
                          forms.offsets, half);
  half[-1] = half[0];
  half[c1 - c0] = half[c1 - c0 - 1];
  return half + (x0 / 2 - c0);
}

// Of whole blocks [x0, end) of pixels of four bytes.
void Keyer::State::pixel_alpha_row(const FrameView& frame, int y, int x0, int end,
                                   const RowKey& key, std::uint8_t* alpha,
                                   BlockState* states) const {
  const silhouette::Kernels& run = kernels();
  const std::uint8_t* pixels = frame.row(0, y);
  const int direct = std::min(end, frame.width / matte_block * matte_block);
  if (direct > x0)
    run.pixel_alpha(pixels + 4 * x0, direct - x0, key.forms, key.ramp, alpha + x0,
                    states + x0 / matte_block);
  if (direct < end) {
    std::uint8_t last[4 * matte_block] = {};
    std::memcpy(last, pixels + 4 * direct, static_cast<std::size_t>(4 * (frame.width - direct)));
    run.pixel_alpha(last, matte_block, key.forms, key.ramp, alpha + direct,
                    states + direct / matte_block);
  }
}

const std::int16_t* Keyer::State::signal_row(const FrameView& frame, int y, int x0, int stop,
                                             const RowKey& key) const {
  RowMemory& memory = RowMemory::of_thread(row_length());
  if (path == Path::chroma) {
    begin_chroma(frame, silhouette::chroma_rows(frame, y), memory);
    const std::int16_t* half = chroma_row(frame, key.chroma, x0, stop, memory);
    double_row(frame.site, half, (stop - x0 + 1) / 2, memory.signal.data());
    return memory.signal.data();
  }
  const std::uint8_t* pixels = frame.row(0, y) + 4 * static_cast<std::ptrdiff_t>(x0);
  if (path == Path::converted) {
    convert_row(frame, y, x0, stop, memory.pixels.data());
    pixels = memory.pixels.data();
  }
  kernels().pixel_signal(pixels, stop - x0, key.forms, memory.signal.data());
  return memory.signal.data();
}

void Keyer::State::soft_span(const FrameView& frame, int y, const Stretch& stretch,
                             RowMemory& memory, std::uint8_t* alpha, BlockState* states) const {
  const auto& [x0, end, key] = stretch;
  if (path == Path::pixels) return pixel_alpha_row(frame, y, x0, end, key, alpha, states);
  const silhouette::Kernels& run = kernels();
  const int stop = std::min(end, frame.width);  // real pixels
  alpha += x0, states += x0 / matte_block;
  if (path == Path::converted) {
    std::uint8_t* pixels = memory.pixels.data();
    convert_row(frame, y, x0, stop, pixels);
    std::fill(pixels + 4 * (stop - x0), pixels + 4 * (end - x0), 0);
    return run.pixel_alpha(pixels, end - x0, key.forms, key.ramp, alpha, states);
  }
  const std::int16_t* half = memory.begun + (x0 - memory.begin) / 2;
  if (!silhouette::between_columns(frame.site) && stop == end)
    return run.doubled_alpha(half, end - x0, key.ramp, alpha, states);
  std::int16_t* signal = memory.signal.data();
  double_row(frame.site, half, (stop - x0 + 1) / 2, signal);
  std::fill(signal + (stop - x0), signal + (end - x0), 0);
  run.ramp_alpha(signal, end - x0, key.ramp, alpha, states);
}

// Of one row of chroma alone.
void Keyer::State::screen_of_chroma(const FrameView& frame, int row, const Part& part,
                                    RowMemory& memory, BlockState* states) const {
  const auto [y, x0, end] = part;
  const auto tiles = static_cast<std::size_t>(y / colours.size());
  begin_chroma(frame, {row, row, 4, 0}, memory);
  const int last = frame.width / matte_block * matte_block;  // a part of a block is looked at
  std::fill(states + x0 / matte_block, states + end / matte_block, block_mixed);
  for (std::size_t i = first_spans[tiles]; i < first_spans[tiles + 1];) {
    const std::size_t beyond = spans[i].beyond;
    const int begin = std::max(spans[i].begin, x0);
    const int stop = std::min({spans[beyond - 1].end, end, last});
    const std::int16_t* half =
        begin < stop ? chroma_row(frame, spans[i].key.chroma, begin, stop, memory) : nullptr;
    for (; i < beyond; ++i) {
      const int from = std::max(spans[i].begin, x0), to = std::min(spans[i].end, stop);
      if (from < to)
        kernels().screen_blocks(half + (from - begin) / 2, (to - from) / matte_block,
                                spans[i].key.ramp.empty_above, states + from / matte_block);
    }
  }
}

// A signal is the least of two linear forms, so that between two rows of chroma, and between two samples
// of them, it is no less than the lesser of theirs: where both rows are surely screen, so is all between.
const BlockState* Keyer::State::screen_blocks(const FrameView& frame, const Part& part,
                                              RowMemory& memory) const {
  const auto tiles = static_cast<std::size_t>(part.y / colours.size());
  const silhouette::ChromaRows rows = silhouette::chroma_rows(frame, part.y);
  const auto of_row = [&](int row) {
    RowMemory::Screen& slot = memory.screens[row & 1];
    if (slot.frame != frame_number || slot.row != row || slot.tiles != tiles) {
      screen_of_chroma(frame, row, part, memory, slot.states.data());
      slot.frame = frame_number, slot.row = row, slot.tiles = tiles;
    }
    return slot.states.data();
  };
  const BlockState* const near_row = of_row(rows.near_row);
  const BlockState* const far_row = of_row(rows.far_row);
  BlockState* const __restrict both = memory.screen.data();
  for (int b = part.x0 / matte_block, last = part.end / matte_block; b < last; ++b)
    both[b] = near_row[b] | far_row[b];
  return both;
}

std::size_t Keyer::State::soft_spans(const FrameView& frame, const Part& part, std::size_t i,
                                     RowMemory& memory, std::uint8_t* alpha,
                                     BlockState* states) const {
  const auto [y, x0, end] = part;
  for (int until = x0;; ++i) {
    const Span& span = spans[i];
    const int from = std::max(span.begin, x0), to = std::min(span.end, end);
    if (from < to) {
      if (from >= until && path == Path::chroma) {
        // Neighbours mostly have the same forms, and differ in their ramps.
        until = std::min(spans[span.beyond - 1].end, end);
        memory.begin = from;
        memory.begun =
            chroma_row(frame, span.key.chroma, from, std::min(until, frame.width), memory);
      }
      soft_span(frame, y, {from, to, span.key}, memory, alpha, states);
      if (span.key.bend != silhouette::Bend{})
        kernels().bend_blocks(span.key.bend, (to - from) / matte_block, alpha + from,
                              states + from / matte_block);
    }
    if (span.end >= end) return i;
  }
}

void Keyer::State::soft_row(const FrameView& frame, int y, int x0, int end, std::uint8_t* alpha,
                            BlockState* states) const {
  RowMemory& memory = RowMemory::of_thread(row_length());
  const bool chroma = path == Path::chroma;
  // Most of a picture is screen, which half the rows of chroma as there are of pixels tell.
  const bool sparse = chroma && halved_down(frame) && !first_spans.empty();
  const BlockState* const screen = sparse ? screen_blocks(frame, {y, x0, end}, memory) : nullptr;
  if (chroma) begin_chroma(frame, silhouette::chroma_rows(frame, y), memory);
  if (first_spans.empty()) {
    memory.begin = x0;
    if (chroma)
      memory.begun = chroma_row(frame, whole.chroma, x0, std::min(end, frame.width), memory);
    return soft_span(frame, y, {x0, end, whole}, memory, alpha, states);
  }
  std::size_t span = first_spans[static_cast<std::size_t>(y / colours.size())];
  if (!sparse) return void(soft_spans(frame, {y, x0, end}, span, memory, alpha, states));
  const int first = x0 / matte_block, blocks = end / matte_block - first;
  std::copy_n(screen + first, blocks, states + first);
  std::fill(alpha + x0, alpha + end, 0);
  const std::uint16_t* const others = memory.others.data();
  const int count = kernels().mixed_blocks(screen + first, blocks, memory.others.data());
  for (int i = 0; i < count;) {
    const int begin = others[i];
    int beyond = begin;
    while (i < count && others[i] == beyond) ++i, ++beyond;
    span = soft_spans(frame, {y, x0 + begin * matte_block, x0 + beyond * matte_block}, span, memory,
                      alpha, states);
  }
}

void Keyer::State::alpha_row(const FrameView& frame, int y, std::uint8_t* alpha,
                             BlockState* states) const {
  // Whole blocks around the active columns; the last block of a row may reach past the frame.
  const int x0 = active.x / matte_block * matte_block;
  const int x1 = active.x + active.width;
  const int whole_blocks = x0 + (x1 - x0) / matte_block * matte_block;
  const int end = whole_blocks == x1 ? x1 : whole_blocks + matte_block;
  const int stop = std::min(end, frame.width);  // real pixels
  const silhouette::Kernels& run = kernels();

  if (method == KeyMethod::soft && !local) return soft_row(frame, y, x0, end, alpha, states);
  RowMemory& memory = RowMemory::of_thread(row_length());
  if (method == KeyMethod::difference) {
    std::uint8_t* pixels = memory.pixels.data();
    convert_row(frame, y, x0, stop, pixels);
    std::fill(pixels + 4 * (stop - x0), pixels + 4 * (end - x0), 0);
    run.difference_alpha(pixels,
                         plate.data() + 4 * (row_length() * static_cast<std::size_t>(y) + x0),
                         end - x0, difference, alpha + x0);
    run.states(alpha + x0, (end - x0) / matte_block, states + x0 / matte_block);
    return;
  }
  signal_row(frame, y, x0, stop, whole);
  std::int16_t* signals = memory.signal.data();
  std::fill(signals + (stop - x0), signals + (end - x0), 0);
  if (method == KeyMethod::soft) {
    const std::size_t at = row_length() * static_cast<std::size_t>(y) + x0;
    run.local_alpha(signals, base.data() + at, gain.data() + at, whole.ramp, end - x0, alpha + x0,
                    states + x0 / matte_block);
    return;
  }
  const bool reversed =
      path == Path::pixels && (format == FrameFormat::bgrx || format == FrameFormat::bgra);
  const int red = static_cast<int>(std::lround(settings.red_gain * 256.0));
  const int blue = static_cast<int>(std::lround(settings.blue_gain * 256.0));
  const int weights[3] = {reversed ? blue : red, 256, reversed ? red : blue};
  const std::uint8_t* pixels = path == Path::pixels
                                   ? frame.row(0, y) + 4 * static_cast<std::ptrdiff_t>(x0)
                                   : memory.pixels.data();  // as signal_row() left them
  prototype_alpha(pixels, signals, stop - x0, static_cast<int>(settings.strength * signal.unit),
                  weights, settings.bright_threshold * 256, alpha + x0);
  std::fill(alpha + stop, alpha + end, 0);
  run.states(alpha + x0, (end - x0) / matte_block, states + x0 / matte_block);
}

void Keyer::key_row(const FrameView& frame, int y, std::uint8_t* alpha, BlockState* states,
                    bool for_colours) {
  State& s = *state_;
  s.limited_row(frame, y, alpha, states);
  if (!for_colours) return;
  if (s.despills()) s.edges.add_row(y, alpha, states);
  const int blocks = blocks_across(frame.width);
  std::copy_n(states, blocks, s.keyed.state_row(y));
  static thread_local std::vector<std::uint16_t> list;
  list.resize(static_cast<std::size_t>(blocks) + 1);
  const int mixed = kernels().mixed_blocks(states, blocks, list.data());
  for (int i = 0; i < mixed; ++i) {
    const int begin = list[i] * matte_block;
    std::memcpy(s.keyed.row(y) + begin, alpha + begin,
                static_cast<std::size_t>(std::min(matte_block, frame.width - begin)));
  }
}

void Keyer::State::limited_row(const FrameView& frame, int y, std::uint8_t* alpha,
                               BlockState* states) const {
  const State& s = *this;
  const int blocks = blocks_across(frame.width);
  const int x0 = s.active.x, x1 = s.active.x + s.active.width;
  if (s.active.empty() || y < s.active.y || y >= s.active.y + s.active.height) {
    std::fill(alpha, alpha + blocks * matte_block, 0);
    std::fill(states, states + blocks, block_empty);
    return;
  }
  s.alpha_row(frame, y, alpha, states);
  if (s.method == KeyMethod::soft)
    silhouette::quieten_row(s.quiet, x0 / matte_block * matte_block,
                            std::min(((x1 - 1) / matte_block + 1) * matte_block, frame.width),
                            alpha, states);

  // Left, right and inside the blocks at the ends: background outside the region of interest.
  const int first = x0 / matte_block, last = (x1 - 1) / matte_block;
  std::fill(alpha, alpha + x0, 0);
  std::fill(states, states + first, block_empty);
  std::fill(alpha + x1, alpha + blocks * matte_block, 0);
  std::fill(states + last + 1, states + blocks, block_empty);

  if (!s.allowed.empty() || !s.forced.empty()) {
    const std::size_t at = s.row_length() * static_cast<std::size_t>(y);
    if (!s.forced.empty())
      for (int x = x0; x < x1; ++x) alpha[x] |= s.forced[at + x];
    if (!s.allowed.empty())
      for (int x = x0; x < x1; ++x) alpha[x] &= s.allowed[at + x];
    find_states(alpha + first * matte_block,
                std::min((last + 1) * matte_block, frame.width) - first * matte_block,
                states + first);
    return;
  }
  const auto again = [&](int block) {
    const int begin = block * matte_block;
    find_states(alpha + begin, std::min(matte_block, frame.width - begin), states + block);
  };
  if (x0 % matte_block != 0) again(first);
  if (x1 % matte_block != 0) again(last);
}

}  // namespace polyhull
