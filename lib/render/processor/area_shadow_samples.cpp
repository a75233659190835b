// SPDX-License-Identifier: LGPL-2.1-or-later
// Which pixels of the grid a subject may shade, and what of the light they lose: by rays to its places,
// or by masks of what hides those.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "render/light_samples.h"
#include "render/processor/area_shadow.h"
#include "scene/spot_cone.h"

namespace polyhull::processor {
namespace {

/// Where pixel (x, y) of the picture lies in the light's map, as deep as 1 / \p inverse.
LightReach::Place place_of(const LightReach& reach, const ShadowView& view, int x, int y,
                           float inverse) {
  return reach.place(view.eye + view.rays.at(x, y) / inverse);
}

/// What an area light, a spot or a point sends.
struct Lamp {
  explicit Lamp(const Light& light)
      : facing(light_normal(light)),
        area(facing != Vec3f(0.0f)),
        spot(light.is_spot()),
        cone(cone_of(light)) {}
  /// To a receiver from one of its places, if nothing is in between; 0: nothing.
  float given(const Receiver& at, const Vec3f& place) const {
    const Vec3f way = place - at.point;
    const float distance_2 = glm::dot(way, way);
    const float incidence = glm::dot(at.normal, way);
    float exit = -glm::dot(facing, way);  // the cosine there times the distance
    if (!area || spot) {
      const float distance = std::sqrt(distance_2);
      exit = spot ? cone.at(exit / distance) * distance : distance;
    }
    if (!(incidence > 0.0f) || !(exit > 0.0f)) return 0.0f;
    return incidence * exit / (distance_2 * distance_2);
  }

  Vec3f facing;
  bool area, spot;
  SpotCone cone;
};

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
  const bool any = block_state_[number] > 0 && is_seen(view, number, margin);
  if (!any && blank_[number]) return 0;
  blank_[number] = !any;
  if (any && block_known_[number] < 3) find_places(reach, view, number);
  // Mostly all of the block's are alike.
  const bool all = any && reach.must_shade(extents_[number]);
  int count = 0;
  ReceiverFinder receivers(scene, view.layer, view.eye);
  const Rectangle part = pixels_of(number);
  for (int y = part.y; y < part.y + part.height; ++y) {
    const std::size_t row = static_cast<std::size_t>(y) * columns_ + part.x;
    for (auto* bytes : {&candidate_, &blocked_})
      std::fill_n(&(*bytes)[row], part.width, std::uint8_t{0});
    for (auto* numbers : {&sum_, &mean_, &gathered_})
      std::fill_n(&(*numbers)[row], part.width, 0.0f);
    if (!any) continue;
    std::uint8_t *const candidate = &candidate_[row], *const known = &known_[row];
    const float* const inverse = &inverse_[row];
    const LightReach::Place* const in_light = &in_light_[row];
    for (int i = 0; i < part.width; ++i) {
      if (!(inverse[i] > 0.0f)) continue;
      if (all ? in_light[i].inverse == 0.0f : !reach.may_shade(in_light[i])) continue;
      candidate[i] = 1;
      ++count;
      if (known[i]) continue;
      known[i] = 1;
      const int x = step_ * (part.x + i);
      receivers_[row + i] = receivers.at(x, step_ * y, view.rays.at(x, step_ * y));
      open_known_[row + i] = open_[row + i] = 0;
    }
  }
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

  void add(std::uint32_t pixel, const Receiver& at, const Vec3f& place, float weight) {
    rays[count] = {at.point, 0.0f, place - at.point, 1.0f - 1e-4f};
    pixels[count] = pixel;
    weights[count++] = weight;
  }
  /// Leaves those that are hidden.
  void keep_hidden() {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (!hidden[i]) continue;
      rays[kept] = rays[i];
      pixels[kept] = pixels[i];
      weights[kept++] = weights[i];
    }
    count = kept;
  }
};

