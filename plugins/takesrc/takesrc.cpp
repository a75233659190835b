// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// takesrc: plays a take that takesink wrote (lib/take/take.h). Each of its streams has a pad and a
/// thread of its own, so that one that lacks a view never holds up the others; all are sought
/// together.
#include <gst/base/gstflowcombiner.h>

#include <algorithm>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/plain_text.h"
#include "plugins/common/element.h"
#include "plugins/common/guard.h"
#include "plugins/common/log.h"
#include "plugins/common/rig_event.h"
#include "plugins/takesrc/take_pads.h"
#include "plugins/takesrc/take_stream.h"

GST_DEBUG_CATEGORY_STATIC(takesrc_debug);
#define GST_CAT_DEFAULT takesrc_debug

namespace {

using namespace polyhull;
using namespace polyhull::element;

/// An error of this element, of which a message has told.
constexpr GstFlowReturn told_error = GST_FLOW_CUSTOM_ERROR;

struct Settings {
  std::string location;
};

struct TakeSrc {
  static constexpr char type_name[] = "PolyhullTakeSrc";
  static GType base_type() { return GST_TYPE_ELEMENT; }
  static void class_init(gpointer klass);

  explicit TakeSrc(gpointer object) {
    GST_OBJECT_FLAG_SET(object, GST_ELEMENT_FLAG_SOURCE);
    statistics.declare({"buffers", "bytes", "packets-damaged", "rigs-unusable", "seeks"});
  }
  ~TakeSrc() { gst_flow_combiner_free(combiner); }

  Settings settings;  // under the object lock
  Statistics statistics{"takesrc-stats"};

  std::mutex seeking;  // one at a time; protects streams
  std::vector<std::unique_ptr<Stream>> streams;
  std::int64_t end = 0;
  std::string rig;  // the text that the take keeps of it; empty: none

