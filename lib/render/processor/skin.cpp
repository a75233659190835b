// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/processor/skin.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "base/srgb.h"
#include "base/thread_pool.h"
#include "render/processor/best_views.h"
#include "render/soft_edge.h"

namespace polyhull::processor {
namespace {

/// What a view of relative weight \p near leaves of a ribbon where its matte is \p matte (soft_edge.h).
float own_alpha(float near, float matte) {
  const float counts = std::clamp((near - 0.05f) * 5.0f, 0.0f, 1.0f);
  const float inside = std::min(2.0f * matte, 1.0f);
  return 1.0f - counts * (1.0f - (inside + near * (matte - inside)));
}

}  // namespace

SkinCounts Skin::prepare(const Mesh& mesh, const std::vector<Vec3>& eyes, double pixel_size,
                         bool same, bool all_views, bool soft, std::span<const int> others) {
  SkinCounts counts;
  pixel_size_ = pixel_size;
  find_vertices(mesh, eyes, soft, others);
  std::vector<int> wanted = drawing_.views;
  for (std::size_t k = 0; k < mesh.views.size(); ++k) {
    if (drawing_.slot_of_view[k] >= 0 || !can_colour(mesh.views[k].view)) continue;
    if (all_views)
      wanted.push_back(static_cast<int>(k));
    else
      ++counts.pictures_skipped;
  }
  const Texturing* texturing = mesh.texturing ? &*mesh.texturing : nullptr;
  const bool blend = texturing && texturing->method == TextureMethod::blend;
  use_maps_ = blend && texturing->maps.size() == mesh.views.size() && !drawing_.views.empty();
  best_ = blend
              ? static_cast<int>(std::clamp<std::uint32_t>(texturing->cameras, 1, most_candidates))
              : 1;
  fill_range_ = fill_range(mesh);
  tolerance_ = 0.0f;
  if (use_maps_) {
    float coarsest = 0.0f, inset = 0.0f;
    for (const int k : drawing_.views) {
      const OcclusionMap& map = texturing->maps[static_cast<std::size_t>(k)];
      if (map.width <= 0 || map.height <= 0) continue;
      const auto focal =
          static_cast<float>(mesh.views[static_cast<std::size_t>(k)].calibration.K[0][0]);
      coarsest = std::max(coarsest, map.step * map.near / focal / (map.far - map.near));
      if (soft) inset = std::max(inset, static_cast<float>(inset_depth(map, focal)));
    }
    // The slope of a texel or two, and what was drawn in.
    tolerance_ = 3.0f * coarsest + 0.002f + inset;
  }

  pictures_.resize(mesh.views.size());
  const int reach = soft ? soft_reach : sharp_reach;
  if (std::exchange(reach_, reach) != reach || !same)
    for (Picture& picture : pictures_) picture.ready = false;
  std::erase_if(wanted, [&](int view) { return pictures_[static_cast<std::size_t>(view)].ready; });
  parallel_for(wanted.size(), 1, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) prepare_picture(mesh, wanted[i]);
  });
  for (const int view : wanted) {
    ++counts.pictures;
    counts.pixels += pictures_[static_cast<std::size_t>(view)].pixels.size();
  }
  parallel_for(drawing_.views.size(), 1, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      add_smaller(mesh, drawing_.views[i],
                  levels_needed(mesh, drawing_.views[i], eyes, pixel_size));
  });
  views_.clear();
  colours_.clear();
  smaller_.clear();
  for (const int view : drawing_.views) {
    views_.push_back(look_through(mesh, view));
    colours_.push_back(mesh.texturing
                           ? colour_of(*mesh.texturing, mesh.views[view].calibration, view)
                           : Mat3f(1.0f));
    std::vector<SkinView>& smaller = smaller_.emplace_back();
    for (const SmallerPicture& picture : pictures_[static_cast<std::size_t>(view)].smaller) {
      SkinView next = smaller.empty() ? views_.back() : smaller.back();
      // The first pixel's middle moves by half of what the pixels grow.
      next.origin_x += 0.5f / next.scale;
      next.origin_y += 0.5f / next.scale;
      next.scale *= 0.5f;
      next.pixels = picture.pixels.data();
      next.width = next.stride = picture.width;
      next.height = picture.height;
      smaller.push_back(next);
    }
  }
  look_along(mesh, eyes.front());
  return counts;
}

