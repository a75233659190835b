// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// silhouette: chromamatte, gaussblur and contourfind in one pass over the frame, without writing a
/// keyed picture in between. It has the properties of the three; the three called `method` are
/// key-method, blur-method and contour-method here. With the same settings its views are the same
/// bytes as those of the three elements one after the other.
#include <gst/base/gstbasetransform.h>
#include <gst/video/video.h>

#include <span>
#include <utility>

#include "plugins/common/memory/payload_buffer.h"
#include "plugins/common/silhouette/blur_properties.h"
#include "plugins/common/silhouette/key_properties.h"
#include "plugins/common/silhouette/view_element.h"
#include "silhouette/silhouette.h"

GST_DEBUG_CATEGORY_STATIC(silhouette_debug);
#define GST_CAT_DEFAULT silhouette_debug

namespace {

using namespace polyhull;
using namespace polyhull::element;

/// The pixels of the view before, which a frame that changed nothing sends again.
struct Sent {
  Ref<GstMemory> pixels;
  Rectangle roi;
};

struct SilhouetteElement : ViewElement {
  static constexpr char type_name[] = "PolyhullSilhouette";
  static GType base_type() { return GST_TYPE_BASE_TRANSFORM; }
  static void class_init(gpointer klass);

  explicit SilhouetteElement(gpointer) {
    declare_contour_statistics(statistics);
    declare_key_statistics(statistics);
    statistics.declare({"frames-unwanted", "colours-unconverted"});
  }
  bool configure(GstElement* element, const KeyValues& key_now, const BlurSettings& blur_now,
                 const ContourValues& contour_now, double tolerance);
  GstBuffer* make_view(GstBaseTransform* base, const GstVideoFrame& video);

  KeyValues key;  // these two: under the object lock
  BlurSettings blur;

