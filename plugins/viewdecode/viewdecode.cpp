// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// viewdecode: unpacks the pixels of views that viewencode has packed. Others pass as they are.
#include <gst/base/gstbasetransform.h>

#include "base/error.h"
#include "base/stopwatch.h"
#include "plugins/common/element.h"
#include "plugins/common/guard.h"
#include "plugins/common/log.h"
#include "plugins/common/memory/payload_buffer.h"
#include "plugins/common/transform.h"
#include "wire/coded_view.h"

GST_DEBUG_CATEGORY_STATIC(viewdecode_debug);
#define GST_CAT_DEFAULT viewdecode_debug

namespace {

using namespace polyhull;
using namespace polyhull::element;

struct ViewDecode {
  static constexpr char type_name[] = "PolyhullViewDecode";
  static GType base_type() { return GST_TYPE_BASE_TRANSFORM; }
  static void class_init(gpointer klass);

  explicit ViewDecode(gpointer object) {
    statistics.declare({"views", "views-packed", "views-damaged", "bytes-in", "bytes-out"});
    statistics.set("unpack-ms", 0.0);
    gst_base_transform_set_qos_enabled(GST_BASE_TRANSFORM(object), FALSE);
  }

  Statistics statistics{"viewdecode-stats"};
  PixelDecoder decoder;  // of the streaming thread
  ViewWriter writer;
};

/// The view in \p coded with its pixels unpacked.
GstBuffer* unpacked(ViewDecode& self, CodedView& coded, GstBuffer* source) {
  const PixelShape shape = coded.shape();
  MappedMemory memory(self.writer.allocate(shape.bytes()), GST_MAP_WRITE);
  self.decoder.decode(coded.coding, shape, coded.block, {memory.data(), shape.bytes()});
  coded.view.pixels = {memory.data(), shape.bytes()};
  return self.writer.write(coded.view, memory.memory(), source);
}

GstFlowReturn prepare_output_buffer(GstBaseTransform* base, GstBuffer* in, GstBuffer** out) {
  auto* element = GST_ELEMENT_CAST(base);
  ViewDecode& self = state_of<ViewDecode>(base);
  return guarded(element, GST_FLOW_ERROR, [&]() -> GstFlowReturn {
    const Stopwatch watch;
    try {
      MappedBuffer mapped(in);
      if (mapped.segments().size() > 2) mapped.join();
      CodedView coded = read_coded_view(mapped.segments());
      *out = coded.coding == PixelCoding::raw ? in : unpacked(self, coded, in);
      if (coded.coding != PixelCoding::raw) self.statistics.count("views-packed");
    } catch (const Error& error) {
      self.statistics.warn(element, "views-damaged",
                           fmt::format("A view was left out: {}", error.what()));
      return GST_BASE_TRANSFORM_FLOW_DROPPED;
    }
    self.statistics.count("views");
    self.statistics.count("bytes-in", gst_buffer_get_size(in));
    self.statistics.count("bytes-out", gst_buffer_get_size(*out));
    self.statistics.set("unpack-ms", watch.milliseconds());
    GST_LOG_OBJECT(base, "%s, %zu bytes: %" GST_PTR_FORMAT,
                   *out == in ? "passed as it is" : "unpacked", gst_buffer_get_size(*out),
                   printed(in));
    return GST_FLOW_OK;
  });
}

gboolean start(GstBaseTransform* base) {
  state_of<ViewDecode>(base).statistics.reset();
  return TRUE;
}

void ViewDecode::class_init(gpointer klass) {
  GST_DEBUG_CATEGORY_INIT(viewdecode_debug, "viewdecode", 0, "pixels of views, unpacked");
  add_statistics<ViewDecode>(
      klass,
      "Counters since the start: views, views-packed (of these), views-damaged (left out), "
      "bytes-in, bytes-out; unpack-ms, the milliseconds that the last view took.");
  set_metadata(klass, "View unpacker", "Filter/Converter",
               "Unpacks the pixels of views that viewencode has packed");
  add_template(klass, "sink", GST_PAD_SINK, view_caps);
  add_template(klass, "src", GST_PAD_SRC, view_caps);
  auto* base_class = GST_BASE_TRANSFORM_CLASS(klass);
  base_class->start = start;
  base_class->prepare_output_buffer = prepare_output_buffer;
  leave_nothing_to_transform(base_class);
}

}  // namespace

GST_ELEMENT_REGISTER_DEFINE(viewdecode, "viewdecode", GST_RANK_NONE, type_of<ViewDecode>())
