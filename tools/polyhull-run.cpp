// SPDX-License-Identifier: LGPL-2.1-or-later
// Runs a pipeline as gst-launch-1.0 does, shows its progress, and prints at the end where the time
// went: per element the processor time of its streaming threads, the `stats` of each polyhull
// element, and how long a frame takes from the cameras to the output. Sets and saves the elements'
// settings by a studio file.
#include <gst/gst.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/stopwatch.h"
#include "command_line.h"
#include "plugins/common/elements_in.h"
#include "run/clock.h"
#include "run/clock_watch.h"
#include "run/profile.h"
#include "studio/studio_file.h"
#include "text_file.h"

namespace {

volatile std::sig_atomic_t save_requested = 0;
volatile std::sig_atomic_t end_requests = 0;  // 1: at the end of the stream, 2: at once

// Ctrl-C ends the stream, once more the wait for its end, a third time the program.
void request_end(int signal) {
  end_requests = end_requests + 1;
  if (end_requests == 2) std::signal(signal, SIG_DFL);
}

double process_cpu_seconds() {
  timespec now;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

struct Run {
  GstElement* pipeline = nullptr;
  bool failed = false;
  bool quiet = false;    // no progress line
  bool brief = false;    // no tables at the end
  std::string count_at;  // the element whose buffers are the frames; empty: the sinks
  std::optional<polyhull::StudioFile> studio;
  std::string studio_path;  // where live changes are saved
  polyhull::Stopwatch watch;
  double next_progress = 10.0;      // seconds since start
  std::optional<ClockWatch> clock;  // that of another machine
  double next_look = 0.0;           // at it, seconds since start
};

void print_message(const char* kind, GstMessage* message, GError* error, const char* debug) {
  g_autofree char* where = gst_object_get_path_string(GST_MESSAGE_SRC(message));
  std::fprintf(stderr, "\n%s: %s: %s\n", kind, where, error->message);
  if (debug && *debug) std::fprintf(stderr, "  (%s)\n", debug);
}

// On a terminal one line that is written over; in a file a line every ten seconds.
void show_progress(Run& run) {
  gint64 position = -1;
  if (run.quiet || !gst_element_query_position(run.pipeline, GST_FORMAT_TIME, &position)) return;
  const bool terminal = isatty(STDERR_FILENO) != 0;
  const double now = run.watch.seconds();
  if (!terminal && now < run.next_progress) return;
  run.next_progress = now + 10.0;
  std::fprintf(stderr,
               terminal ? "\r  %.2f s of the stream done in %.1f s "
                        : "  %.2f s of the stream done in %.1f s\n",
               static_cast<double>(position) / 1e9, now);
}

// Sets what the studio file \p path (empty: none) holds; false, with messages, where it cannot be.
bool open_studio(Run& run, const std::string& path) {
  if (path.empty() && run.studio_path.empty()) return true;
  try {
    run.studio = path.empty() ? polyhull::StudioFile::parse(
                                    R"({"format":"polyhull-studio","version":1})", "")
                              : polyhull::StudioFile::parse(polyhull::read_text(path), path);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "polyhull-run: %s\n", error.what());
    return false;
  }
  if (run.studio_path.empty()) run.studio_path = path;
  const auto report = run.studio->apply(GST_BIN(run.pipeline));
  for (const std::string& key : report.without_taker)
    std::fprintf(stderr, "polyhull-run: note: %s: nothing in the pipeline takes it\n", key.c_str());
  for (const std::string& problem : report.problems)
    std::fprintf(stderr, "polyhull-run: %s\n", problem.c_str());
  std::signal(SIGUSR1, [](int) { save_requested = 1; });
  return report.problems.empty();
}

// The settings as they now are, in the place of the old file only when all is written.
void save_studio(Run& run) {
  for (const std::string& setting : run.studio->read_back(GST_BIN(run.pipeline)))
    std::fprintf(stderr, "polyhull-run: note: %s has a value that a file cannot hold; left out\n",
                 setting.c_str());
  const std::string part = run.studio_path + ".part";
  polyhull::write_text(run.studio->text(), part);
  std::filesystem::rename(part, run.studio_path);
  std::fprintf(stderr, "polyhull-run: settings saved to '%s'\n", run.studio_path.c_str());
}

// Saves where SIGUSR1 asked for it; what cannot be written is said and does not stop the show.
bool save_if_requested(Run& run) {
  if (!save_requested) return true;
  save_requested = 0;
  try {
    save_studio(run);
    return true;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "polyhull-run: %s\n", error.what());
    return false;
  }
}

