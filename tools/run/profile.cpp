// SPDX-License-Identifier: LGPL-2.1-or-later
#define GST_USE_UNSTABLE_API
#include "run/profile.h"

#include <gst/gsttracer.h>
#include <time.h>

#include <algorithm>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace polyhull {
namespace {

struct HookTracer {
  GstTracer parent;
};
struct HookTracerClass {
  GstTracerClass parent_class;
};

G_DEFINE_TYPE(HookTracer, hook_tracer, GST_TYPE_TRACER)
void hook_tracer_class_init(HookTracerClass*) {}
void hook_tracer_init(HookTracer*) {}

double seconds_of(clockid_t clock) {
  timespec now;
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double thread_seconds() {
  return seconds_of(CLOCK_THREAD_CPUTIME_ID);
}

void note_now(double& first, double& last) {
  last = seconds_of(CLOCK_MONOTONIC);
  if (first == 0.0) first = last;
}

void widen(double& first, double& last, double other_first, double other_last) {
  if (other_first == 0.0) return;
  first = first == 0.0 ? other_first : std::min(first, other_first);
  last = std::max(last, other_last);
}

using Times = std::map<std::string, ElementTime>;

// One table per thread, so that the hooks never wait for each other; profile() adds them up.
struct ThreadTimes {
  std::mutex mutex;  // protects times against profile() while the thread runs
  Times times;
  std::vector<std::string> inside;  // elements whose chain functions are on this thread's stack
  double last = thread_seconds();
  std::string outside;  // the element whose buffer is on its way through the pads of bins
};

std::mutex threads_mutex;  // protects threads
std::vector<std::shared_ptr<ThreadTimes>> threads;

ThreadTimes& this_thread() {
  thread_local std::shared_ptr<ThreadTimes> mine = [] {
    auto made = std::make_shared<ThreadTimes>();
    std::lock_guard lock(threads_mutex);
    threads.push_back(made);
    return made;
  }();
  return *mine;
}

std::string element_of(GstPad* pad) {
  if (!pad) return {};
  g_autoptr(GstElement) element = gst_pad_get_parent_element(pad);
  if (!element || GST_IS_BIN(element)) return {};
  g_autofree char* name = gst_object_get_name(GST_OBJECT(element));
  return name;
}

void spend(ThreadTimes& thread, const std::string& element) {
  const double now = thread_seconds();
  if (!element.empty()) thread.times[element].cpu_seconds += now - thread.last;
  thread.last = now;
}

std::mutex latency_mutex;  // protects the two below
LatencyTrace latency_trace;
std::string latency_output;
std::int64_t last_reached = -1;  // the instant that has reached it last; under latency_mutex

/// Running time of \p buffer, ns; -1 where it has none.
std::int64_t instant_of(GstPad* pad, GstBuffer* buffer) {
  if (!GST_BUFFER_PTS_IS_VALID(buffer)) return -1;
  g_autoptr(GstEvent) event = gst_pad_get_sticky_event(pad, GST_EVENT_SEGMENT, 0);
  if (!event) return -1;
  const GstSegment* segment = nullptr;
  gst_event_parse_segment(event, &segment);
  if (segment->format != GST_FORMAT_TIME) return -1;
  const guint64 time =
      gst_segment_to_running_time(segment, GST_FORMAT_TIME, GST_BUFFER_PTS(buffer));
  return GST_CLOCK_TIME_IS_VALID(time) ? static_cast<std::int64_t>(time) : -1;
}

/// \p buffer goes from \p from to \p to, whose pad is \p peer.
void follow(GstPad* pad, GstPad* peer, GstBuffer* buffer, const std::string& from,
            const std::string& to) {
  const std::int64_t instant = instant_of(pad, buffer);
  if (instant < 0 || from.empty() || to.empty()) return;
  const double now = seconds_of(CLOCK_MONOTONIC);
  g_autofree char* name = gst_object_get_name(GST_OBJECT(peer));
  g_autoptr(GstElement) element = gst_pad_get_parent_element(peer);
  const bool sink = element && GST_OBJECT_FLAG_IS_SET(element, GST_ELEMENT_FLAG_SINK);
  std::lock_guard lock(latency_mutex);
  latency_trace.handed_over(now, instant, from, to, g_str_equal(name, "background"));
  // Where it branches, once.
  if (from == latency_output && std::exchange(last_reached, instant) != instant)
    latency_trace.reached(now, instant, from, from);
  if (sink) latency_trace.reached(now, instant, to, from);
}

void push_begins(GstPad* pad, std::uint64_t buffers, GstBuffer* first) {
  const std::string from = element_of(pad);
  g_autoptr(GstPad) peer = gst_pad_get_peer(pad);
  const std::string to = element_of(peer);
  ThreadTimes& thread = this_thread();
  std::lock_guard lock(thread.mutex);
  const std::string& sender = from.empty() ? thread.outside : from;
  if (first) follow(pad, peer, first, sender, to);
  if (to.empty()) thread.outside = sender;
  spend(thread, from.empty() && !thread.inside.empty() ? thread.inside.back() : from);
  if (!from.empty()) {
    thread.times[from].buffers_out += buffers;
    note_now(thread.times[from].first_out, thread.times[from].last_out);
  }
  if (!to.empty()) {
    thread.times[to].buffers_in += buffers;
    note_now(thread.times[to].first_in, thread.times[to].last_in);
  }
  thread.inside.push_back(to);
}

void push_ends() {
  ThreadTimes& thread = this_thread();
  std::lock_guard lock(thread.mutex);
  if (thread.inside.empty()) return;
  spend(thread, thread.inside.back());
  thread.inside.pop_back();
}

void before_push(GstTracer*, GstClockTime, GstPad* pad, GstBuffer* buffer) {
  push_begins(pad, 1, buffer);
}
void after_push(GstTracer*, GstClockTime, GstPad*, GstFlowReturn) {
  push_ends();
}
void before_push_list(GstTracer*, GstClockTime, GstPad* pad, GstBufferList* list) {
  const guint length = gst_buffer_list_length(list);
  push_begins(pad, length, length > 0 ? gst_buffer_list_get(list, 0) : nullptr);
}

}  // namespace

void start_profile(const std::string& output) {
  latency_output = output;
  static GstTracer* tracer = GST_TRACER(g_object_new(hook_tracer_get_type(), nullptr));
  gst_object_ref_sink(tracer);
  gst_tracing_register_hook(tracer, "pad-push-pre", G_CALLBACK(before_push));
  gst_tracing_register_hook(tracer, "pad-push-post", G_CALLBACK(after_push));
  gst_tracing_register_hook(tracer, "pad-push-list-pre", G_CALLBACK(before_push_list));
  gst_tracing_register_hook(tracer, "pad-push-list-post", G_CALLBACK(after_push));
}

std::map<std::string, ElementTime> profile() {
  Times sum;
  std::lock_guard all(threads_mutex);
  for (const auto& thread : threads) {
    std::lock_guard lock(thread->mutex);
    for (const auto& [name, time] : thread->times) {
      ElementTime& entry = sum[name];
      entry.buffers_in += time.buffers_in;
      entry.buffers_out += time.buffers_out;
      entry.cpu_seconds += time.cpu_seconds;
      widen(entry.first_in, entry.last_in, time.first_in, time.last_in);
      widen(entry.first_out, entry.last_out, time.first_out, time.last_out);
    }
  }
  return sum;
}

LatencyReport latency_to(const std::string& output) {
  std::lock_guard lock(latency_mutex);
  return latency_trace.report(output);
}

}  // namespace polyhull
