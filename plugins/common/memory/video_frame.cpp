// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/memory/video_frame.h"

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>

#include "base/error.h"

namespace polyhull::element {
namespace {

/// Where the samples of three components lie that are bytes or little-endian words.
SampleLayout samples_of(const GstVideoFormatInfo* info) {
  SampleLayout samples;
  samples.bits = static_cast<int>(GST_VIDEO_FORMAT_INFO_DEPTH(info, 0));
  for (guint c = 0; c < 3; ++c) {
    // P010's and P012's offsets count words: no word begins at an odd byte.
    const int offset = static_cast<int>(GST_VIDEO_FORMAT_INFO_POFFSET(info, c));
    samples.components[c] = {static_cast<int>(GST_VIDEO_FORMAT_INFO_PLANE(info, c)),
                             samples.bits > 8 && offset % 2 != 0 ? 2 * offset : offset,
                             GST_VIDEO_FORMAT_INFO_PSTRIDE(info, c)};
  }
  samples.shift = static_cast<int>(GST_VIDEO_FORMAT_INFO_SHIFT(info, 0));
  samples.rgb = GST_VIDEO_FORMAT_INFO_IS_RGB(info);
  samples.halved_across = GST_VIDEO_FORMAT_INFO_W_SUB(info, 1) != 0;
  samples.halved_down = GST_VIDEO_FORMAT_INFO_H_SUB(info, 1) != 0;
  return samples;
}

FrameFormat format_of(GstVideoFormat format) {
  constexpr std::pair<GstVideoFormat, FrameFormat> known[] = {
      {GST_VIDEO_FORMAT_RGBx, FrameFormat::rgbx},
      {GST_VIDEO_FORMAT_BGRx, FrameFormat::bgrx},
      {GST_VIDEO_FORMAT_RGBA, FrameFormat::rgba},
      {GST_VIDEO_FORMAT_BGRA, FrameFormat::bgra},
      {GST_VIDEO_FORMAT_RGB, FrameFormat::rgb},
      {GST_VIDEO_FORMAT_BGR, FrameFormat::bgr},
      {GST_VIDEO_FORMAT_GRAY8, FrameFormat::gray8},
      {GST_VIDEO_FORMAT_I420, FrameFormat::i420},
      {GST_VIDEO_FORMAT_NV12, FrameFormat::nv12},
      {GST_VIDEO_FORMAT_YUY2, FrameFormat::yuy2},
      {GST_VIDEO_FORMAT_UYVY, FrameFormat::uyvy},
      {GST_VIDEO_FORMAT_I420_10LE, FrameFormat::i420_10le},
      {GST_VIDEO_FORMAT_v210, FrameFormat::v210}};
  for (const auto& [theirs, ours] : known)
    if (theirs == format) return ours;
  const GstVideoFormatInfo* info = gst_video_format_get_info(format);
  const bool readable =
      GST_VIDEO_FORMAT_INFO_DEPTH(info, 0) <= 8 || GST_VIDEO_FORMAT_INFO_IS_LE(info);
  if ((GST_VIDEO_FORMAT_INFO_IS_YUV(info) || GST_VIDEO_FORMAT_INFO_IS_RGB(info)) && readable &&
      !GST_VIDEO_FORMAT_INFO_IS_COMPLEX(info) && !GST_VIDEO_FORMAT_INFO_IS_TILED(info) &&
      GST_VIDEO_FORMAT_INFO_W_SUB(info, 1) <= 1 && GST_VIDEO_FORMAT_INFO_H_SUB(info, 1) <= 1)
    return FrameFormat::described;
  throw Error(Error::Kind::unsupported,
              "The video format {} cannot be keyed; put a videoconvert in front.",
              gst_video_format_to_string(format));
}

ColourMatrix matrix_of(const GstVideoInfo& info) {
  switch (GST_VIDEO_INFO_COLORIMETRY(&info).matrix) {
    case GST_VIDEO_COLOR_MATRIX_BT709:
    case GST_VIDEO_COLOR_MATRIX_SMPTE240M:  // nearest of the three; differs by 0.01 in Kr
      return ColourMatrix::bt709;
    case GST_VIDEO_COLOR_MATRIX_BT2020:
      return ColourMatrix::bt2020;
    default:
      return ColourMatrix::bt601;
  }
}

ChromaSite site_of(const GstVideoInfo& info) {
  const GstVideoChromaSite site = GST_VIDEO_INFO_CHROMA_SITE(&info);
  if (site == GST_VIDEO_CHROMA_SITE_UNKNOWN) return ChromaSite::left;
  const bool horizontal = (site & GST_VIDEO_CHROMA_SITE_H_COSITED) != 0;
  const bool vertical = (site & GST_VIDEO_CHROMA_SITE_V_COSITED) != 0;
  if (vertical) return horizontal ? ChromaSite::top_left : ChromaSite::top;
  return horizontal ? ChromaSite::left : ChromaSite::centre;
}

/// What caps say of a mosaic; 0 bits: they are of none.
struct Mosaic {
  int bits = 0;
  BayerOrder order = BayerOrder::bggr;
};

Mosaic mosaic_of(const GstCaps* caps) {
  const GstStructure* structure = gst_caps_get_structure(caps, 0);
  const gchar* format = gst_structure_get_string(structure, "format");
  if (!gst_structure_has_name(structure, "video/x-bayer") || format == nullptr) return {};
  const std::string_view name = format;
  Mosaic mosaic;
  for (const auto& [letters, order] :
       {std::pair{"bggr", BayerOrder::bggr}, std::pair{"gbrg", BayerOrder::gbrg},
        std::pair{"grbg", BayerOrder::grbg}, std::pair{"rggb", BayerOrder::rggb}})
    if (name.starts_with(letters)) mosaic.order = order;
  mosaic.bits = name.ends_with("10le") ? 10 : name.ends_with("12le") ? 12 : 8;
  return mosaic;
}

[[noreturn]] void refuse(const GstVideoInfo& info, GstBuffer* buffer) {
  throw Error(Error::Kind::io,
              "A buffer of {} bytes cannot be mapped as a frame of the {} bytes that its caps "
              "announce; look at the element in front.",
              gst_buffer_get_size(buffer), GST_VIDEO_INFO_SIZE(&info));
}

}  // namespace

bool is_mosaic(const GstCaps* caps) {
  return mosaic_of(caps).bits > 0;
}

bool video_info_of(const GstCaps* caps, GstVideoInfo* info) {
  const Mosaic mosaic = mosaic_of(caps);
  if (mosaic.bits == 0) return gst_video_info_from_caps(info, caps) != FALSE;
  const GstStructure* structure = gst_caps_get_structure(caps, 0);
  gint width = 0, height = 0, numerator = 0, denominator = 1;
  if (!gst_structure_get(structure, "width", G_TYPE_INT, &width, "height", G_TYPE_INT, &height,
                         nullptr) ||
      width < 1 || height < 1)
    return false;
  // Rows begin at multiples of four bytes, as those of grey frames do.
  gst_video_info_init(info);
  gst_video_info_set_format(info,
                            mosaic.bits > 8 ? GST_VIDEO_FORMAT_GRAY16_LE : GST_VIDEO_FORMAT_GRAY8,
                            static_cast<guint>(width), static_cast<guint>(height));
  if (gst_structure_get_fraction(structure, "framerate", &numerator, &denominator)) {
    GST_VIDEO_INFO_FPS_N(info) = numerator;
    GST_VIDEO_INFO_FPS_D(info) = denominator;
  }
  return true;
}

FrameView frame_template(const GstCaps* caps, const GstVideoInfo& info) {
  if (GST_VIDEO_INFO_IS_INTERLACED(&info))
    throw Error(Error::Kind::unsupported,
                "Interlaced frames (interlace-mode={}) show two instants and cannot be keyed; put "
                "\"deinterlace\" in front.",
                gst_video_interlace_mode_to_string(GST_VIDEO_INFO_INTERLACE_MODE(&info)));
  FrameView layout;
  const Mosaic mosaic = mosaic_of(caps);
  if (mosaic.bits == 0) layout.format = format_of(GST_VIDEO_INFO_FORMAT(&info));
  if (layout.format == FrameFormat::described) layout.samples = samples_of(info.finfo);
  if (mosaic.bits == 8) layout.format = FrameFormat::bayer8;
  if (mosaic.bits == 10) layout.format = FrameFormat::bayer10le;
  if (mosaic.bits == 12) layout.format = FrameFormat::bayer12le;
  layout.bayer = mosaic.order;
  layout.width = GST_VIDEO_INFO_WIDTH(&info);
  layout.height = GST_VIDEO_INFO_HEIGHT(&info);
  layout.matrix = matrix_of(info);
  layout.full_range = GST_VIDEO_INFO_COLORIMETRY(&info).range == GST_VIDEO_COLOR_RANGE_0_255;
  layout.site = site_of(info);
  return layout;
}

void warn_of_wide_colours(GstElement* element, Statistics& statistics, const GstVideoInfo& info) {
  const GstVideoColorimetry& colour = GST_VIDEO_INFO_COLORIMETRY(&info);
  const char* what =
      colour.transfer == GST_VIDEO_TRANSFER_ARIB_STD_B67     ? "is of high dynamic range (HLG)"
      : colour.transfer == GST_VIDEO_TRANSFER_SMPTE2084      ? "is of high dynamic range (PQ)"
      : colour.primaries == GST_VIDEO_COLOR_PRIMARIES_BT2020 ? "has the primaries of BT.2020"
                                                             : nullptr;
  if (what == nullptr) return;
  statistics.warn(
      element, "colours-unconverted",
      fmt::format("The video {}, and its colours are taken for those of BT.709, so they are pale "
                  "or dark beside others. Record without (phones: switch HDR off), or convert the "
                  "recording to BT.709 first, with a program that maps tones.",
                  what));
}

FrameView frame_view(const FrameView& layout, const GstVideoFrame& frame) {
  FrameView view = layout;
  // A fourth plane is alpha, which the keyer ignores.
  const guint planes = std::min<guint>(GST_VIDEO_FRAME_N_PLANES(&frame), view.planes.size());
  for (guint plane = 0; plane < planes; ++plane) {
    view.planes[plane] =
        static_cast<const std::uint8_t*>(GST_VIDEO_FRAME_PLANE_DATA(&frame, plane));
    view.strides[plane] = GST_VIDEO_FRAME_PLANE_STRIDE(&frame, plane);
  }
  return view;
}

MappedFrame::MappedFrame(const GstVideoInfo& info, GstBuffer* buffer, GstMapFlags flags) {
  // Of a mosaic, sources attach a format that has no name.
  const GstVideoMeta* meta = gst_buffer_get_video_meta(buffer);
  if (meta != nullptr && meta->format != GST_VIDEO_INFO_FORMAT(&info)) {
    map_plain(info, *meta, buffer, flags);
    return;
  }
  // No reference is added: the caller holds the buffer while this object lives.
  const auto without_ref = static_cast<GstMapFlags>(
      static_cast<int>(flags) | static_cast<int>(GST_VIDEO_FRAME_MAP_FLAG_NO_REF));
  if (!gst_video_frame_map(&frame_, &info, buffer, without_ref)) {
    refuse(info, buffer);
  }
}

void MappedFrame::map_plain(const GstVideoInfo& info, const GstVideoMeta& meta, GstBuffer* buffer,
                            GstMapFlags flags) {
  frame_ = {};
  frame_.info = info;
  gsize needed = GST_VIDEO_INFO_SIZE(&info);
  // Some sources attach no more than the format, others how the rows lie, too.
  if (GST_VIDEO_INFO_N_PLANES(&info) == 1 && meta.stride[0] != 0) {
    const int row = GST_VIDEO_INFO_COMP_PSTRIDE(&info, 0) * GST_VIDEO_INFO_WIDTH(&info);
    if (meta.stride[0] < row) refuse(info, buffer);
    GST_VIDEO_INFO_PLANE_STRIDE(&frame_.info, 0) = meta.stride[0];
    GST_VIDEO_INFO_PLANE_OFFSET(&frame_.info, 0) = meta.offset[0];
    const auto rows_before = static_cast<gsize>(GST_VIDEO_INFO_HEIGHT(&info) - 1);
    needed =
        meta.offset[0] + rows_before * static_cast<gsize>(meta.stride[0]) + static_cast<gsize>(row);
  }
  if (gst_buffer_get_size(buffer) < needed || !gst_buffer_map(buffer, &frame_.map[0], flags))
    refuse(info, buffer);
  plain_ = true;
  frame_.buffer = buffer;
  for (guint i = 0; i < GST_VIDEO_INFO_N_PLANES(&info); ++i)
    frame_.data[i] = frame_.map[0].data + GST_VIDEO_INFO_PLANE_OFFSET(&frame_.info, i);
}

MappedFrame::~MappedFrame() {
  if (plain_)
    gst_buffer_unmap(frame_.buffer, &frame_.map[0]);
  else
    gst_video_frame_unmap(&frame_);
}

}  // namespace polyhull::element
