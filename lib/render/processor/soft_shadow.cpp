// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/processor/soft_shadow.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <utility>

namespace polyhull::processor {

Rectangle SoftShadow::asked(const Rectangle& part, const LayerView& view) {
  const Rectangle blocks = in_whole_blocks(part, view, margin, coarsest * block);
  return widened(blocks, view, margin);
}

/// Returns whether a subject may shade any pixel of the block; what they are made of is asked for these.
bool SoftShadow::find_candidates(const SoftMasks& subjects, const TracedScene& scene,
                                 const ShadowView& view, std::size_t number) {
  if (!std::exchange(block_known_[number], 1)) find_depths(view, number);
  const bool seen = is_seen(view, number, margin);
  bool any = false;
  ReceiverFinder receivers(scene, view.layer, view.eye);
  for_pixels(number, [&](std::size_t pixel, int x, int y) {
    candidate_[pixel] = 0;
    for (auto* planes : {&sum_, &gathered_})
      for (SparseArray<float>& plane : *planes) plane[pixel] = 0.0f;
    if (!seen || !(inverse_[pixel] > 0.0f)) return;
    if (!known_[pixel]) {
      known_[pixel] = 1;
      receivers_[pixel] = receivers.at(step_ * x, step_ * y, view.rays.at(step_ * x, step_ * y));
      open_known_[pixel] = open_[pixel] = 0;
    }
    candidate_[pixel] = subjects.may_hide(receivers_[pixel]);
    any = any || candidate_[pixel];
  });
  return any;
}

/// Whether the scene lets light from \p way, which is \p bit of their set, come to the pixels, which is not
/// known. Returns how many rays were traced.
std::uint64_t SoftShadow::find_open(const TracedScene& scene, const Vec3f& way, std::uint64_t bit,
                                    const std::vector<std::uint32_t>& pixels) {
  struct Scratch {
    std::vector<Ray> rays;
    std::vector<std::uint32_t> pixels;
    std::vector<std::uint8_t> hidden;
  };
  thread_local Scratch s;
  s.rays.clear();
  s.pixels.clear();
  for (const std::uint32_t pixel : pixels) {
    open_known_[pixel] |= bit;
    const Receiver& at = receivers_[pixel];
    if (!(glm::dot(at.normal, way) > 0.0f)) continue;  // nothing comes from there
    s.rays.push_back({at.point, 0.0f, way});
    s.pixels.push_back(pixel);
  }
  s.hidden.resize(s.rays.size());
  scene.caster().occluded(s.rays, s.hidden);
  for (std::size_t i = 0; i < s.rays.size(); ++i)
    if (!s.hidden[i]) open_[s.pixels[i]] |= bit;
  return s.rays.size();
}

// Not inlined: the compiler would find the thread's own memory anew for each use.
[[gnu::noinline]] SoftShadow::Scratch& SoftShadow::scratch() {
  thread_local Scratch own;
  return own;
}

/// Asks the masks for all pixels of a set, and sums up what subjects take. Returns how many rays were traced.
std::uint64_t SoftShadow::look_up(const SoftMasks& subjects, const TracedScene& scene, int set) {
  Scratch& s = scratch();
  const std::size_t most = static_cast<std::size_t>(blocks_.width) * blocks_.height * block *
                           block / static_cast<std::size_t>(neighbours);
  s.pixels.resize(most + 1);
  std::uint32_t* const pixels = s.pixels.data();
  const std::uint8_t* const candidate = candidate_.data();
  std::size_t count = 0;
  for_same(set, [&](std::size_t pixel) {
    pixels[count] = static_cast<std::uint32_t>(pixel);
    count += candidate[pixel];
  });
  s.pixels.resize(count);
  for (auto* numbers : {&s.points.x, &s.points.y, &s.points.z}) numbers->resize(count);
  for (std::size_t k = 0; k < count; ++k) {
    const Vec3f& point = receivers_[pixels[k]].point;
    s.points.x[k] = point.x;
    s.points.y[k] = point.y;
    s.points.z[k] = point.z;
  }
  s.hidden.assign(count, 0);
  subjects.find_hidden(set, s.points, s.hidden.data());

  const std::span<const EnvironmentPart> parts = subjects.set_of(set);
  const std::uint64_t traced = find_unknown(scene, parts, s);
  for (std::size_t k = 0; k < count; ++k) {
    std::uint64_t bits = s.hidden[k] & open_[pixels[k]];
    if (bits == 0) continue;
    const Vec3f normal = receivers_[pixels[k]].normal;
    Vec3f sum(0.0f);
    for (; bits != 0; bits &= bits - 1) {
      const EnvironmentPart& part = parts[static_cast<std::size_t>(std::countr_zero(bits))];
      sum += glm::dot(normal, part.direction) * part.irradiance;
    }
    // A sixteenth of the parts stands for all.
    for (std::size_t c = 0; c < 3; ++c)
      sum_[c][pixels[k]] = static_cast<float>(SoftMasks::sets) * sum[static_cast<int>(c)];
  }
  return traced;
}

/// Finds what of the scene is not known, where subjects hide directions. Returns how many rays were traced.
std::uint64_t SoftShadow::find_unknown(const TracedScene& scene,
                                       std::span<const EnvironmentPart> parts, Scratch& s) {
  std::uint64_t traced = 0;
  std::uint64_t unknown = 0;  // of any pixel
  s.unknown.clear();
  for (std::size_t k = 0; k < s.pixels.size(); ++k) {
    const std::uint64_t own = s.hidden[k] & ~open_known_[s.pixels[k]];
    if (own == 0) continue;
    s.unknown.emplace_back(s.pixels[k], own);
    unknown |= own;
  }
  for (; unknown != 0; unknown &= unknown - 1) {
    const int i = std::countr_zero(unknown);
    s.asking.clear();
    for (const auto& [pixel, bits] : s.unknown)
      if (bits >> i & 1) s.asking.push_back(pixel);
    traced += find_open(scene, parts[static_cast<std::size_t>(i)].direction, std::uint64_t{1} << i,
                        s.asking);
  }
  return traced;
}

void SoftShadow::gather(std::size_t number) {
  ShadowTile tile;
  if (!fill(number, sum_, tile)) return;
  float means[3][block * block];
  Loops::best().gather(tile, 3, means[0]);
  block_state_[number] = 2;
  for_pixels(number, [&](std::size_t pixel, int x, int y) {
    if (!candidate_[pixel]) return;
    for (std::size_t c = 0; c < 3; ++c)
      gathered_[c][pixel] = means[c][y % block * block + x % block];
  });
}

bool SoftShadow::draw(const SoftMasks& subjects, const TracedScene& scene, const ShadowView& view,
                      const Rectangle& part, int step) {
  const bool fresh = lay_out(view, step);
  if (!fresh && generation_ == subjects.generation() && part_ == part) {
    rays_ = 0;
    return true;
  }
  generation_ = 0;
  const bool other = std::exchange(directions_, subjects.directions()) != subjects.directions();
  if (fresh) {
    for (auto* bits : {&open_known_, &open_}) bits->make_room(known_.size());
    for (auto* planes : {&sum_, &gathered_})
      for (SparseArray<float>& plane : *planes) plane.make_room(known_.size());
    block_known_.assign(block_state_.size(), 0);
  } else if (other) {
    forget_open(open_known_, open_);
  }
  choose_blocks(widened(part, view.layer.view(), margin));
  in_blocks(0, [&](std::size_t number) {
    block_state_[number] = find_candidates(subjects, scene, view, number);
  });
  std::atomic<std::uint64_t> rays = 0;
  parallel_each(SoftMasks::sets, 1, 0,
                [&](std::size_t set) { rays += look_up(subjects, scene, static_cast<int>(set)); });
  in_blocks(1, [&](std::size_t number) { gather(number); });
  mark_shaded();
  rays_ = rays;
  generation_ = subjects.generation();
  part_ = part;
  return !fresh && !other;
}

/// What the grid has around the 16 pixels from (x, y) on; where it ends, in \p edge. Returns whether any is
/// taken there.
bool SoftShadow::find_rows(int x, int y, Edge& edge, SoftRows& rows) const {
  const Rectangle grid = drawn();
  const int last_x = grid.x + grid.width - 1, last_y = grid.y + grid.height - 1;
  const int first = x / step_, columns = 16 / step_ + 1;
  rows.step = step_;
  rows.below = static_cast<float>(y % step_) / static_cast<float>(step_);
  std::uint32_t any = 0;
  for (std::size_t row = 0; row < 2; ++row) {
    const auto line =
        static_cast<std::size_t>(std::min(y / step_ + static_cast<int>(row), last_y)) * columns_;
    const auto part = [&](const SparseArray<float>& plane, float* rest) {
      const float* const from = &plane[line + first];
      if (first + columns - 1 <= last_x) return from;
      for (int k = 0; k < columns; ++k) rest[k] = plane[line + std::min(first + k, last_x)];
      return static_cast<const float*>(rest);
    };
    rows.inverse[row] = part(inverse_, edge[row][0]);
    for (std::size_t c = 0; c < 3; ++c) {
      const float* const own = rows.taken[row][c] = part(gathered_[c], edge[row][1 + c]);
      for (int k = 0; k < columns; ++k) any |= std::bit_cast<std::uint32_t>(own[k]);
    }
  }
  return any != 0;
}

Vec3f SoftShadow::most(int x, int y) const {
  Edge edge;
  SoftRows rows;
  Vec3f out(0.0f);
  if (!find_rows(x, y, edge, rows)) return out;
  for (const auto& row : rows.taken)
    for (int c = 0; c < 3; ++c)
      for (int k = 0; k <= 16 / step_; ++k) out[c] = std::max(out[c], row[c][k]);
  return out;
}

bool SoftShadow::taken(const SceneLayer& layer, int x, int y, float (&taken)[3][16]) const {
  Edge edge;
  SoftRows rows;
  if (!find_rows(x, y, edge, rows)) return false;
  const float* inverse = layer.middle_inverse(x, y);
  float rest[16] = {};
  if (const int left = layer.view().width - x; left < 16) {
    std::copy_n(inverse, left, rest);
    inverse = rest;
  }
  Loops::best().take_soft(rows, inverse, taken);
  return true;
}

}  // namespace polyhull::processor
