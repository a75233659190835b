// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/blur/blur.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <vector>

#include "base/error.h"
#include "silhouette/blur/blur_plane.h"
#include "silhouette/pixels/kernels.h"
#include "silhouette/pixels/row_ahead.h"

namespace polyhull {
namespace {

using silhouette::kernels;

using Sixteen = std::uint8_t __attribute__((vector_size(16)));

constexpr int vertical_scale = 64;  // units per level between the two passes
constexpr std::int16_t vertical_full = 255 * vertical_scale;

// Weights of a Gaussian that ends at `radius`, in 2^-15. What lies beyond is put onto the last: an
// edge then has its exact value wherever the kernel reaches across it, and is off by the tail where
// it does not. They are so rounded that their running sum is right to half a unit: the error of an
// edge's flank does not grow with the radius. One 0 follows.
std::vector<std::int16_t> fir_weights(double sigma, int radius) {
  const auto gaussian = [&](int k) { return std::exp(-0.5 * k * k / (sigma * sigma)); };
  double beyond = 0.0;
  for (int k = radius + static_cast<int>(std::ceil(8.0 * sigma)); k > radius; --k)
    beyond += gaussian(k);
  double total = 1.0 + 2.0 * beyond;
  for (int k = 1; k <= radius; ++k) total += 2.0 * gaussian(k);
  std::vector<std::int16_t> weights(radius + 2, 0);
  double tail = beyond / total * 32768.0;
  long rounded_tail = 0;
  for (int k = radius; k >= 1; --k) {
    tail += gaussian(k) / total * 32768.0;
    const long now = std::lround(tail);
    weights[k] = static_cast<std::int16_t>(now - rounded_tail);
    rounded_tail = now;
  }
  weights[0] = static_cast<std::int16_t>(std::min(32768 - 2 * rounded_tail, 32767l));
  return weights;
}

int fir_radius(double sigma) {
  return std::max(1, static_cast<int>(std::ceil(3.5 * sigma)));
}

// A row kept in a ring, with room on both sides.
template <typename T>
class RowRing {
 public:
  void resize(int rows, std::ptrdiff_t length, std::ptrdiff_t pad) {
    rows_ = static_cast<int>(std::bit_ceil(static_cast<unsigned>(rows)));
    pad_ = pad;
    stride_ = (length + 2 * pad + 31) / 32 * 32;
    values_.resize(static_cast<std::size_t>(stride_) * rows_);
  }
  T* row(int y) { return slot(y & (rows_ - 1)); }
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
  silhouette::RowAhead* ahead = nullptr;  // of the row being pulled
  RowRing<std::uint8_t> alpha;
  RowRing<BlockState> alpha_states;
  RowRing<std::int16_t> out;
  RowRing<BlockState> out_states;
  std::vector<std::int16_t> vertical;  // one row with `side` values on both sides
  int side = 0;
  std::vector<RowRing<BlockState>> unions;  // see push()
  int side_blocks = 0;                      // that the radius reaches
  std::vector<BlockState> column_states;    // over the window of rows, 0 beside the row
  std::vector<BlockState> reached_states;   // over all that the filter reaches
  std::vector<BlockState> vertical_states;  // what the blocks of `vertical` hold
  std::vector<std::uint16_t> mixed_out, mixed_columns;
  std::vector<const std::uint8_t*> window;

  silhouette::PlaneBlur plane;  // box and recursive

