// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/subject/view_picture.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "base/srgb.h"

namespace polyhull {
namespace {

constexpr std::uint32_t covered = 250;  // of 255: a matte pixel without background in it

std::uint32_t alpha(std::uint32_t pixel) {
  return pixel >> 24;  // RGBA bytes read as a little-endian word
}

/// The mean colour of the covered neighbours of p, which is not; false: there is none.
bool mean_of_neighbours(const std::vector<std::uint32_t>& pixels, std::size_t p, std::size_t stride,
                        std::uint32_t& mean) {
  using Int4 = std::int32_t __attribute__((vector_size(16)));
  using Bytes = std::uint8_t __attribute__((vector_size(16)));
  using Shorts = std::uint16_t __attribute__((vector_size(32)));
  // Four pixels at a time of each row; the fourth, which does not count, lies where there is memory.
  Shorts sum{};
  for (int row = -1; row <= 1; ++row) {
    Int4 four;
    std::memcpy(&four,
                pixels.data() + p + row * static_cast<std::ptrdiff_t>(stride) - (row > 0 ? 2 : 1),
                sizeof four);
    const Int4 beside = row > 0 ? Int4{0, -1, -1, -1} : Int4{-1, -1, -1, 0};
    const Int4 counts = beside & ((four >> 24 & 255) >= static_cast<int>(covered));
    four = counts & ((four & 0xffffff) | 1 << 24);
    Bytes bytes;
    std::memcpy(&bytes, &four, sizeof bytes);
    sum += __builtin_convertvector(bytes, Shorts);
  }
  // All channels, and how many there are.
  const Shorts across =
      __builtin_shufflevector(sum, sum, 8, 9, 10, 11, 12, 13, 14, 15, 0, 1, 2, 3, 4, 5, 6, 7) + sum;
  const std::uint32_t red = across[0] + across[4], green = across[1] + across[5],
                      blue = across[2] + across[6], count = across[3] + across[7];
  if (count == 0) return false;
  static constexpr std::array<std::uint32_t, 9> inverses = [] {  // exact for so small sums
    std::array<std::uint32_t, 9> of{};
    for (std::uint32_t n = 1; n < of.size(); ++n) of[n] = 65536 / n + 1;
    return of;
  }();
  const std::uint32_t half = count / 2, inverse = inverses[count];
  mean = 0xff000000u | ((blue + half) * inverse >> 16) << 16 |
         ((green + half) * inverse >> 16) << 8 | (red + half) * inverse >> 16;
  return true;
}

/// Where the frame goes on beyond the region of interest the subject does not.
void clear_border(const View& view, std::vector<std::uint32_t>& pixels) {
  const Rectangle& roi = view.roi;
  const auto width = static_cast<std::size_t>(roi.width) + 2;
  const auto height = static_cast<std::size_t>(roi.height) + 2;
  const auto clear = [&](std::size_t first, std::size_t step, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) pixels[first + i * step] &= 0xffffffu;
  };
  if (roi.x > 0) clear(0, width, height);
  if (roi.x + roi.width < view.width) clear(width - 1, width, height);
  if (roi.y > 0) clear(0, 1, width);
  if (roi.y + roi.height < view.height) clear((height - 1) * width, 1, width);
}

/// The view's pixels with a border of one that repeats them.
void copy_with_border(const View& view, std::vector<std::uint32_t>& pixels) {
  const auto width = static_cast<std::size_t>(view.roi.width);
  const auto height = static_cast<std::size_t>(view.roi.height);
  const std::size_t stride = width + 2;
  pixels.resize(stride * (height + 2));
  for (std::size_t y = 0; y < height; ++y) {
    std::uint32_t* row = pixels.data() + (y + 1) * stride;
    std::memcpy(row + 1, view.pixels.data() + y * static_cast<std::size_t>(view.stride), 4 * width);
    row[0] = row[1];
    row[width + 1] = row[width];
  }
  std::memcpy(pixels.data(), pixels.data() + stride, 4 * stride);
  std::memcpy(pixels.data() + (height + 1) * stride, pixels.data() + height * stride, 4 * stride);
}

/// Pixels within the border that are not \p done and lie beside one that is.
std::vector<std::size_t> pixels_beside(const std::uint8_t* done, std::size_t width,
                                       std::size_t height) {
  const std::size_t stride = width + 2;
  std::vector<std::size_t> ring;
  // Found without branches, as a row has few.
  std::vector<std::uint8_t> flags(stride + 8, 0);
  std::uint8_t* const __restrict beside = flags.data();
  for (std::size_t y = 1; y <= height; ++y) {
    const std::uint8_t* row = done + y * stride;
    const std::uint8_t *above = row - stride, *below = row + stride;
    for (std::size_t x = 1; x <= width; ++x)
      beside[x] = (row[x - 1] | row[x + 1] | above[x] | below[x]) & ~row[x];
    for (std::size_t x = 0; x <= width; x += 8) {
      std::uint64_t any;
      std::memcpy(&any, &beside[x], sizeof any);
      for (; any != 0; any &= any - 1)
        ring.push_back(y * stride + x + static_cast<std::size_t>(std::countr_zero(any)) / 8);
    }
  }
  return ring;
}

}  // namespace

