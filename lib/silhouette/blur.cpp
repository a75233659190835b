// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/blur.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <vector>

#include "base/error.h"
#include "silhouette/blur_plane.h"
#include "silhouette/kernels.h"

namespace polyhull {
namespace {

using silhouette::kernels;

constexpr int vertical_scale = 64;  // units per level between the two passes
constexpr std::int16_t vertical_full = 255 * vertical_scale;

// Weights of a Gaussian cut at `radius`, in 2^-15, so rounded that their running sum is right to
// half a unit: the error of an edge's flank then does not grow with the radius. One 0 follows.
std::vector<std::int16_t> fir_weights(double sigma, int radius) {
  std::vector<double> exact(radius + 1);
  double total = 0.0;
  for (int k = 0; k <= radius; ++k) {
    exact[k] = std::exp(-0.5 * k * k / (sigma * sigma));
    total += k == 0 ? exact[k] : 2.0 * exact[k];
  }
  std::vector<std::int16_t> weights(radius + 2, 0);
  double tail = 0.0;
  long rounded_tail = 0;
  for (int k = radius; k >= 1; --k) {
    tail += exact[k] / total * 32768.0;
    const long now = std::lround(tail);
    weights[k] = static_cast<std::int16_t>(now - rounded_tail);
    rounded_tail = now;
  }
  weights[0] = static_cast<std::int16_t>(std::min(32768 - 2 * rounded_tail, 32767l));
  return weights;
}

int fir_radius(double sigma) {
  const double reach = sigma <= 8.0 ? 4.0 : 3.5;
  return std::max(1, static_cast<int>(std::ceil(reach * sigma)));
}

// A row kept in a ring, with room on both sides.
template <typename T>
class RowRing {
 public:
  void resize(int rows, std::ptrdiff_t length, std::ptrdiff_t pad) {
    rows_ = rows;
    pad_ = pad;
    stride_ = (length + 2 * pad + 31) / 32 * 32;
    values_.resize(static_cast<std::size_t>(stride_) * rows);
  }
  T* row(int y) { return slot(y % rows_); }
  T* slot(int i) { return values_.data() + pad_ + stride_ * i; }
  int rows() const { return rows_; }
  void clear(T value) { std::fill(values_.begin(), values_.end(), value); }

 private:
  int rows_ = 1;
  std::ptrdiff_t pad_ = 0, stride_ = 0;
  std::vector<T> values_;
};

}  // namespace

struct Blur::State {
  BlurSettings settings;
  bool fresh = true;

  int radius = 0;
  std::vector<std::int16_t> weights;

  // The picture being pushed.
  int width = 0, height = 0, blocks = 0;
  int pushed = 0, pulled = 0;
  RowRing<std::uint8_t> alpha;
  RowRing<BlockState> alpha_states;
  RowRing<std::int16_t> out;
  RowRing<BlockState> out_states;
  RowRing<BlockState> out_stored;      // what the memory of each row in `out` holds, as states
  std::vector<std::int16_t> vertical;  // one row with `side` values on both sides
  int side = 0;
  std::vector<RowRing<BlockState>> unions;  // see push()
  std::vector<BlockState> column_states;    // over the window of rows
  std::vector<const std::uint8_t*> window;

  silhouette::PlaneBlur plane;  // box and recursive

