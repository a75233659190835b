// SPDX-License-Identifier: LGPL-2.1-or-later
#include <algorithm>
#include <cstring>
#include <utility>

#include "base/stopwatch.h"
#include "plugins/common/memory/video_frame.h"
#include "plugins/composite/frame.h"
#include "render/dissolve.h"
#include "render/fill.h"

namespace polyhull::element {

/// The lens, and how the viewport has moved since the frame before, which may be some frames' time ago.
void FrameComposer::set_lens(const CompositeSettings& settings, const GstVideoInfo& info,
                             GstBuffer* background) {
  constexpr GstClockTime longest = GST_SECOND;  // who stood still for that long was not moving
  ViewportLens lens = lens_settings(settings, announcement_ ? &*announcement_ : nullptr);
  if (const std::string why = lens_watch_.look(viewport_); !why.empty())
    statistics_.warn(gl_.element(), "viewports-unusable", why);
  const GstClockTime time = GST_BUFFER_PTS(background);
  // Of another name, it is another camera.
  bool known = viewport_before_ && viewport_before_->name == frame_.viewport.name &&
               GST_CLOCK_TIME_IS_VALID(time) && GST_CLOCK_TIME_IS_VALID(time_before_) &&
               time > time_before_ && time - time_before_ <= longest;
  double frames = 1.0;  // since then: not all are drawn where that takes too long
  if (known && GST_VIDEO_INFO_FPS_N(&info) > 0) {
    const double frame =
        static_cast<double>(GST_SECOND) * GST_VIDEO_INFO_FPS_D(&info) / GST_VIDEO_INFO_FPS_N(&info);
    frames = std::max(static_cast<double>(time - time_before_) / frame, 1.0);
    lens.shutter /= frames;
  }
  const std::optional<Camera> before = std::exchange(viewport_before_, frame_.viewport);
  time_before_ = time;
  known = known && !MotionBlur::is_cut(resized(frame_.viewport, frame_.width, frame_.height),
                                       resized(*before, frame_.width, frame_.height), frames);
  lens_.set(frame_, lens, known ? &*before : nullptr);
  if (lens_.moves()) statistics_.count("motion-blurred");
  if (frame_.scene || frame_.depth) return;
  if ((lens.aperture > 0.0 && !lens.subject_only) || (lens_.moves() && !lens.still_background))
    statistics_.warn(gl_.element(), "lens-without-scene",
                     "No scene tells how far away the background is: its depth of field and motion "
                     "blur are those of what is infinitely far. Set scene, have the background "
                     "announce it, or set depth-of-field and motion-blur to subject.");
}

/// Brings the composite through the lens into the target.
void FrameComposer::lens_over(const DrawnRows& rows, LensWork& work) {
  lens_.draw(frame_, plan_, number_, rows.background, rows.background_stride, rows.target,
             rows.target_stride,
             [&](const RenderPlan& plan, const std::uint8_t* from, int from_stride,
                 std::uint8_t* to, int to_stride) {
               const Stopwatch own;
               with_renderer([&](Renderer& renderer) {
                 renderer.render(frame_, plan, settings_, from, from_stride, to, to_stride);
                 if (work.drawn)
                   work.drawn->add(renderer.statistics());
                 else
                   work.drawn = renderer.statistics();
               });
               work.inside += own.milliseconds();
             });
}

/// The same where the background is not opaque: over each of the greys that tell its fill and key
/// (render/fill.h), since no blur or resampling may mix colours that nobody sees.
void FrameComposer::lens_over_greys(const DrawnRows& rows, LensWork& work) {
  const auto& [background, background_stride, target, target_stride, width, height] = rows;
  const AlphaCoding alpha = std::exchange(settings_.alpha, AlphaCoding::ignored);
  const int stride = 4 * width;
  std::vector<std::uint32_t> over[3], drawn[3];
  for (int k = 0; k < 3; ++k) {
    over[k].resize(static_cast<std::size_t>(width) * height);
    for (int y = 0; y < height; ++y) {
      std::uint32_t* row = &over[k][static_cast<std::size_t>(y) * width];
      std::memcpy(row, background + static_cast<std::ptrdiff_t>(y) * background_stride,
                  static_cast<std::size_t>(stride));
      std::transform(row, row + width, row,
                     [&](std::uint32_t pixel) { return over_grey(pixel, fill_greys[k], alpha); });
    }
    drawn[k] = over[k];
    lens_over({reinterpret_cast<const std::uint8_t*>(over[k].data()), stride,
               reinterpret_cast<std::uint8_t*>(drawn[k].data()), stride, width, height},
              work);
  }
  settings_.alpha = alpha;
  for (int y = 0; y < height; ++y) {
    const std::uint8_t* from = background + static_cast<std::ptrdiff_t>(y) * background_stride;
    std::uint8_t* to = target + static_cast<std::ptrdiff_t>(y) * target_stride;
    for (int x = 0; x < width; ++x) {
      const std::size_t at = static_cast<std::size_t>(y) * width + x;
      FillPixel pixel;
      std::memcpy(&pixel.background, from + 4 * x, 4);
      for (int k = 0; k < 3; ++k) {
        pixel.over[k] = over[k][at];
        pixel.ground[k] = drawn[k][at];
      }
      pixel.whole = pixel.ground[1];
      const std::uint32_t fill = fill_of(pixel, alpha);
      std::memcpy(to + 4 * x, &fill, 4);
    }
  }
}

/// Either of these: brings the composite of the frame's subjects into the target.
void FrameComposer::draw_subjects(const DrawnRows& rows, LensWork& work) {
  if (lens_.active() && settings_.alpha != AlphaCoding::ignored &&
      any_translucent(rows.background, rows.background_stride, {0, 0, rows.width, rows.height}))
    lens_over_greys(rows, work);
  else
    lens_over(rows, work);
}

/// The same where subjects fade: with the opacities o_1 > ... > o_n, the composites C_0, C_1 ... C_n of
/// no subject, of those of opacity o_1 and so on, and o_0 = 1, o_(n+1) = 0 it is the sum of
/// (o_k - o_(k+1)) C_k, all that a subject does being in its composites.
void FrameComposer::draw_fading(const DrawnRows& rows, LensWork& work) {
  const auto& [background, background_stride, target, target_stride, width, height] = rows;
  // The target may be the same memory.
  const int stride = 4 * width;
  const auto row = static_cast<std::size_t>(stride);
  unfaded_.resize(row * static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y)
    std::memcpy(&unfaded_[row * static_cast<std::size_t>(y)],
                background + static_cast<std::ptrdiff_t>(y) * background_stride, row);
  draw_subjects({unfaded_.data(), stride, target, target_stride, width, height}, work);
  while (!frame_.subjects.empty()) {
    const float lowest = *std::min_element(opacities_.begin(), opacities_.end());
    for (std::size_t i = opacities_.size(); i-- > 0;) {
      if (opacities_[i] > lowest) continue;
      opacities_.erase(opacities_.begin() + static_cast<std::ptrdiff_t>(i));
      frame_.subjects.erase(frame_.subjects.begin() + static_cast<std::ptrdiff_t>(i));
    }
    const float next =
        opacities_.empty() ? 1.0f : *std::min_element(opacities_.begin(), opacities_.end());
    if (lowest == next) break;
    plan_ = plan();
    less_ = unfaded_;
    draw_subjects({unfaded_.data(), stride, less_.data(), stride, width, height}, work);
    dissolve(target, target_stride, less_.data(), stride, width, height, lowest / next,
             settings_.alpha);
  }
}

/// In system memory, whatever draws and wherever the pictures come from; keys that become video, too,
/// whose lens may change nothing, and subjects that fade.
void FrameComposer::draw_through_lens(const FrameBuffers& buffers, GstBuffer* output) {
  const int width = GST_VIDEO_INFO_WIDTH(buffers.info),
            height = GST_VIDEO_INFO_HEIGHT(buffers.info);
  const auto finish = [&](const std::uint8_t* from, int from_stride, std::uint8_t* to,
                          int to_stride) {
    const DrawnRows rows{from, from_stride, to, to_stride, width, height};
    LensWork work;
    const Stopwatch watch;
    if (fading_)
      draw_fading(rows, work);
    else
      draw_subjects(rows, work);
    if (work.drawn) report(*work.drawn);
    statistics_.set("lens-ms", watch.milliseconds() - work.inside);
    if (lens_.active()) statistics_.count("through-lens");
  };
  if (output == buffers.background) {
    const MappedFrame both(*buffers.info, output, GST_MAP_READWRITE);
    check_strides(both.stride(), both.stride());
    finish(both.data(), both.stride(), both.data(), both.stride());
    return;
  }
  const MappedFrame background(*buffers.info, buffers.background, GST_MAP_READ);
  const bool video = is_video_output(*buffers.output);
  if (video && view_ == CompositeView::composite) settings_.alpha = AlphaCoding::ignored;
  const MappedFrame target(video ? *buffers.output : *buffers.info, output,
                           video ? GST_MAP_WRITE : GST_MAP_READWRITE);
  std::uint8_t* drawn = target.data();
  int stride = target.stride();
  const std::size_t row = 4 * static_cast<std::size_t>(width);
  if (video) {
    through_lens_.resize(row * static_cast<std::size_t>(height));
    drawn = through_lens_.data();
    stride = static_cast<int>(row);
  }
  check_strides(background.stride(), stride);
  for (int y = 0; y < height; ++y)
    std::memcpy(drawn + static_cast<std::ptrdiff_t>(y) * stride,
                background.data() + static_cast<std::ptrdiff_t>(y) * background.stride(), row);
  finish(background.data(), background.stride(), drawn, stride);
  if (video && view_ == CompositeView::key) show_key(drawn, stride, width, height);
  if (video) write_yuv(drawn, stride, yuv_picture(target.frame()));
}

}  // namespace polyhull::element
