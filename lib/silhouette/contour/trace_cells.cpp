// SPDX-License-Identifier: LGPL-2.1-or-later
// Marching squares between two rows: where the half level is crossed, and how the crossings of a
// cell are joined.
#include <array>
#include <cstring>

#include "silhouette/contour/trace_state.h"
#include "silhouette/pixels/kernels.h"

namespace polyhull {
namespace {

using silhouette::kernels;

// Sides of a cell of four pixel centres.
enum Side : std::uint8_t { top, left, right, bottom };
struct Link {
  std::uint8_t from, to;
};

// Indexed by corners inside: 1 top left, 2 top right, 4 bottom left, 8 bottom right. The inside is
// on the left of the way, seen on screen. Saddles (6, 9) have two ways, listed below.
constexpr std::array<Link, 16> single_links = {{{top, top},
                                                {left, top},
                                                {top, right},
                                                {left, right},
                                                {bottom, left},
                                                {bottom, top},
                                                {top, top},
                                                {bottom, right},
                                                {right, bottom},
                                                {top, top},
                                                {top, bottom},
                                                {left, bottom},
                                                {right, left},
                                                {right, top},
                                                {top, left},
                                                {top, top}}};
constexpr Link separate_6[2] = {{top, right}, {bottom, left}};
constexpr Link joined_6[2] = {{top, left}, {bottom, right}};
constexpr Link separate_9[2] = {{left, top}, {right, bottom}};
constexpr Link joined_9[2] = {{right, top}, {left, bottom}};

// Which corner (offsets 0 or 1 in x and y) a way around one corner of the cell goes around.
struct Corner {
  float x, y;
};
Corner corner_of(Link link) {
  const auto is = [&](Side a, Side b) {
    return (link.from == a && link.to == b) || (link.from == b && link.to == a);
  };
  if (is(left, top)) return {0.0f, 0.0f};
  if (is(top, right)) return {1.0f, 0.0f};
  if (is(bottom, left)) return {0.0f, 1.0f};
  return {1.0f, 1.0f};
}

bool straight(Link link) {
  return (link.from + link.to) == 3;  // left and right, or top and bottom
}

}  // namespace

// The cells between grid rows y and y + 1, whose bits are in above and below. Makes the crossings
// on row y + 1 and then those between the rows, and links across each cell.
void Tracer::State::cells(int y) {
  const std::size_t most = count + 2 * static_cast<std::size_t>(width) + 16;
  const bool binary = settings.method == TraceMethod::binary;
  if (vertices.size() < most) {
    const std::size_t size = most + most / 2;
    vertices.resize(size);
    next.resize(size);
  }
  if (binary && corners.size() < vertices.size()) corners.resize(vertices.size());
  row_begins.push_back(count);
  row_below = count;
  silhouette::some_of(ahead);
  kernels().find_changes(above.data(), below.data(), words, changes);
  if (changes.cells_count == 0) return;
  const std::uint32_t first_between = count + static_cast<std::uint32_t>(changes.on_row_count);
  silhouette::some_of(ahead);
  cross(y);
  silhouette::some_of(ahead);
  if (binary)
    link_cells<true>(y, first_between);
  else
    link_cells<false>(y, first_between);
}

// Crossings on grid row y + 1, whose bits are in below, and then those between grid rows y and
// y + 1.
void Tracer::State::cross(int y) {
  const int on = changes.on_row_count, between = changes.between_count, all = on + between;
  const int last_column = width - 1;
  const bool inner = y >= 0 && y < height - 1;  // both rows are the frame's
  std::int32_t* const here = near_values.data();
  std::int32_t* const there = far_values.data();
  // Beside the frame lies a copy of its border, and then the outside, where the region ends.
  struct Ends {
    bool left, right;
  };
  const auto clamp_ends = [](std::int32_t* columns, int made, int last) {
    const Ends ends{(made > 0) && (columns[0] < 64), (made > 0) && (columns[made - 1] > last + 64)};
    if (ends.left) columns[0] = 64;
    if (ends.right) columns[made - 1] = 64 + std::max(last, 0);
    return ends;
  };
  std::int32_t* const on_row = changes.on_row;
  std::int32_t* const columns = changes.between;
  const Ends on_ends = clamp_ends(on_row, on, last_column - 1);
  const Ends between_ends = clamp_ends(columns, between, last_column);
  // A value that classify() has left, or, in a uniform block, what it would be.
  struct Values {
    const std::int32_t* mixed;
    const BlockState* states;
    CorrectedRow uniform;
    std::int32_t operator()(std::ptrdiff_t x) const {
      if (states[x / matte_block] == block_mixed) [[likely]]
        return mixed[x];
      return uniform(x);
    }
  };
  const Values upper{values_above.data(), states(y), corrected(y)};
  const Values lower{values_below.data(), states(y + 1), corrected(y + 1)};
  for (int i = 0; i < on; ++i) {
    const std::int32_t x = on_row[i] - 64;
    here[i] = lower(x);
    there[i] = lower(x + 1);
  }
  for (int i = 0; inner && i < between; ++i) {  // others lie on the frame's rim
    const std::int32_t x = columns[i] - 64;
    here[on + i] = upper(x);
    there[on + i] = lower(x);
  }
  kernels().crossing_offsets(here, there, inner ? all : on, offsets.data());

  const float left_end = -0.5f, right_end = static_cast<float>(width) - 0.5f;
  const float row_y =
      std::clamp(static_cast<float>(y + 1), -0.5f, static_cast<float>(height) - 0.5f);
  const float* offset = offsets.data();
  Vec2f* out = vertices.data() + count;
  count += static_cast<std::uint32_t>(all);
  const auto place_ends = [&](const Ends& ends, int made) {
    if (ends.left) out[0].x = left_end;
    if (ends.right) out[made - 1].x = right_end;
  };
  for (int i = 0; i < on; ++i) out[i] = {static_cast<float>(on_row[i] - 64) + offset[i], row_y};
  place_ends(on_ends, on);
  out += on;
  offset += on;
  const float outer_y = y < 0 ? -0.5f : static_cast<float>(height) - 0.5f;
  for (int i = 0; i < between; ++i)
    out[i] = {static_cast<float>(columns[i] - 64),
              inner ? static_cast<float>(y) + offset[i] : outer_y};
  place_ends(between_ends, between);
}

namespace {

// The next crossing of each side of a cell, and how far each goes on with the cell's corners.
using Next = std::uint32_t __attribute__((vector_size(16)));
constexpr std::array<std::array<std::uint32_t, 4>, 16> steps = [] {
  std::array<std::array<std::uint32_t, 4>, 16> out{};
  for (unsigned in = 0; in < 16; ++in) {
    out[in][top] = (in >> 1 ^ in) & 1;
    out[in][left] = out[in][right] = (in >> 3 ^ in >> 1) & 1;
    out[in][bottom] = (in >> 3 ^ in >> 2) & 1;
  }
  return out;
}();

}  // namespace

template <bool binary>
void Tracer::State::link_cells(int y, std::uint32_t first_between) {
  const CorrectedRow upper = corrected(y), lower = corrected(y + 1);
  const auto inside_on_mean = [&](int x) {
    const int x0 = std::clamp(x, 0, width - 1), x1 = std::clamp(x + 1, 0, width - 1);
    return static_cast<std::int64_t>(upper(x0)) + upper(x1) + lower(x0) + lower(x1) >= 0;
  };
  const float right_end = static_cast<float>(width) - 0.5f;
  const float bottom_end = static_cast<float>(height) - 0.5f;
  // Where a side has no crossing, its entry is not used.
  Next at = {row_above, first_between - 1, first_between, row_below};
  std::uint32_t* const links = next.data();
  const std::int32_t* const cell = changes.cells;
  const int made = changes.cells_count;
  for (int i = 0; i < made; ++i) {
    const unsigned in = cell[i] & 15;
    std::uint32_t now[4];
    std::memcpy(now, &at, sizeof now);
    Next step;
    std::memcpy(&step, steps[in].data(), sizeof step);
    at += step;
    const auto link = [&](Link l, bool saddle) {
      links[now[l.from]] = now[l.to];
      if (!binary) return;
      const int x = (cell[i] >> 4) - 64;
      corners[now[l.from]] = Vec2f{-1e9f, -1e9f};
      if (straight(l)) return;
      // The pixels' common corner; where two ways pass it, each keeps a little to its own side.
      Vec2f corner{static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f};
      if (saddle) {
        const Corner around = corner_of(l);
        corner.x += (around.x - 0.5f) / 8.0f;
        corner.y += (around.y - 0.5f) / 8.0f;
      }
      corners[now[l.from]] = {std::clamp(corner.x, -0.5f, right_end),
                              std::clamp(corner.y, -0.5f, bottom_end)};
    };
    if (in != 6 && in != 9) {
      link(single_links[in], false);
      continue;
    }
    const bool joined = inside_on_mean((cell[i] >> 4) - 64);
    const Link* const both =
        in == 6 ? (joined ? joined_6 : separate_6) : (joined ? joined_9 : separate_9);
    link(both[0], true);
    link(both[1], true);
  }
}

}  // namespace polyhull
