// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// viewencode: packs the pixels of views, for slow wires and long takes (lib/wire/pixel_coding.h);
/// viewdecode unpacks them. The rest of a view stays as it is.
#include <gst/base/gstbasetransform.h>

#include <ctime>
#include <new>
#include <optional>
#include <vector>

#include "base/error.h"
#include "plugins/common/element.h"
#include "plugins/common/guard.h"
#include "plugins/common/log.h"
#include "plugins/common/memory/payload_buffer.h"
#include "plugins/common/transform.h"
#include "wire/coded_view.h"
#include "wire/coding_choice.h"

GST_DEBUG_CATEGORY_STATIC(viewencode_debug);
#define GST_CAT_DEFAULT viewencode_debug

namespace polyhull::element {

enum class ViewCoding { automatic, none, lz4, zstd, jpeg };

template <>
GType enum_type<ViewCoding>() {
  return register_enum<ViewCoding>(
      "PolyhullViewCoding",
      {{ViewCoding::automatic, "Whatever brings views over the link soonest", "auto"},
       {ViewCoding::none, "As they are", "none"},
       {ViewCoding::lz4, "LZ4 of differences: the quickest, without loss", "lz4"},
       {ViewCoding::zstd, "zstd of differences: about half, without loss", "zstd"},
       {ViewCoding::jpeg, "The colours as JPEG, the matte without loss: a sixth", "jpeg"}});
}

}  // namespace polyhull::element

namespace {

using namespace polyhull;
using namespace polyhull::element;

struct Settings {
  ViewCoding coding = ViewCoding::automatic;
  double link = 1000;
  bool lossless = true;
  std::uint32_t quality = 90;
};

struct ViewEncode {
  static constexpr char type_name[] = "PolyhullViewEncode";
  static GType base_type() { return GST_TYPE_BASE_TRANSFORM; }
  static void class_init(gpointer klass);

  explicit ViewEncode(gpointer object) {
    statistics.declare({"views", "views-unusable", "bytes-in", "bytes-out", "views-raw",
                        "views-lz4", "views-zstd", "views-jpeg"});
    statistics.set("pack-ms", 0.0);
    // A view left out here would be missing from its set.
    gst_base_transform_set_qos_enabled(GST_BASE_TRANSFORM(object), FALSE);
  }

