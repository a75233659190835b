// SPDX-License-Identifier: LGPL-2.1-or-later
#include "texture/align/align.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <mutex>
#include <numbers>
#include <utility>

#include "base/thread_pool.h"
#include "texture/eye.h"

namespace polyhull {
namespace {

constexpr double widest = 110.0 * std::numbers::pi / 180.0;  // between views that are compared

/// The least (or the largest) of 3 x 3.
template <typename Less>
std::vector<std::uint16_t> least_around(const std::vector<std::uint16_t>& in, int width, int height,
                                        const Less& less) {
  std::vector<std::uint16_t> rows(in.size()), out(in.size());
  for (int y = 0; y < height; ++y) {
    const std::size_t row = static_cast<std::size_t>(y) * width;
    for (int x = 0; x < width; ++x)
      rows[row + x] = std::min(
          {in[row + std::max(x - 1, 0)], in[row + x], in[row + std::min(x + 1, width - 1)]}, less);
  }
  for (int y = 0; y < height; ++y) {
    const std::size_t row = static_cast<std::size_t>(y) * width;
    const std::size_t above = static_cast<std::size_t>(std::max(y - 1, 0)) * width;
    const std::size_t below = static_cast<std::size_t>(std::min(y + 1, height - 1)) * width;
    for (int x = 0; x < width; ++x)
      out[row + x] = std::min({rows[above + x], rows[row + x], rows[below + x]}, less);
  }
  return out;
}

/// The mean of the pixels around a place, the nearer the more; by how much the matte holds them.
struct Mean {
  Vec3f colour{0.0f};
  float covered = 0.0f;
};

Mean mean_around(const FillPicture& picture, const Vec2& at, float reach) {
  Mean out;
  const Rectangle& roi = picture.roi;
  const auto px = static_cast<float>(at.x - roi.x), py = static_cast<float>(at.y - roi.y);
  const auto end_x = static_cast<float>(roi.width - 1), end_y = static_cast<float>(roi.height - 1);
  if (!(px >= reach && py >= reach && px + reach <= end_x && py + reach <= end_y)) return out;
  const int x0 = static_cast<int>(std::ceil(px - reach)), x1 = static_cast<int>(px + reach);
  const int y0 = static_cast<int>(std::ceil(py - reach)), y1 = static_cast<int>(py + reach);
  float all = 0.0f;
  for (int y = y0; y <= y1; ++y) {
    const std::uint8_t* from =
        picture.pixels.data() + static_cast<std::ptrdiff_t>(y) * picture.stride + 4 * x0;
    const float wy = reach - std::abs(static_cast<float>(y) - py);
    for (int x = x0; x <= x1; ++x, from += 4) {
      const float w = wy * (reach - std::abs(static_cast<float>(x) - px));
      all += w;
      const float own = from[3] >= 250 ? w : 0.0f;  // a matte without background in it
      out.covered += own;
      for (int c = 0; c < 3; ++c) out.colour[c] += own * from[c];
    }
  }
  if (!(out.covered > 0.0f)) return out;
  out.colour /= out.covered;
  out.covered /= all;
  return out;
}

/// Unit vector from the hull's middle to the camera.
Vec3 direction_to(const Camera& camera, const Vec3& middle) {
  const Vec3 way = camera.centre() - middle;
  const double length = glm::length(way);
  return length > 0.0 ? way / length : Vec3(0.0);
}

Vec3 middle_of(const Hull& hull) {
  Vec3f low = hull.vertices.front(), high = low;
  for (const Vec3f& v : hull.vertices) {
    low = glm::min(low, v);
    high = glm::max(high, v);
  }
  return hull.origin + Vec3(0.5f * (low + high));
}

}  // namespace

/// The map's contents as they are needed here.
void PictureAligner::sample(const Camera& camera, const FillPicture& picture,
                            const OcclusionMap& map, Grid& grid) {
  constexpr int coarser = PictureFlow::coarser;
  grid.camera = camera;
  grid.image.resize(map.width > 0 ? (map.width + coarser - 1) / coarser : 0,
                    map.width > 0 ? (map.height + coarser - 1) / coarser : 0);
  grid.depth.assign(grid.image.texels(), 0.0f);
  grid.sees = false;
  if (grid.image.texels() == 0 || picture.pixels.empty()) return;
  grid.x = map.x;
  grid.y = map.y;
  grid.step = coarser * map.step;
  grid.tolerance = 3.0 * map.step * map.near / camera.K[0][0] + 0.002 * (map.far - map.near);
  // The map has the farthest of 3 x 3 depths: the nearest of 3 x 3 of these is the surface again.
  const std::vector<std::uint16_t> depth =
      least_around(map.depth, map.width, map.height, std::less<>());
  const float unit = (map.far - map.near) / 65534.0f;
  const bool distorted = camera.has_distortion();
  const auto reach = static_cast<float>(std::max(grid.step, 1.0));
  const bool coloured = picture.colour != Mat3f(1.0f);
  for (int y = 1; y < grid.image.height - 1; ++y) {
    for (int x = 1; x < grid.image.width - 1; ++x) {
      const std::size_t texel = static_cast<std::size_t>(coarser * y) * map.width + coarser * x;
      if (map.fade[texel] == 0 || depth[texel] == 65535) continue;
      const Vec2 ideal(grid.x + x * grid.step, grid.y + y * grid.step);
      const Mean mean = mean_around(picture, distorted ? camera.distort(ideal) : ideal, reach);
      const std::size_t i = static_cast<std::size_t>(y) * grid.image.width + x;
      const Vec3f colour = coloured ? with_colour(mean.colour, picture.colour) : mean.colour;
      for (int c = 0; c < 3; ++c) grid.image.channel[c][i] = colour[c];
      grid.image.weight[i] = mean.covered * static_cast<float>(map.fade[texel]) / 255.0f;
      grid.sees = grid.sees || grid.image.weight[i] > 0.0f;
      grid.depth[i] = map.near + static_cast<float>(depth[texel]) * unit;
    }
  }
}

/// The other's picture seen through the surface; false: next to nothing of it.
bool PictureAligner::reproject(const Grid& grid, const Grid& other, FlowImage& out) {
  const Camera &camera = grid.camera, &other_camera = other.camera;
  const FlowImage& own = grid.image;
  const FlowImage& theirs = other.image;
  out.resize(own.width, own.height);
  const Mat3 turn = other_camera.R * glm::transpose(camera.R);
  const Mat3 to_other = other_camera.K * turn * glm::inverse(camera.K);
  const Vec3 shift = other_camera.K * (other_camera.t - turn * camera.t);
  std::size_t count = 0;
  for (int y = 1; y < own.height - 1; ++y) {
    for (int x = 1; x < own.width - 1; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * own.width + x;
      if (!(own.weight[i] > 0.0f)) continue;
      const Vec3 pixel(grid.x + x * grid.step, grid.y + y * grid.step, 1.0);
      const Vec3 p = static_cast<double>(grid.depth[i]) * (to_other * pixel) + shift;
      if (!(p.z > 0.0)) continue;
      const auto tx = static_cast<float>((p.x / p.z - other.x) / other.step);
      const auto ty = static_cast<float>((p.y / p.z - other.y) / other.step);
      if (!(tx >= 0.0f && ty >= 0.0f && tx < static_cast<float>(theirs.width - 1) &&
            ty < static_cast<float>(theirs.height - 1)))
        continue;
      const int ix = static_cast<int>(tx), iy = static_cast<int>(ty);
      const float ax = tx - static_cast<float>(ix), ay = ty - static_cast<float>(iy);
      const std::size_t at = static_cast<std::size_t>(iy) * theirs.width + ix;
      const std::size_t four[] = {at, at + 1, at + theirs.width, at + theirs.width + 1};
      const float share[] = {(1.0f - ax) * (1.0f - ay), ax * (1.0f - ay), (1.0f - ax) * ay,
                             ax * ay};
      float weight = 0.0f, least = 1.0f, depth = 0.0f;
      for (int k = 0; k < 4; ++k) {
        weight += share[k] * theirs.weight[four[k]];
        least = std::min(least, theirs.weight[four[k]]);
        depth += share[k] * other.depth[four[k]];
      }
      if (!(least > 0.0f) || std::abs(p.z - depth) > other.tolerance) continue;
      for (int c = 0; c < 3; ++c)
        for (int k = 0; k < 4; ++k) out.channel[c][i] += share[k] * theirs.channel[c][four[k]];
      out.weight[i] = std::min(own.weight[i], weight);
      ++count;
    }
  }
  return count >= 64;
}

PictureFlow PictureAligner::compare(const Pair& pair, const Grid& grid, const Grid& other,
                                    FlowFinder& finder) {
  PictureFlow out;
  const FlowImage& own = grid.image;
  FlowImage seen;
  if (own.texels() == 0 || other.image.texels() == 0 || !reproject(grid, other, seen)) return out;
  constexpr float unit = PictureFlow::unit / PictureFlow::coarser;  // grid texels
  Flow flow;
  finder.find(own, seen, 127.0f * unit, flow);
  out.view = pair.view;
  out.other = pair.other;
  out.width = own.width;
  out.height = own.height;
  out.offsets.resize(2 * own.texels());
  const auto rounded = [](float d) { return static_cast<std::int8_t>(std::lround(d / unit)); };
  for (std::size_t t = 0; t < own.texels(); ++t) {
    out.offsets[2 * t] = rounded(flow.dx[t]);
    out.offsets[2 * t + 1] = rounded(flow.dy[t]);
  }
  return out;
}

/// Each view with those nearest to it by angle.
std::vector<PictureAligner::Pair> PictureAligner::pairs_of(const Hull& hull) const {
  const Vec3 middle = middle_of(hull);
  std::vector<Vec3> directions;
  for (const Grid& grid : grids_) directions.push_back(direction_to(grid.camera, middle));
  const double least = std::cos(widest);
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < grids_.size(); ++i) {
    std::vector<std::pair<double, int>> others;
    for (std::size_t j = 0; j < grids_.size(); ++j) {
      const double cosine = glm::dot(directions[i], directions[j]);
      if (j != i && grids_[i].sees && grids_[j].sees && cosine > least)
        others.push_back({-cosine, static_cast<int>(j)});
    }
    std::sort(others.begin(), others.end());
    for (std::size_t n = 0; n < others.size() && n < PictureFlow::most_of_view; ++n)
      pairs.push_back({static_cast<int>(i), others[n].second});
  }
  return pairs;
}

