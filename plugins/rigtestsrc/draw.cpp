// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/rigtestsrc/draw.h"

#include <algorithm>

#include "builtin/stamp.h"
#include "studio/cameras/yuv.h"

namespace polyhull::element {
namespace {

PictureLook look_of(const RigTestSettings& settings) {
  PictureLook look;
  const bool green = settings.screen == ScreenColour::green;
  const std::uint8_t colour[3] = {static_cast<std::uint8_t>(green ? 44 : 30),
                                  static_cast<std::uint8_t>(green ? 168 : 74),
                                  static_cast<std::uint8_t>(green ? 66 : 178)};
  std::copy(colour, colour + 3, look.screen.colour);
  look.screen.unevenness = settings.unevenness;
  look.shadow = settings.shadow;
  look.spill = settings.spill;
  look.noise = settings.noise;
  look.seed = settings.seed;
  look.linear_light = settings.linear_light;
  return look;
}

void swap_red_and_blue(std::uint8_t* pixels, int width) {
  for (int x = 0; x < width; ++x) std::swap(pixels[4 * x], pixels[4 * x + 2]);
}

void write_yuv(const std::vector<std::uint8_t>& rgba, const GstVideoFrame& frame) {
  const GstVideoInfo& info = frame.info;
  YuvCoding coding;
  if (!gst_video_color_matrix_get_Kr_Kb(info.colorimetry.matrix, &coding.kr, &coding.kb)) {
    coding.kr = 0.299;
    coding.kb = 0.114;
  }
  coding.full_range = info.colorimetry.range == GST_VIDEO_COLOR_RANGE_0_255;
  coding.left_sited = (info.chroma_site & GST_VIDEO_CHROMA_SITE_H_COSITED) != 0;
  YuvTarget target;
  const auto component = [&](int c) {
    return static_cast<std::uint8_t*>(GST_VIDEO_FRAME_COMP_DATA(&frame, c));
  };
  target.y = component(0);
  target.y_stride = GST_VIDEO_FRAME_COMP_STRIDE(&frame, 0);
  target.y_step = GST_VIDEO_FRAME_COMP_PSTRIDE(&frame, 0);
  target.cb = component(1);
  target.cr = component(2);
  target.chroma_stride = GST_VIDEO_FRAME_COMP_STRIDE(&frame, 1);
  target.chroma_step = GST_VIDEO_FRAME_COMP_PSTRIDE(&frame, 1);
  target.half_height = GST_VIDEO_FORMAT_INFO_H_SUB(info.finfo, 1) == 1;
  rgba_to_yuv(rgba.data(), static_cast<std::ptrdiff_t>(4) * info.width, info.width, info.height,
              coding, target);
}

void write_depth(RigTestDrawing& drawing, double scale, const GstVideoFrame& frame) {
  const int width = GST_VIDEO_FRAME_WIDTH(&frame), height = GST_VIDEO_FRAME_HEIGHT(&frame);
  drawing.depth.resize(static_cast<std::size_t>(width) * height);
  drawing.picture->depth(drawing.depth.data());
  const auto levels = static_cast<float>(drawing.metres_per_unit / scale);
  for (int y = 0; y < height; ++y) {
    auto* row = reinterpret_cast<guint16*>(
        static_cast<std::uint8_t*>(GST_VIDEO_FRAME_PLANE_DATA(&frame, 0)) +
        static_cast<std::ptrdiff_t>(y) * GST_VIDEO_FRAME_PLANE_STRIDE(&frame, 0));
    const float* depth = drawing.depth.data() + static_cast<std::size_t>(y) * width;
    for (int x = 0; x < width; ++x) {
      row[x] = GUINT16_TO_LE(static_cast<guint16>(std::min(depth[x] * levels + 0.5f, 65535.0f)));
    }
  }
}

}  // namespace

void prepare(RigTestDrawing& drawing, const RigTestSettings& settings) {
  if (settings.output != RigOutput::matte && settings.output != RigOutput::depth)
    drawing.picture->prepare(look_of(settings));
}

void draw(RigTestDrawing& drawing, const RigTestSettings& settings, std::uint64_t number,
          const GstVideoFrame& frame) {
  auto* pixels = static_cast<std::uint8_t*>(GST_VIDEO_FRAME_PLANE_DATA(&frame, 0));
  const std::ptrdiff_t stride = GST_VIDEO_FRAME_PLANE_STRIDE(&frame, 0);
  const int width = GST_VIDEO_FRAME_WIDTH(&frame), height = GST_VIDEO_FRAME_HEIGHT(&frame);
  if (settings.output == RigOutput::matte) {
    drawing.picture->matte(pixels, stride);
    return;
  }
  if (settings.output == RigOutput::depth) {
    write_depth(drawing, settings.depth_scale, frame);
    return;
  }
  const bool keyed = settings.output == RigOutput::keyed;
  const PictureLook look = look_of(settings);
  const auto stamp = [&](std::uint8_t* rgba, std::ptrdiff_t row) {
    if (settings.stamp)
      draw_stamp(static_cast<std::uint16_t>(number), drawing.picture->region(), rgba, row, width,
                 height);
  };
  if (GST_VIDEO_FORMAT_INFO_IS_RGB(frame.info.finfo)) {
    drawing.picture->picture(look, number, keyed, pixels, stride);
    stamp(pixels, stride);
    const GstVideoFormat format = GST_VIDEO_FRAME_FORMAT(&frame);
    if (format == GST_VIDEO_FORMAT_BGRx || format == GST_VIDEO_FORMAT_BGRA) {
      for (int y = 0; y < height; ++y) swap_red_and_blue(pixels + y * stride, width);
    }
    return;
  }
  drawing.rgba.resize(static_cast<std::size_t>(width) * height * 4);
  drawing.picture->picture(look, number, keyed, drawing.rgba.data(),
                           static_cast<std::ptrdiff_t>(4) * width);
  stamp(drawing.rgba.data(), static_cast<std::ptrdiff_t>(4) * width);
  write_yuv(drawing.rgba, frame);
}

}  // namespace polyhull::element
