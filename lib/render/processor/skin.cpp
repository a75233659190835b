// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/processor/skin.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <utility>

#include "base/srgb.h"
#include "base/thread_pool.h"
#include "render/subject/soft_edge.h"

namespace polyhull::processor {
namespace {

static_assert(sizeof(SkinCorner) == sizeof(HullVertex) &&
              offsetof(SkinCorner, weights) == offsetof(HullVertex, weights) &&
              offsetof(SkinCorner, slots) == offsetof(HullVertex, slots) &&
              offsetof(SkinCorner, fill) == offsetof(HullVertex, fill));

/// What a view of relative weight \p near leaves of a ribbon where its matte is \p matte (subject/soft_edge.h).
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
  parallel_each(wanted.size(), 1, 0, [&](std::size_t i) { prepare_picture(mesh, wanted[i]); });
  for (const int view : wanted) {
    ++counts.pictures;
    counts.pixels += pictures_[static_cast<std::size_t>(view)].pixels.size();
  }
  parallel_each(drawing_.views.size(), 1, 0, [&](std::size_t i) {
    add_smaller(mesh, drawing_.views[i], levels_needed(mesh, drawing_.views[i], eyes, pixel_size));
  });
  views_.clear();
  colours_.clear();
  for (const int view : drawing_.views) {
    std::vector<SkinView>& levels = views_.emplace_back(1, look_through(mesh, view));
    colours_.push_back(mesh.texturing
                           ? colour_of(*mesh.texturing, mesh.views[view].calibration, view)
                           : Mat3f(1.0f));
    for (const SmallerPicture& picture : pictures_[static_cast<std::size_t>(view)].smaller) {
      SkinView next = levels.back();
      // The first pixel's middle moves by half of what the pixels grow.
      next.origin_x += 0.5f / next.scale;
      next.origin_y += 0.5f / next.scale;
      next.scale *= 0.5f;
      next.pixels = picture.pixels.data();
      next.width = next.stride = picture.width;
      next.height = picture.height;
      levels.push_back(next);
    }
  }
  look_along(mesh, eyes.front());
  return counts;
}

void Skin::find_vertices(const Mesh& mesh, const std::vector<Vec3>& eyes, bool soft,
                         std::span<const int> others) {
  drawing_.clear(mesh.views.size());
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
  picture.map.clear();
  if (!use_maps_) return;
  const OcclusionMap& map = mesh.texturing->maps[k];
  const std::size_t stride = static_cast<std::size_t>(std::max(map.width, 0)) + 1;
  const std::size_t rows = static_cast<std::size_t>(std::max(map.height, 0)) + 2;
  picture.map.assign(stride * rows + 1, {});
  for (int y = 0; y < map.height; ++y) {
    const std::size_t from = static_cast<std::size_t>(y) * map.width;
    const std::size_t to = static_cast<std::size_t>(y) * stride;
    for (int x = 0; x < map.width; ++x)
      picture.map[to + x] = {static_cast<float>(map.depth[from + x]) / 65534.0f,
                             static_cast<float>(map.fade[from + x]) / 255.0f};
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
    out.map = picture.map.data();
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

// Finds the points that have the same candidates.
void Skin::find_groups(const SkinItems& items, SkinScratch& s) const {
  constexpr std::uint32_t none = ~0u;
  constexpr int bits = 8;
  std::array<std::uint32_t, 1 << bits> latest;  // groups, by a hash; a group may be forgotten there
  latest.fill(none);
  const auto alike = [&](std::size_t a, std::size_t b) {
    if (items[a].parts != items[b].parts) return false;
    if ((a < items.first_of_ribbon) != (b < items.first_of_ribbon)) return false;
    for (std::size_t k = 0; k < items[a].parts; ++k)
      if (items[a + k].slots != items[b + k].slots) return false;
    return true;
  };
  s.groups.clear();
  s.runs.clear();
  const auto count = static_cast<std::uint32_t>(items.size());
  for (std::uint32_t i = 0; i < count;) {
    const std::uint32_t slots = items[i].slots, parts = items[i].parts, first = i;
    std::uint32_t hash = 0;
    for (std::uint32_t k = 0; k < parts; ++k) hash = (hash ^ items[i + k].slots) * 0x9e3779b1u;
    std::uint32_t& group = latest[hash >> (32 - bits)];
    if (group == none || !alike(s.groups[group].first, i)) {
      group = static_cast<std::uint32_t>(s.groups.size());
      s.groups.push_back({i, 0, 0, 0});
    }
    i += parts;
    while (parts == 1 && i < count && items[i].slots == slots && items[i].parts == 1 &&
           i != items.first_of_ribbon)
      ++i;
    s.runs.push_back({first, parts == 1 ? i - first : 1, group});
    s.groups[group].count += s.runs.back().count;
  }
  std::size_t end = 0;
  for (SkinScratch::Group& group : s.groups) {
    group.begin = group.end = end;
    end += (group.count + 7) / 8 * 8;
  }
  s.order.resize(end);
  for (const SkinScratch::Run& run : s.runs)
    for (std::uint32_t i = 0; i < run.count; ++i)
      s.order[s.groups[run.group].end++] = run.first + i;
  for (SkinScratch::Group& group : s.groups)
    for (; (group.end - group.begin) % 8 != 0; ++group.end)
      s.order[group.end] = s.order[group.end - 1];
}

// Which views may colour a block's points, where these lie in them, and how much each sees of them.
void Skin::look(const SkinItems& items, const std::uint32_t* which, int count,
                SkinScratch& s) const {
  const std::uint32_t first = which[0], parts = items[first].parts;
  const bool ribbons = first >= items.first_of_ribbon;
  // What no view sees takes all the same what colours the views have there.
  const float least = ribbons ? 1e-3f : items.nearest_where_unseen ? 1e-4f : 0.0f;
  const SkinPoints points{count, s.x, s.y, s.z, s.depth};
  s.rows.resize(std::max(s.rows.size(), 16 * parts * SkinScratch::block));
  float* row = s.rows.data();
  const auto next_row = [&] { return std::exchange(row, row + SkinScratch::block); };
  s.views.clear();
  s.weights.clear();
  for (std::uint32_t part = 0; part < parts; ++part) {
    float* const weights[4] = {next_row(), next_row(), next_row(), next_row()};
    Loops::best().spread(items[part].weights.data(), which, count, weights);
    for (std::uint32_t c = 0; c < 4; ++c) {
      float heaviest = 0.0f;
      for (int i = 0; i < count; ++i) heaviest = std::max(heaviest, weights[c][i]);
      if (heaviest == 0.0f) continue;
      const std::uint32_t slot = items[first + part].slots >> (8 * c) & 255u;
      const SkinScratch::View view{slot,       4 * part + c, weights[c],
                                   next_row(), next_row(),   ribbons ? next_row() : nullptr};
      s.views.push_back(view);
      s.weights.push_back(view.weight);
      Loops::best().look(views_[slot].front(), points, least, view.u, view.v, view.weight);
    }
  }
}

SkinLight::SkinLight(std::shared_ptr<const LightLattice> lattice, const Mat4& scene_from_local,
                     const Grade& grade)
    : lattice_(std::move(lattice)), grade_(grade), graded_(!grade.neutral()) {
  if (!lattice_) return;
  Mat4 cells(1.0 / lattice_->cell);
  cells[3] = Vec4(Vec3(lattice_->origin) / -static_cast<double>(lattice_->cell), 1.0);
  cells_from_local_ = glm::mat4(cells * scene_from_local);
}

void SkinLight::shade(const SkinPoints& points, float* red, float* green, float* blue) const {
  for (int i = 0; lattice_ && i < points.count; ++i) {
    const Vec3f factor = lattice_->at(
        Vec3f(cells_from_local_ * glm::vec4(points.x[i], points.y[i], points.z[i], 1.0f)));
    red[i] *= factor.x;
    green[i] *= factor.y;
    blue[i] *= factor.z;
  }
  for (int i = 0; graded_ && i < points.count; ++i) {
    const Vec3f colour = graded(grade_, {red[i], green[i], blue[i]});
    red[i] = colour.x;
    green[i] = colour.y;
    blue[i] = colour.z;
  }
}

void Skin::paint_block(const SkinItems& items, const SkinLight& light, const std::uint32_t* which,
                       int count, SkinScratch& s) const {
  const bool ribbons = which[0] >= items.first_of_ribbon;
  const SkinItem& base = items[0];
  Loops::best().spread(&base.place.x, which, count, {s.x, s.y, s.z, s.depth});
  Loops::best().spread(&base.fill.x, which, count, {s.red, s.green, s.blue, s.share});
  look(items, which, count, s);
  // What hardly any camera sees fades to the fill; ribbons show what little they have.
  Loops::best().settle(s.weights.data(), static_cast<int>(s.views.size()), best_,
                       ribbons ? 1e-6f : fill_range_, count, {s.red, s.green, s.blue, nullptr});
  std::sort(s.views.begin(), s.views.end(),
            [](const auto& a, const auto& b) { return a.slot < b.slot; });
  const SkinPoints points{count, s.x, s.y, s.z, s.depth};
  for (const SkinScratch::View& view : s.views) {
    const std::vector<SkinView>& levels = views_[view.slot];
    const Mat3f& colour = colours_[view.slot];
    if (ribbons)
      std::fill_n(view.alpha, count, 0.0f);
    else
      displace(view, count, s);  // mattes stay where they are
    Loops::best().add({levels.data(), static_cast<int>(levels.size()),
                       static_cast<float>(pixel_size_) * levels.front().fx,
                       colour == Mat3f(1.0f) ? nullptr : &colour[0][0]},
                      points, view.weight, srgb_to_linear_table(), view.u, view.v,
                      {s.red, s.green, s.blue, view.alpha});
  }
  for (int i = 0; !items.form.empty() && i < count; ++i) {
    const Vec3f& form = items.form[which[i]];
    s.red[i] *= form.x;
    s.green[i] *= form.y;
    s.blue[i] *= form.z;
  }
  light.shade(points, s.red, s.green, s.blue);
  for (int i = 0; i < count; ++i) {
    glm::vec4& to = s.colours[which[i]];
    to = glm::vec4(s.red[i], s.green[i], s.blue[i], 1.0f);
    if (!ribbons) continue;
    // Their coverage, by the view that knows best where the subject ends (subject/soft_edge.h).
    const std::array<float, 4>& weights = items[which[i]].weights;
    const float largest = *std::max_element(weights.begin(), weights.end());
    float alpha = 1.0f;
    for (const SkinScratch::View& view : s.views)
      if (weights[view.candidate] > 0.0f)
        alpha = std::min(alpha, own_alpha(weights[view.candidate] / largest, view.alpha[i]));
    to *= alpha;
  }
}

void Skin::paint(const SkinItems& items, const SkinLight& light, SkinScratch& s,
                 glm::vec4* pixels) const {
  if (items.empty()) return;
  find_groups(items, s);
  s.colours.resize(items.size());
  for (const SkinScratch::Group& group : s.groups)
    for (std::size_t i = group.begin; i < group.end; i += SkinScratch::block)
      paint_block(items, light, &s.order[i],
                  static_cast<int>(std::min(SkinScratch::block, group.end - i)), s);
  for (std::size_t i = 0; i < items.size(); i += items[i].parts)
    pixels[items[i].pixel] += items[i].share * s.colours[i];
}

}  // namespace polyhull::processor
