// SPDX-License-Identifier: LGPL-2.1-or-later
#include "take/picture_filter.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <vector>

namespace polyhull {
namespace {

constexpr std::size_t run = 32;

std::size_t planes_of(const Region& region) {
  return region.kind == RegionKind::video ? 1 : region.element;
}

std::size_t runs_of(const Region& region) {
  return (region.width + run - 1) / run;
}

/// A row's planes, one after the other \p stride apart.
void split(const Region& region, const std::uint8_t* row, std::size_t count, std::uint8_t* out,
           std::size_t stride) {
  if (region.element == 1) {
    std::memcpy(out, row, count);
  } else if (region.kind == RegionKind::video) {
    for (std::size_t x = 0; x < count; ++x) out[x] = row[4 * x + 3];
  } else {
    std::uint8_t *red = out, *green = out + stride, *blue = green + stride, *alpha = blue + stride;
    for (std::size_t x = 0; x < count; ++x) {
      red[x] = static_cast<std::uint8_t>(row[4 * x] - row[4 * x + 1]);
      green[x] = row[4 * x + 1];
      blue[x] = static_cast<std::uint8_t>(row[4 * x + 2] - row[4 * x + 1]);
      alpha[x] = row[4 * x + 3];
    }
  }
}

void join(const Region& region, const std::uint8_t* planes, std::uint8_t* row) {
  const std::size_t width = region.width;
  if (region.element == 1) {
    std::memcpy(row, planes, width);
  } else if (region.kind == RegionKind::video) {
    for (std::size_t x = 0; x < width; ++x) row[4 * x + 3] = planes[x];
  } else {
    const std::uint8_t *red = planes, *green = red + width, *blue = green + width,
                       *alpha = blue + width;
    for (std::size_t x = 0; x < width; ++x) {
      row[4 * x] = static_cast<std::uint8_t>(red[x] + green[x]);
      row[4 * x + 1] = green[x];
      row[4 * x + 2] = static_cast<std::uint8_t>(blue[x] + green[x]);
      row[4 * x + 3] = alpha[x];
    }
  }
}

/// Rows of the packet before, as planes, at the place of this one's.
class RowsBefore {
 public:
  RowsBefore(const Region& region, const PictureBefore& before)
      : region_(region), before_(before), planes_(planes_of(region) * region.width) {
    if (before.pixels == nullptr || before.region.element != region.element ||
        before.region.kind != region.kind)
      return;
    begin_ = std::max(region.x, before.region.x);
    end_ = std::min(region.x + region.width, before.region.x + before.region.width);
  }

  void go_to(std::uint32_t y) {
    const std::uint32_t at = region_.y + y;
    there_ =
        begin_ < end_ && at >= before_.region.y && at - before_.region.y < before_.region.height;
    if (!there_) return;
    const std::size_t first =
        std::size_t{at - before_.region.y} * before_.region.width + begin_ - before_.region.x;
    split(region_, before_.pixels + first * region_.element, end_ - begin_,
          planes_.data() + (begin_ - region_.x), region_.width);
  }
  bool has(std::size_t from, std::size_t to) const {
    return there_ && region_.x + from >= begin_ && region_.x + to <= end_;
  }
  const std::uint8_t* plane(std::size_t p) const { return planes_.data() + p * region_.width; }

 private:
  const Region& region_;
  const PictureBefore& before_;
  std::vector<std::uint8_t> planes_;
  std::uint32_t begin_ = 0, end_ = 0;  // columns of the frame that both have
  bool there_ = false;
};

int magnitude(const std::uint8_t* less, std::size_t count) {
  int sum = 0;
  for (std::size_t i = 0; i < count; ++i) sum += std::abs(static_cast<std::int8_t>(less[i]));
  return sum;
}

void subtract(const std::uint8_t* a, const std::uint8_t* b, std::size_t count, std::uint8_t* out) {
  for (std::size_t i = 0; i < count; ++i) out[i] = static_cast<std::uint8_t>(a[i] - b[i]);
}

}  // namespace

std::size_t filtered_size(const Region& region) {
  return planes_of(region) * region.height * (region.width + runs_of(region));
}

void filter_picture(const Region& region, const std::uint8_t* pixels, const PictureBefore& before,
                    std::uint8_t* out) {
  const std::size_t width = region.width, planes = planes_of(region), runs = runs_of(region);
  const std::size_t plane = width * region.height;
  std::uint8_t* told = out + planes * plane;
  std::vector<std::uint8_t> row(planes * width), less(width);
  std::vector<std::uint8_t> above(planes, 0);
  RowsBefore rows(region, before);
  for (std::uint32_t y = 0; y < region.height; ++y) {
    split(region, pixels + y * width * region.element, width, row.data(), width);
    rows.go_to(y);
    for (std::size_t p = 0; p < planes; ++p) {
      const std::uint8_t* now = row.data() + p * width;
      std::uint8_t* to = out + p * plane + y * width;
      std::uint8_t* which = told + (p * region.height + y) * runs;
      to[0] = static_cast<std::uint8_t>(now[0] - above[p]);
      subtract(now + 1, now, width - 1, to + 1);
      above[p] = now[0];
      for (std::size_t r = 0; r < runs; ++r) {
        const std::size_t from = r * run, count = std::min(run, width - from);
        which[r] = 0;
        if (!rows.has(from, from + count)) continue;
        subtract(now + from, rows.plane(p) + from, count, less.data());
        if (magnitude(less.data(), count) >= magnitude(to + from, count)) continue;
        which[r] = 1;
        std::memcpy(to + from, less.data(), count);
      }
    }
  }
}

void unfilter_picture(const Region& region, const std::uint8_t* filtered,
                      const PictureBefore& before, std::uint8_t* pixels) {
  const std::size_t width = region.width, planes = planes_of(region), runs = runs_of(region);
  const std::size_t plane = width * region.height;
  const std::uint8_t* told = filtered + planes * plane;
  std::vector<std::uint8_t> row(planes * width);
  std::vector<std::uint8_t> above(planes, 0);
  RowsBefore rows(region, before);
  for (std::uint32_t y = 0; y < region.height; ++y) {
    rows.go_to(y);
    for (std::size_t p = 0; p < planes; ++p) {
      const std::uint8_t* from = filtered + p * plane + y * width;
      const std::uint8_t* which = told + (p * region.height + y) * runs;
      std::uint8_t* now = row.data() + p * width;
      std::uint8_t left = above[p];
      for (std::size_t r = 0; r < runs; ++r) {
        const std::size_t begin = r * run, end = std::min(begin + run, width);
        if (which[r] == 0) {
          for (std::size_t x = begin; x < end; ++x)
            now[x] = left = static_cast<std::uint8_t>(left + from[x]);
          continue;
        }
        if (which[r] != 1 || !rows.has(begin, end))
          refuse_packed("it counts on a picture that the packet before does not have");
        for (std::size_t x = begin; x < end; ++x)
          now[x] = static_cast<std::uint8_t>(rows.plane(p)[x] + from[x]);
        left = now[end - 1];
      }
      above[p] = now[0];
    }
    join(region, row.data(), pixels + y * width * region.element);
  }
}

}  // namespace polyhull
