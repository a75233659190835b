// SPDX-License-Identifier: LGPL-2.1-or-later
#include "support/triggered_line.h"

#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <random>
#include <thread>

namespace {

std::mutex line_mutex;  // protects the times
std::vector<std::int64_t>
    line_times;  // of the packets, CLOCK_MONOTONIC, which is GStreamer's clock

std::int64_t monotonic() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * 1000000000 + now.tv_nsec;
}

}  // namespace

extern "C" ssize_t write(int file, const void* bytes, std::size_t count) {
  if (file > 2 && isatty(file)) {
    const std::scoped_lock lock(line_mutex);
    line_times.push_back(monotonic());
  }
  return static_cast<ssize_t>(syscall(SYS_write, file, bytes, count));
}

namespace polyhull::test {
namespace {

constexpr std::uint64_t none = ~std::uint64_t{0};
constexpr std::int64_t millisecond = 1000000;

std::uint64_t packets() {
  const std::scoped_lock lock(line_mutex);
  return line_times.size();
}

std::string with_number(std::string text, int number) {
  for (std::size_t at; (at = text.find("%d")) != std::string::npos;)
    text.replace(at, 2, std::to_string(number));
  return text;
}

std::uint64_t number_on(GstBuffer* buffer) {
  GstCaps* caps = gst_caps_new_empty_simple("timestamp/x-polyhull-trigger");
  const auto* meta = gst_buffer_get_reference_timestamp_meta(buffer, caps);
  gst_caps_unref(caps);
  return meta != nullptr ? meta->timestamp : none;
}

}  // namespace

struct TriggeredLine::Camera {
  int index;
  const TriggeredOptions options;
  GstElement* pipeline;
  GstElement* source;  // appsrc
  std::atomic<bool> stopping{false};
  std::mutex mutex;  // protects the frames
  std::vector<StampedFrame> frames;
  std::thread thread;

  Camera(int camera, const TriggeredOptions& all, GstElement* line)
      : index(camera), options(all), pipeline(line) {
    source = gst_bin_get_by_name(GST_BIN(line), ("camera" + std::to_string(index)).c_str());
    GstElement* sink = gst_bin_get_by_name(GST_BIN(line), ("sink" + std::to_string(index)).c_str());
    if (sink == nullptr) return;
    g_signal_connect(sink, "handoff", G_CALLBACK(arrived), this);
    gst_object_unref(sink);
  }
  ~Camera() {
    stop();
    gst_object_unref(source);
  }
  void stop() {
    stopping = true;
    if (thread.joinable()) thread.join();
  }

  static void arrived(GstElement*, GstBuffer* buffer, GstPad*, gpointer data) {
    auto* camera = static_cast<Camera*>(data);
    StampedFrame frame{none, number_on(buffer)};
    gst_buffer_extract(buffer, 0, &frame.pulse, sizeof frame.pulse);
    const std::scoped_lock lock(camera->mutex);
    camera->frames.push_back(frame);
  }

  void send(std::uint64_t pulse, std::int64_t time) const {
    GstBuffer* buffer = gst_buffer_new_allocate(nullptr, sizeof pulse, nullptr);
    gst_buffer_fill(buffer, 0, &pulse, sizeof pulse);
    const auto base = static_cast<std::int64_t>(gst_element_get_base_time(pipeline));
    GST_BUFFER_PTS(buffer) = static_cast<GstClockTime>(std::max<std::int64_t>(time - base, 0));
    GstFlowReturn flow = GST_FLOW_OK;
    g_signal_emit_by_name(source, "push-buffer", buffer, &flow);
    gst_buffer_unref(buffer);
  }

  void run() const {
    std::mt19937_64 random(static_cast<std::uint64_t>(index) + 1);
    std::uniform_int_distribution<std::int64_t> jitter(-options.jitter, options.jitter);
    for (std::uint64_t pulse = 0; !stopping;) {
      std::int64_t seen = 0;
      {
        const std::scoped_lock lock(line_mutex);
        if (pulse < line_times.size()) seen = line_times[pulse];
      }
      if (seen == 0) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        continue;
      }
      const int count = options.frames ? options.frames(index, pulse) : 1;
      const std::int64_t time = seen + options.delay + jitter(random);
      const std::int64_t wait = time + options.transfer - monotonic();
      if (wait > 0) std::this_thread::sleep_for(std::chrono::nanoseconds(wait));
      for (int i = 0; i < count; ++i) send(pulse, time + i * millisecond);
      ++pulse;
    }
  }
};

TriggeredLine::TriggeredLine(const TriggeredOptions& options) {
  {
    const std::scoped_lock lock(line_mutex);
    line_times.clear();
  }
  std::string text = "serialtrigger name=trigger device=" + terminal.device + " " + options.trigger;
  for (int i = 0; i < options.cameras; ++i)
    text +=
        with_number(" appsrc name=camera%d is-live=true format=time ! triggerstamp name=stamp%d " +
                        options.stamp + " ! " + options.tail,
                    i);
  GError* error = nullptr;
  pipeline = gst_parse_launch((text + " " + options.beside).c_str(), &error);
  if (error != nullptr) g_error("%s: %s", text.c_str(), error->message);
  for (int i = 0; i < options.cameras; ++i)
    cameras_.push_back(std::make_unique<Camera>(i, options, pipeline));
}

TriggeredLine::~TriggeredLine() {
  for (auto& camera : cameras_) camera->stop();
  gst_element_set_state(pipeline, GST_STATE_NULL);
  cameras_.clear();
  gst_object_unref(pipeline);
}

void TriggeredLine::play() {
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  for (auto& camera : cameras_)
    if (!camera->thread.joinable()) camera->thread = std::thread([&camera] { camera->run(); });
}

bool TriggeredLine::wait_for_pulses(std::uint64_t count, double seconds) {
  const std::int64_t end = monotonic() + static_cast<std::int64_t>(seconds * 1e9);
  while (packets() < count && monotonic() < end) {
    terminal.read_all();  // so that its buffer does not fill
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return packets() >= count;
}

void TriggeredLine::finish() {
  gst_util_set_object_arg(G_OBJECT(element("trigger")), "rate", "0/1");
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
}

void TriggeredLine::stray(int camera, std::int64_t time) {
  cameras_[static_cast<std::size_t>(camera)]->send(none, time);
}

std::uint64_t TriggeredLine::pulses() const {
  return packets();
}

std::vector<StampedFrame> TriggeredLine::frames(int camera) {
  Camera& one = *cameras_[static_cast<std::size_t>(camera)];
  const std::scoped_lock lock(one.mutex);
  return one.frames;
}

GstElement* TriggeredLine::element(const std::string& name) const {
  GstElement* found = gst_bin_get_by_name(GST_BIN(pipeline), name.c_str());
  if (found != nullptr) gst_object_unref(found);  // the pipeline keeps it
  return found;
}

std::vector<gint64> TriggeredLine::latenesses() {
  std::vector<gint64> all;
  GstBus* bus = gst_element_get_bus(pipeline);
  while (GstMessage* message = gst_bus_pop_filtered(bus, GST_MESSAGE_ELEMENT)) {
    const GstStructure* s = gst_message_get_structure(message);
    gint64 lateness = 0;
    if (gst_structure_has_name(s, "polyhull-trigger") &&
        gst_structure_get_int64(s, "lateness", &lateness))
      all.push_back(lateness);
    gst_message_unref(message);
  }
  gst_object_unref(bus);
  return all;
}

}  // namespace polyhull::test