// Once a second; what cannot go on is said.
void look_at_clock(Run& run) {
  if (!run.clock || run.watch.seconds() < run.next_look) return;
  run.next_look = run.watch.seconds() + 1.0;
  try {
    run.clock->look();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "\npolyhull-run: %s\n", error.what());
    run.failed = true;
  }
}

// Runs until the end of the stream or an error.
void run_to_end(Run& run) {
  g_autoptr(GstBus) bus = gst_element_get_bus(run.pipeline);
  if (gst_element_set_state(run.pipeline, GST_STATE_PLAYING) == GST_STATE_CHANGE_FAILURE)
    run.failed = true;  // the reason follows on the bus
  bool ending = false;
  for (;;) {
    g_autoptr(GstMessage) message = gst_bus_timed_pop_filtered(
        bus, run.failed ? 0 : GST_SECOND,
        static_cast<GstMessageType>(GST_MESSAGE_EOS | GST_MESSAGE_ERROR | GST_MESSAGE_WARNING |
                                    GST_MESSAGE_LATENCY));
    save_if_requested(run);
    if (end_requests > 1) return;
    if (!run.failed) {
      look_at_clock(run);
      if (run.failed) return;
    }
    if (end_requests > 0 && !ending) {
      ending = true;
      std::fprintf(stderr, "\npolyhull-run: ending the stream; again to stop at once\n");
      gst_element_send_event(run.pipeline, gst_event_new_eos());
    }
    if (!message) {
      if (run.failed) return;
      show_progress(run);
      continue;
    }
    g_autoptr(GError) error = nullptr;
    g_autofree char* debug = nullptr;
    switch (GST_MESSAGE_TYPE(message)) {
      case GST_MESSAGE_ERROR:
        gst_message_parse_error(message, &error, &debug);
        print_message("error", message, error, debug);
        run.failed = true;
        return;
      case GST_MESSAGE_WARNING:
        gst_message_parse_warning(message, &error, &debug);
        print_message("warning", message, error, debug);
        break;
      case GST_MESSAGE_LATENCY:
        gst_bin_recalculate_latency(GST_BIN(run.pipeline));
        break;
      default:
        show_progress(run);
        return;
    }
  }
}

GstStructure* stats_of(GstElement* element) {
  GParamSpec* property = g_object_class_find_property(G_OBJECT_GET_CLASS(element), "stats");
  if (!property || property->value_type != GST_TYPE_STRUCTURE) return nullptr;
  GstStructure* stats = nullptr;
  g_object_get(element, "stats", &stats, nullptr);
  return stats;
}

const char* factory_name(GstElement* element) {
  GstElementFactory* factory = gst_element_get_factory(element);
  return factory ? GST_OBJECT_NAME(factory) : "";
}

bool is_polyhull(GstElement* element) {
  GstElementFactory* factory = gst_element_get_factory(element);
  if (!factory) return false;
  g_autoptr(GstPlugin) plugin = gst_plugin_feature_get_plugin(GST_PLUGIN_FEATURE(factory));
  return plugin && g_str_equal(gst_plugin_get_name(plugin), "polyhull");
}

nlohmann::json value_to_json(const GValue* value) {
  if (G_VALUE_HOLDS_BOOLEAN(value)) return static_cast<bool>(g_value_get_boolean(value));
  if (G_VALUE_HOLDS_INT(value)) return g_value_get_int(value);
  if (G_VALUE_HOLDS_UINT(value)) return g_value_get_uint(value);
  if (G_VALUE_HOLDS_INT64(value)) return g_value_get_int64(value);
  if (G_VALUE_HOLDS_UINT64(value)) return g_value_get_uint64(value);
  if (G_VALUE_HOLDS_DOUBLE(value)) return g_value_get_double(value);
  if (G_VALUE_HOLDS_STRING(value)) {
    const char* text = g_value_get_string(value);
    return text ? text : "";
  }
  g_autofree char* text = gst_value_serialize(value);
  return text ? text : "";
}