void Skin::find_vertices(const Mesh& mesh, const std::vector<Vec3>& eyes, bool soft,
                         std::span<const int> others) {
  drawing_.vertices.clear();
  drawing_.corner.clear();
  drawing_.lists.clear();
  drawing_.views.clear();
  drawing_.slot_of_view.assign(mesh.views.size(), -1);
  first_.assign(1, 0);
  first_wide_.clear();
  for (const int view : others) slot_of(drawing_, static_cast<std::size_t>(view));
  for (const Vec3& eye : eyes) {
    first_wide_.push_back(add_hull_vertices(mesh, {eye, pixel_size_}, drawing_));
    if (soft && first_.size() == 1) draw_in(mesh, 0, drawing_);
    first_.push_back(drawing_.vertices.size());
  }
  if (soft) add_ribbons(mesh, eyes.front(), drawing_);
  rests_ = rim_shares(mesh, eyes.front(), soft);
}

bool Skin::wide(std::size_t index) const {
  std::size_t eye = 0;
  while (eye < first_wide_.size() && index >= first_[eye + 1]) ++eye;
  return eye < first_wide_.size() && index >= first_wide_[eye];
}

void Skin::prepare_picture(const Mesh& mesh, int view) {
  const auto k = static_cast<std::size_t>(view);
  Picture& picture = pictures_[k];
  picture.ready = true;
  prepare_view_picture(mesh.views[k].view, reach_, picture.pixels);
  picture.smaller.clear();
  picture.depth.clear();
  picture.fade.clear();
  if (!use_maps_) return;
  const OcclusionMap& map = mesh.texturing->maps[k];
  const std::size_t stride = static_cast<std::size_t>(std::max(map.width, 0)) + 1;
  const std::size_t rows = static_cast<std::size_t>(std::max(map.height, 0)) + 1;
  picture.depth.assign(stride * rows, 0.0f);
  picture.fade.assign(stride * rows, 0.0f);
  for (int y = 0; y < map.height; ++y) {
    const std::size_t from = static_cast<std::size_t>(y) * map.width;
    const std::size_t to = static_cast<std::size_t>(y) * stride;
    for (int x = 0; x < map.width; ++x) {
      picture.depth[to + x] = static_cast<float>(map.depth[from + x]) / 65534.0f;
      picture.fade[to + x] = static_cast<float>(map.fade[from + x]) / 255.0f;
    }
  }
}

void Skin::add_smaller(const Mesh& mesh, int view, int levels) {
  Picture& picture = pictures_[static_cast<std::size_t>(view)];
  const Rectangle& roi = mesh.views[static_cast<std::size_t>(view)].view.roi;
  while (static_cast<int>(picture.smaller.size()) < levels) {
    if (picture.smaller.empty()) {
      picture.smaller.push_back(halved(picture.pixels, roi.width + 2, roi.height + 2));
    } else {
      const SmallerPicture& last = picture.smaller.back();
      picture.smaller.push_back(halved(last.pixels, last.width, last.height));
    }
  }
}