  // One finished row; states tells before what the memory of values holds.
  template <typename Rows>
  void blur_row(int y, const Rows& alpha_row, std::int16_t* values, BlockState* states);
  void copy_row(const std::uint8_t* alpha_row, int y, std::int16_t* values, BlockState* states);
  template <typename Rows>
  void finish_row(int y, const Rows& alpha_row, std::int16_t* values, BlockState* states);
  void push_states();
  BlockState* states_level(int level, int y) {
    return level == 0 ? alpha_states.row(y) : unions[static_cast<std::size_t>(level) - 1].row(y);
  }
  // Sixteen at a time: rows of states have that room.
  void unite(const BlockState* a, const BlockState* b, BlockState* out) const {
    for (int i = 0, end = blocks; i < end; i += 16) {
      Sixteen one, other;
      std::memcpy(&one, a + i, sizeof one);
      std::memcpy(&other, b + i, sizeof other);
      one |= other;
      std::memcpy(out + i, &one, sizeof one);
    }
  }
  // Calls change(block) for each block whose state in `now` is not that in `before`.
  template <typename Change>
  void each_changed(const BlockState* now, const BlockState* before, const Change& change) const {
    const int end = blocks;
    int b = 0;
    for (; b + 8 <= end; b += 8)
      if (eight_states(now + b) != eight_states(before + b))
        for (int i = b; i < b + 8; ++i)
          if (now[i] != before[i]) change(i);
    for (; b < end; ++b)
      if (now[b] != before[b]) change(b);
  }
  void threshold_row(std::int16_t* values, BlockState* states) const;
};

Blur::Blur() : state_(std::make_unique<State>()) {}
Blur::~Blur() = default;
Blur::Blur(Blur&&) noexcept = default;
Blur& Blur::operator=(Blur&&) noexcept = default;

void Blur::set(const BlurSettings& settings) {
  if (!(settings.sigma >= 0.0 && settings.sigma <= 100.0))
    throw Error(Error::Kind::bad_input, "Blur settings: sigma must be from 0 to 100 px.");
  if (settings.passes < 1 || settings.passes > 10)
    throw Error(Error::Kind::bad_input, "Blur settings: passes must be from 1 to 10.");
  if (settings.threshold < 0 || settings.threshold > 255)
    throw Error(Error::Kind::bad_input, "Blur settings: threshold must be from 0 to 255.");
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
  s.out_states.clear(block_mixed);
  s.side = s.radius + 2 * matte_block;
  s.vertical.resize(static_cast<std::size_t>(length + 2 * s.side));
  s.side_blocks = (s.radius + matte_block - 1) / matte_block;
  s.column_states.assign(static_cast<std::size_t>((s.blocks + 15) / 16 * 16 + 2 * s.side_blocks),
                         0);
  s.reached_states.resize(static_cast<std::size_t>((s.blocks + 15) / 16 * 16));
  s.vertical_states.assign(static_cast<std::size_t>(s.blocks), 0);
  s.mixed_out.resize(static_cast<std::size_t>(s.blocks) + 1);
  s.mixed_columns.resize(static_cast<std::size_t>(s.blocks) + 1);
  s.window.resize(2 * s.radius + 1);
}

std::uint8_t* Blur::next_alpha() {
  return state_->alpha.row(state_->pushed);
}
BlockState* Blur::next_states() {
  return state_->alpha_states.row(state_->pushed);
}
void Blur::push() {
  state_->push_states();
}

void Blur::State::push_states() {
  // unions[l - 1] of a row: of the 2^l rows that end with it, or of as many as there are.
  constexpr std::size_t most_levels = 16;
  const BlockState* before[most_levels];
  BlockState* united[most_levels];
  const std::size_t levels = unions.size();
  for (std::size_t l = 0; l < levels; ++l) {
    before[l] = states_level(static_cast<int>(l), std::max(pushed - (1 << l), 0));
    united[l] = unions[l].row(pushed);
  }
  const BlockState* const latest = states_level(0, pushed);
  for (int i = 0, end = blocks; i < end; i += 16) {
    Sixteen sum, more;
    std::memcpy(&sum, latest + i, sizeof sum);
    for (std::size_t l = 0; l < levels; ++l) {
      if (pushed >= 1 << l) {
        std::memcpy(&more, before[l] + i, sizeof more);
        sum |= more;
      }
      std::memcpy(united[l] + i, &sum, sizeof sum);
    }
  }
  ++pushed;
}

bool Blur::pull(Row& row, silhouette::RowAhead* ahead) {
  State& s = *state_;
  if (s.pulled >= s.height || (s.pushed < s.height && s.pushed <= s.pulled + s.radius))
    return false;
  row = {s.out.row(s.pulled), s.out_states.row(s.pulled), s.pulled};
  s.ahead = ahead;
  s.finish_row(
      s.pulled, [&](int y) { return s.alpha.row(y); }, s.out.row(s.pulled),
      s.out_states.row(s.pulled));
  ++s.pulled;
  return true;
}

template <typename Rows>
void Blur::State::finish_row(int y, const Rows& alpha_row, std::int16_t* values,
                             BlockState* states) {
  if (radius == 0)
    copy_row(alpha_row(y), y, values, states);
  else
    blur_row(y, alpha_row, values, states);
  if (settings.threshold > 0) threshold_row(values, states);
  std::fill(values - field_pad, values, values[0]);
  std::fill(values + width, values + blocks * matte_block + field_pad, values[width - 1]);
}

void Blur::State::copy_row(const std::uint8_t* alpha_row, int y, std::int16_t* values,
                           BlockState* states) {
  for (int x = 0; x < width; ++x) values[x] = static_cast<std::int16_t>(alpha_row[x] * field_scale);
  std::memcpy(states, alpha_states.row(y), static_cast<std::size_t>(blocks));
}

template <typename Rows>
void Blur::State::blur_row(int y, const Rows& alpha_row, std::int16_t* values, BlockState* states) {
  // Copies: the compiler must take it that a state written to memory could change a member.
  const int blocks = this->blocks, side_blocks = this->side_blocks, radius = this->radius;
  const int top = std::max(y - radius, 0), bottom = std::min(y + radius, height - 1);
  // The state of each block's column over the window of rows: of two runs of rows, a power of two
  // long, that together cover it.
  BlockState* const columns = column_states.data() + side_blocks;
  const int level = std::bit_width(static_cast<unsigned>(bottom - top + 1)) - 1;
  unite(states_level(level, bottom), states_level(level, top + (1 << level) - 1), columns);
  std::fill(columns + blocks, column_states.data() + column_states.size(), BlockState{0});

  // A block is uniform when all that the filter reaches is alike.
  BlockState* const reached = reached_states.data();
  for (int i = 0; i < blocks; i += 16) {
    const auto at = [&](int k) {
      Sixteen sixteen;
      std::memcpy(&sixteen, columns + i + k, sizeof sixteen);
      return sixteen;
    };
    Sixteen sum = at(0);
    for (int k = 1; k <= side_blocks; ++k) sum |= at(-k) | at(k);
    std::memcpy(reached + i, &sum, sizeof sum);
  }
  silhouette::some_of(ahead);
  // What a row's memory holds already is not written again.
  const auto fill_block = [](std::int16_t* row, int b, std::int16_t value) {
    std::fill_n(row + b * matte_block, matte_block, value);
  };
  each_changed(reached, states, [&](int b) {
    if (reached[b] != block_mixed)
      fill_block(values, b, reached[b] == block_full ? field_full : std::int16_t{0});
    states[b] = reached[b];
  });
  const int mixed = kernels().mixed_blocks(states, blocks, mixed_out.data());
  if (mixed == 0) return;

  // Vertical pass over the mixed columns; the others are known.
  silhouette::some_of(ahead);
  std::int16_t* v = vertical.data() + side;
  BlockState* const held = vertical_states.data();
  each_changed(columns, held, [&](int b) {
    if (columns[b] != block_mixed)
      fill_block(v, b, columns[b] == block_full ? vertical_full : std::int16_t{0});
    held[b] = columns[b];
  });
  const int filtered = kernels().mixed_blocks(columns, blocks, mixed_columns.data());
  if (filtered > 0) {
    for (int k = -radius; k <= radius; ++k)
      window[k + radius] = alpha_row(std::clamp(y + k, top, bottom));
    kernels().fir_vertical(window.data(), radius, weights.data(), mixed_columns.data(), filtered,
                           v);
  }
  silhouette::some_of(ahead);
  // The frame's border values go on outwards.
  if (mixed_out[0] <= side_blocks) std::fill(v - side, v, v[0]);
  if (mixed_out[mixed - 1] + side_blocks >= blocks - 1)
    std::fill(v + width, v + blocks * matte_block + side, v[width - 1]);
  kernels().fir_horizontal(v, radius, weights.data(), mixed_out.data(), mixed, values);
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
    s.ahead = nullptr;
    for (int y = 0, next = 0; y < matte.height; ++y) {
      for (; next < matte.height && next <= y + s.radius; ++next) {
        std::memcpy(next_states(), matte.state_row(next), static_cast<std::size_t>(s.blocks));
        push();
      }
      s.finish_row(
          y, [&](int row) { return matte.row(row); }, field.row(y), field.state_row(y));
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
