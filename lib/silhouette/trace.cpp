// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/trace.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "silhouette/kernels.h"

namespace polyhull {
namespace {

using silhouette::kernels;

constexpr std::uint32_t nothing = 0xffffffffu;
constexpr std::uint32_t on_column = 0xfffffffeu;
constexpr float vertex_grid = 512.0f;

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

struct Tracer::State {
  TraceSettings settings;
  int width = 0, height = 0, blocks = 0, words = 0;
  int reach = 1;
  std::int16_t centre = 1, side = 0;

  int pushed = 0;                         // rows given
  int classified = 0;                     // rows whose bits are known
  std::vector<const std::int16_t*> rows;  // ring of the last 2*reach+2 rows
  std::vector<const BlockState*> row_states;

  // Bits of two rows of the grid, 64 columns to a word; word 0 and the last hold what is beyond the
  // frame. above belongs to grid row `grid_row`, below to the next.
  std::vector<std::uint64_t> above, below;
  std::vector<std::uint16_t> pieces;
  // Crossings on the grid row above and below, in the order of x.
  std::vector<std::uint32_t> crossings_above, crossings_below;

  // Vertices made so far, and the next along the boundary; corners[v]: for `binary`, what the way
  // from v passes. The vectors are longer, so that a row of cells needs no checks.
  std::uint32_t count = 0;
  std::vector<Vec2f> vertices, corners;
  std::vector<std::uint32_t> next;
  std::vector<std::uint32_t> left_neighbour;  // of a crossing on a row: the one before
                                              // it, or nothing
  // For the parents: each vertex's ring, and each ring's first crossing on a row.
  std::vector<std::int32_t> ring_of;
  std::vector<std::uint32_t> first_crossing;
  std::vector<std::uint32_t> order;
  std::vector<std::uint8_t> holes;