std::vector<PictureFlow> PictureAligner::find(const Hull& hull, std::span<const Camera> cameras,
                                              std::span<const FillPicture> pictures,
                                              const Texturing& texturing, int threads) {
  statistics_ = {};
  const std::size_t views = cameras.size();
  if (texturing.maps.size() != views || hull.vertices.empty()) return {};
  std::swap(grids_, last_grids_);
  grids_.resize(views);
  std::vector<std::uint8_t> same(views, 0);
  parallel_each(views, 1, threads, [&](std::size_t k) {
    sample(cameras[k], pictures[k], texturing.maps[k], grids_[k]);
    same[k] = k < last_grids_.size() && grids_[k] == last_grids_[k];
  });
  std::vector<Pair> pairs = pairs_of(hull);
  const bool same_pairs = pairs == pairs_;
  pairs_.swap(pairs);
  found_.resize(pairs_.size());
  std::mutex mutex;  // of finders_
  const auto reused = [&](const Pair& pair) {
    return same_pairs && same[pair.view] && same[pair.other];
  };
  parallel_for(pairs_.size(), 1, threads, [&](std::size_t begin, std::size_t end) {
    std::unique_ptr<FlowFinder> finder;
    {
      const std::lock_guard lock(mutex);
      if (!finders_.empty()) {
        finder = std::move(finders_.back());
        finders_.pop_back();
      }
    }
    if (!finder) finder = std::make_unique<FlowFinder>();
    for (std::size_t n = begin; n < end; ++n)
      if (!reused(pairs_[n]))
        found_[n] = compare(pairs_[n], grids_[pairs_[n].view], grids_[pairs_[n].other], *finder);
    const std::lock_guard lock(mutex);
    finders_.push_back(std::move(finder));
  });
  std::vector<PictureFlow> flows;
  for (const PictureFlow& flow : found_)
    if (std::any_of(flow.offsets.begin(), flow.offsets.end(), [](int d) { return d != 0; }))
      flows.push_back(flow);
  statistics_.flows = flows.size();
  statistics_.pairs = pairs_.size();
  statistics_.pairs_reused =
      static_cast<std::uint64_t>(std::count_if(pairs_.begin(), pairs_.end(), reused));
  return flows;
}

}  // namespace polyhull
