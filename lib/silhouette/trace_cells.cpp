// SPDX-License-Identifier: LGPL-2.1-or-later
// Marching squares between two rows: where the half level is crossed, and how the crossings of a
// cell are joined.
#include <array>

#include "silhouette/kernels.h"
#include "silhouette/trace_state.h"

namespace polyhull {
namespace {

using silhouette::kernels;

// Sides of a cell of four pixel centres.
enum Side : std::uint8_t { top, left, right, bottom };
struct Link {
  std::uint8_t from, to;
};

// Indexed by corners inside: 1 top left, 2 top right, 4 bottom left, 8 bottom right. The inside is
// on the left of the way, seen on screen. Saddles (6, 9) come apart; joined they are saddle_joined.
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
  kernels().find_changes(above.data(), below.data(), words, changes);
  cross_row(y + 1);
  const std::uint32_t first_between = count;
  cross_columns(y);
  if (binary)
    link_cells<true>(y, first_between);
  else
    link_cells<false>(y, first_between);
}

// Crossings on grid row y, whose bits are in below.
void Tracer::State::cross_row(int y) {
  const int made = changes.on_row_count;
  const std::int32_t* const columns = changes.on_row;
  const CorrectedRow value = corrected(y);
  // Beside the frame lies a copy of its border, and then the outside.
  const int first = made > 0 && columns[0] < 64 ? 1 : 0;
  const int last = made > 0 && columns[made - 1] - 64 >= width - 1 ? made - 1 : made;
  for (int i = first; i < last; ++i) {
    near_values[i] = value(columns[i] - 64);
    far_values[i] = value(columns[i] - 63);
  }
  kernels().crossing_offsets(near_values.data() + first, far_values.data() + first, last - first,
                             offsets.data() + first);
  const float row_y = std::clamp(static_cast<float>(y), -0.5f, static_cast<float>(height) - 0.5f);
  Vec2f* out = vertices.data() + count;
  for (int i = first; i < last; ++i)
    out[i] = {static_cast<float>(columns[i] - 64) + offsets[i], row_y};
  if (first > 0) out[0] = {-0.5f, row_y};
  if (last < made) out[last] = {static_cast<float>(width) - 0.5f, row_y};
  count += static_cast<std::uint32_t>(made);
}

// Crossings between grid rows y and y + 1.
void Tracer::State::cross_columns(int y) {
  const int made = changes.between_count;
  const std::int32_t* const columns = changes.between;
  Vec2f* out = vertices.data() + count;
  count += static_cast<std::uint32_t>(made);
  const float right_end = static_cast<float>(width) - 0.5f;
  const auto column_of = [&](int i) {
    return std::clamp(static_cast<float>(columns[i] - 64), -0.5f, right_end);
  };
  if (y < 0 || y >= height - 1) {
    const float row_y = y < 0 ? -0.5f : static_cast<float>(height) - 0.5f;
    for (int i = 0; i < made; ++i) out[i] = {column_of(i), row_y};
    return;
  }
  const CorrectedRow upper = corrected(y), lower = corrected(y + 1);
  for (int i = 0; i < made; ++i) {
    const int x = std::clamp(columns[i] - 64, 0, width - 1);
    near_values[i] = upper(x);
    far_values[i] = lower(x);
  }
  kernels().crossing_offsets(near_values.data(), far_values.data(), made, offsets.data());
  for (int i = 0; i < made; ++i) out[i] = {column_of(i), static_cast<float>(y) + offsets[i]};
}

template <bool binary>
void Tracer::State::link_cells(int y, std::uint32_t first_between) {
  const CorrectedRow upper = corrected(y), lower = corrected(y + 1);
  const auto inside_on_mean = [&](int x) {
    const int x0 = std::clamp(x, 0, width - 1), x1 = std::clamp(x + 1, 0, width - 1);
    return static_cast<std::int64_t>(upper(x0)) + upper(x1) + lower(x0) + lower(x1) >= 0;
  };
  const float right_end = static_cast<float>(width) - 0.5f;
  const float bottom_end = static_cast<float>(height) - 0.5f;
  std::uint32_t on_top = row_above, on_bottom = row_below, between = first_between;
  std::uint32_t* const links = next.data();
  for (int i = 0; i < changes.cells_count; ++i) {
    const int x = (changes.cells[i] >> 4) - 64;
    const unsigned in = changes.cells[i] & 15;
    // The next crossing of each side; where there is none, the entry is not used.
    const std::uint32_t at[4] = {on_top, between - 1, between, on_bottom};
    on_top += (in >> 1 ^ in) & 1;
    on_bottom += (in >> 3 ^ in >> 2) & 1;
    between += (in >> 3 ^ in >> 1) & 1;
    const auto link = [&](Link l, bool saddle) {
      links[at[l.from]] = at[l.to];
      if (!binary) return;
      corners[at[l.from]] = Vec2f{-1e9f, -1e9f};
      if (straight(l)) return;
      // The pixels' common corner; where two ways pass it, each keeps a little to its own side.
      Vec2f corner{static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f};
      if (saddle) {
        const Corner around = corner_of(l);
        corner.x += (around.x - 0.5f) / 8.0f;
        corner.y += (around.y - 0.5f) / 8.0f;
      }
      corners[at[l.from]] = {std::clamp(corner.x, -0.5f, right_end),
                             std::clamp(corner.y, -0.5f, bottom_end)};
    };
    if (in != 6 && in != 9) {
      link(single_links[in], false);
      continue;
    }
    const bool joined = inside_on_mean(x);
    const Link* const both =
        in == 6 ? (joined ? joined_6 : separate_6) : (joined ? joined_9 : separate_9);
    link(both[0], true);
    link(both[1], true);
  }
}

}  // namespace polyhull
