// SPDX-License-Identifier: LGPL-2.1-or-later
#include "texture/fill_colours.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

namespace polyhull {
namespace {

std::uint32_t packed(const Vec3f& colour) {
  const auto byte = [](float code) {  // 0 for NaN
    return static_cast<std::uint32_t>(code > 0.0f ? std::min(code + 0.5f, 255.0f) : 0.0f);
  };
  return byte(colour.x) | byte(colour.y) << 8 | byte(colour.z) << 16 | 0xff000000u;
}

/// Of all samples, by their confidence; \p otherwise where there is none.
Vec3f mean_colour(const std::vector<FillSample>& samples, const Vec3f& otherwise) {
  Vec3 sum(0.0);
  double weight = 0.0;
  for (const FillSample& s : samples) {
    sum += Vec3(s.confidence * s.colour);
    weight += s.confidence;
  }
  return weight > 0.0 ? Vec3f(sum / weight) : otherwise;
}

}  // namespace

/// Lists the open vertices and their neighbours; no edge counts as shorter than \p shortest.
void FillColours::link(const Hull& hull, const Texturing& texturing, float shortest) {
  open_.clear();
  number_.assign(samples_.size(), -1);
  for (std::size_t v = 0; v < samples_.size(); ++v) {
    if (!samples_[v].open) continue;
    number_[v] = static_cast<std::int32_t>(open_.size());
    open_.push_back({static_cast<std::uint32_t>(v), 0});
  }
  if (open_.empty()) return;
  open_.push_back({});
  // Each edge of a closed mesh is met twice, once in either direction.
  const auto each_edge = [&](const auto& use) {
    for (std::size_t i = 0; i < hull.triangles.size(); ++i) {
      const std::int32_t n = number_[hull.triangles[i]];
      if (n >= 0) use(static_cast<std::size_t>(n), hull.triangles[i % 3 == 2 ? i - 2 : i + 1]);
    }
  };
  each_edge([&](std::size_t n, std::uint32_t to) { open_[n + 1].first_edge += number_[to] >= 0; });
  for (std::size_t n = 0; n + 1 < open_.size(); ++n) open_[n + 1].first_edge += open_[n].first_edge;
  edges_.resize(open_.back().first_edge);
  std::vector<std::uint32_t> next;
  for (const Open& open : open_) next.push_back(open.first_edge);
  each_edge([&](std::size_t n, std::uint32_t to) {
    Open& open = open_[n];
    const FillSample& other = samples_[to];
    if (number_[to] < 0 && !(other.confidence > 0.0f)) return;
    const float length = glm::distance(hull.vertices[open.vertex], hull.vertices[to]);
    const float alike =
        std::max(glm::dot(texturing.normals[open.vertex], texturing.normals[to]), 0.1f);
    const float weight = alike * alike / std::max(length, shortest);
    if (number_[to] >= 0) {
      edges_[next[n]++] = {static_cast<std::uint32_t>(number_[to]), weight};
      return;
    }
    open.given += weight * other.colour;
    open.given_weight += weight;
    if (!(weight > open.nearest_weight)) return;
    open.nearest_weight = weight;
    open.nearest = other.colour;
  });
}

/// Dijkstra's shortest ways from all samples at once.
void FillColours::take_nearest(float doubt) {
  const std::size_t count = open_.size() - 1;
  std::vector<float> way(count, std::numeric_limits<float>::infinity());
  using Entry = std::pair<float, std::uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  const auto offer = [&](std::uint32_t n, float length, const Vec3f& colour) {
    if (!(length < way[n])) return;
    way[n] = length;
    colours_[n] = colour;
    has_[n] = 1;
    queue.emplace(length, n);
  };
  for (std::uint32_t n = 0; n < count; ++n) {
    const Open& open = open_[n];
    const FillSample& own = samples_[open.vertex];
    if (own.confidence > 0.0f) offer(n, doubt * (1.0f - own.confidence), own.colour);
    if (open.nearest_weight > 0.0f) offer(n, 1.0f / open.nearest_weight, open.nearest);
  }
  while (!queue.empty()) {
    const auto [length, n] = queue.top();
    queue.pop();
    if (length > way[n]) continue;
    for (std::uint32_t e = open_[n].first_edge; e < open_[n + 1].first_edge; ++e)
      offer(edges_[e].to, length + 1.0f / edges_[e].weight, colours_[n]);
  }
}

/// Ring by ring from what has a sample: each takes the mean of the neighbours that have a colour.
void FillColours::take_means() {
  const auto count = static_cast<std::uint32_t>(open_.size() - 1);
  order_.clear();
  for (std::uint32_t n = 0; n < count; ++n) {
    const Open& open = open_[n];
    const FillSample& own = samples_[open.vertex];
    if (own.confidence > 0.0f)
      colours_[n] = own.colour;
    else if (open.given_weight > 0.0f)
      colours_[n] = open.given / open.given_weight;
    else
      continue;
    has_[n] = 1;
    order_.push_back(n);
  }
  for (std::size_t i = 0; i < order_.size(); ++i) {
    const std::uint32_t from = order_[i];
    for (std::uint32_t e = open_[from].first_edge; e < open_[from + 1].first_edge; ++e) {
      const std::uint32_t n = edges_[e].to;
      if (has_[n]) continue;
      Vec3f sum(0.0f);
      float weight = 0.0f;
      for (std::uint32_t other = open_[n].first_edge; other < open_[n + 1].first_edge; ++other) {
        if (!has_[edges_[other].to]) continue;
        sum += edges_[other].weight * colours_[edges_[other].to];
        weight += edges_[other].weight;
      }
      colours_[n] = weight > 0.0f ? sum / weight : colours_[from];
      has_[n] = 1;
      order_.push_back(n);
    }
  }
}

void FillColours::relax() {
  constexpr int sweeps = 16;
  constexpr float over = 1.6f;
  constexpr float still = 0.5f;  // codes
  // What does not change: the weights' sums and what is given, both ready for use.
  std::vector<glm::vec4> fixed(open_.size());  // given, and 1 / sum
  for (const std::uint32_t n : order_) {
    const Open& open = open_[n];
    float weight = open.given_weight;
    for (std::uint32_t e = open.first_edge; e < open_[n + 1].first_edge; ++e)
      weight += edges_[e].weight;
    const FillSample& own = samples_[open.vertex];
    const float c = own.confidence;
    const float hold = c * c * c / (1.0f - c) * weight;
    const float sum = weight + hold;
    fixed[n] = glm::vec4(open.given + hold * own.colour, sum > 0.0f ? 1.0f / sum : 0.0f);
  }
  using Float4 = float __attribute__((vector_size(16)));
  std::vector<Float4> colours(colours_.size());  // all channels at a time
  for (std::size_t n = 0; n < colours.size(); ++n)
    colours[n] = Float4{colours_[n].x, colours_[n].y, colours_[n].z, 0.0f};
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    Float4 most{};
    for (std::size_t i = 0; i < order_.size(); ++i) {
      const std::uint32_t n = order_[sweep % 2 == 0 ? i : order_.size() - 1 - i];
      const glm::vec4& start = fixed[n];
      if (!(start.w > 0.0f)) continue;
      Float4 sum{start.x, start.y, start.z, 0.0f};
      for (std::uint32_t e = open_[n].first_edge; e < open_[n + 1].first_edge; ++e)
        sum += edges_[e].weight * colours[edges_[e].to];
      const Float4 change = sum * start.w - colours[n];
      colours[n] += over * change;
      const Float4 size = change < 0.0f ? -change : change;
      most = size > most ? size : most;
    }
    if (std::max({most[0], most[1], most[2]}) < still) break;
  }
  for (const std::uint32_t n : order_)
    colours_[n] = Vec3f(colours[n][0], colours[n][1], colours[n][2]);
}

