// SPDX-License-Identifier: LGPL-2.1-or-later
#include "texture/colour/colour_memory.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "base/thread_pool.h"
#include "texture/colour/local_motion.h"

namespace polyhull {
namespace {

constexpr float sure = 0.9f;    // a sample that is remembered
constexpr float least = 0.05f;  // the confidence of what is kept

Vec3f unpacked(std::uint32_t rgba) {
  return Vec3f(rgba & 255u, rgba >> 8 & 255u, rgba >> 16 & 255u);
}

std::uint32_t mixed(std::uint32_t before, const Vec3f& colour, float share) {
  const Vec3f codes = unpacked(before) + share * (colour - unpacked(before));
  std::uint32_t out = 0xff000000u;
  for (int c = 0; c < 3; ++c)
    out |= static_cast<std::uint32_t>(std::clamp(codes[c] + 0.5f, 0.0f, 255.0f)) << 8 * c;
  return out;
}

/// What \p views see surely of \p hull, whose vertices have \p samples.
SeenSurface seen_of(const Hull& hull, const ColourViews& views,
                    std::span<const FillSample> samples) {
  SeenSurface now;
  const std::size_t count = views.cameras.size();
  for (std::size_t v = 0; v < samples.size(); ++v) {
    if (samples[v].confidence < sure) continue;
    now.points.add(hull.vertices[v], views.texturing.normals[v], samples[v].colour);
    const float* weights = views.texturing.weights.data() + v * count;
    now.views.push_back(
        static_cast<std::uint8_t>(std::max_element(weights, weights + count) - weights));
  }
  return now;
}

}  // namespace

void ColourMemory::age(std::optional<double> time, double half_life) {
  constexpr double longest = 2.0;  // seconds without a mesh
  if (time && last_ && (*time < *last_ || *time > *last_ + longest)) reset();
  const double step = time && last_ ? *time - *last_ : 1.0 / 25.0;
  last_ = time ? *time : last_.value_or(0.0) + step;
  const auto left = static_cast<float>(half_life > 0.0 ? std::exp2(-step / half_life) : 0.0);
  for (Trace& trace : traces_) {
    trace.confidence *= left;
    trace.hidden += static_cast<float>(step);
  }
  for (Told& told : told_)
    for (double* sum : {&told.points, &told.error, &told.error_without}) *sum *= left;
}

/// Which of told_ is for what was hidden for \p hidden seconds.
std::size_t ColourMemory::span_of(float hidden) {
  return hidden < 0.6f ? 0 : hidden < 1.5f ? 1 : hidden < 4.0f ? 2 : 3;
}

/// By span.
std::array<double, ColourMemory::spans> ColourMemory::trusts() const {
  constexpr double enough = 100.0;  // points
  std::array<double, spans> out{};
  for (std::size_t i = 0; i < out.size(); ++i) {
    const Told& told = told_[i];
    if (told.points >= enough)
      out[i] = std::max(0.0, 1.0 - told.error / std::max(told.error_without, 1e-9));
    else if (i > 0)
      out[i] = 0.7 * out[i - 1];  // until it is known
  }
  return out;
}

/// What a point that is seen again tells of the trust.
void ColourMemory::judge(const Trace& trace, const Vec3f& remembered, const Vec3f& seen) {
  constexpr float long_hidden = 0.3f;  // seconds
  if (trace.hidden < long_hidden || !(trace.fills > 0.0f)) return;
  const Vec3f off = remembered - seen;
  Told& told = told_[span_of(trace.hidden)];
  told.points += 1.0;
  told.error += glm::dot(off, off);
  told.error_without += (trace.filled_square - 2.0f * glm::dot(trace.filled, seen)) / trace.fills +
                        glm::dot(seen, seen);
}

/// Points that are seen take from what is seen. False where next to nothing is where it was.
bool ColourMemory::meet(const SeenSurface& now) {
  constexpr float other = 60.0f;  // codes
  const float close = 3.0f * now.pixel;
  const PointGrid grid(now.points.positions, close);
  std::size_t expected = 0, found = 0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    expected += shown_[i];
    const bool before = shown_[i] != 0;
    shown_[i] = 0;
    Vec3f& place = points_.positions[i];
    const std::uint32_t k =
        nearest_point(grid, now.points.normals, place, points_.normals[i], close, 0.7f);
    if (k == no_point) continue;
    const Vec3f normal = now.points.normals[k];
    const Vec3f on = place - glm::dot(normal, place - now.points.positions[k]) * normal;
    const std::optional<Vec3f> colour = now.shown(now.views[k], on);
    if (!colour) continue;
    const Vec3f off = *colour - points_.colours[i];
    found += before && glm::dot(off, off) < other * other;
    judge(traces_[i], points_.colours[i], *colour);
    shown_[i] = 1;
    place = on;
    points_.normals[i] = glm::normalize(points_.normals[i] + normal);
    points_.colours[i] += (before ? 0.15f : 0.5f) * off;
    traces_[i] = {};
  }
  return 5 * found >= expected;
}