/// Whether the scene lets the rays of \p packet through, which are those of \p sample, if that is not
/// known. Returns how many were traced.
std::size_t AreaShadow::find_open(const TracedScene& scene, int sample, Packet& packet) {
  const std::uint64_t bit = std::uint64_t{1} << sample;
  std::array<Ray, Packet::most> rays;
  std::array<std::uint32_t, Packet::most> pixels;
  std::size_t asked = 0;
  for (std::size_t i = 0; i < packet.count; ++i) {
    if (open_known_[packet.pixels[i]] & bit) continue;
    rays[asked] = packet.rays[i];
    pixels[asked++] = packet.pixels[i];
  }
  if (asked == 0) return 0;
  scene.caster().occluded(std::span(rays).first(asked), std::span(packet.hidden).first(asked));
  for (std::size_t i = 0; i < asked; ++i) {
    open_known_[pixels[i]] |= bit;
    if (!packet.hidden[i]) open_[pixels[i]] |= bit;
  }
  return asked;
}

// Not inlined: the compiler would find the thread's own memory anew for each use.
[[gnu::noinline]] AreaShadow::Scratch& AreaShadow::scratch() {
  thread_local Scratch own;
  return own;
}

/// Asks the masks for all rays of one of the neighbours, those to one place of the light together, so
/// that its image is at hand, and sums up what subjects take. Returns how many rays were traced through
/// the scene.
std::uint64_t AreaShadow::look_up(const ShadowCasters& subjects, const TracedScene& scene,
                                  const Light& light, int same) {
  Scratch& s = scratch();
  const std::size_t most =
      static_cast<std::size_t>(blocks_.width) * blocks_.height * Packet::most + 1;
  for (auto* numbers : {&s.pixels, &s.hidden, &s.asking}) numbers->resize(most);
  for (auto* numbers : {&s.x, &s.y, &s.w}) numbers->resize(most);
  std::uint32_t *const pixels = s.pixels.data(), *const hidden = s.hidden.data();
  float *const in_x = s.x.data(), *const in_y = s.y.data(), *const in_w = s.w.data();
  // The compiler cannot know that what is written is not what leads to these.
  const std::uint8_t* const candidate = candidate_.data();
  const LightReach::Place* const in_light = in_light_.data();

  std::size_t count = 0;
  for_same(same, [&](std::size_t pixel) {
    const LightReach::Place& at = in_light[pixel];
    pixels[count] = static_cast<std::uint32_t>(pixel);
    in_x[count] = at.tangents.x;
    in_y[count] = at.tangents.y;
    in_w[count] = at.inverse;
    count += candidate[pixel];
  });
  s.count = count;
  std::fill_n(hidden, count, 0);
  const std::size_t first = same * static_cast<std::size_t>(recipe_.rays);
  subjects.find_hidden(first, recipe_.rays, {static_cast<int>(count), in_x, in_y, in_w}, hidden);
  const Vec3f* const places = &places_[first];
  const std::uint64_t traced = find_unknown(scene, light, places, s);
  add_given(light, places, s);
  return traced;
}

/// Finds what of the scene is not known, where subjects hide \p places. Returns how many rays were traced.
std::uint64_t AreaShadow::find_unknown(const TracedScene& scene, const Light& light,
                                       const Vec3f* places, Scratch& s) {
  const std::uint32_t *const pixels = s.pixels.data(), *const hidden = s.hidden.data();
  const std::uint64_t* const open_known = open_known_.data();
  const Lamp lamp(light);
  std::uint64_t traced = 0;
  std::uint32_t unknown = 0;  // of any pixel
  std::uint32_t* const asking = s.asking.data();
  std::size_t asking_count = 0;
  for (std::size_t i = 0; i < s.count; ++i) {
    const std::uint32_t own = hidden[i] & ~static_cast<std::uint32_t>(open_known[pixels[i]]);
    asking[asking_count] = static_cast<std::uint32_t>(i);
    asking_count += own != 0;
    unknown |= own;
  }
  for (; unknown != 0; unknown &= unknown - 1) {
    const int sample = std::countr_zero(unknown);
    Packet packet;
    for (std::size_t k = 0; k < asking_count; ++k) {
      const std::uint32_t i = asking[k], pixel = pixels[i];
      if (!((hidden[i] & ~open_known[pixel]) >> sample & 1)) continue;
      const float weight = lamp.given(receivers_[pixel], places[sample]);
      if (weight > 0.0f)
        packet.add(pixel, receivers_[pixel], places[sample], weight);
      else
        open_known_[pixel] |= std::uint64_t{1} << sample;  // nothing comes from there
      if (packet.count < Packet::most) continue;
      traced += find_open(scene, sample, packet);
      packet.count = 0;
    }
    traced += find_open(scene, sample, packet);
  }
  return traced;
}