  int depth() const { return 2 * reach + 2; }
  const std::int16_t* row(int y) const {
    return rows[static_cast<std::size_t>(std::clamp(y, 0, height - 1)) % rows.size()];
  }
  void classify(int y);
  void cells(int y);
  void advance(int until);
  void find_parents(const Rings& rings, std::vector<std::int32_t>& parents);
};

Tracer::Tracer() : state_(std::make_unique<State>()) {}
Tracer::~Tracer() = default;
Tracer::Tracer(Tracer&&) noexcept = default;
Tracer& Tracer::operator=(Tracer&&) noexcept = default;

namespace {

// The Laplacian's step: half a sigma, so that the noise of the field's last bit stays small against
// the slope of the blurred edge at every sigma.
int reach_of(const TraceSettings& settings) {
  if (settings.corrected_sigma <= 0.0) return 1;
  return std::clamp(static_cast<int>(std::lround(settings.corrected_sigma / 2.0)), 1,
                    field_pad - 1);
}

}  // namespace

int Tracer::rows_kept(const TraceSettings& settings) {
  return 2 * reach_of(settings) + 2;
}

void Tracer::begin(int width, int height, const TraceSettings& settings) {
  State& s = *state_;
  s.settings = settings;
  s.width = width;
  s.height = height;
  s.blocks = blocks_across(width);
  s.words = (width + 63) / 64 + 2;
  s.reach = reach_of(settings);
  s.centre = 1;
  s.side = 0;
  if (settings.corrected_sigma > 0.0 && settings.method == TraceMethod::subpixel) {
    constexpr double unit = 512.0;
    // The pixel's aperture, and the segments of the traced line, which are chords of the boundary.
    const double variance =
        settings.corrected_sigma * settings.corrected_sigma + 1.0 / 12.0 + 1.0 / 8.0;
    const double factor = variance / (1.0 * s.reach * s.reach);
    s.side = static_cast<std::int16_t>(std::min(std::lround(factor * unit), 8000l));
    s.centre = static_cast<std::int16_t>(unit + 4 * s.side);
  }
  s.pushed = s.classified = 0;
  s.rows.assign(static_cast<std::size_t>(s.depth()), nullptr);
  s.row_states.assign(static_cast<std::size_t>(s.depth()), nullptr);
  s.above.assign(s.words, 0);
  s.below.assign(s.words, 0);
  s.pieces.assign(static_cast<std::size_t>(s.words) * 4, 0);
  s.crossings_above.clear();
  s.crossings_below.clear();
  s.count = 0;
}

void Tracer::push(const std::int16_t* values, const BlockState* states) {
  State& s = *state_;
  s.rows[static_cast<std::size_t>(s.pushed) % s.rows.size()] = values;
  s.row_states[static_cast<std::size_t>(s.pushed) % s.rows.size()] = states;
  ++s.pushed;
  s.advance(s.pushed == s.height ? s.height : s.pushed - s.reach);
}

// Classifies rows below `until` and does the cells between them. Grid rows: -2 all outside, -1 a
// copy of row 0, 0 .. height-1, height a copy of the last, height+1 all outside.
void Tracer::State::advance(int until) {
  for (; classified < until; ++classified) {
    if (classified == 0) {
      classify(0);
      cells(-2);
      above = below;
      std::swap(crossings_above, crossings_below);
      cells(-1);
    } else {
      classify(classified);
      cells(classified - 1);
    }
    std::swap(above, below);
    std::swap(crossings_above, crossings_below);
  }
}

void Tracer::State::classify(int y) {
  const std::int16_t* here = row(y);
  const BlockState* states = row_states[static_cast<std::size_t>(y) % rows.size()];
  std::uint16_t* out = pieces.data() + 4;  // the first word is beyond the frame
  const std::int16_t* up = row(y - reach);
  const std::int16_t* down = row(y + reach);
  for (int b = 0; b < blocks;) {
    if (states[b] != block_mixed) {
      // A uniform block keeps its side: the correction only moves it farther from the half level.
      out[b] = states[b] == block_full ? 0xffff : 0;
      ++b;
      continue;
    }
    int e = b + 1;
    while (e < blocks && states[e] == block_mixed) ++e;
    kernels().inside(up, here, down, reach, centre, side, b * matte_block, e * matte_block,
                     out + b);
    b = e;
  }
  for (int w = 1; w < words - 1; ++w) {
    const std::uint16_t* p = pieces.data() + 4 * w;
    below[w] = static_cast<std::uint64_t>(p[0]) | static_cast<std::uint64_t>(p[1]) << 16 |
               static_cast<std::uint64_t>(p[2]) << 32 | static_cast<std::uint64_t>(p[3]) << 48;
  }
  // One copy of the border values on both sides, then outside.
  const std::uint64_t first = below[1] & 1;
  below[0] = first << 63;
  const int last = width - 1;
  const std::uint64_t end = below[1 + last / 64] >> (last % 64) & 1;
  const int after = last + 1;
  std::uint64_t& word = below[1 + after / 64];
  if (after % 64 != 0)
    word &= (std::uint64_t{1} << (after % 64)) - 1;
  else
    word = 0;
  word |= end << (after % 64);
}

namespace {

// Where between two values of opposite sign the level is crossed, in (0, 1), on the vertex grid.
// The half unit keeps it off the pixel centre when a value is 0.
inline float crossing(std::int32_t a, std::int32_t b) {
  const float t = (static_cast<float>(a) + 0.5f) / (static_cast<float>(a) - static_cast<float>(b));
  const float snapped = static_cast<float>(static_cast<int>(t * vertex_grid + 0.5f));
  return std::clamp(snapped, 1.0f, vertex_grid - 1.0f) / vertex_grid;
}

// One row of the field with the rows that its Laplacian reaches: above (>= 0) or below the half
// level, with the blur's shift corrected.
struct CorrectedRow {
  const std::int16_t *here, *up, *down;
  int reach;
  std::int32_t centre, side;
  int last;
  std::int32_t operator()(int x) const {
    x = std::clamp(x, 0, last);
    const std::int32_t d = here[x] - field_half;
    if (side == 0) return d;
    const std::int32_t around =
        here[x - reach] + here[x + reach] + up[x] + down[x] - 4 * field_half;
    return centre * d - side * around;
  }
};

}  // namespace

// The cells between grid rows y and y + 1, whose bits are in above and below. Makes the crossings
// on row y + 1 and between the rows, and links across each cell.
void Tracer::State::cells(int y) {
  const std::size_t most = count + 2 * static_cast<std::size_t>(width) + 16;
  const bool binary = settings.method == TraceMethod::binary;
  if (vertices.size() < most) {
    const std::size_t size = most + most / 2;
    vertices.resize(size);
    next.resize(size);
    left_neighbour.resize(size);
  }
  if (binary && corners.size() < vertices.size()) corners.resize(vertices.size());
  if (crossings_below.size() < static_cast<std::size_t>(width) + 8)
    crossings_below.resize(static_cast<std::size_t>(width) + 8);
  const auto corrected = [&](int row_y) {
    row_y = std::clamp(row_y, 0, height - 1);
    return CorrectedRow{row(row_y), row(row_y - reach), row(row_y + reach), reach, centre,
                        side,       width - 1};
  };
  const CorrectedRow upper = corrected(y), lower = corrected(y + 1);
  const float right_end = static_cast<float>(width) - 0.5f;
  const float bottom_end = static_cast<float>(height) - 0.5f;
  const float lower_y = std::clamp(static_cast<float>(y + 1), -0.5f, bottom_end);
  const bool inner_rows = y >= 0 && y < height - 1;

  std::size_t next_above = 0, made_below = 0;
  std::uint32_t last_vertical = nothing, last_horizontal = nothing;
  std::uint32_t id = count;
  for (int w = 0; w < words; ++w) {
    const std::uint64_t p = above[w], c = below[w];
    const std::uint64_t p1 = w + 1 < words ? above[w + 1] << 63 : 0;
    const std::uint64_t c1 = w + 1 < words ? below[w + 1] << 63 : 0;
    const std::uint64_t pn = p >> 1 | p1, cn = c >> 1 | c1;
    std::uint64_t active = (p ^ c) | (p ^ pn) | (c ^ cn);
    while (active != 0) {
      const int bit = std::countr_zero(active);
      active &= active - 1;
      const int x = (w - 1) * 64 + bit;
      const unsigned in = static_cast<unsigned>((p >> bit & 1) | (pn >> bit & 1) << 1 |
                                                (c >> bit & 1) << 2 | (cn >> bit & 1) << 3);
      std::uint32_t at[4];
      at[left] = last_vertical;  // only used where the left corners differ
      if ((in >> 1 ^ in) & 1) at[top] = crossings_above[next_above++];
      if ((in >> 1 ^ in) & 4) {
        const float t = x < 0 || x >= width - 1 ? 0.5f : crossing(lower(x), lower(x + 1));
        vertices[id] = {std::clamp(static_cast<float>(x) + t, -0.5f, right_end), lower_y};
        next[id] = nothing;
        left_neighbour[id] = last_horizontal;
        last_horizontal = at[bottom] = crossings_below[made_below++] = id++;
      }
      if ((in >> 2 ^ in) & 2) {
        const float t = inner_rows ? crossing(upper(x + 1), lower(x + 1)) : 0.5f;
        vertices[id] = {std::clamp(static_cast<float>(x + 1), -0.5f, right_end),
                        std::clamp(static_cast<float>(y) + t, -0.5f, bottom_end)};
        next[id] = nothing;
        left_neighbour[id] = on_column;
        last_vertical = at[right] = id++;
      }

      const auto link = [&](Link l, bool saddle) {
        next[at[l.from]] = at[l.to];
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
      if (in == 6 || in == 9) {
        const std::int64_t mean =
            static_cast<std::int64_t>(upper(x)) + upper(x + 1) + lower(x) + lower(x + 1);
        const Link* links =
            in == 6 ? (mean >= 0 ? joined_6 : separate_6) : (mean >= 0 ? joined_9 : separate_9);
        link(links[0], true);
        link(links[1], true);
      } else {
        link(single_links[in], false);
      }
    }
  }
  count = id;
}

void Tracer::finish(Rings& rings, std::vector<std::int32_t>* parents) {
  State& s = *state_;
  // `above` now holds the last row: its copy, then what lies outside the frame.
  s.below = s.above;
  s.cells(s.height - 1);
  std::swap(s.crossings_above, s.crossings_below);
  std::fill(s.below.begin(), s.below.end(), 0);
  s.cells(s.height);

  rings.clear();
  const bool binary = s.settings.method == TraceMethod::binary;
  s.first_crossing.clear();
  if (s.ring_of.size() < s.count) s.ring_of.resize(s.vertices.size());
  for (std::uint32_t start = 0; start < s.count; ++start) {
    if (s.next[start] == nothing) continue;
    const auto begin = rings.points.size();
    const auto ring = static_cast<std::int32_t>(rings.ends.size());
    std::uint32_t first = nothing;
    for (std::uint32_t v = start; s.next[v] != nothing;) {
      const Vec2f p = binary ? s.corners[v] : s.vertices[v];
      if ((!binary || p.x > -1e8f) && (rings.points.size() == begin || rings.points.back() != p))
        rings.points.push_back(p);
      s.ring_of[v] = ring;
      if (s.left_neighbour[v] != on_column) first = std::min(first, v);
      const std::uint32_t to = s.next[v];
      s.next[v] = nothing;
      v = to;
    }
    while (rings.points.size() > begin + 1 && rings.points.back() == rings.points[begin])
      rings.points.pop_back();
    rings.ends.push_back(static_cast<std::uint32_t>(rings.points.size()));
    s.first_crossing.push_back(first);
  }
  if (parents) s.find_parents(rings, *parents);
}

// To the left of a ring's first crossing on a row (its leftmost on its topmost row) lies either a
// ring of the other kind, which then is directly around it, or one of its own kind, which has the
// same parent (S. Suzuki, K. Abe, "Topological structural analysis of digitized binary images",
// 1985).
void Tracer::State::find_parents(const Rings& rings, std::vector<std::int32_t>& parents) {
  parents.assign(rings.size(), -1);
  order.resize(rings.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<std::uint32_t>(i);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return first_crossing[a] < first_crossing[b];
  });
  holes.resize(rings.size());
  for (std::size_t i = 0; i < rings.size(); ++i) holes[i] = ring_area(rings.ring(i)) < 0.0;
  for (const std::uint32_t ring : order) {
    const std::uint32_t neighbour = left_neighbour[first_crossing[ring]];
    if (neighbour == nothing) continue;
    const auto other = static_cast<std::size_t>(ring_of[neighbour]);
    parents[ring] = holes[ring] == holes[other] ? parents[other] : static_cast<std::int32_t>(other);
  }
}

void Tracer::trace(const Field& field, const TraceSettings& settings, Rings& rings,
                   std::vector<std::int32_t>* parents) {
  begin(field.width, field.height, settings);
  for (int y = 0; y < field.height; ++y) push(field.row(y), field.state_row(y));
  finish(rings, parents);
}

double ring_area(std::span<const Vec2f> ring) {
  if (ring.size() < 3) return 0.0;
  // Counter-clockwise on screen, y down, is negative in the shoelace formula.
  double sum = 0.0;
  Vec2f last = ring.back();
  for (const Vec2f& p : ring) {
    sum += static_cast<double>(p.x) * last.y - static_cast<double>(last.x) * p.y;
    last = p;
  }
  return 0.5 * sum;
}

}  // namespace polyhull
