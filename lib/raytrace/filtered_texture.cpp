// SPDX-License-Identifier: LGPL-2.1-or-later
#include "raytrace/filtered_texture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <mutex>
#include <optional>

#include "base/srgb.h"

namespace polyhull {
namespace {

/// A linear value as TextureLevel stores it. Not by std::lround, which is a call of a function.
std::uint32_t stored(float linear) {
  return static_cast<std::uint32_t>(1023.0f * std::sqrt(linear) + 0.5f);
}

std::uint32_t packed(std::uint32_t red, std::uint32_t green, std::uint32_t blue) {
  return red | green << 10 | blue << 20;
}

/// stored() of all sRGB values.
const std::array<std::uint32_t, 256>& stored_bytes() {
  static const std::array<std::uint32_t, 256> table = [] {
    std::array<std::uint32_t, 256> out;
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = stored(srgb_to_linear_table()[i]);
    return out;
  }();
  return table;
}

/// Means of two by two of what at(x, y) gives. An odd row or column at the end is left out, as
/// graphics cards' makers do.
template <class At>
std::vector<Vec3f> halved(int width, int height, const At& at) {
  const int columns = std::max(width / 2, 1), rows = std::max(height / 2, 1);
  std::vector<Vec3f> out;
  out.reserve(static_cast<std::size_t>(columns) * rows);
  for (int y = 0; y < rows; ++y) {
    const int below = std::min(2 * y + 1, height - 1);
    for (int x = 0; x < columns; ++x) {
      const int next = std::min(2 * x + 1, width - 1);
      out.push_back(0.25f *
                    (at(2 * x, 2 * y) + at(next, 2 * y) + at(2 * x, below) + at(next, below)));
    }
  }
  return out;
}

}  // namespace

/// Adds a level whose texels texel(x, y) gives as they are stored.
template <class Texel>
void FilteredTexture::add_level(int width, int height, const Texel& texel) {
  const std::size_t stride = static_cast<std::size_t>(width) + 1;
  const std::size_t first = texels_.size();
  levels_.push_back({static_cast<int>(first), width, height, width + 1});
  texels_.resize(first + stride * (height + 1));
  std::uint32_t* texels = &texels_[first];
  for (int y = 0; y < height; ++y) {
    std::uint32_t* row = &texels[y * stride];
    for (int x = 0; x < width; ++x) row[x] = texel(x, y);
    row[width] = row[0];
  }
  std::copy_n(texels, stride, texels + stride * height);
}

FilteredTexture::FilteredTexture(const Picture& picture) {
  int width = picture.width, height = picture.height;
  std::size_t size = 0;  // of all levels, so that they are not moved
  for (int w = width, h = height;; w = std::max(w / 2, 1), h = std::max(h / 2, 1)) {
    size += (static_cast<std::size_t>(w) + 1) * (static_cast<std::size_t>(h) + 1);
    if (w == 1 && h == 1) break;
  }
  texels_.reserve(size);
  // The finest level straight from the bytes, of which there are few different ones.
  const auto bytes = [&](int x, int y) { return picture.row(y) + 4 * static_cast<std::size_t>(x); };
  const std::array<std::uint32_t, 256>& codes = stored_bytes();
  add_level(width, height, [&](int x, int y) {
    const std::uint8_t* pixel = bytes(x, y);
    return packed(codes[pixel[0]], codes[pixel[1]], codes[pixel[2]]);
  });
  const float* linear = srgb_to_linear_table();
  std::vector<Vec3f> fine;
  while (width > 1 || height > 1) {
    if (fine.empty()) {
      fine = halved(width, height, [&](int x, int y) {
        const std::uint8_t* pixel = bytes(x, y);
        return Vec3f(linear[pixel[0]], linear[pixel[1]], linear[pixel[2]]);
      });
    } else {
      fine = halved(width, height, [&, columns = width](int x, int y) {
        return fine[static_cast<std::size_t>(y) * columns + x];
      });
    }
    width = std::max(width / 2, 1);
    height = std::max(height / 2, 1);
    add_level(width, height, [&](int x, int y) {
      const Vec3f& value = fine[static_cast<std::size_t>(y) * width + x];
      return packed(stored(value.x), stored(value.y), stored(value.z));
    });
  }
}

std::shared_ptr<const FilteredTexture> filtered_texture(const SharedPicture& picture) {
  struct Filtered {
    SharedPicture picture;  // held so that no other one takes its address
    std::once_flag once;    // not under the mutex: several are made at once
    std::optional<FilteredTexture> texture;
  };
  static std::mutex mutex;
  static std::map<const Picture*, std::weak_ptr<Filtered>> known;
  std::shared_ptr<Filtered> found;
  {
    const std::lock_guard lock(mutex);
    std::erase_if(known, [](const auto& one) { return one.second.expired(); });
    std::weak_ptr<Filtered>& place = known[&*picture];
    found = place.lock();
    if (!found) place = found = std::make_shared<Filtered>(picture);
  }
  std::call_once(found->once, [&] { found->texture.emplace(*picture); });
  return {found, &*found->texture};
}

Vec3f FilteredTexture::over(const Vec2f& uv, const Vec2f& du, const Vec2f& dv) const {
  Float4 mean;
  ViewLoops::best().over(levels(), &uv.x, &du.x, &dv.x, &mean);
  return {mean[0], mean[1], mean[2]};
}

}  // namespace polyhull