SkinView Skin::look_through(const Mesh& mesh, int number) const {
  const auto k = static_cast<std::size_t>(number);
  const Picture& picture = pictures_[k];
  const Camera& camera = mesh.views[k].calibration;
  const View& view = mesh.views[k].view;
  SkinView out;
  const Mat3 KR = camera.K * camera.R;
  const Vec3 shift = camera.K * camera.to_camera(mesh.hull.origin);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      out.pixel_from_local[row][column] = static_cast<float>(KR[column][row]);
    out.pixel_from_local[row][3] = static_cast<float>(shift[row]);
  }
  if (use_maps_) {
    const OcclusionMap& map = mesh.texturing->maps[k];
    out.map_depth = picture.depth.data();
    out.map_fade = picture.fade.data();
    out.map_x = map.x;
    out.map_y = map.y;
    out.map_scale = 1.0f / map.step;
    out.map_near = map.near;
    out.map_range = map.far - map.near;
    out.map_width = std::max(map.width, 0);
    out.map_height = std::max(map.height, 0);
    out.map_stride = out.map_width + 1;
    out.tolerance = tolerance_;
    out.rest = rests_[k];
  }
  out.pixels = picture.pixels.data();
  out.width = view.roi.width + 2;
  out.height = view.roi.height + 2;
  out.stride = out.width;
  out.origin_x = static_cast<float>(view.roi.x - 1);
  out.origin_y = static_cast<float>(view.roi.y - 1);
  out.distorted = camera.has_distortion();
  out.fx = static_cast<float>(camera.K[0][0]);
  out.fy = static_cast<float>(camera.K[1][1]);
  out.cx = static_cast<float>(camera.K[2][0]);
  out.cy = static_cast<float>(camera.K[2][1]);
  out.skew = static_cast<float>(camera.K[1][0]);
  for (std::size_t i = 0; i < std::min<std::size_t>(camera.distortion.size(), 12); ++i)
    out.lens[i] = static_cast<float>(camera.distortion[i]);
  return out;
}

// Which of a view's points are blended, and how many of its pixels a pixel of the picture spans there
// (view_picture.h).
void Skin::choose(std::size_t slot, const SkinItems& items, SkinScratch& s) const {
  const SkinView& view = views_[slot];
  const float* const row = view.pixel_from_local[2];
  const float factor = static_cast<float>(pixel_size_) * view.fx;
  const auto most = static_cast<float>(smaller_[slot].size());
  const std::size_t first_of_ribbon = 4 * items.first_of_ribbon;
  const std::uint32_t* const entries = s.entries.data();
  const float *const weights = s.weights.data(), *const u = s.u.data(), *const v = s.v.data();
  const float *const x = s.x.data(), *const y = s.y.data(), *const z = s.z.data();
  std::uint32_t* const chosen = s.chosen.data();
  float *const chosen_u = s.chosen_u.data(), *const chosen_v = s.chosen_v.data();
  float* const levels = s.levels.data();
  std::size_t n = 0;
  for (std::size_t j = s.first_of_slot[slot]; j < s.end_of_slot[slot]; ++j) {
    const std::uint32_t entry = entries[j];
    chosen[n] = entry;
    chosen_u[n] = u[j];
    chosen_v[n] = v[j];
    const float depth = row[0] * x[j] + row[1] * y[j] + row[2] * z[j] + row[3];
    const float spans = std::max(1.0f, factor * items[entry / 4].depth / depth);  // 1 for no number
    // From 1 on a float's exponent and the rest of it are the level and the way to the next.
    const auto bits = std::bit_cast<std::uint32_t>(spans);
    const int whole = static_cast<int>(bits >> 23) - 127;
    const auto rest = std::bit_cast<float>((bits & 0x7fffffu) | 0x3f800000u);
    levels[n] = std::min(static_cast<float>(whole - 1) + rest, most);
    n += weights[entry] > 0.0f || entry >= first_of_ribbon;
  }
  s.chosen_count = n;
}

