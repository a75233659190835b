// SPDX-License-Identifier: LGPL-2.1-or-later
// The environment cut into a few parts, each as a light of its own.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "base/srgb.h"
#include "environment/environment.h"

namespace polyhull {
namespace {

constexpr double narrowest = 0.5 * std::numbers::pi / 180.0;  // as the sun
constexpr double widest = 100.0 * std::numbers::pi / 180.0;
constexpr int most_cells_high = 64;
constexpr double most_even = 8.0;  // times the mean

}  // namespace

/// A rectangle of cells, and the best cut through it.
struct Environment::Region {
  std::size_t layer;         // of cells_
  std::array<int, 4> cells;  // from and to: columns, rows
  Cell all;
  double spread = 0.0;  // the luminance times the variance of its directions
  int axis = -1, cut = 0;
  double left = 0.0;  // of the spread, of both parts together

  /// The variance of unit vectors with mean m is 1 - m.m.
  static double spread_of(const Cell& cell) {
    const Vec3 moment = cell.moment();
    return cell.luminous > 0.0
               ? std::max(cell.luminous - glm::dot(moment, moment) / cell.luminous, 0.0)
               : 0.0;
  }
};

void Environment::make_cells() {
  cells_high_ = std::min(lighting_.height, most_cells_high);
  for (std::vector<Cell>& layer : cells_)
    layer.resize(static_cast<std::size_t>(2 * cells_high_ * cells_high_));
  const auto width = static_cast<std::size_t>(lighting_.width);
  const auto row_of = [&](int y) {
    const double top = std::cos(std::numbers::pi * y / lighting_.height);
    return Vec2(top, std::cos(std::numbers::pi * (y + 1) / lighting_.height));
  };
  const auto luminance_of = [&](int x, int y) {
    return glm::dot(
        luminance_weights<double>,
        Vec3(lighting_.pixels[static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)]));
  };
  double mean = 0.0;
  for (int y = 0; y < lighting_.height; ++y)
    for (int x = 0; x < lighting_.width; ++x)
      mean += luminance_of(x, y) * (row_of(y).x - row_of(y).y) / (2.0 * lighting_.width);
  for (int y = 0; y < lighting_.height; ++y) {
    const Vec2 row = row_of(y);
    const double solid_angle = (row.x - row.y) * 2.0 * std::numbers::pi / lighting_.width;
    for (int x = 0; x < lighting_.width; ++x) {
      const Vec3 way(direction((x + 0.5) / lighting_.width, 0.5 * (row.x + row.y)));
      const Vec3 radiance(
          lighting_.pixels[static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)]);
      const double luminous = luminance_of(x, y), even = std::min(luminous, most_even * mean);
      const auto cell =
          static_cast<std::size_t>(y * cells_high_ / lighting_.height * 2 * cells_high_ +
                                   x * 2 * cells_high_ / lighting_.width);
      for (std::size_t layer = 0; luminous > 0.0 && layer < 2; ++layer) {
        const double part = layer == 0 ? even : luminous - even;  // of the luminance
        Cell pixel;
        for (int k = 0; k < 3; ++k)
          pixel.moments[static_cast<std::size_t>(k)] =
              part / luminous * radiance[k] * solid_angle * way;
        pixel.luminous = part * solid_angle;
        cells_[layer][cell].add(pixel);
      }
    }
  }
}

Environment::Region Environment::region(std::size_t layer, const std::array<int, 4>& cells) const {
  Region out{layer, cells, {}};
  std::array<std::vector<Cell>, 2> sums;  // of each column, of each row
  sums[0].resize(static_cast<std::size_t>(cells[1] - cells[0]));
  sums[1].resize(static_cast<std::size_t>(cells[3] - cells[2]));
  for (int y = cells[2]; y < cells[3]; ++y)
    for (int x = cells[0]; x < cells[1]; ++x) {
      const Cell& cell = cells_[layer][static_cast<std::size_t>(y * 2 * cells_high_ + x)];
      sums[0][static_cast<std::size_t>(x - cells[0])].add(cell);
      sums[1][static_cast<std::size_t>(y - cells[2])].add(cell);
    }
  for (const Cell& column : sums[0]) out.all.add(column);
  out.left = out.spread = Region::spread_of(out.all);
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const std::size_t count = sums[axis].size();
    std::vector<double> after(count, 0.0);  // the spread from each on
    Cell sum;
    for (std::size_t i = count; i-- > 1;) {
      sum.add(sums[axis][i]);
      after[i] = Region::spread_of(sum);
    }
    sum = {};
    for (std::size_t i = 1; i < count; ++i) {
      sum.add(sums[axis][i - 1]);
      const double both = Region::spread_of(sum) + after[i];
      if (both >= out.left) continue;
      out.left = both;
      out.axis = static_cast<int>(axis);
      out.cut = cells[2 * axis] + static_cast<int>(i);
    }
  }
  return out;
}