  Settings settings;  // under the object lock
  Statistics statistics{"viewencode-stats"};
  PixelEncoder encoder;  // the rest belongs to the streaming thread
  PixelDecoder decoder;
  CodingChoice choice;
  std::vector<std::uint8_t> unpacked;
};

std::span<const Property<Settings>> properties() {
  using S = Settings;
  static const Property<S> table[] = {
      property<&S::coding>("coding",
                           "How pixels are packed. 'auto' measures on every fiftieth view which "
                           "coding brings it over the link soonest."),
      property<&S::link>("link",
                         "For coding=auto: megabits a second that this view's way has, its part of "
                         "a link that several share (1 to 1000000).",
                         1, 1e6),
      property<&S::lossless>("lossless",
                             "For coding=auto: whether what comes out of viewdecode must be what "
                             "went in. Without it JPEG may be chosen, too."),
      property<&S::quality>("quality", "Of JPEG (1 to 100).", 1, 100),
  };
  return table;
}

/// Processor time of this thread, ms: what else runs on the machine is not the coding's.
double thread_ms() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

/// Of the codings, by their numbers.
constexpr const char* counters[] = {"views-raw", "views-lz4", "views-zstd", "views-jpeg"};

/// Tries what may be chosen.
void try_all(ViewEncode& self, const View& view, const PixelShape& shape,
             const Settings& settings) {
  self.unpacked.resize(shape.bytes());
  for (const PixelCoding coding : {PixelCoding::lz4, PixelCoding::zstd, PixelCoding::jpeg}) {
    if (coding == PixelCoding::jpeg && (settings.lossless || shape.channels != 4)) continue;
    const double begin = thread_ms();
    const auto block = self.encoder.encode(coding, shape, view.pixels, view.stride,
                                           static_cast<int>(settings.quality));
    const double packed = thread_ms();
    self.decoder.decode(coding, shape, block, self.unpacked);
    const double end = thread_ms();
    self.choice.note(coding, {shape.bytes(), block.size(), packed - begin, end - packed});
    GST_DEBUG("trial of %s: %zu bytes become %zu, packed in %.2f ms and unpacked in %.2f ms",
              counters[static_cast<std::size_t>(coding)], shape.bytes(), block.size(),
              packed - begin, end - packed);
  }
}

PixelCoding coding_of(ViewEncode& self, const Settings& settings, const View& view,
                      const PixelShape& shape) {
  switch (settings.coding) {
    case ViewCoding::none:
      return PixelCoding::raw;
    case ViewCoding::lz4:
      return PixelCoding::lz4;
    case ViewCoding::zstd:
      return PixelCoding::zstd;
    case ViewCoding::jpeg:
      // A grey picture is a matte, which stays exact.
      return shape.channels == 4 ? PixelCoding::jpeg : PixelCoding::zstd;
    case ViewCoding::automatic:
      break;
  }
  if (self.choice.trial_due()) try_all(self, view, shape, settings);
  return self.choice.choose(shape.bytes(), settings.link,
                            !settings.lossless && shape.channels == 4);
}

GstBuffer* coded_buffer(const View& view, PixelCoding coding, std::span<const std::uint8_t> block,
                        GstBuffer* source) {
  const std::vector<std::uint8_t> header = write_coded_view_header(view, coding, block.size());
  GstBuffer* buffer = gst_buffer_new_allocate(nullptr, header.size() + block.size(), nullptr);
  if (buffer == nullptr) throw std::bad_alloc();
  gst_buffer_fill(buffer, 0, header.data(), header.size());
  gst_buffer_fill(buffer, header.size(), block.data(), block.size());
  gst_buffer_copy_into(
      buffer, source,
      static_cast<GstBufferCopyFlags>(GST_BUFFER_COPY_FLAGS | GST_BUFFER_COPY_TIMESTAMPS), 0, -1);
  return buffer;
}

/// Makes the buffer that goes on: the one that came, where its pixels stay as they are.
GstFlowReturn prepare_output_buffer(GstBaseTransform* base, GstBuffer* in, GstBuffer** out) {
  auto* element = GST_ELEMENT_CAST(base);
  ViewEncode& self = state_of<ViewEncode>(base);
  return guarded(element, GST_FLOW_ERROR, [&]() -> GstFlowReturn {
    const Settings settings = snapshot(base, self.settings);
    std::optional<ViewBuffer> view;
    try {
      view.emplace(in);
    } catch (const Error& error) {
      self.statistics.warn(element, "views-unusable",
                           fmt::format("A view was left out: {}", error.what()));
      return GST_BASE_TRANSFORM_FLOW_DROPPED;
    }
    const View& seen = view->view();
    const PixelShape shape{seen.roi.width, seen.roi.height, bytes_per_pixel(seen.format)};
    const double begin = thread_ms();
    // Nobody packs what is larger than viewdecode unpacks.
    const bool packable = shape.bytes() > 0 && shape.bytes() <= most_decoded_bytes;
    const PixelCoding coding = packable ? coding_of(self, settings, seen, shape) : PixelCoding::raw;
    *out = in;
    if (coding != PixelCoding::raw)
      *out = coded_buffer(seen, coding,
                          self.encoder.encode(coding, shape, seen.pixels, seen.stride,
                                              static_cast<int>(settings.quality)),
                          in);
    self.statistics.count(counters[static_cast<std::size_t>(coding)]);
    self.statistics.count("views");
    self.statistics.count("bytes-in", gst_buffer_get_size(in));
    self.statistics.count("bytes-out", gst_buffer_get_size(*out));
    self.statistics.set("pack-ms", thread_ms() - begin);
    GST_LOG_OBJECT(base, "%s, %zu bytes: %" GST_PTR_FORMAT,
                   counters[static_cast<std::size_t>(coding)], gst_buffer_get_size(*out),
                   printed(in));
    return GST_FLOW_OK;
  });
}

gboolean start(GstBaseTransform* base) {
  ViewEncode& self = state_of<ViewEncode>(base);
  self.statistics.reset();
  self.choice = CodingChoice();
  return TRUE;
}

void ViewEncode::class_init(gpointer klass) {
  GST_DEBUG_CATEGORY_INIT(viewencode_debug, "viewencode", 0, "pixels of views, packed");
  add_properties<ViewEncode>(klass, properties(), &ViewEncode::settings);
  add_statistics<ViewEncode>(
      klass,
      "Counters since the start: views, views-unusable (left out), bytes-in, bytes-out, and how "
      "the pixels went: views-raw, views-lz4, views-zstd, views-jpeg; pack-ms, the milliseconds of "
      "processor time that the last view took.");
  set_metadata(klass, "View packer", "Filter/Converter",
               "Packs the pixels of views for a wire or a take");
  add_template(klass, "sink", GST_PAD_SINK, view_caps);
  add_template(klass, "src", GST_PAD_SRC, view_caps);
  auto* base_class = GST_BASE_TRANSFORM_CLASS(klass);
  base_class->start = start;
  base_class->before_transform = sync_controlled_properties;
  base_class->prepare_output_buffer = prepare_output_buffer;
  leave_nothing_to_transform(base_class);
}

}  // namespace

GST_ELEMENT_REGISTER_DEFINE(viewencode, "viewencode", GST_RANK_NONE, type_of<ViewEncode>())