/// Leaves out what is forgotten and what lies too close to others.
void ColourMemory::thin(float pixel) {
  const PointGrid grid(points_.positions, 2.0f * pixel);
  std::vector<std::uint8_t> kept(points_.size());
  for (std::size_t i = 0; i < kept.size(); ++i) kept[i] = traces_[i].confidence >= least;
  for (std::size_t i = 0; i < kept.size(); ++i) {
    if (!kept[i]) continue;
    grid.near(points_.positions[i], 1.2f * pixel, [&](std::uint32_t k, float) {
      if (k > i && shown_[k] == shown_[i] && alike(points_.normals[i], points_.normals[k]))
        kept[k] = 0;
    });
  }
  std::size_t n = 0;
  for (std::size_t i = 0; i < kept.size(); ++i) {
    if (!kept[i]) continue;
    points_.move(i, n);
    traces_[n] = traces_[i];
    shown_[n++] = shown_[i];
  }
  points_.resize(n);
  traces_.resize(n);
  shown_.resize(n);
}

/// What is seen and not known.
void ColourMemory::add(const SeenSurface& now) {
  const PointGrid grid(points_.positions, 2.0f * now.pixel);
  std::vector<std::uint32_t> fresh;
  for (std::uint32_t k = 0; k < now.points.size(); ++k) {
    bool known = false;
    grid.near(now.points.positions[k], 1.8f * now.pixel, [&](std::uint32_t i, float) {
      known = known || (shown_[i] && alike(now.points.normals[k], points_.normals[i]));
    });
    if (!known) fresh.push_back(k);
  }
  fresh.resize(std::min(fresh.size(), most - std::min(most, points_.size())));
  for (const std::uint32_t k : fresh)
    points_.add(now.points.positions[k], now.points.normals[k], now.points.colours[k]);
  traces_.resize(points_.size());
  shown_.resize(points_.size(), 1);
}

/// What is filled in without memory where hidden points are; a quarter of them each time.
void ColourMemory::note(const Hull& hull, std::span<const Vec3f> normals, float pixel,
                        std::span<const std::uint32_t> fill) {
  constexpr std::size_t turns = 4;
  const Vec3f shift(hull.origin - origin_);
  const PointGrid grid(hull.vertices, 8.0f * pixel);
  const std::vector<Vec3f> facing(normals.begin(), normals.end());
  for (std::size_t i = instant_++ % turns; i < points_.size(); i += turns) {
    if (shown_[i]) continue;
    const Vec3f place = points_.positions[i] - shift;
    std::uint32_t v = no_point;
    for (const float radius : {6.0f, 24.0f})
      if (v == no_point)
        v = nearest_point(grid, facing, place, points_.normals[i], radius * pixel, 0.3f);
    // Where nothing of the surface is near, or the silhouettes say that nothing is, it is astray.
    if (v == no_point || glm::dot(normals[v], place - hull.vertices[v]) > 4.0f * pixel)
      traces_[i].confidence *= 0.7f;
    if (v == no_point || fill.empty()) continue;
    const Vec3f colour = unpacked(fill[v]);
    traces_[i].filled += colour;
    traces_[i].filled_square += glm::dot(colour, colour);
    traces_[i].fills += 1.0f;
  }
}

