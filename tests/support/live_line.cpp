// SPDX-License-Identifier: LGPL-2.1-or-later
#include "support/live_line.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <thread>

#include <unistd.h>

#include "builtin/default_rig.h"
#include "rig/rig.h"
#include "support/labels.h"
#include "wire/mesh_payload.h"

namespace polyhull::test {
namespace {

/// A spindle of 1.7 m as an OBJ file, quickly drawn: machines shall be busy with the line, not with
/// its cameras. Returns its path.
std::string spindle() {
  const auto path = std::filesystem::temp_directory_path() /
                    ("polyhull_live_" + std::to_string(::getuid()) + "_spindle.obj");
  const std::string partial = path.string() + "." + std::to_string(::getpid());
  std::ofstream file(partial);
  constexpr int around = 10, rows = 6;
  for (int row = 1; row < rows; ++row)
    for (int i = 0; i < around; ++i) {
      const double radius = 0.3 * std::sin(M_PI * row / rows), angle = 2 * M_PI * i / around;
      file << "v " << radius * std::sin(angle) << " " << 1.7 * row / rows << " "
           << 0.7 * radius * std::cos(angle) << "\n";
    }
  file << "v 0 0 0\nv 0 1.7 0\n";
  const int bottom = around * (rows - 1) + 1, top = bottom + 1;
  for (int i = 0; i < around; ++i) {
    const int j = (i + 1) % around, last = around * (rows - 2) + 1;
    file << "f " << bottom << " " << j + 1 << " " << i + 1 << "\n";
    file << "f " << top << " " << last + i << " " << last + j << "\n";
    for (int row = 0; row < rows - 2; ++row) {
      const int a = row * around + 1;
      file << "f " << a + i << " " << a + j << " " << a + around + j << " " << a + around + i
           << "\n";
    }
  }
  file.close();
  std::filesystem::rename(partial, path);
  return path.string();
}

/// Camera \p i up to its views.
std::string camera_line(const LiveOptions& options, int i) {
  const std::string name = "cam" + std::to_string(i);
  const int delay = options.delays.empty()
                        ? 0
                        : options.delays[static_cast<std::size_t>(i) % options.delays.size()];
  return "rigtestsrc name=" + name + " rig=" + ring_rig(options) + " camera=" + name +
         " subject=" + (options.figure ? "figure" : spindle()) +
         " is-live=true stamp=true shadow=0 unevenness=0 noise=0 spill=0 delay=" +
         std::to_string(delay) + "000000 jitter=" + std::to_string(options.jitter) + "000000 " +
         options.source + " ! video/x-raw,format=RGBx,framerate=" + std::to_string(options.rate) +
         "/1 ! " + options.branch + " camera=" + name;
}

std::string line_of(const LiveOptions& options, int linked) {
  std::string line =
      "hullbuild name=hull rig=" + ring_rig(options) + " " + options.hull + " ! " + options.tail;
  for (int i = 0; i < linked; ++i)
    line += " " + camera_line(options, i) + " ! hull.sink_" + std::to_string(i);
  return line;
}

}  // namespace

std::string ring_rig(const LiveOptions& options) {
  const Rig built_in = default_rig();
  Rig rig = built_in;
  rig.cameras.clear();
  for (int i = 0; i < options.cameras; ++i) {
    Camera camera = built_in.cameras[0];
    camera.name = "cam" + std::to_string(i);
    const double scale = std::min(static_cast<double>(options.width) / camera.width,
                                  static_cast<double>(options.height) / camera.height);
    camera.K[0][0] *= scale;
    camera.K[1][1] *= scale;
    camera.K[2][0] = 0.5 * (options.width - 1);
    camera.K[2][1] = 0.5 * (options.height - 1);
    camera.width = options.width;
    camera.height = options.height;
    const double angle = 2.0 * M_PI * i / options.cameras, c = std::cos(angle), s = std::sin(angle);
    const Mat3 turn(Vec3(c, 0, -s), Vec3(0, 1, 0), Vec3(s, 0, c));
    camera.R = camera.R * turn;
    rig.cameras.push_back(camera);
  }
  const std::string path =
      (std::filesystem::temp_directory_path() /
       ("polyhull_live_" + std::to_string(::getuid()) + "_" + std::to_string(options.cameras) +
        "_" + std::to_string(options.width) + "x" + std::to_string(options.height) + ".json"))
          .string();
  const std::string partial = path + "." + std::to_string(::getpid());
  std::ofstream(partial) << rig_to_json(rig);
  std::filesystem::rename(partial, path);
  return path;
}

bool LiveSet::whole(int cameras) const {
  return static_cast<int>(numbers.size()) == cameras && !mixed();
}

bool LiveSet::mixed() const {
  return are_mixed(numbers);
}

LiveLine::LiveLine(const LiveOptions& options) : options_(options) {
  GError* error = nullptr;
  joined_ = options.linked < 0 ? options.cameras : options.linked;
  const std::string line = line_of(options, joined_);
  pipeline_ = gst_parse_launch(line.c_str(), &error);
  if (error != nullptr) {
    std::fprintf(stderr, "%s\n%s\n", line.c_str(), error->message);
    std::abort();
  }
  hull_ = gst_bin_get_by_name(GST_BIN(pipeline_), "hull");
  GstPad* pad = gst_element_get_static_pad(hull_, "src");
  gst_pad_add_probe(pad, GST_PAD_PROBE_TYPE_BUFFER, mesh_comes, this, nullptr);
  gst_object_unref(pad);
}

LiveLine::~LiveLine() {
  stop();
  gst_object_unref(hull_);
  gst_object_unref(pipeline_);
}

GstPadProbeReturn LiveLine::mesh_comes(GstPad* pad, GstPadProbeInfo* info, gpointer data) {
  auto* self = static_cast<LiveLine*>(data);
  GstBuffer* buffer = GST_PAD_PROBE_INFO_BUFFER(info);
  LiveSet set;
  GstEvent* event = gst_pad_get_sticky_event(pad, GST_EVENT_SEGMENT, 0);
  const GstSegment* segment = nullptr;
  gst_event_parse_segment(event, &segment);
  set.time = gst_segment_to_running_time(segment, GST_FORMAT_TIME, GST_BUFFER_PTS(buffer));
  gst_event_unref(event);
  GstMapInfo map;
  gst_buffer_map(buffer, &map, GST_MAP_READ);
  set.numbers = labels_of(read_mesh(Bytes(map.data, map.size)));
  gst_buffer_unmap(buffer, &map);
  const std::scoped_lock lock(self->mutex_);
  self->sets_.push_back(std::move(set));
  return GST_PAD_PROBE_OK;
}

void LiveLine::play(double seconds) {
  gst_element_set_state(pipeline_, GST_STATE_PLAYING);
  GstBus* bus = gst_element_get_bus(pipeline_);
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (std::chrono::steady_clock::now() < end && error_.empty()) {
    GstMessage* message = gst_bus_timed_pop(bus, 20 * GST_MSECOND);
    if (message == nullptr) continue;
    GError* text = nullptr;
    switch (GST_MESSAGE_TYPE(message)) {
      case GST_MESSAGE_LATENCY:
        gst_bin_recalculate_latency(GST_BIN(pipeline_));
        break;
      case GST_MESSAGE_WARNING:
        gst_message_parse_warning(message, &text, nullptr);
        warnings_.emplace_back(text->message);
        break;
      case GST_MESSAGE_ERROR:
        gst_message_parse_error(message, &text, nullptr);
        error_ = text->message;
        break;
      default:
        break;
    }
    g_clear_error(&text);
    gst_message_unref(message);
  }
  gst_object_unref(bus);
}

void LiveLine::pause() {
  gst_element_set_state(pipeline_, GST_STATE_PAUSED);
  gst_element_get_state(pipeline_, nullptr, nullptr, 5 * GST_SECOND);
}

void LiveLine::join() {
  GstElement* camera =
      gst_parse_bin_from_description(camera_line(options_, joined_).c_str(), TRUE, nullptr);
  gst_bin_add(GST_BIN(pipeline_), camera);
  gst_element_link_pads(camera, "src", hull_, ("sink_" + std::to_string(joined_)).c_str());
  gst_element_sync_state_with_parent(camera);
  ++joined_;
}

void LiveLine::stop() {
  gst_element_set_state(pipeline_, GST_STATE_NULL);
}

std::vector<std::thread> LiveLine::load(int threads, double seconds) {
  std::vector<std::thread> result;
  for (int i = 0; i < threads; ++i)
    result.emplace_back([seconds] {
      const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
      volatile double work = 1.0;
      while (std::chrono::steady_clock::now() < end)
        for (int k = 0; k < 1000; ++k) work = std::sqrt(work + k);
    });
  return result;
}

LiveFigures LiveLine::figures(double begin, double end) const {
  LiveFigures figures;
  std::map<int, int> seen;
  for (const LiveSet& set : sets()) {
    const double time = static_cast<double>(set.time) * 1e-9;
    if (time < begin || time >= end) continue;
    ++figures.sets;
    if (static_cast<int>(set.numbers.size()) < options_.cameras) ++figures.incomplete;
    if (set.mixed()) ++figures.mixed;
    const auto known = std::find_if(set.numbers.begin(), set.numbers.end(),
                                    [](int number) { return number >= 0; });
    for (const int number : set.numbers) figures.unreadable += number < 0;
    if (known == set.numbers.end()) continue;
    if (seen[*known]++ > 0) ++figures.split;
    if (set.whole(options_.cameras)) ++figures.shown;
  }
  for (int number = 0; number < end * options_.rate; ++number) {
    const double time = static_cast<double>(number) / options_.rate;
    figures.instants += time >= begin && time < end;
  }
  return figures;
}

std::vector<LiveSet> LiveLine::sets() const {
  const std::scoped_lock lock(mutex_);
  return sets_;
}

double LiveLine::now() const {
  GstClock* clock = gst_element_get_clock(pipeline_);
  if (clock == nullptr) return 0.0;
  const GstClockTime now = gst_clock_get_time(clock) - gst_element_get_base_time(pipeline_);
  gst_object_unref(clock);
  return static_cast<double>(now) * 1e-9;
}

double LiveLine::latency() const {
  GstQuery* query = gst_query_new_latency();
  GstPad* pad = gst_element_get_static_pad(hull_, "src");
  GstClockTime least = 0;
  if (gst_pad_query(pad, query)) gst_query_parse_latency(query, nullptr, &least, nullptr);
  gst_object_unref(pad);
  gst_query_unref(query);
  return static_cast<double>(least) * 1e-6;
}

GstElement* LiveLine::element(const char* name) const {
  return gst_bin_get_by_name(GST_BIN(pipeline_), name);
}

guint64 LiveLine::statistic(const char* name, const char* field) const {
  GstElement* element = this->element(name);
  GstStructure* stats = nullptr;
  g_object_get(element, "stats", &stats, nullptr);
  guint64 value = 0;
  gst_structure_get_uint64(stats, field, &value);
  gst_structure_free(stats);
  gst_object_unref(element);
  return value;
}

}  // namespace polyhull::test
