// SPDX-License-Identifier: LGPL-2.1-or-later
// Which pixels of the grid a subject may shade, and what of the light they lose: by rays to its places,
// or by masks of what hides those.
#include <algorithm>
#include <array>
#include <cmath>

#include "render/processor/area_shadow.h"
#include "scene/spot_cone.h"

namespace polyhull::processor {
namespace {

/// Where pixel (x, y) of the picture lies in the light's map, as deep as 1 / \p inverse.
LightReach::Place place_of(const LightReach& reach, const ShadowView& view, int x, int y,
                           float inverse) {
  return reach.place(view.eye + view.rays.at(x, y) / inverse);
}

/// Which block of the sequence a pixel of the grid asks for: those of each 2 x 2 are consecutive.
std::size_t neighbour(int x, int y) {
  return static_cast<std::size_t>((x & 1) | (y & 1) << 1 | (x & 2) << 1 | (y & 2) << 2);
}

}  // namespace

/// Whether a subject may shade any of the block's pixels.
bool AreaShadow::may_shade(const LightReach& reach, const ShadowView& view, std::size_t number) {
  if (block_known_[number] < 1) {
    block_known_[number] = 1;
    find_depths(view, number);
  }
  if (block_known_[number] < 2) {
    block_known_[number] = 2;
    extents_[number] = extent_of(reach, view, number);
  }
  return reach.may_shade(extents_[number]);
}

void AreaShadow::find_depths(const ShadowView& view, std::size_t number) {
  for_pixels(number, [&](std::size_t pixel, int x, int y) {
    inverse_[pixel] = *view.layer.middle_inverse(step_ * x, step_ * y);
  });
}

/// Whether what the block has is to be seen at all. Where none of the pixels up to those that are
/// gathered show the mirror, nobody asks what is found there.
bool AreaShadow::is_seen(const ShadowView& view, std::size_t number) const {
  if (!view.mirror) return true;
  const Rectangle part = pixels_of(number);
  const Rectangle pixels{step_ * part.x, step_ * part.y, step_ * part.width, step_ * part.height};
  return view.mirror->shows_mirror(surroundings(pixels, view.layer.view()));
}

/// Around the block's places in the light's map. What lies between the rays of four corners and
/// between two depths is a convex body, and so is its image, as long as all of it is before the
/// light.
LightReach::Extent AreaShadow::extent_of(const LightReach& reach, const ShadowView& view,
                                         std::size_t number) const {
  float least = 1e30f, most = 0.0f;
  for_pixels(number, [&](std::size_t pixel, int, int) {
    const float inverse = inverse_[pixel];
    least = inverse > 0.0f ? std::min(least, inverse) : least;
    most = std::max(most, inverse);
  });
  LightReach::Extent extent;
  if (most == 0.0f) return extent;
  const Rectangle part = pixels_of(number);
  bool before = true;
  for (const int x : {part.x, part.x + part.width - 1}) {
    for (const int y : {part.y, part.y + part.height - 1}) {
      for (const float inverse : {least, most}) {
        const LightReach::Place at = place_of(reach, view, step_ * x, step_ * y, inverse);
        before = before && at.inverse > 0.0f;
        extent.add(at);
      }
    }
  }
  if (before) return extent;
  for_pixels(number, [&](std::size_t pixel, int x, int y) {
    if (inverse_[pixel] > 0.0f)
      extent.add(place_of(reach, view, step_ * x, step_ * y, inverse_[pixel]));
  });
  return extent;
}

/// Where the block's pixels lie in the light's map: that follows from their depths.
void AreaShadow::find_places(const LightReach& reach, const ShadowView& view, std::size_t number) {
  block_known_[number] = 3;
  for_pixels(number, [&](std::size_t pixel, int x, int y) {
    in_light_[pixel] = {};
    if (inverse_[pixel] > 0.0f)
      in_light_[pixel] = place_of(reach, view, step_ * x, step_ * y, inverse_[pixel]);
  });
}

/// Returns how many pixels of the block a subject may shade; what they are made of is asked for
/// these only.
int AreaShadow::find_candidates(const LightReach& reach, const TracedScene& scene,
                                const ShadowView& view, std::size_t number) {
  const bool any = block_state_[number] > 0 && is_seen(view, number);
  if (!any && blank_[number]) return 0;
  blank_[number] = !any;
  if (any && block_known_[number] < 3) find_places(reach, view, number);
  int count = 0;
  ReceiverFinder receivers(scene, view.layer, view.eye);
  for_pixels(number, [&](std::size_t pixel, int x, int y) {
    candidate_[pixel] = blocked_[pixel] = 0;
    sum_[pixel] = mean_[pixel] = gathered_[pixel] = 0.0f;
    if (!any || !(inverse_[pixel] > 0.0f) || !reach.may_shade(in_light_[pixel])) return;
    if (!known_[pixel]) {
      known_[pixel] = 1;
      receivers_[pixel] = receivers.at(step_ * x, step_ * y, view.rays.at(step_ * x, step_ * y));
      open_known_[pixel] = open_[pixel] = 0;
    }
    candidate_[pixel] = 1;
    ++count;
  });
  return count;
}

/// Rays from pixels to one point of the light, in a packet, with what each pixel's point would get.
struct AreaShadow::Packet {
  static constexpr std::size_t most = block * block / neighbours;  // pixels that ask for the same
  static_assert(most <= ImageHull::lanes, "ShadowCasters asks for as many at once");
  std::array<Ray, most> rays;
  std::array<std::uint8_t, most> hidden;
  std::array<std::uint32_t, most> pixels;
  std::array<float, most> weights;
  std::size_t count = 0;

