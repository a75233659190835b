// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// contourfind: turns a keyed frame (RGBA with the matte in alpha, or GRAY8) into a view: the
/// silhouette's contours with sub-pixel precision as polygons with few vertices, and only those
/// pixels of the frame that the silhouette covers. A frame without foreground becomes an empty
/// view.
#include <gst/base/gstbasetransform.h>
#include <gst/video/video.h>

#include <algorithm>
#include <cstring>

#include "plugins/common/memory/matte_meta.h"
#include "plugins/common/memory/payload_buffer.h"
#include "plugins/common/silhouette/view_element.h"
#include "silhouette/pixels/matte_content.h"
#include "silhouette/silhouette.h"

GST_DEBUG_CATEGORY_STATIC(contourfind_debug);
#define GST_CAT_DEFAULT contourfind_debug

namespace {

using namespace polyhull;
using namespace polyhull::element;

struct ContourFind : ViewElement {
  static constexpr char type_name[] = "PolyhullContourFind";
  static GType base_type() { return GST_TYPE_BASE_TRANSFORM; }
  static void class_init(gpointer klass);

  explicit ContourFind(gpointer) { declare_contour_statistics(statistics); }
  const Rings& find_contours(MatteContent content, const ContourValues& values, double tolerance);
  GstBuffer* make_view(GstBaseTransform* base, const GstVideoFrame& frame);

  Statistics statistics{"contourfind-stats"};
  Contourer contourer;  // this and the rest belong to the streaming thread
  MatteContent before;  // of the frame before, where it may be needed
  PlanePool<Matte> mattes;
};

gboolean set_caps(GstBaseTransform* base, GstCaps* in, GstCaps*) {
  ContourFind& self = state_of<ContourFind>(base);
  if (!self.set_format(base, in)) return FALSE;
  self.before = {};
  return TRUE;
}

MatteContent content_of(ContourFind& self, const GstVideoFrame& frame) {
  const AlphaView alpha = alpha_of(frame);
  const MatteContent* attached = attached_matte(frame.buffer, alpha, is_unwritten(frame.buffer));
  if (attached != nullptr) return *attached;
  return {read_matte(alpha, self.mattes), nullptr, 0.0};
}

/// Writes what was keyed into a view's alpha, where the blur changed it: a picture's edges are as soft
/// as that, and its colours belong to it.
void write_keyed(const MatteContent& content, const View& view, std::uint8_t* alpha, int step) {
  const Rectangle& roi = view.roi;
  const int end = roi.x + roi.width;
  for (int y = roi.y; y < roi.y + roi.height; ++y, alpha += view.stride) {
    const BlockState* const blurred = content.field->state_row(y);
    const BlockState* const states = content.keyed->state_row(y);
    const std::uint8_t* const keyed = content.keyed->row(y);
    for (int block = roi.x / matte_block; block * matte_block < end; ++block) {
      if (states[block] == blurred[block] && states[block] != block_mixed) continue;
      const int last = std::min((block + 1) * matte_block, end);
      for (int x = std::max(block * matte_block, roi.x); x < last; ++x)
        alpha[step * (x - roi.x)] = keyed[x];
    }
  }
}

/// The contours of \p content: where reuse is on and neither it nor the settings changed, those of
/// the frame before.
const Rings& ContourFind::find_contours(MatteContent content, const ContourValues& values,
                                        double tolerance) {
  const ContourSettings settings{{values.method, values.correct_curvature ? content.sigma : 0.0},
                                 values.approximation(tolerance),
                                 values.steadiness};
  const bool reused = values.reuse && contourer.holds(settings) && same_content(content, before);
  if (!reused && content.field != nullptr)
    contourer.find(*content.field, settings);
  else if (!reused)
    contourer.find(*content.matte, settings);
  before = values.reuse ? std::move(content) : MatteContent{};
  report_contours(statistics, contourer.counts(), {reused, !reused && contourer.stayed()},
                  tolerance);
  return contourer.contours();
}

GstBuffer* ContourFind::make_view(GstBaseTransform* base, const GstVideoFrame& frame) {
  const ContourValues values = snapshot(base, contour);
  const double tolerance = tolerance_of(values);
  begin_view(base, values, frame);
  const MatteContent content = content_of(*this, frame);
  view.contours = find_contours(content, values, tolerance);
  view.roi = bounding_rectangle(view.contours, view.width, view.height);
  if (view.roi.empty()) return writer.write(view, nullptr, frame.buffer);

  const int pixel = GST_VIDEO_FRAME_COMP_PSTRIDE(&frame, 0);
  view.format = pixel == 4 ? PixelFormat::rgba : PixelFormat::grey;
  view.stride = view.roi.width * pixel;
  const std::size_t stride = view.stride;
  MappedMemory pixels(writer.allocate(stride * view.roi.height), GST_MAP_READWRITE);
  const auto* source = static_cast<const std::uint8_t*>(GST_VIDEO_FRAME_PLANE_DATA(&frame, 0)) +
                       static_cast<std::ptrdiff_t>(pixel) * view.roi.x;
  const std::ptrdiff_t source_stride = GST_VIDEO_FRAME_PLANE_STRIDE(&frame, 0);
  for (int y = 0; y < view.roi.height; ++y) {
    std::memcpy(pixels.data() + stride * y, source + source_stride * (view.roi.y + y), stride);
  }
  if (content.keyed != nullptr) write_keyed(content, view, pixels.data() + pixel - 1, pixel);
  view.pixels = pixels.bytes();
  return writer.write(view, pixels.memory(), frame.buffer);
}

gboolean start(GstBaseTransform* base) {
  ContourFind& self = state_of<ContourFind>(base);
  self.statistics.reset();
  self.control.reset();
  return TRUE;
}

gboolean stop(GstBaseTransform* base) {
  ContourFind& self = state_of<ContourFind>(base);
  self.before = {};
  self.mattes.clear();
  return TRUE;
}

void ContourFind::class_init(gpointer klass) {
  GST_DEBUG_CATEGORY_INIT(contourfind_debug, "contourfind", 0, "contours of mattes");
  add_properties<ContourFind>(klass, contour_properties(), &ContourFind::contour);
  add_statistics<ContourFind>(klass, contour_statistics_blurb);
  set_metadata(klass, "Contour finder", "Filter/Analyzer/Video",
               "Turns keyed frames into views: the silhouette's contours and the pixels it covers");
  add_template(klass, "sink", GST_PAD_SINK, GST_VIDEO_CAPS_MAKE("{ RGBA, GRAY8 }"));
  add_template(klass, "src", GST_PAD_SRC, view_caps);
  install_view_element<ContourFind>(klass);
  auto* base_class = GST_BASE_TRANSFORM_CLASS(klass);
  base_class->set_caps = set_caps;
  base_class->start = start;
  base_class->stop = stop;
}

}  // namespace

GST_ELEMENT_REGISTER_DEFINE(contourfind, "contourfind", GST_RANK_NONE, type_of<ContourFind>())