void prepare_view_picture(const View& view, int reach, std::vector<std::uint32_t>& pixels) {
  static_assert(std::endian::native == std::endian::little);
  const auto width = static_cast<std::size_t>(view.roi.width);
  const auto height = static_cast<std::size_t>(view.roi.height);
  const std::size_t stride = width + 2;
  copy_with_border(view, pixels);

  // Ring by ring: each takes the mean of what the ring before it gave.
  std::vector<std::uint32_t> colours;
  std::vector<std::pair<std::size_t, std::uint32_t>> mattes;  // alpha says meanwhile what is done
  const bool soft = reach > sharp_reach;
  if (soft) {
    for (std::size_t p = 0; p < pixels.size(); ++p) {
      const std::uint32_t matte = alpha(pixels[p]);
      if (matte < 40 || matte >= covered) continue;
      mattes.emplace_back(p, matte << 24);
      pixels[p] |= 0xff000000u;
    }
  }
  // Which pixels are covered, or will be; the border stays as it is.
  thread_local std::vector<std::uint8_t> memory;
  memory.resize(pixels.size());
  std::uint8_t* const done = memory.data();
  const auto find_covered = [](const std::uint32_t* from, std::size_t count,
                               std::uint8_t* __restrict to) {
    for (std::size_t p = 0; p < count; ++p) to[p] = alpha(from[p]) >= covered;
  };
  find_covered(pixels.data(), pixels.size(), done);
  std::vector<std::size_t> ring = pixels_beside(done, width, height), next;
  std::fill_n(done, stride, std::uint8_t{1});
  std::fill_n(done + (height + 1) * stride, stride, std::uint8_t{1});
  for (std::size_t y = 1; y <= height; ++y) done[y * stride] = done[y * stride + width + 1] = 1;
  for (const std::size_t p : ring) done[p] = 1;
  for (int round = 0; round < reach && !ring.empty(); ++round) {
    colours.resize(ring.size());
    for (std::size_t i = 0; i < ring.size(); ++i)
      if (!mean_of_neighbours(pixels, ring[i], stride, colours[i])) colours[i] = pixels[ring[i]];
    next.clear();
    for (std::size_t i = 0; i < ring.size(); ++i) {
      if (soft) mattes.emplace_back(ring[i], pixels[ring[i]] & 0xff000000u);
      pixels[ring[i]] = colours[i];
    }
    for (const std::size_t p : ring) {
      for (const std::size_t q : {p - 1, p + 1, p - stride, p + stride}) {
        if (!done[q]) next.push_back(q);
        done[q] = 1;
      }
    }
    ring.swap(next);
  }
  if (!soft) return;
  // The first entry of a pixel is its own.
  for (auto entry = mattes.rbegin(); entry != mattes.rend(); ++entry)
    pixels[entry->first] = (pixels[entry->first] & 0xffffffu) | entry->second;
  clear_border(view, pixels);
}

