// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Views of a box, made without any camera or keying: its silhouette is the convex hull of its
/// corners' pixels.
#pragma once

#include <gst/gst.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "builtin/default_rig.h"
#include "rig/rig.h"
#include "wire/view_payload.h"

namespace polyhull::test {

struct Box {
  Vec3 centre{0.0, 1.0, 0.0};
  Vec3 half{0.2, 0.8, 0.15};
  double volume() const { return 8.0 * half.x * half.y * half.z; }
};

/// The convex hull of \p points, counter-clockwise as seen on screen.
inline std::vector<Vec2f> convex_outline(std::vector<Vec2> points) {
  std::sort(points.begin(), points.end(),
            [](const Vec2& a, const Vec2& b) { return a.x != b.x ? a.x < b.x : a.y < b.y; });
  const auto turn = [](const Vec2& a, const Vec2& b, const Vec2& c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  };
  std::vector<Vec2> chain;
  for (int side = 0; side < 2; ++side) {
    const std::size_t begin = chain.size();
    for (const Vec2& p : points) {
      while (chain.size() >= begin + 2 && turn(chain[chain.size() - 2], chain.back(), p) <= 0.0)
        chain.pop_back();
      chain.push_back(p);
    }
    chain.pop_back();
    std::reverse(points.begin(), points.end());
  }
  // Positive area with y down is clockwise on screen.
  std::vector<Vec2f> outline(chain.rbegin(), chain.rend());
  return outline;
}

/// The box' silhouette in \p camera, in real pixels (for cameras without distortion).
inline Rings box_contours(const Camera& camera, const Box& box) {
  std::vector<Vec2> corners;
  for (int i = 0; i < 8; ++i) {
    const Vec3 sign(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
    if (const auto pixel = camera.project(box.centre + sign * box.half)) corners.push_back(*pixel);
  }
  Rings rings;
  rings.points = convex_outline(corners);
  rings.ends = {static_cast<std::uint32_t>(rings.points.size())};
  return rings;
}

/// A view with pixels around the contours. \p pixels must outlive it.
inline View box_view(const Camera& camera, const Box& box, std::uint64_t trigger,
                     std::vector<std::uint8_t>& pixels) {
  View view;
  view.camera = camera.name;
  view.trigger = trigger;
  view.capture_time = static_cast<std::int64_t>(trigger) * 40000000;
  view.width = camera.width;
  view.height = camera.height;
  view.contours = box_contours(camera, box);
  view.roi = {100, 100, 64, 32};
  view.format = PixelFormat::rgba;
  view.stride = 4 * 64;
  pixels.assign(static_cast<std::size_t>(view.stride) * 32, 0);
  for (std::size_t i = 0; i < pixels.size(); ++i)
    pixels[i] = static_cast<std::uint8_t>(i + trigger * 31 + camera.name.back());
  view.pixels = pixels;
  return view;
}

inline GstBuffer* buffer_of(const std::vector<std::uint8_t>& bytes) {
  return gst_buffer_new_memdup(bytes.data(), bytes.size());
}

/// Writes views of a moving box, FRAMES for each camera, as FOLDER/NAME-%03d.view.
inline std::string write_view_files(const std::string& folder, int frames,
                                    const Rig& rig = default_rig()) {
  std::filesystem::create_directories(folder);
  for (const Camera& camera : rig.cameras)
    for (int frame = 0; frame < frames; ++frame) {
      Box box;
      box.centre.x += 0.01 * frame;
      std::vector<std::uint8_t> pixels;
      const auto bytes = write_view(box_view(camera, box, frame, pixels));
      char name[32];
      std::snprintf(name, sizeof name, "-%03d.view", frame);
      std::ofstream(folder + "/" + camera.name + name, std::ios::binary)
          .write(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    }
  return folder;
}

/// gst-launch text: a source of such files for camera \p name.
inline std::string view_files(const std::string& folder, const std::string& name) {
  return "multifilesrc location=" + folder + "/" + name +
         "-%03d.view caps=application/x-polyhull-view ";
}

/// gst-launch text: all cameras of the default rig into the element called `hull`.
inline std::string all_view_files(const std::string& folder) {
  std::string line;
  for (const Camera& camera : default_rig().cameras)
    line += view_files(folder, camera.name) + "! queue ! hull. ";
  return line;
}

}  // namespace polyhull::test