  std::mutex mutex;  // protects all below
  GstFlowCombiner* combiner = gst_flow_combiner_new();
  GstSegment segment{};
  guint32 seqnum = GST_SEQNUM_INVALID;  // of the last seek
  guint group = 0;
};

std::span<const Property<Settings>> properties() {
  static const Property<Settings> table[] = {
      property<&Settings::location>("location", "The take to play, one file.", 0, 0,
                                    Change::when_ready),
  };
  return table;
}

void send_start(GstElement* element, Stream& stream) {
  TakeSrc& self = state_of<TakeSrc>(element);
  g_autofree char* id = gst_pad_create_stream_id(stream.pad, element, GST_PAD_NAME(stream.pad));
  GstEvent* event = gst_event_new_stream_start(id);
  {
    const std::scoped_lock lock(self.mutex);
    gst_event_set_group_id(event, self.group);
  }
  gst_pad_push_event(stream.pad, event);
  stream.started = true;
}

void send_segment(TakeSrc& self, Stream& stream) {
  GstEvent* event = nullptr;
  {
    const std::scoped_lock lock(self.mutex);
    event = gst_event_new_segment(&self.segment);
    if (self.seqnum != GST_SEQNUM_INVALID) gst_event_set_seqnum(event, self.seqnum);
  }
  gst_pad_push_event(stream.pad, event);
  gst_pad_push_event(stream.pad, make_rig_event(self.rig));
  stream.segment_due = false;
}

/// The next packet within the segment.
std::optional<TakePacket> next_packet(GstElement* element, Stream& stream) {
  TakeSrc& self = state_of<TakeSrc>(element);
  GstSegment segment;
  {
    const std::scoped_lock lock(self.mutex);
    segment = self.segment;
  }
  auto packet =
      segment.rate > 0 && stream.discont ? first_packet(*stream.cursor) : stream.cursor->next();
  // Backwards, what needs the one before it to be decoded is left out.
  while (segment.rate < 0 && packet && needs_another(*packet)) packet = stream.cursor->next();
  const std::uint64_t damaged =
      stream.cursor->damaged() - std::exchange(stream.damaged, stream.cursor->damaged());
  if (damaged > 0) {
    self.statistics.count("packets-damaged", damaged - 1);
    self.statistics.warn(
        element, "packets-damaged",
        fmt::format("{} buffers of {} are damaged in '{}' and were left out.", damaged,
                    GST_PAD_NAME(stream.pad), snapshot(element, self.settings).location));
  }
  if (!packet) return packet;
  const auto time = static_cast<GstClockTime>(packet->time);
  const bool beyond = segment.rate > 0
                          ? GST_CLOCK_TIME_IS_VALID(segment.stop) && time >= segment.stop
                          : time < segment.start;
  return beyond ? std::nullopt : std::move(packet);
}

void finish(GstElement* element, Stream& stream, GstFlowReturn flow) {
  TakeSrc& self = state_of<TakeSrc>(element);
  gst_pad_pause_task(stream.pad);
  GstFlowReturn combined = flow;
  guint32 seqnum = GST_SEQNUM_INVALID;
  {
    const std::scoped_lock lock(self.mutex);
    combined = gst_flow_combiner_update_pad_flow(self.combiner, stream.pad,
                                                 flow == told_error ? GST_FLOW_ERROR : flow);
    seqnum = self.seqnum;
  }
  if (flow == GST_FLOW_EOS || flow == told_error) {
    GstEvent* end = gst_event_new_eos();
    if (seqnum != GST_SEQNUM_INVALID) gst_event_set_seqnum(end, seqnum);
    gst_pad_push_event(stream.pad, end);
  } else if (combined == GST_FLOW_NOT_LINKED || combined < GST_FLOW_EOS) {
    GST_ELEMENT_FLOW_ERROR(element, combined);
    gst_pad_push_event(stream.pad, gst_event_new_eos());
  }
}

/// One buffer.
void loop(gpointer data) {
  auto* pad = static_cast<GstPad*>(data);
  auto& stream = *static_cast<Stream*>(gst_pad_get_element_private(pad));
  g_autoptr(GstElement) element = gst_pad_get_parent_element(pad);
  if (element == nullptr) return;
  TakeSrc& self = state_of<TakeSrc>(element);
  const GstFlowReturn flow = guarded(element, told_error, [&]() -> GstFlowReturn {
    if (!stream.started) send_start(element, stream);
    auto packet = next_packet(element, stream);
    if (packet && packet->caps != stream.caps) send_caps(stream, packet->caps);
    if (stream.segment_due) send_segment(self, stream);
    if (!packet) {
      GST_DEBUG_OBJECT(pad, "its stream has ended");
      return GST_FLOW_EOS;
    }
    if (packet->event != stream.event) send_announcement(stream, packet->event);
    const std::size_t size = packet->data.size();
    {
      const std::scoped_lock lock(self.mutex);
      self.segment.position = static_cast<guint64>(packet->time);
    }
    GstBuffer* buffer = make_buffer(*packet, std::exchange(stream.discont, false));
    GST_LOG_OBJECT(pad, "sends %" GST_PTR_FORMAT, printed(buffer));
    const GstFlowReturn pushed = gst_pad_push(pad, buffer);
    if (pushed == GST_FLOW_OK) {
      self.statistics.count("buffers");
      self.statistics.count("bytes", size);
    }
    return pushed;
  });
  if (flow != GST_FLOW_OK) finish(element, stream, flow);
}

void start_threads(TakeSrc& self) {
  for (const auto& stream : self.streams)
    gst_pad_start_task(stream->pad, loop, stream->pad, nullptr);
}

/// Where a seek leads from \p segment; false: nowhere.
bool lead(GstSegment& segment, GstEvent* event, std::int64_t end) {
  gdouble rate = 1;
  GstFormat format{};
  GstSeekFlags flags{};
  GstSeekType start_type{}, stop_type{};
  gint64 start = 0, stop = 0;
  gst_event_parse_seek(event, &rate, &format, &flags, &start_type, &start, &stop_type, &stop);
  // What ends a segment here is an end of stream; and without a flush a paused thread could stand for
  // good in what is full behind it.
  constexpr int refused = GST_SEEK_FLAG_SEGMENT | GST_SEEK_FLAG_INSTANT_RATE_CHANGE;
  if (format != GST_FORMAT_TIME || (flags & refused) != 0 || (flags & GST_SEEK_FLAG_FLUSH) == 0)
    return false;
  // Going on from behind where going back, or a part, has ended.
  if (rate > 0 && start_type == GST_SEEK_TYPE_SET && stop_type == GST_SEEK_TYPE_NONE &&
      (start >= static_cast<gint64>(segment.stop) ||
       static_cast<gint64>(segment.stop) >= static_cast<gint64>(end)))
    segment.stop = GST_CLOCK_TIME_NONE;
  const guint64 from =
      start_type == GST_SEEK_TYPE_NONE ? segment.start : static_cast<guint64>(start);
  const guint64 to = stop_type == GST_SEEK_TYPE_NONE ? segment.stop : static_cast<guint64>(stop);
  const bool types = start_type <= GST_SEEK_TYPE_SET && stop_type <= GST_SEEK_TYPE_SET;
  if (types && from > to) return false;  // no end is the largest number
  if (!gst_segment_do_seek(&segment, rate, format, flags, start_type, static_cast<guint64>(start),
                           stop_type, static_cast<guint64>(stop), nullptr))
    return false;
  if (rate < 0 && !GST_CLOCK_TIME_IS_VALID(segment.stop)) segment.stop = static_cast<guint64>(end);
  if (rate < 0 && segment.position > segment.stop) segment.position = segment.stop;
  return true;
}

bool seek(GstElement* element, GstEvent* event) {
  TakeSrc& self = state_of<TakeSrc>(element);
  const guint32 seqnum = gst_event_get_seqnum(event);
  const std::scoped_lock one(self.seeking);
  if (self.streams.empty()) return false;
  {
    // One seek comes once from each sink.
    const std::scoped_lock lock(self.mutex);
    if (seqnum == self.seqnum) return true;
    // Before anything is flushed: a seek that is refused changes nothing.
    GstSegment segment = self.segment;
    if (!lead(segment, event, self.end)) return false;
  }
  for (const auto& stream : self.streams) {
    GstEvent* begin = gst_event_new_flush_start();
    gst_event_set_seqnum(begin, seqnum);
    gst_pad_push_event(stream->pad, begin);
    gst_pad_pause_task(stream->pad);
  }
  for (const auto& stream : self.streams) {
    GST_PAD_STREAM_LOCK(stream->pad);  // its thread stands
    GST_PAD_STREAM_UNLOCK(stream->pad);
  }
  const bool sought = guarded(element, false, [&] {
    GstSegment segment;
    {
      const std::scoped_lock lock(self.mutex);
      lead(self.segment, event, self.end);  // from where the threads stand now
      self.seqnum = seqnum;
      gst_flow_combiner_reset(self.combiner);
      segment = self.segment;
    }
    for (const auto& stream : self.streams) stream->segment_due = stream->discont = true;
    for (const auto& stream : self.streams) set_out(*stream, segment, self.end);
    self.statistics.count("seeks");
    GST_DEBUG_OBJECT(element, "goes on with %" GST_SEGMENT_FORMAT, printed(&segment));
    return true;
  });
  for (const auto& stream : self.streams) {
    GstEvent* end = gst_event_new_flush_stop(TRUE);
    gst_event_set_seqnum(end, seqnum);
    gst_pad_push_event(stream->pad, end);
  }
  start_threads(self);
  return sought;
}

gboolean event(GstPad* pad, GstObject* parent, GstEvent* event) {
  if (GST_EVENT_TYPE(event) != GST_EVENT_SEEK) return gst_pad_event_default(pad, parent, event);
  const bool done = seek(GST_ELEMENT_CAST(parent), event);
  gst_event_unref(event);
  return done;
}

gboolean send_event(GstElement* element, GstEvent* event) {
  if (GST_EVENT_TYPE(event) != GST_EVENT_SEEK)
    return GST_ELEMENT_CLASS(parent_class<TakeSrc>())->send_event(element, event);
  const bool done = seek(element, event);
  gst_event_unref(event);
  return done;
}

gboolean query(GstPad* pad, GstObject* parent, GstQuery* query) {
  TakeSrc& self = state_of<TakeSrc>(parent);
  GstFormat format = GST_FORMAT_TIME;
  switch (GST_QUERY_TYPE(query)) {
    case GST_QUERY_DURATION:
      gst_query_parse_duration(query, &format, nullptr);
      if (format != GST_FORMAT_TIME) return FALSE;
      gst_query_set_duration(query, GST_FORMAT_TIME, self.end);
      return TRUE;
    case GST_QUERY_SEEKING:
      gst_query_parse_seeking(query, &format, nullptr, nullptr, nullptr);
      gst_query_set_seeking(query, format, format == GST_FORMAT_TIME, 0, self.end);
      return TRUE;
    case GST_QUERY_SEGMENT: {
      const std::scoped_lock lock(self.mutex);
      const GstSegment& segment = self.segment;
      gst_query_set_segment(query, segment.rate, GST_FORMAT_TIME,
                            static_cast<gint64>(segment.start), static_cast<gint64>(segment.stop));
      return TRUE;
    }
    default:
      return gst_pad_query_default(pad, parent, query);
  }
}

/// The text of the rig that the take keeps, as UTF-8; empty where it keeps none, or, with a warning,
/// where that is no text.
std::string kept_rig(GstElement* element, const TakeContent& content, const std::string& location) {
  for (const TakeNote& note : content.notes) {
    if (note.name != "rig") continue;
    try {
      const std::string text = plain_text(note.value, "The rig");
      if (!g_utf8_validate(text.data(), static_cast<gssize>(text.size()), nullptr))
        throw Error(Error::Kind::bad_input, "The rig: its text is neither UTF-8 nor UTF-16.");
      return text;
    } catch (const Error& error) {
      state_of<TakeSrc>(element).statistics.warn(
          element, "rigs-unusable",
          fmt::format("The take '{}' plays without the rig that it keeps. {} Set hullbuild's rig "
                      "to the file of these cameras.",
                      location, error.what()));
    }
  }
  return {};
}

bool open(GstElement* element) {
  TakeSrc& self = state_of<TakeSrc>(element);
  return guarded(element, false, [&] {
    const std::string location = snapshot(element, self.settings).location;
    if (location.empty())
      throw Error(Error::Kind::not_found, "There is no take to play; set location=NAME.take.");
    const TakeContent content = read_take(location);
    if (content.streams.empty())
      throw Error(Error::Kind::bad_input, "The take '{}' holds nothing: no stream was written.",
                  location);
    std::vector<std::unique_ptr<Stream>> streams;
    for (const TakeStream& told : content.streams) {
      auto& stream = streams.emplace_back(std::make_unique<Stream>());
      stream->cursor.emplace(location, told.id);
    }
    self.statistics.reset();
    self.end = content.end;
    self.rig = kept_rig(element, content, location);
    {
      const std::scoped_lock lock(self.mutex);
      gst_segment_init(&self.segment, GST_FORMAT_TIME);
      // No stop: the last buffers may have no duration.
      self.segment.duration = static_cast<guint64>(content.end);
      self.seqnum = GST_SEQNUM_INVALID;
      self.group = gst_util_group_id_next();
    }
    std::set<std::string> names;
    for (std::size_t i = 0; i < streams.size(); ++i)
      take_pad_name(content.streams[i].name, i, names);
    remove_other_pads(element, names);
    names.clear();
    for (std::size_t i = 0; i < streams.size(); ++i) {
      const std::string name = take_pad_name(content.streams[i].name, i, names);
      GstPad* pad = take_pad(element, name, event, query);
      streams[i]->pad = pad;
      gst_pad_set_element_private(pad, streams[i].get());
      gst_flow_combiner_add_pad(self.combiner, pad);
    }
    {
      const std::scoped_lock one(self.seeking);
      self.streams = std::move(streams);
    }
    gst_element_no_more_pads(element);
    const std::scoped_lock one(self.seeking);
    start_threads(self);
    return true;
  });
}

/// Its pads stay, for the next time: what they were linked to when they came stays linked.
void close(GstElement* element) {
  TakeSrc& self = state_of<TakeSrc>(element);
  const std::scoped_lock one(self.seeking);
  for (const auto& stream : self.streams) {
    gst_pad_set_active(stream->pad, FALSE);
    gst_pad_stop_task(stream->pad);
    gst_flow_combiner_remove_pad(self.combiner, stream->pad);
  }
  self.streams.clear();
}

GstStateChangeReturn change_state(GstElement* element, GstStateChange transition) {
  const GstStateChangeReturn result =
      GST_ELEMENT_CLASS(parent_class<TakeSrc>())->change_state(element, transition);
  if (result == GST_STATE_CHANGE_FAILURE) return result;
  if (transition == GST_STATE_CHANGE_READY_TO_PAUSED && !open(element))
    return GST_STATE_CHANGE_FAILURE;
  if (transition == GST_STATE_CHANGE_PAUSED_TO_READY) close(element);
  return result;
}

void TakeSrc::class_init(gpointer klass) {
  GST_DEBUG_CATEGORY_INIT(takesrc_debug, "takesrc", 0, "takes from files");
  add_properties<TakeSrc>(klass, properties(), &TakeSrc::settings);
  add_statistics<TakeSrc>(klass,
                          "Counters since the start: buffers and bytes (played), packets-damaged "
                          "(left out), rigs-unusable (kept in the take, but no text), seeks.");
  set_metadata(klass, "Take player", "Source/File",
               "Plays the views, meshes and sound of a performance from one file");
  add_template(klass, "src_%u", GST_PAD_SRC, "ANY", G_TYPE_NONE, GST_PAD_SOMETIMES);
  auto* element_class = GST_ELEMENT_CLASS(klass);
  element_class->change_state = change_state;
  element_class->send_event = send_event;
}

}  // namespace

GST_ELEMENT_REGISTER_DEFINE(takesrc, "takesrc", GST_RANK_NONE, type_of<TakeSrc>())