namespace {

/// The mean of four pixels in linear light, weighted by how much they show the subject.
std::uint32_t mean_of_four(const std::uint32_t (&four)[4], const float* decode,
                           const std::uint8_t* encode) {
  if (alpha(four[0] | four[1] | four[2] | four[3]) == 0) return four[0];  // nothing of the subject
  if (alpha(four[0] & four[1] & four[2] & four[3]) == 255) {  // the same, as all weigh alike
    const auto mean = [&](int bits) {
      const auto of = [&](std::uint32_t p) { return decode[p >> bits & 255]; };
      const float sum = of(four[0]) + of(four[1]) + of(four[2]) + of(four[3]);
      return static_cast<std::uint32_t>(linear_to_srgb(0.25f * sum, encode)) << bits;
    };
    return mean(0) | mean(8) | mean(16) | 0xff000000u;
  }
  float red = 0.0f, green = 0.0f, blue = 0.0f, count = 0.0f;
  std::uint32_t matte = 2;
  for (const std::uint32_t p : four) {
    const auto share = static_cast<float>(1 + alpha(p));  // colours may go on beyond the matte
    red += share * decode[p & 255];
    green += share * decode[p >> 8 & 255];
    blue += share * decode[p >> 16 & 255];
    count += share;
    matte += alpha(p);
  }
  return static_cast<std::uint32_t>(linear_to_srgb(red / count, encode)) |
         static_cast<std::uint32_t>(linear_to_srgb(green / count, encode)) << 8 |
         static_cast<std::uint32_t>(linear_to_srgb(blue / count, encode)) << 16 | matte / 4 << 24;
}

}  // namespace

SmallerPicture halved(std::span<const std::uint32_t> pixels, int width, int height) {
  SmallerPicture out;
  out.width = (width + 1) / 2 + 1;
  out.height = (height + 1) / 2 + 1;
  out.pixels.resize(static_cast<std::size_t>(out.width) * out.height);
  const float* const decode = srgb_to_linear_table();
  const std::uint8_t* const encode = linear_to_srgb_table();
  std::uint32_t* to = out.pixels.data();
  for (int y = 0; y < out.height; ++y) {
    const int top = std::min(2 * y, height - 1), bottom = std::min(2 * y + 1, height - 1);
    const std::uint32_t* above = pixels.data() + static_cast<std::ptrdiff_t>(top) * width;
    const std::uint32_t* below = pixels.data() + static_cast<std::ptrdiff_t>(bottom) * width;
    for (int x = 0; x < width / 2; ++x, above += 2, below += 2)
      *to++ = mean_of_four({above[0], above[1], below[0], below[1]}, decode, encode);
    // Beyond, the last column goes on.
    const int last = width % 2 - 1;
    for (int x = width / 2; x < out.width; ++x)
      *to++ = mean_of_four({above[last], above[last], below[last], below[last]}, decode, encode);
  }
  return out;
}

int levels_needed(const Mesh& mesh, int view, const std::vector<Vec3>& eyes, double pixel_size) {
  if (mesh.hull.vertices.empty()) return 0;
  const Camera& camera = mesh.views[static_cast<std::size_t>(view)].calibration;
  double most = 0.0;  // squared
  for (const Vec3f& vertex : mesh.hull.vertices) {
    const Vec3 p = mesh.hull.origin + Vec3(vertex);
    const double depth = camera.to_camera(p).z;
    if (depth <= 0.0) return most_levels;
    for (const Vec3& eye : eyes)
      most = std::max(most, glm::dot(p - eye, p - eye) / (depth * depth));
  }
  const double spans = std::sqrt(most) * pixel_size * camera.K[0][0];
  if (!(spans < HUGE_VAL)) return most_levels;
  if (spans <= 1.0) return 0;
  return std::clamp(static_cast<int>(std::ceil(std::log2(spans))), 0, most_levels);
}

}  // namespace polyhull