// Adds what the view has at the chosen points.
void Skin::fetch(std::size_t slot, const SkinItems& items, SkinScratch& s) const {
  // Entries go up, and ribbons' points come last.
  const std::size_t count = s.chosen_count;
  const bool ribbons = count > 0 && s.chosen[count - 1] / 4 >= items.first_of_ribbon;
  const auto colours = [&](const SkinView& view, std::size_t n, float* u, float* v) {
    loops().fetch(view, static_cast<int>(n), srgb_to_linear_table(), u, v, s.red.data(),
                  s.green.data(), s.blue.data(), ribbons ? s.alpha.data() : nullptr);
    const Mat3f& colour = colours_[slot];
    if (colour == Mat3f(1.0f)) return;
    for (std::size_t j = 0; j < n; ++j) {
      const Vec3f light = glm::clamp(colour * Vec3f(s.red[j], s.green[j], s.blue[j]), 0.0f, 1.0f);
      s.red[j] = light.r;
      s.green[j] = light.g;
      s.blue[j] = light.b;
    }
  };
  const auto add = [&](const std::uint32_t* entries, const float* shares, std::size_t n) {
    const float *const red = s.red.data(), *const green = s.green.data();
    const float *const blue = s.blue.data(), *const weights = s.weights.data();
    glm::vec4* const sums = s.sums.data();
    for (std::size_t j = 0; j < n; ++j) {
      const std::uint32_t entry = entries[j];
      const float share = shares == nullptr ? weights[entry] : shares[j] * weights[entry];
      sums[entry / 4] += share * glm::vec4(red[j], green[j], blue[j], 0.0f);
    }
    for (std::size_t j = 0; ribbons && j < n; ++j)
      s.alphas[entries[j]] += shares == nullptr ? s.alpha[j] : shares[j] * s.alpha[j];
  };
  if (smaller_[slot].empty()) {
    colours(views_[slot], count, s.chosen_u.data(), s.chosen_v.data());
    add(s.chosen.data(), nullptr, count);
    return;
  }
  const float* const levels = s.levels.data();
  for (std::size_t level = 0; level <= smaller_[slot].size(); ++level) {
    std::uint32_t* const of_level = s.of_level.data();
    float *const u = s.level_u.data(), *const v = s.level_v.data();
    float* const shares = s.level_weights.data();
    std::size_t n = 0;
    for (std::size_t j = 0; j < count; ++j) {
      const float share = 1.0f - std::abs(levels[j] - static_cast<float>(level));
      of_level[n] = s.chosen[j];
      shares[n] = share;
      u[n] = s.chosen_u[j];
      v[n] = s.chosen_v[j];
      n += share > 0.0f;
    }
    colours(level == 0 ? views_[slot] : smaller_[slot][level - 1], n, u, v);
    add(of_level, shares, n);
  }
}

// The ribbons' coverage: by the view that knows best where the subject ends (soft_edge.h).
void Skin::soften(const SkinItems& items, SkinScratch& s) const {
  for (std::size_t i = items.first_of_ribbon; i < items.size(); ++i) {
    const std::array<float, 4>& weights = items[i].weights;
    const float largest = std::max({weights[0], weights[1], weights[2], weights[3]});
    float alpha = 1.0f;
    for (std::size_t c = 0; c < 4; ++c)
      if (weights[c] > 0.0f)
        alpha = std::min(alpha, own_alpha(weights[c] / largest, s.alphas[4 * i + c]));
    s.sums[i] *= alpha;
  }
}

// Lists what each view may colour.
void Skin::list_entries(const SkinItems& items, SkinScratch& s) const {
  const std::size_t count = items.size(), slots = std::max<std::size_t>(views_.size(), 1);
  s.first_of_slot.assign(slots + 1, 0);
  for (const SkinItem& item : items)
    for (std::size_t c = 0; c < 4; ++c)
      if (item.weights[c] > 0.0f) ++s.first_of_slot[(item.slots >> (8 * c) & 255u) + 1];
  // One place more than a view needs: what has no weight is written there.
  for (std::size_t slot = 0; slot < slots; ++slot)
    s.first_of_slot[slot + 1] += s.first_of_slot[slot] + 1;
  s.end_of_slot.assign(s.first_of_slot.begin(), s.first_of_slot.end() - 1);
  const auto room = [](std::size_t size, auto&... arrays) {
    (arrays.resize(std::max(arrays.size(), size)), ...);
  };
  const std::size_t all = s.first_of_slot[slots];
  room(all, s.entries, s.x, s.y, s.z, s.u, s.v, s.weight, s.chosen, s.chosen_u, s.chosen_v,
       s.levels, s.of_level, s.level_u, s.level_v, s.level_weights, s.red, s.green, s.blue,
       s.alpha);
  s.weights.resize(4 * count);
  s.sums.resize(count);
  std::uint32_t* const entries = s.entries.data();
  float *const x = s.x.data(), *const y = s.y.data(), *const z = s.z.data();
  float *const weight = s.weight.data(), *const weights = s.weights.data();
  std::size_t* const ends = s.end_of_slot.data();
  for (std::size_t i = 0; i < count; ++i) {
    const SkinItem& item = items[i];
    for (std::size_t c = 0; c < 4; ++c) {
      std::size_t& end = ends[item.slots >> (8 * c) & 255u];
      entries[end] = static_cast<std::uint32_t>(4 * i + c);
      x[end] = item.place.x;
      y[end] = item.place.y;
      z[end] = item.place.z;
      weight[end] = weights[4 * i + c] = item.weights[c];
      end += item.weights[c] > 0.0f;
    }
  }
}