  /// Asks \p caster which rays are blocked; returns how many were asked.
  std::size_t ask(const RayCaster& caster) {
    caster.occluded(std::span(rays).first(count), std::span(hidden).first(count));
    return count;
  }
  /// Ray \p i becomes the last one of those that stay.
  void keep(std::size_t i, std::size_t& kept) {
    rays[kept] = rays[i];
    pixels[kept] = pixels[i];
    weights[kept++] = weights[i];
  }
};

/// The rays of \p pixels to \p place, of those for which it shines.
void AreaShadow::aim(std::span<const std::uint32_t> pixels, const Vec3f& place, const Vec3f& facing,
                     Packet& packet) const {
  const bool area = facing != Vec3f(0.0f), spot = light_.is_spot();
  const SpotCone cone = cone_of(light_);
  packet.count = 0;
  for (const std::uint32_t pixel : pixels) {
    const Receiver& at = receivers_[pixel];
    const Vec3f way = place - at.point;
    const float distance_2 = glm::dot(way, way);
    const float incidence = glm::dot(at.normal, way);
    float exit = -glm::dot(facing, way);  // the cosine there times the distance
    if (!area || spot) {
      const float distance = std::sqrt(distance_2);
      exit = spot ? cone.at(exit / distance) * distance : distance;
    }
    if (!(incidence > 0.0f) || !(exit > 0.0f)) continue;
    Ray& ray = packet.rays[packet.count];
    ray.origin = at.point;
    ray.near = 0.0f;
    ray.direction = way;
    ray.far = 1.0f - 1e-4f;
    packet.pixels[packet.count] = pixel;
    packet.weights[packet.count++] = incidence * exit / (distance_2 * distance_2);
  }
}

/// The rays to place \p number, which is \p sample of each of \p pixels, of those from which subjects
/// hide it. Returns how many were traced.
std::size_t AreaShadow::hide(const ShadowCasters& subjects, std::span<const std::uint32_t> pixels,
                             std::size_t number, int sample, const Vec3f& facing,
                             Packet& packet) const {
  if (!subjects.masked()) {
    aim(pixels, places_[number], facing, packet);
    if (packet.count == 0) return 0;
    const std::size_t traced = packet.count;
    subjects.occluded(std::span(packet.rays).first(packet.count), number, packet.hidden);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < packet.count; ++i)
      if (packet.hidden[i]) packet.keep(i, kept);
    packet.count = kept;
    return traced;
  }
  std::array<std::uint32_t, Packet::most> hidden;
  std::size_t count = 0;
  for (const std::uint32_t pixel : pixels)
    if (hidden_[pixel] >> sample & 1) hidden[count++] = pixel;
  aim(std::span(hidden).first(count), places_[number], facing, packet);
  return 0;
}

