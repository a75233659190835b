// SPDX-License-Identifier: LGPL-2.1-or-later
#include "texture/colour/colour_pairs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/thread_pool.h"
#include "texture/eye.h"

namespace polyhull {
namespace {

constexpr std::size_t wanted = 4096;  // places

/// A point of the surface.
struct Place {
  std::uint32_t triangle;
  Vec3f corners;  ///< its barycentric coordinates
};

/// As many as wanted, one to each of as many equal parts of the area; where in its triangle a
/// sequence of low discrepancy says (Roberts 2018: the plastic number's powers).
std::vector<Place> places_on(const Hull& hull) {
  const std::size_t count = hull.triangles.size() / 3;
  std::vector<double> ends(count);
  double total = 0.0;
  for (std::size_t f = 0; f < count; ++f) {
    const std::uint32_t* v = &hull.triangles[3 * f];
    const Vec3f& a = hull.vertices[v[0]];
    total += glm::length(glm::cross(hull.vertices[v[1]] - a, hull.vertices[v[2]] - a));
    ends[f] = total;
  }
  std::vector<Place> places;
  if (!(total > 0.0)) return places;
  places.reserve(wanted);
  std::size_t f = 0;
  for (std::size_t i = 0; i < wanted; ++i) {
    const double at = (static_cast<double>(i) + 0.5) / wanted * total;
    while (f + 1 < count && ends[f] < at) ++f;
    double u = std::fmod(0.7548776662466927 * static_cast<double>(i), 1.0);
    double v = std::fmod(0.5698402909980532 * static_cast<double>(i), 1.0);
    if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
    places.push_back({static_cast<std::uint32_t>(f), Vec3f(1.0 - u - v, u, v)});
  }
  return places;
}

/// What the views that see a place best see there, logarithms of linear light.
struct Seen {
  static constexpr int most = 4;
  int count = 0;
  std::array<std::uint32_t, most> view{};
  std::array<float, most> cosine{};
  std::array<Vec3f, most> light{};

  void offer(std::uint32_t k, float c, const Vec3f& value) {
    int at = std::min(count, most - 1);
    if (count == most && !(c > cosine[at])) return;
    for (; at > 0 && c > cosine[at - 1]; --at) {
      view[at] = view[at - 1];
      cosine[at] = cosine[at - 1];
      light[at] = light[at - 1];
    }
    view[at] = k;
    cosine[at] = c;
    light[at] = value;
    count = std::min(count + 1, most);
  }
};

/// No number where a channel says nothing of the light: too dark to have a ratio, or clipped.
Vec3f log_light(const Vec3f& codes) {
  constexpr float darkest = 12.0f, brightest = 245.0f;
  Vec3f out(std::numeric_limits<float>::quiet_NaN());
  for (int c = 0; c < 3; ++c)
    if (codes[c] >= darkest && codes[c] <= brightest)
      out[c] = std::log(srgb_decoded(codes[c] / 255.0f));
  return out;
}

Seen look_at(const Hull& hull, const Place& place, const std::vector<Eye>& eyes,
             const std::vector<Vec3f>& centres, const Texturing& texturing) {
  constexpr float flattest = 0.25f;  // cosine: beyond 75 degrees a pixel spans too much
  constexpr float least_fade = 0.1f;
  const std::uint32_t* v = &hull.triangles[3 * place.triangle];
  Vec3f point(0.0f), normal(0.0f);
  for (int i = 0; i < 3; ++i) {
    point += place.corners[i] * hull.vertices[v[i]];
    normal += place.corners[i] * texturing.normals[v[i]];
  }
  normal /= std::max(glm::length(normal), 1e-6f);
  Seen seen;
  for (std::size_t k = 0; k < eyes.size(); ++k) {
    if (!(texturing.visible[place.triangle] >> k & 1)) continue;
    const Vec3f way = centres[k] - point;
    const float cosine = glm::dot(normal, way) / glm::length(way);
    Vec2f at;
    if (!(cosine > flattest) || !(eyes[k].look(point, at) > least_fade)) continue;
    const std::optional<Vec3f> codes = eyes[k].colour(at);
    if (codes) seen.offer(static_cast<std::uint32_t>(k), cosine, log_light(*codes));
  }
  return seen;
}

/// The mean of the middle half of \p values, which are put in order, and how sure it is.
void judge(std::vector<float>& values, double& mean, double& weight) {
  constexpr double finest = 0.03;  // no pictures agree better
  std::sort(values.begin(), values.end());
  const std::size_t first = values.size() / 4, last = values.size() - first;
  double sum = 0.0;
  for (std::size_t i = first; i < last; ++i) sum += values[i];
  mean = sum / static_cast<double>(last - first);
  const double spread = 0.74 * (values[last - 1] - values[first]);  // a normal one's deviation
  weight = static_cast<double>(values.size()) / (spread * spread + finest * finest);
}

}  // namespace

std::vector<ColourPair> colour_pairs(const Hull& hull, const ColourViews& views) {
  const std::size_t count = views.cameras.size();
  std::vector<Eye> eyes;
  std::vector<Vec3f> centres;
  for (std::size_t k = 0; k < count; ++k) {
    eyes.emplace_back(hull, views.cameras[k], views.pictures[k],
                      views.texturing.maps.empty() ? nullptr : &views.texturing.maps[k]);
    centres.emplace_back(views.cameras[k].centre() - hull.origin);
  }
  const std::vector<Place> places = places_on(hull);
  std::vector<Seen> seen(places.size());
  parallel_each(places.size(), 256, views.threads, [&](std::size_t i) {
    seen[i] = look_at(hull, places[i], eyes, centres, views.texturing);
  });
  std::vector<std::array<std::vector<float>, 3>> ratios(count * count);
  for (const Seen& s : seen)
    for (int i = 0; i < s.count; ++i)
      for (int j = 0; j < s.count; ++j)
        if (s.view[i] < s.view[j])
          for (int c = 0; c < 3; ++c)
            if (const float ratio = s.light[i][c] - s.light[j][c]; std::isfinite(ratio))
              ratios[s.view[i] * count + s.view[j]][c].push_back(ratio);
  constexpr std::size_t fewest = 8;
  std::vector<ColourPair> pairs;
  for (std::size_t at = 0; at < ratios.size(); ++at) {
    ColourPair pair{at / count, at % count};
    for (int c = 0; c < 3; ++c)
      if (ratios[at][c].size() >= fewest) judge(ratios[at][c], pair.ratio[c], pair.weight[c]);
    if (pair.weight != Vec3(0.0)) pairs.push_back(pair);
  }
  return pairs;
}

}  // namespace polyhull
