// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// takesink: writes what its pads carry, views, meshes, sound, into one file, from which takesrc
/// plays it again (lib/take/take.h). Each pad is a stream; buffers are written as they come, with
/// their running times, and never waited for.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "base/error.h"
#include "base/stopwatch.h"
#include "files/claimed_location.h"
#include "plugins/common/element.h"
#include "plugins/common/guard.h"
#include "plugins/common/log.h"
#include "plugins/common/memory/payload_buffer.h"
#include "plugins/takesink/take_times.h"
#include "plugins/takesink/takesink_settings.h"
#include "take/packing.h"
#include "take/take_writer.h"

GST_DEBUG_CATEGORY_STATIC(takesink_debug);
#define GST_CAT_DEFAULT takesink_debug

namespace {

using namespace polyhull;
using namespace polyhull::element;

/// One pad's stream.
struct Stream {
  std::int64_t id = 0;  // in the file; 0: not known yet
  GstSegment segment{};
  std::string caps;
  std::string announcement;      // that came and is not in the take yet
  std::int64_t time = 0;         // of the last buffer
  std::int64_t last_packed = 0;  // id of what the packer packed last; 0: it was not written
  bool ended = false;
  PacketPacker packer;  // the pad's thread's, not under the lock: streams are packed side by side
};

struct TakeSink {
  static constexpr char type_name[] = "PolyhullTakeSink";
  static GType base_type() { return GST_TYPE_ELEMENT; }
  static void class_init(gpointer klass);

  explicit TakeSink(gpointer object) {
    GST_OBJECT_FLAG_SET(object, GST_ELEMENT_FLAG_SINK);
    statistics.declare({"buffers", "bytes", "bytes-stored", "buffers-alone", "buffers-untimed",
                        "buffers-early", "commits-held-up", "announcements",
                        "announcements-unusable"});
  }

  TakeSinkSettings settings;  // under the object lock
  Statistics statistics{"takesink-stats"};

  std::mutex mutex;  // protects all below
  std::optional<ClaimedLocation> claim;
  std::optional<TakeWriter> take;
  std::map<GstPad*, Stream> streams;
  bool playing = false;
  bool ended = false;  // and not yet told
  guint32 ended_by = 0;
  guint next_pad = 0;
  TakeTimes times;
  bool held_up = false;     // was said
  double vertex_error = 0;  // mm, the largest
  double colour_error = 0, colours = 0;
};

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
    const TakeSinkSettings settings = snapshot(element, self.settings);
    if (settings.location.empty())
      throw Error(Error::Kind::not_found, "There is no file to write; set location=NAME.take.");
    const std::scoped_lock lock(self.mutex);
    self.claim.emplace(settings.location);
    try {
      // Read before a take is replaced.
      const TakeTexts texts = read_texts(settings);
      self.take.emplace(settings.location, settings.existing);
      if (!settings.rig.empty()) self.take->note("rig", texts.rig);
      if (!settings.settings.empty()) self.take->note("settings", texts.settings);
    } catch (...) {
      self.take.reset();
      self.claim.reset();
      throw;
    }
    self.statistics.reset();
    self.ended = self.held_up = false;
    self.times = TakeTimes();
    self.vertex_error = self.colour_error = self.colours = 0;
    // In the pads' order, whichever carries something first.
    std::map<guint, Stream*> ordered;
    for (auto& [pad, stream] : self.streams) {
      stream = Stream();
      ordered[number_of(GST_OBJECT_NAME(pad)).value_or(0)] = &stream;
    }
    for (const auto& [number, stream] : ordered)
      stream->id = self.take->stream(fmt::format("sink_{}", number));
    return true;
  });
}

