// SPDX-License-Identifier: LGPL-2.1-or-later
#include "texture/fill_samples.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/thread_pool.h"
#include "texture/eye.h"

namespace polyhull {
namespace {

/// The views that see a point best, the heavier first.
struct Sighting {
  float confidence = 0.0f;
  float weight[2] = {};
  std::uint32_t view[2] = {};
  Vec2f at[2] = {};  ///< Eye::look()'s
};

/// \p weight of each view, as the texturing's.
template <typename Weight>
Sighting look(const std::vector<Eye>& eyes, const Vec3f& point, const Weight& weight) {
  Sighting out;
  std::size_t first = 0;
  for (std::size_t k = 1; k < eyes.size(); ++k)
    if (weight(k) > weight(first)) first = k;
  for (std::size_t i = 0; i < eyes.size(); ++i) {
    const std::size_t k = i == 0 ? first : i <= first ? i - 1 : i;
    const float w = weight(k);
    if (!(w * w > out.weight[1])) continue;
    Vec2f at;
    const float fade = eyes[k].look(point, at);
    const float total = w * w * fade;
    if (!(total > out.weight[1])) continue;
    const int place = total > out.weight[0] ? 0 : 1;
    if (place == 0) {
      out.weight[1] = out.weight[0];
      out.view[1] = out.view[0];
      out.at[1] = out.at[0];
    }
    out.weight[place] = total;
    out.view[place] = static_cast<std::uint32_t>(k);
    out.at[place] = at;
    out.confidence = std::max(out.confidence, std::min(1.0f, 3.0f * w) * fade);
    if (out.confidence == 1.0f) break;  // the heaviest, mostly: that will do
  }
  return out;
}

/// Confidence 0 where no picture has a colour to give.
FillSample colour_of(const std::vector<Eye>& eyes, const Sighting& seen) {
  FillSample out;
  float sum = 0.0f;
  for (int i = 0; i < 2; ++i) {
    if (!(seen.weight[i] > 0.0f)) continue;
    const std::optional<Vec3f> colour = eyes[seen.view[i]].colour(seen.at[i]);
    if (!colour) continue;
    out.colour += seen.weight[i] * *colour;
    sum += seen.weight[i];
  }
  if (!(sum > 0.0f)) return {};
  out.colour /= sum;
  out.confidence = seen.confidence;
  return out;
}

float longest_square(const Vec3f& a, const Vec3f& b, const Vec3f& c) {
  const auto square = [](const Vec3f& v) { return glm::dot(v, v); };
  return std::max({square(b - a), square(c - b), square(a - c)});
}

/// By triangle whether it has an edge beyond \p length.
std::vector<std::uint8_t> large_triangles(const Hull& hull, float length) {
  std::vector<std::uint8_t> large(hull.triangles.size() / 3);
  for (std::size_t f = 0; f < large.size(); ++f) {
    const std::uint32_t* v = &hull.triangles[3 * f];
    large[f] = longest_square(hull.vertices[v[0]], hull.vertices[v[1]], hull.vertices[v[2]]) >
               length * length;
  }
  return large;
}

/// What a vertex is for: nothing; its colour is wanted; it is open, too.
enum Part : std::uint8_t { none, border, open };

/// As fill_samples() says.
std::vector<std::uint8_t> parts_of(const Hull& hull, const std::vector<Sighting>& sightings,
                                   const std::vector<std::uint8_t>& large) {
  constexpr int rings = 3;  // around what is not seen
  std::vector<std::uint8_t> part(sightings.size(), none);
  const auto doubtful = [&](std::uint32_t v) { return sightings[v].confidence < 1.0f; };
  bool any = false;
  for (std::size_t v = 0; v < part.size(); ++v) {
    if (sightings[v].confidence > 0.0f) continue;
    part[v] = open;
    any = true;
  }
  for (std::size_t f = 0; f < large.size(); ++f) {
    if (!large[f]) continue;
    for (std::size_t i = 3 * f; i < 3 * f + 3; ++i)
      part[hull.triangles[i]] = doubtful(hull.triangles[i]) ? open : border;
    any = true;
  }
  if (!any) return part;
  std::vector<std::uint8_t> next;
  for (int ring = 0; ring < rings; ++ring) {
    const bool last = ring == rings - 1;
    next = part;
    for (std::size_t i = 0; i < hull.triangles.size(); i += 3) {
      const std::uint32_t* v = &hull.triangles[i];
      if (part[v[0]] != open && part[v[1]] != open && part[v[2]] != open) continue;
      for (int k = 0; k < 3; ++k)
        if (next[v[k]] != open) next[v[k]] = doubtful(v[k]) && !last ? open : border;
    }
    part.swap(next);
  }
  return part;
}

/// Gives vertices on rims what larger triangles show.
void look_inside(const Hull& hull, const std::vector<Eye>& eyes, const Texturing& texturing,
                 const std::vector<std::uint8_t>& large, std::vector<FillSample>& samples) {
  struct Sum {
    Vec3f colour{0.0f};
    float weight = 0.0f, confidence = 0.0f;
  };
  std::vector<Sum> sums;
  const std::size_t views = eyes.size();
  for (std::size_t f = 0; f < texturing.visible.size(); ++f) {
    const std::uint32_t* v = &hull.triangles[3 * f];
    const auto weak = [&](std::uint32_t i) { return samples[i].confidence < 1.0f; };
    if (texturing.visible[f] == 0 || !large[f] || !(weak(v[0]) || weak(v[1]) || weak(v[2])))
      continue;
    const Vec3f &a = hull.vertices[v[0]], &b = hull.vertices[v[1]], &c = hull.vertices[v[2]];
    const auto weight = [&](std::size_t k) {
      const float* w = texturing.weights.data() + k;
      return texturing.visible[f] >> k & 1
                 ? (w[v[0] * views] + w[v[1] * views] + w[v[2] * views]) / 3.0f
                 : 0.0f;
    };
    const FillSample middle = colour_of(eyes, look(eyes, (a + b + c) / 3.0f, weight));
    if (!(middle.confidence > 0.0f)) continue;
    sums.resize(samples.size());
    for (int i = 0; i < 3; ++i) {
      Sum& sum = sums[v[i]];
      sum.colour += middle.confidence * middle.colour;
      sum.weight += middle.confidence;
      sum.confidence = std::max(sum.confidence, middle.confidence);
    }
  }
  for (std::size_t i = 0; i < sums.size(); ++i)
    if (sums[i].confidence > samples[i].confidence)
      samples[i] = {sums[i].colour / sums[i].weight, sums[i].confidence, samples[i].open};
}

}  // namespace

float mean_pixel_size(const Hull& hull, std::span<const Camera> cameras) {
  if (cameras.empty() || hull.vertices.empty()) return 1.0f;
  Vec3f low = hull.vertices.front(), high = low;
  for (const Vec3f& v : hull.vertices) {
    low = glm::min(low, v);
    high = glm::max(high, v);
  }
  const Vec3 middle = hull.origin + Vec3(0.5f * (low + high));
  double sum = 0.0;
  for (const Camera& camera : cameras)
    sum += glm::distance(camera.centre(), middle) / std::abs(camera.K[0][0]);
  return static_cast<float>(sum / static_cast<double>(cameras.size()));
}

std::vector<FillSample> fill_samples(const Hull& hull, std::span<const Camera> cameras,
                                     std::span<const FillPicture> pictures,
                                     const Texturing& texturing, int threads, bool all) {
  const std::size_t views = cameras.size();
  std::vector<Eye> eyes;
  eyes.reserve(views);
  for (std::size_t k = 0; k < views; ++k)
    eyes.emplace_back(hull, cameras[k], pictures[k],
                      texturing.maps.empty() ? nullptr : &texturing.maps[k]);
  const std::size_t count = hull.vertices.size();
  std::vector<Sighting> sightings(count);
  parallel_each(count, 1024, threads, [&](std::size_t v) {
    const float* weights = texturing.weights.data() + v * views;
    sightings[v] = look(eyes, hull.vertices[v], [&](std::size_t k) { return weights[k]; });
  });
  constexpr float most =
      8.0f;  // pixels; a larger triangle may show its corners' fill when all are seen
  const std::vector<std::uint8_t> large =
      large_triangles(hull, most * mean_pixel_size(hull, cameras));
  const std::vector<std::uint8_t> part = parts_of(hull, sightings, large);
  std::vector<FillSample> samples(count);
  parallel_each(count, 1024, threads, [&](std::size_t v) {
    if (part[v] == none && !all) return;
    samples[v] = colour_of(eyes, sightings[v]);
    samples[v].open = part[v] == open;
  });
  look_inside(hull, eyes, texturing, large, samples);
  // What became certain is so.
  for (FillSample& sample : samples) sample.open = sample.open && sample.confidence < 1.0f;
  return samples;
}

}  // namespace polyhull
