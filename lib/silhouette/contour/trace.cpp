// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/contour/trace.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "silhouette/contour/trace_state.h"
#include "silhouette/pixels/kernels.h"

namespace polyhull {
namespace {

using silhouette::kernels;

constexpr std::uint32_t taken = 0xffffffffu;  // in place of a crossing's next

}  // namespace

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

int Tracer::State::rows_kept(const TraceSettings& settings) {
  return 2 * reach_of(settings) + 2;
}

void Tracer::State::begin(int new_width, int new_height, const TraceSettings& new_settings) {
  settings = new_settings;
  width = new_width;
  height = new_height;
  blocks = blocks_across(width);
  mixed_list.resize(static_cast<std::size_t>(blocks) + 1);
  words = ((width + 63) / 64 + 2 + 3) / 4 * 4;
  reach = reach_of(settings);
  centre = 1;
  side = 0;
  if (settings.corrected_sigma > 0.0 && settings.method == TraceMethod::subpixel) {
    constexpr double unit = 512.0;
    // The pixel's aperture, and the segments of the traced line, which are chords of the boundary.
    const double variance =
        settings.corrected_sigma * settings.corrected_sigma + 1.0 / 12.0 + 1.0 / 8.0;
    const double factor = variance / (1.0 * reach * reach);
    side = static_cast<std::int16_t>(std::min(std::lround(factor * unit), 8000l));
    centre = static_cast<std::int16_t>(unit + 4 * side);
  }
  pushed = classified = 0;
  rows.assign(static_cast<std::size_t>(depth()), nullptr);
  row_states.assign(static_cast<std::size_t>(depth()), nullptr);
  above.assign(static_cast<std::size_t>(words) + 1, 0);  // find_changes() reads one more
  below.assign(static_cast<std::size_t>(words) + 1, 0);
  values_above.resize(static_cast<std::size_t>(words) * 64);
  values_below.resize(static_cast<std::size_t>(words) * 64);
  pieces.assign(static_cast<std::size_t>(words) * 4, 0);
  const std::size_t room = static_cast<std::size_t>(words) * 64 + 4;
  columns.resize(3 * room);
  changes.on_row = columns.data();
  changes.between = changes.on_row + room;
  changes.cells = changes.between + room;
  near_values.resize(2 * room + 8);
  far_values.resize(2 * room + 8);
  offsets.resize(2 * room + 8);
  count = row_above = row_below = 0;
  row_begins.clear();
}

void Tracer::State::push(const std::int16_t* values, const BlockState* states,
                         silhouette::RowAhead* row_ahead) {
  ahead = row_ahead;
  rows[static_cast<std::size_t>(pushed) % rows.size()] = values;
  row_states[static_cast<std::size_t>(pushed) % rows.size()] = states;
  ++pushed;
  advance(pushed == height ? height : pushed - reach);
}

void Tracer::State::push_all(const Field& field, const TraceSettings& new_settings) {
  begin(field.width, field.height, new_settings);
  for (int y = 0; y < field.height; ++y) push(field.row(y), field.state_row(y));
}

// Classifies rows below `until` and does the cells between them. Grid rows: -2 all outside, -1 a
// copy of row 0, 0 .. height-1, height a copy of the last, height+1 all outside.
void Tracer::State::advance(int until) {
  for (; classified < until; ++classified) {
    if (classified == 0) {
      classify(0);
      cells(-2);
      above = below;
      row_above = row_below;
      cells(-1);
    } else {
      classify(classified);
      cells(classified - 1);
    }
    std::swap(above, below);
    std::swap(values_above, values_below);
    row_above = row_below;
  }
}

void Tracer::State::classify(int y) {
  const std::int16_t* here = row(y);
  const BlockState* states = this->states(y);
  std::uint16_t* out = pieces.data() + 4;  // the first word is beyond the frame
  const std::int16_t* up = row(y - reach);
  const std::int16_t* down = row(y + reach);
  // A uniform block keeps its side: the correction only moves it farther from the half level.
  for (int b = 0; b < blocks; ++b)
    out[b] = static_cast<std::uint16_t>(states[b] == block_full ? 0xffff : 0);
  const int mixed = kernels().mixed_blocks(states, blocks, mixed_list.data());
  silhouette::some_of(ahead);
  kernels().inside(up, here, down, reach, centre, side, mixed_list.data(), mixed,
                   values_below.data(), out);
  static_assert(std::endian::native == std::endian::little);  // four pieces are a word
  std::memcpy(below.data() + 1, out, static_cast<std::size_t>(words - 2) * 8);
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

void Tracer::State::finish(Rings& rings, std::vector<std::int32_t>* parents) {
  ahead = nullptr;
  // `above` now holds the last row: its copy, then what lies outside the frame.
  below = above;
  values_below = values_above;
  cells(height - 1);
  row_above = row_below;
  std::fill(below.begin(), below.end(), 0);
  cells(height);

  rings.clear();
  const bool binary = settings.method == TraceMethod::binary;
  first_crossing.clear();
  if (this->ring_of.size() < count) this->ring_of.resize(vertices.size());
  if (rings.points.capacity() < count) rings.points.reserve(vertices.size());
  rings.points.resize(count);
  std::uint32_t* const next = this->next.data();
  std::int32_t* const ring_of = this->ring_of.data();
  const Vec2f* const passed = binary ? corners.data() : vertices.data();
  Vec2f* const points = rings.points.data();
  Vec2f* end = points;
  for (std::uint32_t start = 0; start < count; ++start) {
    if (next[start] == taken) continue;
    Vec2f* const begin = end;
    const auto ring = static_cast<std::int32_t>(rings.ends.size());
    for (std::uint32_t v = start; next[v] != taken;) {
      const Vec2f p = passed[v];
      if ((!binary || p.x > -1e8f) && (end == begin || end[-1] != p)) *end++ = p;
      ring_of[v] = ring;
      const std::uint32_t to = next[v];
      next[v] = taken;
      v = to;
    }
    while (end > begin + 1 && end[-1] == *begin) --end;
    rings.ends.push_back(static_cast<std::uint32_t>(end - points));
    first_crossing.push_back(start);
  }
  rings.points.resize(static_cast<std::size_t>(end - points));
  if (parents) find_parents(rings, *parents);
}

// A ring's first crossing is its leftmost on its topmost row (cells() counts crossings on a row
// before those under it). To the left of it on that row lies either a ring of the other kind, which
// then is directly around it, or one of its own kind, which has the same parent (S. Suzuki, K. Abe,
// "Topological structural analysis of digitized binary images", 1985).
void Tracer::State::find_parents(const Rings& rings, std::vector<std::int32_t>& parents) {
  parents.assign(rings.size(), -1);
  holes.resize(rings.size());
  std::size_t row = 0;
  for (std::size_t i = 0; i < rings.size(); ++i) {
    const std::uint32_t first = first_crossing[i];
    while (row + 1 < row_begins.size() && row_begins[row + 1] <= first) ++row;
    // Crossings on a row lead in and out by turns.
    holes[i] = (first - row_begins[row]) & 1;
    if (first == row_begins[row]) continue;
    const auto other = static_cast<std::size_t>(ring_of[first - 1]);
    parents[i] = holes[i] == holes[other] ? parents[other] : static_cast<std::int32_t>(other);
  }
}

void Tracer::trace(const Field& field, const TraceSettings& settings, Rings& rings,
                   std::vector<std::int32_t>* parents) {
  state_->push_all(field, settings);
  state_->finish(rings, parents);
}

double ring_area(std::span<const Vec2f> ring) {
  if (ring.size() < 3) return 0.0;
  // Counter-clockwise on screen, y down, is negative in the shoelace formula. Four sums, so that
  // one addition need not wait for the other.
  double sums[4] = {};
  const auto add = [&](double& sum, Vec2f last, Vec2f p) {
    sum += static_cast<double>(p.x) * last.y - static_cast<double>(last.x) * p.y;
  };
  std::size_t i = 1;
  for (; i + 4 <= ring.size(); i += 4)
    for (std::size_t k = 0; k < 4; ++k) add(sums[k], ring[i + k - 1], ring[i + k]);
  for (; i < ring.size(); ++i) add(sums[0], ring[i - 1], ring[i]);
  add(sums[1], ring.back(), ring.front());
  return 0.5 * ((sums[0] + sums[1]) + (sums[2] + sums[3]));
}

}  // namespace polyhull