// View by view, how much of each point it sees.
void Skin::look(const SkinItems& items, SkinScratch& s) const {
  const bool plain = items.first_of_ribbon >= items.size() && !items.nearest_where_unseen;
  for (std::size_t slot = 0; slot < views_.size(); ++slot) {
    const std::size_t first = s.first_of_slot[slot], end = s.end_of_slot[slot];
    loops().look(views_[slot],
                 {static_cast<int>(end - first), &s.x[first], &s.y[first], &s.z[first]},
                 &s.u[first], &s.v[first], &s.weight[first]);
    for (std::size_t j = first; plain && j < end; ++j) s.weights[s.entries[j]] = s.weight[j];
    for (std::size_t j = first; !plain && j < end; ++j) {
      // A ribbon that no view sees free of the hull takes the nearest one's colours.
      const std::uint32_t i = s.entries[j] / 4;
      const bool ribbon = i >= items.first_of_ribbon;
      const float least = ribbon ? 1e-3f : items.nearest_where_unseen ? 1e-4f : 0.0f;
      s.weights[s.entries[j]] = s.weight[j] + least * items[i].weights[s.entries[j] % 4];
    }
  }
}

void Skin::paint(const SkinItems& items, SkinScratch& s, glm::vec4* pixels) const {
  const std::size_t count = items.size();
  if (count == 0) return;
  // First how much each view gives, then with what.
  list_entries(items, s);
  if (items.first_of_ribbon < count) s.alphas.assign(4 * count, 0.0f);
  look(items, s);
  for (std::size_t i = 0; i < count; ++i) {
    if (items[i].parts == 0) {  // of the point before
      s.sums[i] = glm::vec4(0.0f);
      continue;
    }
    float* w = &s.weights[4 * i];
    const std::size_t candidates = 4 * std::size_t(items[i].parts);
    const auto sum = [=] {
      float of = w[0] + w[1] + w[2] + w[3];
      for (std::size_t c = 4; c < candidates; ++c) of += w[c];
      return of;
    };
    const float all = sum();
    keep_best_views(w, candidates, best_);
    const float total = sum();
    // What hardly any camera sees fades to the fill; ribbons show what little they have.
    const float range = i < items.first_of_ribbon ? fill_range_ : 1e-6f;
    const float t = std::clamp(all / range, 0.0f, 1.0f);
    const float sure = total > 0.0f ? t * t * (3.0f - 2.0f * t) : 0.0f;
    const float scale = sure > 0.0f ? sure / total : 0.0f;
    for (std::size_t c = 0; c < candidates; ++c) w[c] *= scale;
    s.sums[i] = glm::vec4((1.0f - sure) * items[i].fill, 1.0f);
  }
  for (std::size_t slot = 0; slot < views_.size(); ++slot) {
    choose(slot, items, s);
    displace(slot, items, s);
    fetch(slot, items, s);
  }
  if (items.first_of_ribbon < count) soften(items, s);
  for (std::size_t i = 0; i < count; ++i) pixels[items[i].pixel] += items[i].share * s.sums[i];
}

}  // namespace polyhull::processor