void ColourMemory::recall(const Hull& hull, const ColourViews& views, float pixel,
                          std::span<const FillSample> samples, std::vector<std::uint32_t>& fill) {
  constexpr float beside = 4.0f, behind = 8.0f, reach = 24.0f;  // pixels
  const Vec3f shift(hull.origin - origin_);
  const PointGrid grid(points_.positions, 6.0f * pixel);
  const std::array<double, spans> trust = trusts();
  const auto sureness = [&](const Trace& trace) {
    return trace.confidence * static_cast<float>(trust[span_of(trace.hidden)]);
  };
  std::atomic<std::size_t> vertices = 0;
  parallel_each(samples.size(), 256, views.threads, [&](std::size_t v) {
    if (!samples[v].open) return;
    const Vec3f place = hull.vertices[v] + shift, normal = views.texturing.normals[v];
    std::uint32_t nearest = no_point;
    for (const float radius : {0.25f * reach, reach})
      if (nearest == no_point)
        nearest = nearest_point(grid, points_.normals, place, normal, radius * pixel, 0.3f);
    if (nearest == no_point) return;
    // Beside what is remembered nothing is known; before or behind it, where a guessed surface bulges,
    // what was seen there is known, and the less where the deeper it lies.
    const Vec3f way = (points_.positions[nearest] - place) / pixel;
    const float deep = glm::dot(way, normal), wide = 2.0f + 0.8f * std::abs(deep);
    Vec3f colour(0.0f);
    float weight = 0.0f, confidence = 0.0f;
    grid.near(place, (glm::length(way) + wide) * pixel, [&](std::uint32_t i, float square) {
      if (!alike(points_.normals[i], normal)) return;
      const float height = glm::dot(place - points_.positions[i], normal) / pixel;
      const float aside = square / (pixel * pixel) - height * height;
      const float own = traces_[i].confidence * std::exp(-aside / (wide * wide));
      colour += own * points_.colours[i];
      weight += own;
      confidence = std::max(
          confidence, sureness(traces_[i]) * std::exp(-aside / (beside * beside + wide * wide) -
                                                      height * height / (behind * behind)));
    });
    if (!(weight > 0.0f)) return;
    const float share = confidence * (1.0f - samples[v].confidence);
    fill[v] = mixed(fill[v], colour / weight, share);
    vertices += share >= 0.5f;
  });
  statistics_.vertices = vertices;
}

void ColourMemory::update(const Hull& hull, const ColourViews& views, std::optional<double> time,
                          double half_life, std::vector<std::uint32_t>& fill) {
  age(time, half_life);
  statistics_ = {};
  const float pixel = mean_pixel_size(hull, views.cameras);
  if (hull.empty() || !(pixel > 0.0f)) return;
  const std::vector<FillSample> samples =
      fill_samples(hull, views.cameras, views.pictures, views.texturing, views.threads, true);
  if (points_.size() == 0) origin_ = hull.origin;
  std::vector<Eye> eyes;
  for (std::size_t k = 0; k < views.cameras.size(); ++k)
    eyes.emplace_back(hull, views.cameras[k], views.pictures[k],
                      views.texturing.maps.empty() ? nullptr : &views.texturing.maps[k]);
  SeenSurface now = seen_of(hull, views, samples);
  now.shift = Vec3f(hull.origin - origin_);
  for (Vec3f& place : now.points.positions) place += now.shift;
  now.eyes = eyes;
  now.pixel = pixel;
  carry(points_, shown_, now, views.threads);
  if (!meet(now)) {
    const std::optional<double> last = last_;
    reset();
    last_ = last;
    origin_ = hull.origin - Vec3(now.shift);
  }
  thin(pixel);
  add(now);
  statistics_.points = points_.size();
  Told all;
  for (const Told& told : told_)
    all = {all.points + told.points, all.error + told.error,
           all.error_without + told.error_without};
  if (all.points > 0.0) {
    statistics_.error = std::sqrt(all.error / all.points / 3.0);
    statistics_.error_without = std::sqrt(std::max(all.error_without, 0.0) / all.points / 3.0);
  }
  statistics_.trust = trusts().back();
  note(hull, views.texturing.normals, pixel, fill);
  if (!fill.empty() && statistics_.trust > 0.0) recall(hull, views, pixel, samples, fill);
}

}  // namespace polyhull
