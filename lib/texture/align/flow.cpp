// SPDX-License-Identifier: LGPL-2.1-or-later
#include "texture/align/flow.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "texture/align/flow_loops.h"

namespace polyhull {
namespace {

// Of squared codes per texel.
constexpr float smoothness = 20.0f;
constexpr float rest_inside = 0.5f, rest_outside = 20.0f;
constexpr int steps = 2, relaxations = 8;  // on each level
constexpr int smallest = 16;  // texels of the shorter side of the coarsest level, at least

FlowPicture picture_of(const FlowImage& image) {
  return {{image.channel[0].data(), image.channel[1].data(), image.channel[2].data()},
          image.weight.data()};
}

float clamped(float value, float most) {
  return std::clamp(value, -most, most);
}

}  // namespace

void FlowImage::resize(int across, int down) {
  width = across;
  height = down;
  for (auto& values : channel) values.assign(texels(), 0.0f);
  weight.assign(texels(), 0.0f);
}

/// Each texel the mean of four by their weights; the last of an odd number is left out.
void FlowFinder::halve(const FlowImage& from, FlowImage& to) {
  to.resize((from.width + 1) / 2, (from.height + 1) / 2);
  for (int y = 0; 2 * y + 1 < from.height; ++y) {
    for (int x = 0; 2 * x + 1 < from.width; ++x) {
      const std::size_t i = static_cast<std::size_t>(2 * y) * from.width + 2 * x;
      const std::size_t four[] = {i, i + 1, i + from.width, i + from.width + 1};
      float sum[3] = {}, weight = 0.0f;
      for (const std::size_t j : four) {
        weight += from.weight[j];
        for (int c = 0; c < 3; ++c) sum[c] += from.weight[j] * from.channel[c][j];
      }
      const std::size_t out = static_cast<std::size_t>(y) * to.width + x;
      const bool rim = x == 0 || y == 0 || x >= to.width - 1 || y >= to.height - 1;
      if (rim || !(weight > 0.0f)) continue;
      for (int c = 0; c < 3; ++c) to.channel[c][out] = sum[c] / weight;
      to.weight[out] = 0.25f * weight;
    }
  }
}

/// The coarser level's flow as the finer one's first guess.
void FlowFinder::begin(const Flow& coarse, int coarse_width, int coarse_height,
                       const FlowImage& level) {
  flow_.dx.assign(level.texels(), 0.0f);
  flow_.dy.assign(level.texels(), 0.0f);
  if (coarse_width == 0) return;
  for (int y = 1; y < level.height - 1; ++y) {
    // Texel i of the coarser level lies between 2 i and 2 i + 1.
    const float py = std::clamp(0.5f * static_cast<float>(y) - 0.25f, 0.0f,
                                static_cast<float>(coarse_height) - 1.001f);
    const int iy = static_cast<int>(py);
    const float ay = py - static_cast<float>(iy);
    for (int x = 1; x < level.width - 1; ++x) {
      const float px = std::clamp(0.5f * static_cast<float>(x) - 0.25f, 0.0f,
                                  static_cast<float>(coarse_width) - 1.001f);
      const int ix = static_cast<int>(px);
      const float ax = px - static_cast<float>(ix);
      const std::size_t at = static_cast<std::size_t>(iy) * coarse_width + ix;
      const auto mixed = [&](const std::vector<float>& v) {
        const float up = v[at] + (v[at + 1] - v[at]) * ax;
        const float down =
            v[at + coarse_width] + (v[at + coarse_width + 1] - v[at + coarse_width]) * ax;
        return 2.0f * (up + (down - up) * ay);
      };
      const std::size_t i = static_cast<std::size_t>(y) * level.width + x;
      flow_.dx[i] = mixed(coarse.dx);
      flow_.dy[i] = mixed(coarse.dy);
    }
  }
}

/// Linearises at flow_ and solves.
void FlowFinder::step(const FlowImage& a, const FlowImage& b) {
  const FlowLoops& loops = FlowLoops::best();
  const int width = a.width, height = a.height;
  const std::size_t texels = a.texels();
  moved_.resize(width, height);
  float* const moved[3] = {moved_.channel[0].data(), moved_.channel[1].data(),
                           moved_.channel[2].data()};
  loops.warp(picture_of(a), b.weight.data(), width, height, flow_.dx.data(), flow_.dy.data(), moved,
             moved_.weight.data());
  FlowEquations equations;
  for (int k = 0; k < FlowEquations::count; ++k) {
    equations_[k].assign(texels, 0.0f);
    equations.of[k] = equations_[k].data();
  }
  const float* const from[3] = {moved[0], moved[1], moved[2]};
  loops.equations(from, moved_.weight.data(), picture_of(b), width, height, equations);
  room_.assign(texels, 0.0f);
  for (int k = 0; k < FlowEquations::count; ++k)
    for (int twice = 0; twice < 2; ++twice)
      loops.smooth(equations.of[k], width, height, room_.data(), equations.of[k]);

  rest_.resize(texels);
  target_x_.resize(texels);
  target_y_.resize(texels);
  for (std::size_t i = 0; i < texels; ++i) {
    const float dx = flow_.dx[i], dy = flow_.dy[i];
    target_x_[i] = equations.of[0][i] * dx + equations.of[1][i] * dy + equations.of[3][i];
    target_y_[i] = equations.of[1][i] * dx + equations.of[2][i] * dy + equations.of[4][i];
    rest_[i] = rest_inside + rest_outside * (1.0f - moved_.weight[i]);
  }
  next_x_.assign(texels, 0.0f);
  next_y_.assign(texels, 0.0f);
  for (int i = 0; i < relaxations; ++i) {
    loops.relax(equations, target_x_.data(), target_y_.data(), rest_.data(), smoothness, width,
                height, flow_.dx.data(), flow_.dy.data(), next_x_.data(), next_y_.data());
    std::swap(flow_.dx, next_x_);
    std::swap(flow_.dy, next_y_);
  }
}

void FlowFinder::find(const FlowImage& a, const FlowImage& b, float most, Flow& out) {
  std::size_t levels = 1;
  for (int side = std::min(a.width, a.height); side >= 2 * smallest; side = (side + 1) / 2)
    ++levels;
  a_.resize(levels - 1);
  b_.resize(levels - 1);
  for (std::size_t l = 0; l + 1 < levels; ++l) {
    halve(l == 0 ? a : a_[l - 1], a_[l]);
    halve(l == 0 ? b : b_[l - 1], b_[l]);
  }
  int width = 0, height = 0;
  for (std::size_t l = levels; l-- > 0;) {
    const FlowImage& from = l == 0 ? a : a_[l - 1];
    const FlowImage& to = l == 0 ? b : b_[l - 1];
    std::swap(coarse_, flow_);
    begin(coarse_, width, height, to);
    for (int i = 0; i < steps; ++i) step(from, to);
    width = to.width;
    height = to.height;
  }
  judge(a, b, most, out);
}

/// Keeps of flow_ what brings the pictures nearer to each other.
void FlowFinder::judge(const FlowImage& a, const FlowImage& b, float most, Flow& out) {
  const FlowLoops& loops = FlowLoops::best();
  const std::size_t texels = a.texels();
  float* const moved[3] = {moved_.channel[0].data(), moved_.channel[1].data(),
                           moved_.channel[2].data()};
  // What they are apart with and without.
  std::vector<float>&before = equations_[0], &after = equations_[1], &gain = equations_[2];
  next_x_.assign(texels, 0.0f);
  for (std::vector<float>* off : {&before, &after}) {
    const bool with = off == &after;
    loops.warp(picture_of(a), b.weight.data(), a.width, a.height,
               with ? flow_.dx.data() : next_x_.data(), with ? flow_.dy.data() : next_x_.data(),
               moved, moved_.weight.data());
    for (std::size_t i = 0; i < texels; ++i) {
      float sum = 0.0f;
      for (int c = 0; c < 3; ++c) {
        const float e = moved[c][i] - b.channel[c][i];
        sum += e * e;
      }
      (*off)[i] = moved_.weight[i] * sum;
    }
    for (int i = 0; i < 3; ++i)
      loops.smooth(off->data(), a.width, a.height, room_.data(), off->data());
  }
  constexpr float noise = 8.0f;  // squared codes that nobody sees
  constexpr float least = 0.4f, slope = 4.0f;
  for (std::size_t i = 0; i < texels; ++i) {
    const float share = (before[i] - after[i]) / (before[i] + noise);
    gain[i] = std::clamp(slope * (share - least), 0.0f, 1.0f);
  }
  for (int i = 0; i < 3; ++i)
    loops.smooth(gain.data(), a.width, a.height, room_.data(), gain.data());
  out.dx.assign(texels, 0.0f);
  out.dy.assign(texels, 0.0f);
  for (int y = 1; y < a.height - 1; ++y)
    for (int x = 1; x < a.width - 1; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * a.width + x;
      out.dx[i] = clamped(gain[i] * flow_.dx[i], most);
      out.dy[i] = clamped(gain[i] * flow_.dy[i], most);
    }
}

}  // namespace polyhull