  // `stored`: the states of what the row's memory holds.
  void blur_row(int y, std::int16_t* values, const BlockState* stored, BlockState* states);
  void copy_row(int y, std::int16_t* values, BlockState* states);
  BlockState* states_level(int level, int y) {
    return level == 0 ? alpha_states.row(y) : unions[static_cast<std::size_t>(level) - 1].row(y);
  }
  // To whole words: rows of states have that room.
  void unite(const BlockState* a, const BlockState* b, BlockState* __restrict out) const {
    for (int i = 0; i < (blocks + 15) / 16 * 16; ++i) out[i] = a[i] | b[i];
  }
  void threshold_row(std::int16_t* values, BlockState* states) const;
  struct Interval {
    int begin, end;
  };
  // Filters the columns within the radius of where something changes; returns those written.
  Interval horizontal_pass(Interval changes, std::int16_t* values);
};

Blur::Blur() : state_(std::make_unique<State>()) {}
Blur::~Blur() = default;
Blur::Blur(Blur&&) noexcept = default;
Blur& Blur::operator=(Blur&&) noexcept = default;

void Blur::set(const BlurSettings& settings) {
  if (!(settings.sigma >= 0.0 && settings.sigma <= 100.0))
    throw Error(Error::Kind::bad_input, "blur settings: sigma must be from 0 to 100 px");
  if (settings.passes < 1 || settings.passes > 10)
    throw Error(Error::Kind::bad_input, "blur settings: passes must be from 1 to 10");
  if (settings.threshold < 0 || settings.threshold > 255)
    throw Error(Error::Kind::bad_input, "blur settings: threshold must be from 0 to 255");
  state_->settings = settings;
  state_->fresh = true;
}

const BlurSettings& Blur::settings() const {
  return state_->settings;
}

bool Blur::streams() const {
  return state_->settings.method == BlurMethod::fir || state_->settings.sigma == 0.0;
}

void Blur::begin(int width, int height, int keep) {
  State& s = *state_;
  if (s.fresh) {
    // Below 0.2 px the neighbours' weight is under 2^-15.
    s.radius = s.settings.sigma < 0.2 ? 0 : fir_radius(s.settings.sigma);
    if (s.radius > 0) s.weights = fir_weights(s.settings.sigma, s.radius);
    s.fresh = false;
  }
  s.width = width;
  s.height = height;
  s.blocks = blocks_across(width);
  s.pushed = s.pulled = 0;
  const std::ptrdiff_t length = static_cast<std::ptrdiff_t>(s.blocks) * matte_block;
  s.alpha.resize(2 * s.radius + 2, length, 0);
  s.alpha_states.resize(2 * s.radius + 2, s.blocks, 0);
  s.unions.resize(std::bit_width(static_cast<unsigned>(2 * s.radius + 1)) - 1);
  for (auto& level : s.unions) level.resize(2 * s.radius + 2, s.blocks, 0);
  s.out.resize(keep + 1, length, field_pad);
  s.out_states.resize(keep + 1, s.blocks, 0);
  s.out_stored.resize(keep + 1, s.blocks, 0);
  s.out_stored.clear(block_mixed);
  s.side = s.radius + 2 * matte_block;
  s.vertical.resize(static_cast<std::size_t>(length + 2 * s.side));
  s.column_states.resize(static_cast<std::size_t>(s.blocks + 15) / 16 * 16);
  s.window.resize(2 * s.radius + 1);
}

std::uint8_t* Blur::next_alpha() {
  return state_->alpha.row(state_->pushed);
}
BlockState* Blur::next_states() {
  return state_->alpha_states.row(state_->pushed);
}
void Blur::push() {
  State& s = *state_;
  // unions[l - 1] of a row: of the 2^l rows that end with it.
  for (int l = 1; l <= static_cast<int>(s.unions.size()); ++l) {
    const int before = s.pushed - (1 << (l - 1));
    const BlockState* latest = s.states_level(l - 1, s.pushed);
    s.unite(latest, before >= 0 ? s.states_level(l - 1, before) : latest,
            s.unions[static_cast<std::size_t>(l) - 1].row(s.pushed));
  }
  ++s.pushed;
}

bool Blur::pull(Row& row) {
  State& s = *state_;
  if (s.pulled >= s.height || (s.pushed < s.height && s.pushed <= s.pulled + s.radius))
    return false;
  std::int16_t* values = s.out.row(s.pulled);
  BlockState* states = s.out_states.row(s.pulled);
  if (s.radius == 0)
    s.copy_row(s.pulled, values, states);
  else
    s.blur_row(s.pulled, values, s.out_stored.row(s.pulled), states);
  if (s.settings.threshold > 0) s.threshold_row(values, states);
  std::memcpy(s.out_stored.row(s.pulled), states, static_cast<std::size_t>(s.blocks));
  std::fill(values - field_pad, values, values[0]);
  std::fill(values + s.width, values + s.blocks * matte_block + field_pad, values[s.width - 1]);
  row = {values, states, s.pulled++};
  return true;
}

void Blur::State::copy_row(int y, std::int16_t* values, BlockState* states) {
  const std::uint8_t* from = alpha.row(y);
  for (int x = 0; x < width; ++x) values[x] = static_cast<std::int16_t>(from[x] * field_scale);
  std::memcpy(states, alpha_states.row(y), static_cast<std::size_t>(blocks));
}

void Blur::State::blur_row(int y, std::int16_t* values, const BlockState* stored,
                           BlockState* states) {
  const int top = std::max(y - radius, 0), bottom = std::min(y + radius, height - 1);
  // The state of each block's column over the window of rows: of two runs of rows, a power of two
  // long, that together cover it.
  const int level = std::bit_width(static_cast<unsigned>(bottom - top + 1)) - 1;
  unite(states_level(level, bottom), states_level(level, top + (1 << level) - 1),
        column_states.data());
  int slot = top % alpha.rows();
  for (int k = -radius; k <= radius; ++k) {
    window[k + radius] = alpha.slot(slot);
    if (y + k >= top && y + k < bottom) slot = slot + 1 < alpha.rows() ? slot + 1 : 0;
  }

  const auto fill = [&](int x0, int x1) {
    if (x1 > x0)
      std::fill(values + x0, values + x1,
                static_cast<std::int16_t>(
                    column_states[(x1 - 1) / matte_block] == block_full ? field_full : 0));
  };
  std::memcpy(states, column_states.data(), static_cast<std::size_t>(blocks));

  // Intervals of columns in which something changes: mixed blocks, and the borders of two uniform
  // blocks of different kind. Intervals whose surroundings meet are filtered in one go.
  int done = 0;
  Interval current{};
  bool open = false;
  const auto process = [&] {
    const Interval computed = horizontal_pass(current, values);
    // What is left of the blocks at both ends.
    fill(std::max(computed.begin & ~(matte_block - 1), done), computed.begin);
    const int length = blocks * matte_block;
    const int block_end = (computed.end + matte_block - 1) & ~(matte_block - 1);
    fill(std::min(computed.end, length), std::min(block_end, length));
    done = computed.end;
    const int last = std::min(current.end + radius, width) - 1;
    for (int b = computed.begin / matte_block; b <= last / matte_block; ++b)
      states[b] = block_mixed;
  };
  for (int b = 0, e; b < blocks; b = e) {
    e = run_end(column_states.data(), b, blocks);
    const int x = b * matte_block;
    Interval next{x, x};
    if (column_states[b] == block_mixed)
      next.end = e * matte_block;
    else if (b == 0 || column_states[b - 1] == block_mixed)
      continue;
    if (open && next.begin - radius <= current.end + radius + matte_block) {
      current.end = next.end;
    } else {
      if (open) process();
      current = next;
      open = true;
    }
  }
  if (open) process();

  // Uniform blocks, where this row's memory does not hold them already from a row before.
  for (int b = 0, e; b < blocks; b = e) {
    e = run_end(states, b, blocks);
    if (states[b] != block_mixed && (stored[b] != states[b] || run_end(stored, b, e) != e))
      std::fill(values + b * matte_block, values + e * matte_block,
                static_cast<std::int16_t>(states[b] == block_full ? field_full : 0));
  }
}

Blur::State::Interval Blur::State::horizontal_pass(Interval changes, std::int16_t* values) {
  const int length = blocks * matte_block;
  const int begin = std::max(changes.begin - radius, 0);
  const int wanted = std::min(changes.end + radius, length) - begin;
  const int end = begin + (wanted + matte_block - 1) / matte_block * matte_block;

  // Vertical pass over the blocks that reach into it.
  std::int16_t* v = vertical.data() + side;
  const int first = std::max(begin - radius, 0) / matte_block;
  const int last = std::min((end + radius + matte_block - 1) / matte_block, blocks);
  for (int i = first; i < last;) {
    const int j = run_end(column_states.data(), i, last);
    if (column_states[i] == block_mixed)
      kernels().fir_vertical(window.data(), radius, weights.data(), i * matte_block,
                             j * matte_block, v);
    else
      std::fill(v + i * matte_block, v + j * matte_block,
                column_states[i] == block_full ? vertical_full : std::int16_t{0});
    i = j;
  }
  // The frame's border values go on outwards.
  if (begin < radius) std::fill(v - side, v, v[0]);
  if (end + radius > width) std::fill(v + width, v + length + side, v[width - 1]);
  kernels().fir_horizontal(v, radius, weights.data(), begin, end, values);
  return {begin, end};
}

void Blur::State::threshold_row(std::int16_t* values, BlockState* states) const {
  for (int b = 0; b < blocks; ++b) {
    const int begin = b * matte_block, end = std::min(begin + matte_block, width);
    if (states[b] != block_mixed) continue;
    BlockState state = 0;
    for (int x = begin; x < end; ++x) {
      const bool in = (values[x] + field_scale / 2) / field_scale >= settings.threshold;
      values[x] = static_cast<std::int16_t>(in ? field_full : 0);
      state |= in ? block_full : block_empty;
    }
    states[b] = state;
  }
}

void Blur::apply(const Matte& matte, Field& field) {
  State& s = *state_;
  field.resize(matte.width, matte.height);
  if (streams()) {
    begin(matte.width, matte.height, 1);
    int next = 0;
    const auto take = [&] {
      Row row;
      while (pull(row)) {
        std::memcpy(field.row(row.y) - field_pad, row.values - field_pad,
                    static_cast<std::size_t>(field.stride) * sizeof(std::int16_t));
        std::memcpy(field.state_row(row.y), row.states, static_cast<std::size_t>(s.blocks));
      }
    };
    for (; next < matte.height; ++next) {
      std::memcpy(next_alpha(), matte.row(next), static_cast<std::size_t>(matte.stride));
      std::memcpy(next_states(), matte.state_row(next), static_cast<std::size_t>(s.blocks));
      push();
      take();
    }
    return;
  }
  s.blocks = blocks_across(matte.width);
  s.width = matte.width;
  s.plane.apply(matte, s.settings, field);
  for (int y = 0; y < matte.height; ++y) {
    if (s.settings.threshold > 0) s.threshold_row(field.row(y), field.state_row(y));
    field.pad_row(y);
  }
}

}  // namespace polyhull