// Prints the latency of the frames at \p output and returns it as JSON; null where no frame could be
// followed to there.
nlohmann::json report_latency(const std::string& output, bool brief) {
  const polyhull::LatencyReport latency = polyhull::latency_to(output);
  if (latency.frames == 0) return nullptr;
  nlohmann::json json = {{"output", output},
                         {"frames", latency.frames},
                         {"cameras", latency.cameras},
                         {"minimum_ms", latency.minimum},
                         {"median_ms", latency.median},
                         {"maximum_ms", latency.maximum},
                         {"mean_ms", latency.mean},
                         {"shares_ms", latency.shares},
                         {"other_cameras_ms", latency.other_cameras}};
  if (brief) return json;
  std::string cameras;
  for (const std::string& camera : latency.cameras)
    cameras += (cameras.empty() ? "" : ", ") + camera;
  std::printf("\nlatency from %s to %s, %zu frames: %.1f ms at least, %.1f median, %.1f at most\n",
              cameras.c_str(), output.c_str(), latency.frames, latency.minimum, latency.median,
              latency.maximum);
  std::vector<std::pair<std::string, double>> rows(latency.shares.begin(), latency.shares.end());
  std::stable_sort(rows.begin(), rows.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  rows.emplace_back("(other cameras)", latency.other_cameras);
  for (const auto& [element, milliseconds] : rows)
    std::printf("%-22s %8.3f ms %5.1f %%\n", element.c_str(), milliseconds,
                latency.mean > 0.0 ? 100.0 * milliseconds / latency.mean : 0.0);
  return json;
}

// JSON's text; bytes that are not UTF-8, as of an element's name, are replaced.
std::string text_of(const nlohmann::json& json, int indent = -1) {
  return json.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace);
}

// A figure of `stats` as a person reads it: colours as the properties take them.
std::string printed(const std::string& name, const nlohmann::json& value) {
  if (!name.ends_with("-colour") || !value.is_number_unsigned()) return text_of(value);
  char text[16];
  std::snprintf(text, sizeof text, "0x%06x", value.get<unsigned>());
  return text;
}

void report(const Run& run, double wall, double cpu, const std::string& json_path) {
  const auto times = polyhull::profile();
  nlohmann::json json = {{"wall_seconds", wall}, {"cpu_seconds", cpu}};
  std::uint64_t frames = 0;
  std::string output;  // where frames are counted
  double span = 0.0;   // seconds from the first frame to the last
  if (!run.brief)
    std::printf("\n%-22s %-14s %8s %14s\n", "element", "kind", "buffers", "CPU ms/buffer");
  auto elements = polyhull::element::elements_in(GST_BIN(run.pipeline));
  std::ranges::reverse(elements);  // from sources to sinks
  for (const auto& reference : elements) {
    GstElement* element = reference.get();
    const auto entry = times.find(GST_OBJECT_NAME(element));
    if (entry == times.end()) continue;
    const auto& time = entry->second;
    const std::uint64_t buffers = std::max(time.buffers_in, time.buffers_out);
    const bool counted = run.count_at.empty()
                             ? GST_OBJECT_FLAG_IS_SET(element, GST_ELEMENT_FLAG_SINK)
                             : run.count_at == GST_OBJECT_NAME(element);
    const std::uint64_t handed_on = time.buffers_out ? time.buffers_out : time.buffers_in;
    if (counted && handed_on > frames) {
      frames = handed_on;
      output = GST_OBJECT_NAME(element);
      span = time.buffers_out ? time.last_out - time.first_out : time.last_in - time.first_in;
    }
    const double milliseconds =
        buffers ? 1e3 * time.cpu_seconds / static_cast<double>(buffers) : 0.0;
    json["elements"][GST_OBJECT_NAME(element)] = {
        {"kind", factory_name(element)}, {"buffers", buffers}, {"cpu_ms_per_buffer", milliseconds}};
    if (run.brief) continue;
    std::printf("%-22s %-14s %8llu %14.3f\n", GST_OBJECT_NAME(element), factory_name(element),
                static_cast<unsigned long long>(buffers), milliseconds);
  }
  for (const auto& reference : elements) {
    GstElement* element = reference.get();
    if (!is_polyhull(element)) continue;
    g_autoptr(GstStructure) stats = stats_of(element);
    if (!stats) continue;
    if (!run.brief) std::printf("\n%s:", GST_OBJECT_NAME(element));
    for (int i = 0; i < gst_structure_n_fields(stats); ++i) {
      const char* name = gst_structure_nth_field_name(stats, i);
      const nlohmann::json value = value_to_json(gst_structure_get_value(stats, name));
      json["stats"][GST_OBJECT_NAME(element)][name] = value;
      if (!run.brief) std::printf(" %s=%s", name, printed(name, value).c_str());
    }
    if (!run.brief) std::printf("\n");
  }
  json["latency"] = report_latency(output, run.brief);
  json["frames"] = frames;
  const double rate = span > 0.0 ? static_cast<double>(frames - 1) / span : 0.0;
  json["frames_per_second"] = rate;
  if (run.clock) json["clock_losses"] = run.clock->losses();
  std::printf(
      "\n%llu frames in %.2f s, %.1f frames per second after the first; processor time %.2f s\n",
      static_cast<unsigned long long>(frames), wall, rate, cpu);
  if (!json_path.empty()) polyhull::write_text(text_of(json, 2), json_path);
}

