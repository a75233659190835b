// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/blur/blur.h"

#include <cmath>

#include "base/error.h"
#include "silhouette/blur/blur_state.h"
#include "silhouette/pixels/kernels.h"

namespace polyhull {
namespace {

using silhouette::kernels;

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

}  // namespace

Blur::Blur() : state_(std::make_unique<State>()) {}
Blur::~Blur() = default;
Blur::Blur(Blur&&) noexcept = default;
Blur& Blur::operator=(Blur&&) noexcept = default;

void Blur::set(const BlurSettings& settings) {
  state_->set(settings);
}

const BlurSettings& Blur::settings() const {
  return state_->settings;
}

void Blur::apply(const Matte& matte, Field& field) {
  state_->apply(matte, field);
}

void Blur::State::set(const BlurSettings& now) {
  if (!(now.sigma >= 0.0 && now.sigma <= 100.0))
    throw Error(Error::Kind::bad_input,
                "The blur's sigma is {:g} px; give a value from 0 to 100 px.", now.sigma);
  if (now.passes < 1 || now.passes > 10)
    throw Error(Error::Kind::bad_input, "The blur has {} passes; give a number from 1 to 10.",
                now.passes);
  if (now.threshold < 0 || now.threshold > 255)
    throw Error(Error::Kind::bad_input, "The blur's threshold is {}; give a level from 0 to 255.",
                now.threshold);
  settings = now;
  fresh = true;
}

void Blur::State::begin(int new_width, int new_height, int keep) {
  if (fresh) {
    // Below 0.2 px the neighbours' weight is under 2^-15.
    radius = settings.sigma < 0.2 ? 0 : fir_radius(settings.sigma);
    if (radius > 0) weights = fir_weights(settings.sigma, radius);
    fresh = false;
  }
  width = new_width;
  height = new_height;
  blocks = blocks_across(width);
  pushed = pulled = 0;
  const std::ptrdiff_t length = static_cast<std::ptrdiff_t>(blocks) * matte_block;
  alpha.resize(2 * radius + 2, length, 0);
  alpha_states.resize(2 * radius + 2, blocks, 0);
  unions.resize(std::bit_width(static_cast<unsigned>(2 * radius + 1)) - 1);
  for (auto& level : unions) level.resize(2 * radius + 2, blocks, 0);
  out.resize(keep + 1, length, field_pad);
  out_states.resize(keep + 1, blocks, 0);
  out_states.clear(block_mixed);
  side = radius + 2 * matte_block;
  vertical.resize(static_cast<std::size_t>(length + 2 * side));
  side_blocks = (radius + matte_block - 1) / matte_block;
  column_states.assign(static_cast<std::size_t>((blocks + 15) / 16 * 16 + 2 * side_blocks), 0);
  reached_states.resize(static_cast<std::size_t>((blocks + 15) / 16 * 16));
  vertical_states.assign(static_cast<std::size_t>(blocks), 0);
  mixed_out.resize(static_cast<std::size_t>(blocks) + 1);
  mixed_columns.resize(static_cast<std::size_t>(blocks) + 1);
  window.resize(2 * radius + 1);
}

void Blur::State::push() {
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

bool Blur::State::pull(Row& row, silhouette::RowAhead* row_ahead) {
  if (pulled >= height || (pushed < height && pushed <= pulled + radius)) return false;
  std::int16_t* const values = out.row(pulled);
  BlockState* const states = out_states.row(pulled);
  row = {values, states};
  ahead = row_ahead;
  finish_row(
      pulled, [&](int y) { return alpha.row(y); }, values, states);
  ++pulled;
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

void Blur::State::apply(const Matte& matte, Field& field) {
  field.resize(matte.width, matte.height);
  if (streams()) {
    begin(matte.width, matte.height, 1);
    ahead = nullptr;
    for (int y = 0, next = 0; y < matte.height; ++y) {
      for (; next < matte.height && next <= y + radius; ++next) {
        std::memcpy(next_states(), matte.state_row(next), static_cast<std::size_t>(blocks));
        push();
      }
      finish_row(
          y, [&](int row) { return matte.row(row); }, field.row(y), field.state_row(y));
    }
    return;
  }
  blocks = blocks_across(matte.width);
  width = matte.width;
  plane.apply(matte, settings, field);
  for (int y = 0; y < matte.height; ++y) {
    if (settings.threshold > 0) threshold_row(field.row(y), field.state_row(y));
    field.pad_row(y);
  }
}

}  // namespace polyhull