/// What cannot be written any more is said; the element stops all the same.
void close(GstElement* element) {
  TakeSink& self = state_of<TakeSink>(element);
  guarded(element, 0, [&] {
    const std::scoped_lock lock(self.mutex);
    if (self.take) self.take->finish();
    return 0;
  });
  const std::scoped_lock lock(self.mutex);
  self.take.reset();
  self.claim.reset();
  self.playing = false;
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

void count(TakeSink& self, std::size_t size, std::size_t stored, const PackedPacket& packed) {
  self.statistics.count("buffers");
  self.statistics.count("bytes", size);
  self.statistics.count("bytes-stored", stored);
  if (packed.data.empty() || packed.alone) self.statistics.count("buffers-alone");
  if (packed.vertex_error > self.vertex_error) {
    self.vertex_error = packed.vertex_error;
    self.statistics.set("vertex-error-mm", self.vertex_error);
  }
  if (packed.colours == 0) return;
  self.colour_error += packed.colour_error;
  self.colours += static_cast<double>(packed.colours);
  constexpr double most = 255.0 * 255.0;
  self.statistics.set("picture-psnr",
                      10.0 * std::log10(most * self.colours / std::max(1.0, self.colour_error)));
}

/// Warns of a buffer at \p pad that has no time or one from before the take.
void check_time(GstElement* element, GstPad* pad, const std::optional<TakeTimes::Time>& time) {
  Statistics& statistics = state_of<TakeSink>(element).statistics;
  if (!time)
    statistics.warn(
        element, "buffers-untimed",
        "A buffer without a running time was given that of the one before. Look at what stamps it; "
        "do-timestamp=true of a live source does.");
  if (time && time->early)
    statistics.warn(
        element, "buffers-early",
        fmt::format("A buffer of {} has a time from more than ten seconds before the take's first "
                    "buffer, and was put at the take's begin. Look at what stamps it.",
                    GST_PAD_NAME(pad)));
}

/// But for time and caps.
TakePacket packet_of(GstBuffer* buffer) {
  TakePacket packet;
  const GstClockTime duration = GST_BUFFER_DURATION(buffer);
  if (GST_CLOCK_TIME_IS_VALID(duration)) packet.duration = static_cast<std::int64_t>(duration);
  packet.flags = GST_BUFFER_FLAGS(buffer) &
                 (GST_BUFFER_FLAG_DELTA_UNIT | GST_BUFFER_FLAG_HEADER | GST_BUFFER_FLAG_GAP);
  return packet;
}

GstFlowReturn write(GstElement* element, GstPad* pad, GstBuffer* buffer) {
  TakeSink& self = state_of<TakeSink>(element);
  const PackingSettings packing = packing_of(snapshot(element, self.settings));
  MappedBuffer mapped(buffer);
  if (mapped.segments().size() != 1) mapped.join();
  const Bytes bytes = mapped.segments().empty() ? Bytes() : mapped.segments().front();
  TakePacket packet = packet_of(buffer);
  std::optional<TakeTimes::Time> time;
  Stream* stream = nullptr;
  {
    const std::scoped_lock lock(self.mutex);
    if (!self.take) return GST_FLOW_FLUSHING;
    stream = &self.streams[pad];
    if (stream->ended) return GST_FLOW_EOS;
    time = self.times.of(stream->segment, buffer);
    packet.time = stream->time = time ? time->time : stream->time;
    packet.caps = stream->caps;
  }
  check_time(element, pad, time);
  const Stopwatch watch;
  PackedPacket packed = stream->packer.pack(packing, packet.caps, bytes, stream->last_packed);
  const double packed_after = watch.milliseconds();
  bool held_up = false;
  {
    const std::scoped_lock lock(self.mutex);
    if (!self.take) return GST_FLOW_FLUSHING;
    if (stream->id == 0) stream->id = self.take->stream(GST_OBJECT_NAME(pad));
    // Where another stream's packet could not be written, this one's may be gone with it.
    if (!packed.alone && self.take->last_packed(stream->id) != stream->last_packed)
      packed = stream->packer.pack(packing, packet.caps, bytes, 0);
    if (!stream->announcement.empty()) {
      self.take->announce(stream->id, std::exchange(stream->announcement, {}));
      self.statistics.count("announcements");
    }
    const bool is_packed = !packed.data.empty();
    stream->last_packed = 0;  // where it cannot be written
    const std::int64_t id =
        self.take->write(stream->id, packet, is_packed ? packed.data : bytes, is_packed);
    if (is_packed) stream->last_packed = id;
    held_up = self.take->held_up() && !self.held_up;
    self.held_up = self.take->held_up();
    self.statistics.set("write-ms", watch.milliseconds());
    self.statistics.set("pack-ms", packed_after);
    count(self, bytes.size(), is_packed ? packed.data.size() : bytes.size(), packed);
    GST_LOG_OBJECT(pad, "written at %" GST_TIME_FORMAT " of the take, %s: %" GST_PTR_FORMAT,
                   GST_TIME_ARGS(clock_time(packet.time)),
                   !is_packed     ? "as it is"
                   : packed.alone ? "packed alone"
                                  : "packed after the one before",
                   printed(buffer));
  }
  if (held_up)
    self.statistics.warn(element, "commits-held-up",
                         "Another program reads the take without a pause; what comes meanwhile is "
                         "kept in memory, and lost where this one is killed. Let it read a copy.");
  return GST_FLOW_OK;
}

GstFlowReturn chain(GstPad* pad, GstObject* parent, GstBuffer* buffer) {
  auto* element = GST_ELEMENT_CAST(parent);
  const GstFlowReturn flow =
      guarded(element, GST_FLOW_ERROR, [&] { return write(element, pad, buffer); });
  gst_buffer_unref(buffer);
  return flow;
}

/// Where all streams have ended, what was written is made whole, and the end told.
void end_if_all_have(GstElement* element, guint32 seqnum) {
  TakeSink& self = state_of<TakeSink>(element);
  const bool all = guarded(element, true, [&] {
    const std::scoped_lock lock(self.mutex);
    if (!self.take) return false;
    bool any = false;
    for (const auto& [other, stream] : self.streams) {
      // What nothing is linked to has no end.
      if (!stream.ended && gst_pad_is_linked(other)) return false;
      any = any || stream.ended;
    }
    if (any) self.take->commit();
    return any;
  });
  if (!all) return;
  std::unique_lock lock(self.mutex);
  self.ended = true;
  self.ended_by = seqnum;
  tell_end(element, std::move(lock));
}

void end_stream(GstElement* element, GstPad* pad, guint32 seqnum) {
  TakeSink& self = state_of<TakeSink>(element);
  {
    const std::scoped_lock lock(self.mutex);
    self.streams[pad].ended = true;
    GST_DEBUG_OBJECT(pad, "has ended");
  }
  end_if_all_have(element, seqnum);
}

/// It goes into the take with the next buffer.
void keep_announcement(GstElement* element, GstPad* pad, GstEvent* event) {
  TakeSink& self = state_of<TakeSink>(element);
  const char* json = gst_structure_get_string(gst_event_get_structure(event), "json");
  if (json == nullptr || *json == 0) return;
  std::string text = json;
  if (text.size() > largest_announcement) {
    self.statistics.warn(element, "announcements-unusable",
                         fmt::format("An announcement of {} bytes at {} is left out of the take, "
                                     "which keeps up to {}. Send a smaller one.",
                                     text.size(), GST_PAD_NAME(pad), largest_announcement));
    return;
  }
  const std::scoped_lock lock(self.mutex);
  self.streams[pad].announcement = std::move(text);
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
      GST_DEBUG_OBJECT(pad, "brings %s", text);
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
    case GST_EVENT_CUSTOM_DOWNSTREAM_STICKY:
      if (gst_event_has_name(event, take_announcement)) keep_announcement(element, pad, event);
      break;
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
    self.streams[pad] = Stream();
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
  const GstStateChangeReturn result =
      GST_ELEMENT_CLASS(parent_class<TakeSink>())->change_state(element, transition);
  if (transition == GST_STATE_CHANGE_PAUSED_TO_PLAYING) {
    std::unique_lock lock(self.mutex);
    self.playing = true;
    tell_end(element, std::move(lock));
  }
  if (transition == GST_STATE_CHANGE_PAUSED_TO_READY) close(element);
  return result;
}

void TakeSink::class_init(gpointer klass) {
  GST_DEBUG_CATEGORY_INIT(takesink_debug, "takesink", 0, "takes to files");
  add_properties<TakeSink>(klass, takesink_properties(), &TakeSink::settings);
  add_statistics<TakeSink>(
      klass,
      "Counters since the start: buffers and bytes (that came), bytes-stored, "
      "buffers-alone (stored so that no other is needed), buffers-untimed (that "
      "got the time of the one before), buffers-early (that were put at the take's begin), "
      "commits-held-up (times that another program's reading held up the writing), announcements "
      "(kept) and announcements-unusable (too large); write-ms, the milliseconds the last "
      "buffer took, pack-ms those of its compression. With compression=lossy "
      "vertex-error-mm, how far the vertex moved that moved the furthest, and "
      "picture-psnr, the colours' peak signal to noise ratio in dB.");
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