/// Asks the masks for all rays of a row of blocks, those to one place of the light together.
void AreaShadow::look_up(const ShadowCasters& subjects, int block_row) {
  struct Scratch {
    std::vector<std::uint32_t> pixels, hidden;
    std::vector<float> x, y, w;
  };
  thread_local Scratch s;
  const Rectangle grid = drawn();
  const int top = block_row * block, bottom = std::min(top + block, grid.y + grid.height);
  for (int same = 0; same < neighbours; ++same) {
    s.pixels.clear();
    for (auto* numbers : {&s.x, &s.y, &s.w}) numbers->clear();
    const int right = (same & 1) | (same >> 1 & 2), down = (same >> 1 & 1) | (same >> 2 & 2);
    for (int y = top + down; y < bottom; y += 4) {
      for (int x = grid.x + right; x < grid.x + grid.width; x += 4) {
        const std::size_t pixel = static_cast<std::size_t>(y) * columns_ + x;
        if (!candidate_[pixel]) continue;
        s.pixels.push_back(static_cast<std::uint32_t>(pixel));
        s.x.push_back(in_light_[pixel].tangents.x);
        s.y.push_back(in_light_[pixel].tangents.y);
        s.w.push_back(in_light_[pixel].inverse);
      }
    }
    s.hidden.assign(s.pixels.size(), 0);
    subjects.find_hidden(same * static_cast<std::size_t>(per_pixel_), per_pixel_,
                         {static_cast<int>(s.pixels.size()), s.x.data(), s.y.data(), s.w.data()},
                         s.hidden.data());
    for (std::size_t i = 0; i < s.pixels.size(); ++i) hidden_[s.pixels[i]] = s.hidden[i];
  }
}

/// Samples first .. last - 1 of the block's candidates, of all for first = 0 and of mixed ones
/// after.
std::uint64_t AreaShadow::trace(const ShadowCasters& subjects, const TracedScene& scene,
                                const Light& light, std::size_t number, int first, int last) {
  std::array<std::uint32_t, Packet::most> pixels[neighbours];
  std::size_t counts[neighbours] = {};
  std::uint64_t traced = 0;
  const std::uint8_t least = first == 0 ? 1 : 2;
  for_pixels(number, [&](std::size_t pixel, int x, int y) {
    if (candidate_[pixel] < least) return;
    const std::size_t same = neighbour(x, y);
    pixels[same][counts[same]++] = static_cast<std::uint32_t>(pixel);
  });
  const Vec3f facing = light_normal(light);
  Packet packet;
  // Many pixels' rays to one point of the light are a coherent packet.
  for (int sample = first; sample < last; ++sample) {
    const std::uint64_t bit = std::uint64_t{1} << sample;
    for (std::size_t same = 0; same < neighbours; ++same) {
      const std::size_t place = same * static_cast<std::size_t>(per_pixel_) + sample;
      traced += hide(subjects, std::span(pixels[same]).first(counts[same]), place, sample, facing,
                     packet);
      std::size_t behind = 0;  // those whose way through the scene is not known yet
      for (std::size_t i = 0; i < packet.count; ++i) {
        const std::uint32_t pixel = packet.pixels[i];
        ++blocked_[pixel];
        if (!(open_known_[pixel] & bit))
          packet.keep(i, behind);
        else if (open_[pixel] & bit)
          sum_[pixel] += packet.weights[i];
      }
      packet.count = behind;
      if (behind == 0) continue;
      traced += packet.ask(scene.caster());
      for (std::size_t i = 0; i < behind; ++i) {
        const std::uint32_t pixel = packet.pixels[i];
        open_known_[pixel] |= bit;
        if (packet.hidden[i]) continue;
        open_[pixel] |= bit;
        sum_[pixel] += packet.weights[i];
      }
    }
  }
  for (std::size_t same = 0; same < neighbours; ++same)
    for (std::size_t i = 0; i < counts[same]; ++i)
      mean_[pixels[same][i]] = sum_[pixels[same][i]] / static_cast<float>(last);
  return traced;
}

}  // namespace polyhull::processor