std::vector<std::uint32_t> FillColours::find(const Hull& hull, std::span<const Camera> cameras,
                                             std::span<const FillPicture> pictures,
                                             const Texturing& texturing,
                                             const TextureSettings& settings) {
  if (settings.fill == TextureFill::grey || hull.empty()) return {};
  samples_ = fill_samples(hull, cameras, pictures, texturing, settings.threads);
  const float pixel = mean_pixel_size(hull, cameras);
  link(hull, texturing, 1e-3f * pixel);
  if (open_.empty()) return {};
  const Vec3f mean = mean_colour(samples_, 255.0f * texturing.untextured);
  colours_.assign(open_.size() - 1, mean);
  has_.assign(colours_.size(), 0);
  constexpr float doubt = 24.0f;  // pixels
  if (settings.fill == TextureFill::nearest) {
    take_nearest(doubt * pixel);
  } else {
    take_means();
    relax();
  }
  std::vector<std::uint32_t> out(samples_.size());
  for (std::size_t v = 0; v < out.size(); ++v)
    out[v] = packed(number_[v] >= 0                 ? colours_[static_cast<std::size_t>(number_[v])]
                    : samples_[v].confidence > 0.0f ? samples_[v].colour
                                                    : mean);
  return out;
}

}  // namespace polyhull