/// Sums up what of \p light the pixels do not get from the \p places that are hidden.
void AreaShadow::add_given(const Light& light, const Vec3f* places, const Scratch& s) {
  const std::uint32_t *const pixels = s.pixels.data(), *const hidden = s.hidden.data();
  const std::uint64_t* const open = open_.data();
  const Lamp lamp(light);
  LampPlaces known;
  for (int c = 0; c < 3; ++c) known.facing[c] = lamp.facing[c];
  for (int i = 0; i < recipe_.rays; ++i) {
    known.x[i] = places[i].x;
    known.y[i] = places[i].y;
    known.z[i] = places[i].z;
  }
  for (std::size_t i = 0; i < s.count; ++i) {
    std::uint64_t bits = hidden[i] & open[pixels[i]];
    if (bits == 0) continue;  // the mean is 0
    const Receiver& at = receivers_[pixels[i]];
    float sum = 0.0f;
    if (!lamp.spot)
      sum = Loops::best().given(known, &at.point.x, &at.normal.x, static_cast<std::uint32_t>(bits));
    for (; lamp.spot && bits != 0; bits &= bits - 1)
      sum += lamp.given(at, places[std::countr_zero(bits)]);
    mean_[pixels[i]] = sum / static_cast<float>(recipe_.rays);
  }
}

/// Samples first .. last - 1 of the block's candidates by rays, of all for first = 0 and of mixed ones
/// after.
std::uint64_t AreaShadow::trace(const ShadowCasters& subjects, const TracedScene& scene,
                                const Light& light, std::size_t number, int first, int last) {
  std::array<std::uint32_t, Packet::most> pixels[neighbours];
  std::size_t counts[neighbours] = {};
  std::uint64_t traced = 0;
  const std::uint8_t least = first == 0 ? 1 : 2;
  for_pixels(number, [&](std::size_t pixel, int x, int y) {
    if (candidate_[pixel] < least) return;
    const auto same = static_cast<std::size_t>(neighbour(x, y));
    pixels[same][counts[same]++] = static_cast<std::uint32_t>(pixel);
  });
  const Lamp lamp(light);
  Packet packet;
  // Many pixels' rays to one point of the light are a coherent packet.
  for (int sample = first; sample < last; ++sample) {
    const std::uint64_t bit = std::uint64_t{1} << sample;
    for (std::size_t same = 0; same < neighbours; ++same) {
      const std::size_t place = same * static_cast<std::size_t>(recipe_.rays) + sample;
      packet.count = 0;
      for (std::size_t i = 0; i < counts[same]; ++i) {
        const std::uint32_t pixel = pixels[same][i];
        const float weight = lamp.given(receivers_[pixel], places_[place]);
        if (weight > 0.0f) packet.add(pixel, receivers_[pixel], places_[place], weight);
      }
      if (packet.count == 0) continue;
      traced += packet.count;
      subjects.occluded(std::span(packet.rays).first(packet.count), place, packet.hidden);
      packet.keep_hidden();
      traced += find_open(scene, sample, packet);
      for (std::size_t i = 0; i < packet.count; ++i) {
        const std::uint32_t pixel = packet.pixels[i];
        ++blocked_[pixel];
        if (open_[pixel] & bit) sum_[pixel] += packet.weights[i];
      }
    }
  }
  for (std::size_t same = 0; same < neighbours; ++same)
    for (std::size_t i = 0; i < counts[same]; ++i)
      mean_[pixels[same][i]] = sum_[pixels[same][i]] / static_cast<float>(last);
  return traced;
}

}  // namespace polyhull::processor