// Prints the figures; false where their file cannot be written.
bool report_all(const Run& run, double wall, double cpu, const std::string& json_path) {
  try {
    report(run, wall, cpu, json_path);
    return true;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "polyhull-run: %s\n", error.what());
    return false;
  }
}

struct Options {
  std::vector<std::string> words;
  std::string json_path, studio, clock_server;
  int clock_port = 0;
};

void add_options(polyhull::CommandLine& command, Options& options, Run& run) {
  command.option("pipeline", &options.words, "The pipeline in gst-launch-1.0's syntax").required();
  command.option("--json", &options.json_path, "Also write the figures to this file");
  command.flag("--quiet", &run.quiet, "No progress line");
  command.option("--count", &run.count_at,
                 "Name of the element whose buffers count as frames (default: the busiest sink)");
  command.flag("--brief", &run.brief, "Only the last line of the figures");
  command.option("--studio", &options.studio,
                 "Settings of the elements, a studio file (docs/studio.md)");
  command.option("--save-studio", &run.studio_path,
                 "Saves the settings at the end (Ctrl-C is one) here; SIGUSR1 saves them while it "
                 "runs, without this "
                 "option into --studio's file");
  const polyhull::Option server =
      command
          .option("--clock-server", &options.clock_port,
                  "Gives this machine's clock to others on this UDP port; running time is the "
                  "clock's")
          .range(1, 65535);
  command
      .option("--clock", &options.clock_server,
              "HOST:PORT of a machine that gives its clock, or ptp or ptp:DOMAIN for the "
              "network's PTP clock; running time is that clock's")
      .excludes(server);
}

// Null, and says why, where the words make no pipeline.
GstElement* pipeline_of(const std::vector<std::string>& words) {
  std::vector<const char*> arguments;
  for (const std::string& word : words) arguments.push_back(word.c_str());
  arguments.push_back(nullptr);
  g_autoptr(GError) error = nullptr;
  GstElement* parsed = gst_parse_launchv(arguments.data(), &error);
  if (!parsed || error) {
    std::fprintf(stderr, "polyhull-run: the pipeline cannot be built: %s\n",
                 error ? error->message : "");
    return nullptr;
  }
  if (GST_IS_PIPELINE(parsed)) return parsed;
  GstElement* pipeline = gst_pipeline_new(nullptr);  // around a single element
  gst_bin_add(GST_BIN(pipeline), parsed);
  return pipeline;
}

// Puts the pipeline on the clock that the options name, or gives its own to others, which \p provider then
// does; false, and says why, where that fails.
bool set_clock(Run& run, const Options& options, GstObject*& provider) {
  try {
    provider = share_clock(run.pipeline, options.clock_port, options.clock_server);
    if (!options.clock_server.empty()) {
      g_autoptr(GstClock) clock = gst_pipeline_get_pipeline_clock(GST_PIPELINE(run.pipeline));
      run.clock.emplace(clock, options.clock_server);
    }
    return true;
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "polyhull-run: %s\n", failure.what());
    return false;
  }
}

// Plays the pipeline to its end and reports; false where one of them failed.
bool play(Run& run, const Options& options) {
  std::signal(SIGINT, request_end);
  std::signal(SIGTERM, request_end);
  run.watch = {};
  const double cpu = process_cpu_seconds();
  run_to_end(run);
  const double wall = run.watch.seconds();
  return !run.failed && report_all(run, wall, process_cpu_seconds() - cpu, options.json_path);
}

}  // namespace

int main(int argc, char** argv) {
  polyhull::CommandLine command(
      "polyhull-run", "Runs a pipeline as gst-launch-1.0 does and prints where the time went.");
  Options options;
  Run run;
  add_options(command, options, run);
  if (const auto status = command.parse(argc, argv)) return *status;

  gst_init(nullptr, nullptr);
  polyhull::start_profile(run.count_at);
  run.pipeline = pipeline_of(options.words);
  if (!run.pipeline) return 1;
  const bool save_at_end = !run.studio_path.empty();
  GstObject* clock_provider = nullptr;
  if (!open_studio(run, options.studio) || !set_clock(run, options, clock_provider)) {
    gst_object_unref(run.pipeline);
    return 1;
  }
  const bool played = play(run, options);
  save_requested = save_requested || save_at_end;
  const bool saved = save_if_requested(run);
  run.clock.reset();
  gst_element_set_state(run.pipeline, GST_STATE_NULL);
  gst_object_unref(run.pipeline);
  gst_clear_object(&clock_provider);
  return played && saved ? 0 : 1;
}
