// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// takesink: writes what its pads carry, views, meshes, sound, into one file, from which takesrc
/// plays it again (lib/take/take.h). Each pad is a stream; buffers are written as they come, with
/// their running times, and never waited for.
#include <algorithm>
#include <cstdio>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "base/error.h"
#include "base/stopwatch.h"
#include "files/claimed_location.h"
#include "plugins/common/element.h"
#include "plugins/common/guard.h"
#include "plugins/common/memory/payload_buffer.h"
#include "take/take_writer.h"

GST_DEBUG_CATEGORY_STATIC(takesink_debug);
#define GST_CAT_DEFAULT takesink_debug

namespace polyhull::element {

enum class ExistingTake { refuse, append, replace };

template <>
GType enum_type<ExistingTake>() {
  return register_enum<ExistingTake>(
      "PolyhullExistingTake",
      {{ExistingTake::refuse, "End with an error", "refuse"},
       {ExistingTake::append, "Put what comes behind what is there", "append"},
       {ExistingTake::replace, "Delete the take that is there", "replace"}});
}

}  // namespace polyhull::element

namespace {

using namespace polyhull;
using namespace polyhull::element;

struct Settings {
  std::string location;
  ExistingTake existing = ExistingTake::refuse;
  std::string rig;
  std::string settings;
};

/// One pad's stream.
struct Stream {
  std::int64_t id = 0;  // in the file; 0: not known yet
  GstSegment segment{};
  std::string caps;
  std::int64_t time = 0;  // of the last buffer
  bool ended = false;
};

struct TakeSink {
  static constexpr char type_name[] = "PolyhullTakeSink";
  static GType base_type() { return GST_TYPE_ELEMENT; }
  static void class_init(gpointer klass);

  explicit TakeSink(gpointer object) {
    GST_OBJECT_FLAG_SET(object, GST_ELEMENT_FLAG_SINK);
    statistics.declare({"buffers", "bytes", "buffers-untimed"});
  }

  Settings settings;  // under the object lock
  Statistics statistics{"takesink-stats"};

