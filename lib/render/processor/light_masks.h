// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What a subject hides of an area light: a bit image for each point of the light that pixels ask.
///
/// In the light's map (light_reach.h) a point at tangents m and depth z, w = 1/z, lies on one ray to
/// the light's point c + d with all points that have the same
///   q = m - d w.
/// So rays to one point of the light are parallel in (m, w), and what they meet is an image over q: the
/// subject's cross-sections at several w, each moved by -d w, one over the other. There are 63 of them,
/// bit images of up to 256 x 256 texels around the subject. A ray asks for one bit instead of a tree; it may
/// be wrong within half a texel of the subject's outline, and within what a section moves half the way
/// to the next one.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "render/light_reach.h"
#include "render/processor/loops/loops.h"

namespace polyhull::processor {

class LightMasks {
 public:
  static constexpr int sections = 63, texels = 256;

  /// Cuts the triangles (three points each, scene coordinates) into sections for the area light of
  /// \p reach, at most \p finest texels on a side of the subject. Returns false, and is not to be asked, where they come so near to the light's plane that
  /// the sections lie too far from each other.
  bool set(const LightReach& reach, std::span<const Vec3f> points,
           std::span<const std::uint32_t> triangles, int finest = texels);

  /// Makes the images for \p places on the light (scene coordinates).
  void aim(std::span<const Vec3f> places);

  /// Sets bit i of \p hidden for each of \p receivers from which the subject hides place \p first + i, i
  /// below \p count, at most 32.
  void find_hidden(std::size_t first, int count, const MaskPoints& receivers,
                   std::uint32_t* hidden) const;

 private:
  /// Where sections lie in an image: texel = m * scale + origin + w * per_inverse.
  struct Shift {
    Vec2f origin{0.0f}, per_inverse{0.0f};
    int x[sections], y[sections];  // of the sections' texels
  };
  void cut(std::span<const std::uint32_t> triangles);
  void part();
  void draw(std::size_t number);
  std::size_t image_size() const { return columns_ * static_cast<std::size_t>(height_); }
  bool is_hidden(std::size_t number, const Vec3f& at) const;
  MaskImage image(std::size_t number) const;

  LightReach::Map map_;
  Vec2f low_{0.0f}, scale_{0.0f};         // of the sections: texel = (m - low) * scale
  float deepest_ = 0.0f;                  // the subject's smallest w
  float per_section_ = 0.0f;              // sections to a unit of w
  int columns_used_ = 0, rows_used_ = 0;  // texels of the sections that the subject lies in
  int width_ = 0, height_ = 0;            // of an image, with an empty texel all around
  std::size_t columns_ = 0;               // of an image, a word wide
  std::vector<Vec3f> corners_;            // of the subject: texel and section
  // By texel: a bit for each section that lies inside, and the last for an open surface; the sections of
  // the surface.
  std::vector<std::uint64_t> inside_, surface_;
  static constexpr int across = texels / 32;  // columns of a section, a word wide
  static std::size_t section_word(int section, int column, int row) {
    return (static_cast<std::size_t>(section) * across + column) * texels + row;
  }
  std::vector<std::uint32_t> sections_;  // by section, column and row
  struct Rows {
    int first = texels, end = 0;
  };
  Rows rows_[sections][across];        // of what a section has in a column, whole eights
  std::vector<Shift> shifts_;          // by place
  std::vector<std::uint32_t> images_;  // by place, column and row
};

}  // namespace polyhull::processor