EnvironmentPart Environment::part_of(const Region& region) const {
  EnvironmentPart out;
  const Vec3 to = glm::normalize(region.all.moment());
  const Vec3 level = std::abs(to.y) < 1.0 - 1e-9 ? Vec3(0.0, 1.0, 0.0) : Vec3(1.0, 0.0, 0.0);
  const Vec3 across = glm::normalize(glm::cross(level, to)), up = glm::cross(to, across);
  Vec2 variance(0.0);
  const Vec2 pixel = std::numbers::pi / lighting_.height * Vec2(std::sqrt(1.0 - to.y * to.y), 1.0);
  for (int y = region.cells[2]; y < region.cells[3]; ++y)
    for (int x = region.cells[0]; x < region.cells[1]; ++x) {
      const Cell& cell = cells_[region.layer][static_cast<std::size_t>(y * 2 * cells_high_ + x)];
      if (!(cell.luminous > 0.0)) continue;
      const Vec3 mean = cell.moment() / cell.luminous;
      // Within the cell alike in all directions, and of pixels that have an extent.
      const Vec2 own = 0.5 * std::max(1.0 - glm::dot(mean, mean), 0.0) + pixel * pixel / 12.0;
      const Vec2 aside(glm::dot(mean, across), glm::dot(mean, up));
      variance += cell.luminous / region.all.luminous * (aside * aside + own);
    }
  // A uniform width w has variance w^2 / 12.
  const Vec2 width = glm::clamp(glm::sqrt(12.0 * variance), Vec2(narrowest), Vec2(widest));
  out.direction = Vec3f(to);
  out.across = Vec3f(across);
  out.width = Vec2f(width);
  for (std::size_t k = 0; k < 3; ++k)
    out.irradiance[static_cast<int>(k)] = static_cast<float>(glm::length(region.all.moments[k]));
  return out;
}

std::vector<Environment::Region> Environment::regions(std::size_t count) const {
  std::vector<Region> regions;
  // Of the even light what is above the horizon and what is below: floors and ceilings are level.
  const int wide = 2 * cells_high_, middle = cells_high_ / 2;
  for (const Region& all :
       {region(0, {0, wide, 0, middle}), region(0, {0, wide, middle, cells_high_}),
        region(1, {0, wide, 0, cells_high_})})
    if (all.all.luminous > 0.0) regions.push_back(all);
  cut(count, regions);
  return regions;
}

/// Cuts them until they are \p count; both halves of one stand where it was.
void Environment::cut(std::size_t count, std::vector<Region>& regions) const {
  while (!regions.empty() && regions.size() < count) {
    const auto gain = [](const Region& region) { return region.spread - region.left; };
    const auto most =
        std::max_element(regions.begin(), regions.end(),
                         [&](const Region& a, const Region& b) { return gain(a) < gain(b); });
    if (!(gain(*most) > 0.0)) break;
    std::array<int, 4> first = most->cells, second = first;
    first[2 * static_cast<std::size_t>(most->axis) + 1] =
        second[2 * static_cast<std::size_t>(most->axis)] = most->cut;
    const std::size_t layer = most->layer;
    *most = region(layer, first);
    regions.insert(most + 1, region(layer, second));
  }
  std::erase_if(regions,
                [](const Region& region) { return glm::length(region.all.moment()) == 0.0; });
}

std::vector<EnvironmentPart> Environment::parts(std::size_t count) const {
  std::vector<EnvironmentPart> out;
  for (const Region& region : regions(count)) out.push_back(part_of(region));
  return out;
}

std::vector<EnvironmentPart> Environment::soft_parts(std::size_t count, std::size_t finer) const {
  std::vector<Region> soft = regions(count);
  std::erase_if(soft, [this](const Region& region) { return part_of(region).is_sharp(); });
  cut(finer, soft);
  std::vector<EnvironmentPart> out;
  for (const Region& region : soft) out.push_back(part_of(region));
  return out;
}

}  // namespace polyhull