  std::mutex mutex;  // protects all below
  std::optional<ClaimedLocation> claim;
  std::optional<TakeWriter> take;
  std::map<GstPad*, Stream> streams;
  bool playing = false;
  bool ended = false;  // and not yet told
  guint32 ended_by = 0;
  guint next_pad = 0;
  std::optional<std::int64_t> origin;  // the running time at which the take begins
};

std::span<const Property<Settings>> properties() {
  using S = Settings;
  static const Property<S> table[] = {
      property<&S::location>("location", "Location", "The take to write, one file.", 0, 0,
                             Change::when_ready),
      property<&S::existing>("existing", "Existing take",
                             "What is done where there is a take of this name already. Any other "
                             "file is refused.",
                             0, 0, Change::when_ready),
      property<&S::rig>("rig", "Rig",
                        "Rig file whose content is kept in the take, so that it goes where the "
                        "take goes. Unset: none.",
                        0, 0, Change::when_ready),
      property<&S::settings>("settings", "Settings",
                             "Studio file whose content is kept in the take. Unset: none.", 0, 0,
                             Change::when_ready),
  };
  return table;
}

std::string read_text(const char* what, const std::string& path) {
  g_autofree char* text = nullptr;
  gsize size = 0;
  g_autoptr(GError) error = nullptr;
  if (!g_file_get_contents(path.c_str(), &text, &size, &error))
    throw Error(Error::Kind::not_found, "The file for {}, '{}', cannot be kept in the take: {}.",
                what, path, error->message);
  return {text, size};
}

constexpr guint most_pads = 1'000'000;  // more are nobody's numbers

std::optional<guint> number_of(const char* pad_name) {
  guint number = 0;
  if (pad_name == nullptr || std::sscanf(pad_name, "sink_%u", &number) != 1 || number > most_pads)
    return std::nullopt;
  return number;
}

bool open(GstElement* element) {
  TakeSink& self = state_of<TakeSink>(element);
  return guarded(element, false, [&] {
    const Settings settings = snapshot(element, self.settings);
    if (settings.location.empty())
      throw Error(Error::Kind::not_found, "There is no file to write; set location=NAME.take.");
    const std::scoped_lock lock(self.mutex);
    self.claim.emplace(settings.location);
    const auto existing = settings.existing == ExistingTake::refuse ? TakeWriter::Existing::refuse
                          : settings.existing == ExistingTake::append
                              ? TakeWriter::Existing::append
                              : TakeWriter::Existing::replace;
    try {
      // Read before a take is replaced.
      const std::string rig = settings.rig.empty() ? "" : read_text("rig", settings.rig);
      const std::string studio =
          settings.settings.empty() ? "" : read_text("settings", settings.settings);
      self.take.emplace(settings.location, existing);
      if (!settings.rig.empty()) self.take->note("rig", rig);
      if (!settings.settings.empty()) self.take->note("settings", studio);
    } catch (...) {
      self.take.reset();
      self.claim.reset();
      throw;
    }
    self.statistics.reset();
    self.ended = false;
    self.origin.reset();
    // In the pads' order, whichever carries something first.
    std::map<guint, Stream*> ordered;
    for (auto& [pad, stream] : self.streams) {
      stream = {};
      ordered[number_of(GST_OBJECT_NAME(pad)).value_or(0)] = &stream;
    }
    for (const auto& [number, stream] : ordered)
      stream->id = self.take->stream(fmt::format("sink_{}", number));
    return true;
  });
}

bool close(GstElement* element) {
  TakeSink& self = state_of<TakeSink>(element);
  const std::scoped_lock lock(self.mutex);
  const bool closed = guarded(element, false, [&] {
    if (self.take) self.take->finish();
    return true;
  });
  self.take.reset();
  self.claim.reset();
  self.playing = false;
  return closed;
}

/// The message that makes the pipeline end; it counts only while playing.
void tell_end(GstElement* element, std::unique_lock<std::mutex> lock) {
  TakeSink& self = state_of<TakeSink>(element);
  if (!self.ended || !self.playing) return;
  self.ended = false;
  GstMessage* message = gst_message_new_eos(GST_OBJECT(element));
  gst_message_set_seqnum(message, self.ended_by);
  lock.unlock();
  gst_element_post_message(element, message);
}

/// Of other pads, what was taken before the first buffer comes may come after it.
constexpr std::int64_t lead = GST_SECOND;

/// Time of \p buffer in the take, ns: its running time, or what of that comes after a second before the
/// first buffer; where it has none, that of the buffer before.
std::int64_t time_of(GstElement* element, Stream& stream, GstBuffer* buffer) {
  const GstClockTime stamp =
      GST_BUFFER_PTS_IS_VALID(buffer) ? GST_BUFFER_PTS(buffer) : GST_BUFFER_DTS(buffer);
  const GstClockTime time =
      stream.segment.format == GST_FORMAT_TIME
          ? gst_segment_to_running_time(&stream.segment, GST_FORMAT_TIME, stamp)
          : GST_CLOCK_TIME_NONE;
  if (!GST_CLOCK_TIME_IS_VALID(time) || time > static_cast<GstClockTime>(G_MAXINT64 / 4)) {
    state_of<TakeSink>(element).statistics.warn(
        element, "buffers-untimed",
        "A buffer without a running time was given that of the one before. Look at what stamps it; "
        "do-timestamp=true of a live source does.");
    return stream.time;
  }
  // A pipeline that has run for hours, or by another machine's clock, makes no take of hours.
  TakeSink& self = state_of<TakeSink>(element);
  const auto running = static_cast<std::int64_t>(time);
  if (!self.origin) self.origin = std::max<std::int64_t>(0, running - lead);
  return stream.time = std::max<std::int64_t>(0, running - *self.origin);
}

GstFlowReturn chain(GstPad* pad, GstObject* parent, GstBuffer* buffer) {
  auto* element = GST_ELEMENT_CAST(parent);
  TakeSink& self = state_of<TakeSink>(element);
  const GstFlowReturn flow = guarded(element, GST_FLOW_ERROR, [&]() -> GstFlowReturn {
    MappedBuffer mapped(buffer);
    if (mapped.segments().size() != 1) mapped.join();
    const Bytes bytes = mapped.segments().empty() ? Bytes() : mapped.segments().front();
    const std::scoped_lock lock(self.mutex);
    if (!self.take) return GST_FLOW_FLUSHING;
    Stream& stream = self.streams[pad];
    if (stream.ended) return GST_FLOW_EOS;
    if (stream.id == 0) stream.id = self.take->stream(GST_OBJECT_NAME(pad));
    const GstClockTime duration = GST_BUFFER_DURATION(buffer);
    const TakePacket packet{
        stream.caps,
        time_of(element, stream, buffer),
        GST_CLOCK_TIME_IS_VALID(duration) ? static_cast<std::int64_t>(duration) : no_take_time,
        GST_BUFFER_FLAGS(buffer) &
            (GST_BUFFER_FLAG_DELTA_UNIT | GST_BUFFER_FLAG_HEADER | GST_BUFFER_FLAG_GAP),
        {}};
    const Stopwatch watch;
    self.take->write(stream.id, packet, bytes);
    self.statistics.set("write-ms", watch.milliseconds());
    self.statistics.count("buffers");
    self.statistics.count("bytes", bytes.size());
    return GST_FLOW_OK;
  });
  gst_buffer_unref(buffer);
  return flow;
}

/// Where all streams have ended, what was written is made whole, and the end told.
void end_if_all_have(GstElement* element, guint32 seqnum) {
  TakeSink& self = state_of<TakeSink>(element);
  std::unique_lock lock(self.mutex);
  if (self.streams.empty() || !self.take) return;
  for (const auto& [other, stream] : self.streams)
    if (!stream.ended) return;
  guarded(element, false, [&] {
    if (self.take) self.take->commit();
    return true;
  });
  self.ended = true;
  self.ended_by = seqnum;
  tell_end(element, std::move(lock));
}

void end_stream(GstElement* element, GstPad* pad, guint32 seqnum) {
  TakeSink& self = state_of<TakeSink>(element);
  {
    const std::scoped_lock lock(self.mutex);
    self.streams[pad].ended = true;
  }
  end_if_all_have(element, seqnum);
}

gboolean event(GstPad* pad, GstObject* parent, GstEvent* event) {
  auto* element = GST_ELEMENT_CAST(parent);
  TakeSink& self = state_of<TakeSink>(element);
  switch (GST_EVENT_TYPE(event)) {
    case GST_EVENT_CAPS: {
      GstCaps* caps = nullptr;
      gst_event_parse_caps(event, &caps);
      g_autofree char* text = gst_caps_to_string(caps);
      const std::scoped_lock lock(self.mutex);
      self.streams[pad].caps = text;
      break;
    }
    case GST_EVENT_SEGMENT: {
      const std::scoped_lock lock(self.mutex);
      gst_event_copy_segment(event, &self.streams[pad].segment);
      break;
    }
    case GST_EVENT_STREAM_START: {
      const std::scoped_lock lock(self.mutex);
      self.streams[pad].ended = false;
      break;
    }
    case GST_EVENT_FLUSH_STOP: {
      const std::scoped_lock lock(self.mutex);
      self.streams[pad].ended = self.ended = false;
      break;
    }
    case GST_EVENT_EOS:
      end_stream(element, pad, gst_event_get_seqnum(event));
      break;
    default:
      break;
  }
  gst_event_unref(event);
  return TRUE;
}

GstPad* request_new_pad(GstElement* element, GstPadTemplate* from, const gchar* name,
                        const GstCaps*) {
  TakeSink& self = state_of<TakeSink>(element);
  std::string chosen;
  {
    const std::scoped_lock lock(self.mutex);
    const guint number = number_of(name).value_or(self.next_pad);
    self.next_pad = std::max(self.next_pad, number + 1);
    chosen = fmt::format("sink_{}", number);
  }
  GstPad* pad = gst_pad_new_from_template(from, chosen.c_str());
  gst_pad_set_chain_function(pad, chain);
  gst_pad_set_event_function(pad, event);
  {
    const std::scoped_lock lock(self.mutex);
    self.streams[pad] = {};
  }
  if (GST_STATE(element) > GST_STATE_READY) gst_pad_set_active(pad, TRUE);
  gst_object_ref_sink(pad);
  const bool added = gst_element_add_pad(element, pad);
  if (!added) {  // the name is taken
    gst_pad_set_active(pad, FALSE);
    const std::scoped_lock lock(self.mutex);
    self.streams.erase(pad);
  }
  gst_object_unref(pad);
  return added ? pad : nullptr;
}

void release_pad(GstElement* element, GstPad* pad) {
  TakeSink& self = state_of<TakeSink>(element);
  gst_pad_set_active(pad, FALSE);
  {
    const std::scoped_lock lock(self.mutex);
    self.streams.erase(pad);
  }
  gst_element_remove_pad(element, pad);
  // It may have been the only one that others' ends waited for.
  end_if_all_have(element, gst_util_seqnum_next());
}

GstStateChangeReturn change_state(GstElement* element, GstStateChange transition) {
  TakeSink& self = state_of<TakeSink>(element);
  if (transition == GST_STATE_CHANGE_READY_TO_PAUSED && !open(element))
    return GST_STATE_CHANGE_FAILURE;
  if (transition == GST_STATE_CHANGE_PLAYING_TO_PAUSED) {
    const std::scoped_lock lock(self.mutex);
    self.playing = false;
  }
  GstStateChangeReturn result =
      GST_ELEMENT_CLASS(parent_class<TakeSink>())->change_state(element, transition);
  if (transition == GST_STATE_CHANGE_PAUSED_TO_PLAYING) {
    std::unique_lock lock(self.mutex);
    self.playing = true;
    tell_end(element, std::move(lock));
  }
  if (transition == GST_STATE_CHANGE_PAUSED_TO_READY && !close(element))
    result = GST_STATE_CHANGE_FAILURE;
  return result;
}

void TakeSink::class_init(gpointer klass) {
  GST_DEBUG_CATEGORY_INIT(takesink_debug, "takesink", 0, "takes to files");
  add_properties<TakeSink>(klass, properties(), &TakeSink::settings);
  add_statistics<TakeSink>(klass,
                           "Counters since the start: buffers and bytes (written), "
                           "buffers-untimed (that got the time of the one before); write-ms, the "
                           "milliseconds the last buffer took.");
  set_metadata(klass, "Take writer", "Sink/File",
               "Writes views, meshes and sound of a performance into one file");
  add_template(klass, "sink_%u", GST_PAD_SINK, "ANY", G_TYPE_NONE, GST_PAD_REQUEST);
  auto* element_class = GST_ELEMENT_CLASS(klass);
  element_class->change_state = change_state;
  element_class->request_new_pad = request_new_pad;
  element_class->release_pad = release_pad;
}

}  // namespace

GST_ELEMENT_REGISTER_DEFINE(takesink, "takesink", GST_RANK_NONE, type_of<TakeSink>())
