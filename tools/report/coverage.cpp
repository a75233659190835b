// SPDX-License-Identifier: LGPL-2.1-or-later
#include "report/coverage.h"

#include <algorithm>
#include <cmath>

#include "report/hull_caster.h"

namespace polyhull::report {
namespace {

// Even-odd scan conversion at pixel centres.
std::vector<std::uint8_t> fill(const Rings& rings, int width, int height) {
  std::vector<std::vector<double>> crossings(height);
  for (std::size_t i = 0; i < rings.size(); ++i) {
    const auto ring = rings.ring(i);
    for (std::size_t k = 0; k < ring.size(); ++k) {
      Vec2 a = ring[k];
      Vec2 b = ring[(k + 1) % ring.size()];
      if (a.y == b.y) continue;
      if (a.y > b.y) std::swap(a, b);
      const int first = std::max(0, static_cast<int>(std::ceil(a.y)));
      const int last = std::min(height - 1, static_cast<int>(std::ceil(b.y)) - 1);
      for (int y = first; y <= last; ++y)
        crossings[y].push_back(a.x + (b.x - a.x) * (y - a.y) / (b.y - a.y));
    }
  }
  std::vector<std::uint8_t> mask(static_cast<std::size_t>(width) * height, 0);
  for (int y = 0; y < height; ++y) {
    auto& row = crossings[y];
    std::sort(row.begin(), row.end());
    for (std::size_t k = 0; k + 1 < row.size(); k += 2) {
      const int first = std::clamp(static_cast<int>(std::ceil(row[k])), 0, width);
      const int last = std::clamp(static_cast<int>(std::ceil(row[k + 1])), 0, width);
      std::fill(mask.begin() + static_cast<std::ptrdiff_t>(y) * width + first,
                mask.begin() + static_cast<std::ptrdiff_t>(y) * width + std::max(first, last), 255);
    }
  }
  return mask;
}

}  // namespace

std::vector<std::uint8_t> mask_of(const View& view, Mask kind) {
  if (kind == Mask::contours || view.format != PixelFormat::rgba || view.pixels.empty())
    return fill(view.contours, view.width, view.height);
  std::vector<std::uint8_t> mask(static_cast<std::size_t>(view.width) * view.height, 0);
  for (int y = 0; y < view.roi.height; ++y) {
    const std::uint8_t* row = view.pixels.data() + static_cast<std::size_t>(y) * view.stride;
    for (int x = 0; x < view.roi.width; ++x)
      if (row[4 * x + 3] >= 128)
        mask[static_cast<std::size_t>(view.roi.y + y) * view.width + view.roi.x + x] = 255;
  }
  return mask;
}

std::vector<Coverage> measure_coverage(const Mesh& mesh, Mask kind) {
  std::vector<Coverage> rows;
  const HullCaster caster(mesh.hull);
  for (const MeshView& view : mesh.views) {
    const std::vector<std::uint8_t> mask = mask_of(view.view, kind);
    const HitPicture hits = caster.cast(view.calibration);
    Coverage row;
    row.camera = view.calibration.name;
    for (std::size_t i = 0; i < mask.size() && i < hits.hits.size(); ++i) {
      const bool hull = hits.hits[i].hit();
      row.mask += mask[i] != 0;
      row.covered += mask[i] && hull;
      row.outside += !mask[i] && hull;
    }
    rows.push_back(row);
  }
  return rows;
}

}  // namespace polyhull::report
