// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/lens/depth_layers.h"

#include <algorithm>

#include "base/thread_pool.h"
#include "raster/screen_triangles.h"
#include "render/depth_picture.h"
#include "render/processor/image_layer.h"
#include "view/scene_planes.h"

namespace polyhull {
namespace {

constexpr int samples = 4;

/// Calls \p draw for each band of rows: its number, first row and the one past its last.
template <typename Draw>
void for_bands(int height, const Draw& draw) {
  parallel_each((height + band_rows - 1) / band_rows, 1, 0, [&](int band) {
    draw(band, band * band_rows, std::min((band + 1) * band_rows, height));
  });
}

}  // namespace

void DepthLayers::set(const RenderFrame& frame, const RenderPlan& plan) {
  const Mat4 pixels = pixels_from_scene(resized(frame.viewport, frame.width, frame.height));
  scene_reused_ = frame.scene == scene_held_ && pixels == pixels_ && frame.width == width_ &&
                  frame.height == height_;
  width_ = frame.width;
  height_ = frame.height;
  if (!scene_reused_) draw_scene(frame, pixels);
  add_depth(frame);
  draw_subjects(plan, pixels);
}

void DepthLayers::draw_scene(const RenderFrame& frame, const Mat4& pixels) {
  if (frame.scene != scene_held_) geometry_.reset();
  scene_held_ = frame.scene;
  pixels_ = pixels;
  const auto columns = static_cast<std::size_t>(width_);
  scene_.assign(columns * static_cast<std::size_t>(height_), 0.0f);
  if (!frame.scene) return;
  std::shared_ptr<const SceneOnScreen> screen =
      ready_triangles(frame.planes.get(), *frame.scene, geometry_, pixels, width_, height_);
  if (!screen) {
    const auto made = std::make_shared<SceneOnScreen>();
    made->set(*frame.scene, pixels, {}, width_, height_, 0);
    screen = made;
  }
  for_bands(height_, [&](int band, int top, int bottom) {
    thread_local std::vector<std::uint32_t> ids;
    thread_local std::vector<float> inverse;
    const std::size_t pixels_drawn = columns * static_cast<std::size_t>(bottom - top);
    ids.resize(samples * pixels_drawn);  // which nobody reads
    inverse.assign(samples * pixels_drawn, 0.0f);
    screen->draw(band, {0, width_, top, bottom, samples, sample_places(samples), inverse.data(),
                        ids.data()});
    float* nearest = &scene_[columns * static_cast<std::size_t>(top)];
    for (std::size_t s = 0; s < samples; ++s) {
      const float* sample = &inverse[s * pixels_drawn];
      for (std::size_t i = 0; i < pixels_drawn; ++i)
        nearest[i] = nearest[i] < sample[i] ? sample[i] : nearest[i];
    }
  });
}

void DepthLayers::add_depth(const RenderFrame& frame) {
  depth_.clear();
  if (!frame.depth) return;
  depth_ = scene_;
  std::size_t i = 0;
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x, ++i) {
      const float found = frame.depth->at(x, y, width_, height_);
      if (found * (1.0f - depth_picture_ahead) > depth_[i]) depth_[i] = found;
    }
}

namespace {

/// Adds the subjects that are drawn as triangles to \p triangles. The others, which are drawn by image.
std::vector<processor::ReadySubject> collect(const RenderPlan& plan, const Mat4& pixels,
                                             ScreenTriangles& triangles) {
  std::vector<processor::ReadySubject> by_image;
  std::vector<Corner> corners;
  for (const PlacedSubject& subject : plan.subjects) {
    if (subject.image) {
      processor::ReadySubject& ready = by_image.emplace_back();
      ready.image = subject.image;
      ready.local_to_scene = subject.local_to_scene;
      continue;
    }
    corners.clear();
    for (const Vec3f& point : subject.points)
      corners.push_back({Vec3(pixels * Vec4(Vec3(point), 1.0)), 1.0});
    const std::vector<std::uint32_t>& t = subject.mesh->hull.triangles;
    for (std::size_t i = 0; i + 2 < t.size(); i += 3)
      triangles.add({corners[t[i]], corners[t[i + 1]], corners[t[i + 2]]}, 0, Facing::both);
  }
  return by_image;
}

}  // namespace

void DepthLayers::draw_subjects(const RenderPlan& plan, const Mat4& pixels) {
  const auto columns = static_cast<std::size_t>(width_);
  subject_.assign(scene_.size(), 0.0f);
  coverage_.assign(scene_.size(), 0.0f);
  part_ = plan.subject;
  if (plan.subject.empty()) return;
  ScreenTriangles triangles;
  triangles.begin(width_, height_);
  const std::vector<processor::ReadySubject> by_image = collect(plan, pixels, triangles);
  processor::ImageLayer images;
  images.fill(by_image, {0, pixels, Facing::clockwise, std::nullopt}, width_, height_);
  for_bands(height_, [&](int band, int top, int bottom) {
    ScreenTriangles::Columns drawn = triangles.columns(band);
    if (const Rectangle part = images.painted(band); !part.empty())
      drawn = drawn.empty() ? ScreenTriangles::Columns{part.x, part.x + part.width}
                            : ScreenTriangles::Columns{std::min(drawn.first, part.x),
                                                       std::max(drawn.end, part.x + part.width)};
    if (drawn.empty()) return;
    thread_local std::vector<std::uint32_t> ids;
    thread_local std::vector<float> inverse;
    thread_local processor::ImageLayer::Scratch scratch;
    const auto across = static_cast<std::size_t>(drawn.end - drawn.first);
    const std::size_t pixels_drawn = across * static_cast<std::size_t>(bottom - top);
    ids.assign(samples * pixels_drawn, no_triangle);
    inverse.resize(samples * pixels_drawn);
    const auto place = [&](std::size_t i) {  // of the band's pixel i in the picture
      return (static_cast<std::size_t>(top) + i / across) * columns +
             static_cast<std::size_t>(drawn.first) + i % across;
    };
    // What the scene hides is not drawn.
    for (std::size_t i = 0; i < samples * pixels_drawn; ++i)
      inverse[i] = scene()[place(i % pixels_drawn)];
    const SampleRows rows{drawn.first,    drawn.end, top, bottom, samples, sample_places(samples),
                          inverse.data(), ids.data()};
    triangles.draw(band, rows);
    images.draw(by_image, rows, scratch);
    const auto shown = [&](std::size_t sample) {
      return ids[sample] != no_triangle ||
             (!by_image.empty() && scratch.seen[sample].subject != no_triangle);
    };
    for (std::size_t i = 0; i < pixels_drawn; ++i) {
      int count = 0;
      float sum = 0.0f;
      for (std::size_t s = 0; s < samples; ++s) {
        if (!shown(s * pixels_drawn + i)) continue;
        sum += inverse[s * pixels_drawn + i];
        ++count;
      }
      if (count == 0) continue;
      subject_[place(i)] = sum / static_cast<float>(count);
      coverage_[place(i)] = static_cast<float>(count) / samples;
    }
  });
}

}  // namespace polyhull