  Statistics statistics{"silhouette-stats"};
  PaceFilter pace;
  FrameView layout;  // the rest belongs to the streaming thread
  KeyConfiguration configuration;
  SilhouetteSettings settings;
  bool configured = false;
  Silhouetter silhouetter;
  std::uint64_t reused = 0, steady = 0;  // of the silhouetter's statistics
  Sent sent;
};

std::span<const Property<KeyValues>> key_table() {
  static const auto table = renamed(key_properties(), "method", "key-method");
  return table;
}
std::span<const Property<BlurSettings>> blur_table() {
  static const auto table = renamed(blur_properties(), "method", "blur-method");
  return table;
}
std::span<const Property<ContourValues>> contour_table() {
  static const auto table = renamed(contour_properties(), "method", "contour-method");
  return table;
}

gboolean set_caps(GstBaseTransform* base, GstCaps* in, GstCaps*) {
  SilhouetteElement& self = state_of<SilhouetteElement>(base);
  return guarded(GST_ELEMENT_CAST(base), FALSE, [&]() -> gboolean {
    if (!self.set_format(base, in)) return FALSE;
    self.layout = frame_template(in, self.info);
    warn_of_wide_colours(GST_ELEMENT_CAST(base), self.statistics, self.info);
    self.sent = {};
    return TRUE;
  });
}

/// Takes over what has changed since the last frame; returns whether anything did.
bool SilhouetteElement::configure(GstElement* element, const KeyValues& key_now,
                                  const BlurSettings& blur_now, const ContourValues& contour_now,
                                  double tolerance) {
  const std::string camera =
      contour_now.camera.empty() ? GST_OBJECT_NAME(element) : contour_now.camera;
  bool changed = false;

  SilhouetteSettings wanted = settings;
  wanted.blur = blur_now;
  wanted.method = contour_now.method;
  wanted.correct_curvature = contour_now.correct_curvature;
  wanted.approximate = contour_now.approximation(tolerance);
  wanted.steadiness = contour_now.steadiness;
  wanted.reuse = contour_now.reuse;
  if (!configured || wanted != settings) {
    if (configured) silhouetter.set(wanted);
    settings = wanted;
    changed = true;
  }
  configure_key(configuration, element, statistics, key_now, camera, layout.width, layout.height,
                [&](const KeySettings& key_settings) {
                  wanted.key = key_settings;
                  silhouetter.set(wanted);
                  settings = wanted;
                  configured = true;
                  changed = true;
                });
  const auto keyer = [this]() -> Keyer& { return silhouetter.keyer(); };
  return configuration.sample_and_learn(key_now, keyer) || changed;
}

GstBuffer* SilhouetteElement::make_view(GstBaseTransform* base, const GstVideoFrame& video) {
  const auto [key_now, blur_now, values] = snapshots(base, key, blur, contour);
  const double tolerance = tolerance_of(values);
  const bool changed = configure(GST_ELEMENT_CAST(base), key_now, blur_now, values, tolerance);
  const FrameView frame = frame_view(layout, video);
  begin_view(base, values, video);
  view.contours = silhouetter.process(frame);
  view.roi = bounding_rectangle(view.contours, view.width, view.height);
  const SilhouetteStats& stats = silhouetter.stats();
  const bool repeated = stats.reused != reused;
  const bool stayed = stats.steady != steady;
  reused = stats.reused;
  steady = stats.steady;
  report_contours(statistics, stats.last, {repeated, stayed}, tolerance);
  report_calibration(std::as_const(silhouetter).keyer().calibration(), GST_ELEMENT_CAST(base),
                     statistics);
  if (view.roi.empty()) {
    sent = {};
    return writer.write(view, nullptr, video.buffer);
  }

  view.format = PixelFormat::rgba;
  view.stride = view.roi.width * 4;
  const std::size_t size = static_cast<std::size_t>(view.stride) * view.roi.height;
  if (repeated && !changed && sent.pixels != nullptr && sent.roi == view.roi) {
    const MappedMemory pixels(gst_memory_ref(sent.pixels.get()), GST_MAP_READ);
    view.pixels = pixels.bytes();
    return writer.write(view, pixels.memory(), video.buffer);
  }
  MappedMemory pixels(writer.allocate(size), GST_MAP_READWRITE);
  silhouetter.write_rgba(frame, view.roi, pixels.data(), view.stride);
  view.pixels = pixels.bytes();
  sent = {Ref<GstMemory>(gst_memory_ref(pixels.memory())), view.roi};
  return writer.write(view, pixels.memory(), video.buffer);
}

gboolean start(GstBaseTransform* base) {
  SilhouetteElement& self = state_of<SilhouetteElement>(base);
  self.silhouetter = Silhouetter();
  self.configuration = KeyConfiguration();
  self.configured = false;
  self.reused = self.steady = 0;
  self.control.reset();
  self.pace.reset();
  self.statistics.reset();
  return TRUE;
}

gboolean stop(GstBaseTransform* base) {
  SilhouetteElement& self = state_of<SilhouetteElement>(base);
  self.sent = {};
  self.silhouetter = Silhouetter();
  return TRUE;
}

void SilhouetteElement::class_init(gpointer klass) {
  GST_DEBUG_CATEGORY_INIT(silhouette_debug, "silhouette", 0, "silhouettes in one pass");
  add_properties<SilhouetteElement>(klass, key_table(), &SilhouetteElement::key);
  add_properties<SilhouetteElement>(klass, blur_table(), &SilhouetteElement::blur);
  add_properties<SilhouetteElement>(klass, contour_table(), &SilhouetteElement::contour);
  add_statistics<SilhouetteElement>(
      klass,
      "Counters since the element started, and figures of the last frame: all "
      "that the stats of chromamatte, but for its matte's score, and contourfind hold.");
  set_metadata(klass, "Silhouette", "Filter/Analyzer/Video",
               "Keys, blurs and traces a subject in one pass: video in, views with contours out");
  add_template(klass, "sink", GST_PAD_SINK, POLYHULL_KEYABLE_CAPS);
  add_template(klass, "src", GST_PAD_SRC, view_caps);
  install_view_element<SilhouetteElement>(klass);
  auto* base_class = GST_BASE_TRANSFORM_CLASS(klass);
  base_class->set_caps = set_caps;
  base_class->submit_input_buffer = submit_input_buffer<SilhouetteElement>;
  base_class->start = start;
  base_class->stop = stop;
}

}  // namespace

GST_ELEMENT_REGISTER_DEFINE(silhouette, "silhouette", GST_RANK_NONE, type_of<SilhouetteElement>())
