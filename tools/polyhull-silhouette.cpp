// SPDX-License-Identifier: LGPL-2.1-or-later
// Silhouettes without a pipeline: a picture in, rings out, with times and counts.
#include <algorithm>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>
#include <thread>
#include <utility>

#include "base/error.h"
#include "base/median.h"
#include "base/picture.h"
#include "base/stopwatch.h"
#include "command_line.h"
#include "silhouette/key/key_configuration.h"
#include "silhouette/key/key_score.h"
#include "silhouette/silhouette.h"
#include "silhouette_options.h"
#include "text_file.h"

namespace {

using namespace polyhull;
using Json = nlohmann::json;

Json rings_json(const Rings& rings, int width, int height) {
  Json list = Json::array();
  for (std::size_t i = 0; i < rings.size(); ++i) {
    Json ring = Json::array();
    for (const Vec2f p : rings.ring(i)) ring.push_back({p.x, p.y});
    list.push_back(std::move(ring));
  }
  return {{"format", "polyhull-rings"},
          {"version", 1},
          {"width", width},
          {"height", height},
          {"rings", std::move(list)}};
}

// One reading of the frame, as the measure of what the memory allows.
double read_once(const FrameMemory& frame) {
  const Stopwatch watch;
  std::uint64_t sum = 0;
  for (const auto& plane : frame.planes) {
    const std::size_t words = plane.size() / 8;
    const auto* from = reinterpret_cast<const std::uint64_t*>(plane.data());
    std::uint64_t part[8] = {};
    for (std::size_t i = 0; i + 8 <= words; i += 8)
      for (int k = 0; k < 8; ++k) part[k] += from[i + k];
    for (const std::uint64_t p : part) sum += p;
  }
  const double ms = watch.milliseconds();
  return sum == 1 ? ms + 1e-9 : ms;  // the sum is used
}

struct Stages {
  std::vector<double> read, whole, key, blur, trace, approximate;
};

// The same stages one after the other on whole planes, each timed.
void time_stages(const FrameView& frame, const SilhouetteSettings& settings, int repeat,
                 Stages& out) {
  Keyer keyer;
  keyer.set(settings.key);
  Blur blur;
  blur.set(settings.blur);
  Tracer tracer;
  Approximator approximator;
  Matte matte;
  Field field;
  Rings traced, rings;
  std::vector<std::int32_t> parents;
  const TraceSettings trace{settings.method,
                            corrected_sigma(settings.blur, settings.correct_curvature)};
  for (int i = 0; i < repeat; ++i) {
    Stopwatch watch;
    keyer.key(frame, matte);
    out.key.push_back(1e3 * watch.lap());
    blur.apply(matte, field);
    out.blur.push_back(1e3 * watch.lap());
    tracer.trace(field, trace, traced, &parents);
    out.trace.push_back(1e3 * watch.lap());
    approximator.approximate(traced, parents, settings.approximate, rings);
    out.approximate.push_back(1e3 * watch.lap());
  }
}

struct Arguments {
  std::string picture, output, matte, view_file, rig, camera, format = "RGBx";
  KeyView view = KeyView::composite;
  std::vector<std::string> plates;
  int repeat = 1, threads = 1;
  bool json = false;
  SilhouetteOptions options;

  void add_to(CommandLine& command) {
    command.option("picture", &picture, "PNG or JPEG file").required();
    command.option("-o,--output", &output, "Writes the rings as JSON; '-': to standard output");
    command.option("--matte", &matte, "Writes the matte before the blur as a grey PNG");
    command.option("--view-file", &view_file, "Writes the picture that --view chooses as PNG");
    command.choice("--view", &view, "For --view-file: composite, matte, status, spill or split",
                   {{"composite", KeyView::composite},
                    {"matte", KeyView::matte},
                    {"status", KeyView::status},
                    {"spill", KeyView::spill},
                    {"split", KeyView::split}});
    command.option("--format", &format, "Pixel format that the picture is given to the keyer in")
        .one_of({"RGBx", "BGRx", "RGB", "I420", "NV12", "YUY2", "UYVY"});
    command.option("--plate", &plates, "Clean plates; several are averaged, with their variation");
    Option of_rig =
        command.option("--rig", &rig, "Rig file: only what --camera sees of its bounds is keyed")
            .existing_file();
    Option name = command.option("--camera", &camera, "The picture's camera in the rig file");
    of_rig.needs(name);
    name.needs(of_rig);
    command.option("--repeat", &repeat, "Processes the picture this many times").range(1, 1000000);
    command.option("--threads", &threads, "This many streams at a time").range(1, 256);
    command.flag("--json", &json, "Prints times and counts as JSON");
    options.add_to(command);
  }
};

// What all streams work on.
struct Work {
  explicit Work(const Arguments& arguments)
      : settings(arguments.options.settings()),
        picture(load_picture(arguments.picture, 3)),
        frame(pack(picture, arguments.format)) {
    settings.keep_matte = false;
    settings.reuse = false;
    settings.steadiness = 0.0;  // each repetition is to find its contours
    if (arguments.plates.size() == 1)
      settings.key.plate = std::make_shared<Picture>(load_picture(arguments.plates[0], 3));
    else
      for (const std::string& path : arguments.plates)
        plates.push_back(pack(load_picture(path, 3), arguments.format));
    if (arguments.rig.empty()) return;
    KeyValues values;
    values.rig = arguments.rig;
    KeyConfiguration().apply(
        values, arguments.camera, frame.width, frame.height,
        [&](const KeySettings& key) { settings.key.outside_polygon = key.outside_polygon; });
  }

  void learn_plates(Keyer& keyer) const {
    if (plates.empty()) return;
    keyer.learn_plate(static_cast<int>(plates.size()));
    for (const FrameMemory& plate : plates) keyer.prepare(plate.view());
  }

  SilhouetteSettings settings;
  Picture picture;
  FrameMemory frame;
  std::vector<FrameMemory> plates;
};

// What one stream has made.
struct Result {
  Stages stages;
  Rings rings;
  ApproximateCounts counts;
  KeyLack lacks = KeyLack::nothing;
  std::string failure;
};

void run_stream(const Work& work, int repeat, Result& result) {
  try {
    Silhouetter silhouetter;
    silhouetter.set(work.settings);
    work.learn_plates(silhouetter.keyer());
    for (int i = 0; i < repeat; ++i) {
      const Stopwatch watch;
      result.rings = silhouetter.process(work.frame.view());
      result.stages.whole.push_back(watch.milliseconds());
    }
    result.counts = silhouetter.stats().last;
    result.lacks = std::as_const(silhouetter).keyer().calibration().lacks;
  } catch (const std::exception& error) {
    result.failure = error.what();
  }
}

// One for each stream, all with the same rings.
std::vector<Result> run_streams(const Work& work, const Arguments& arguments) {
  std::vector<Result> results(arguments.threads);
  {
    std::vector<std::jthread> workers;
    for (std::size_t t = 1; t < results.size(); ++t)
      workers.emplace_back([&, t] { run_stream(work, arguments.repeat, results[t]); });
    run_stream(work, arguments.repeat, results[0]);
  }
  for (const Result& result : results)
    if (!result.failure.empty()) throw Error(Error::Kind::bad_input, "{}", result.failure);
  for (const Result& result : results)
    if (result.rings != results[0].rings)
      throw Error(Error::Kind::bad_input, "The threads' rings differ: please report this.");
  return results;
}

void warn_of(KeyLack lacks, const std::string& picture) {
  if (lacks == KeyLack::screen)
    std::fprintf(stderr,
                 "polyhull-silhouette: no screen of the key's colour was found in %s, so all of it "
                 "is foreground; give its colour with --key or --screen\n",
                 picture.c_str());
  if (lacks == KeyLack::plate)
    std::fprintf(stderr,
                 "polyhull-silhouette: --method difference without --plate takes pure green or "
                 "blue for the background; give a picture of the empty stage with --plate, or the "
                 "background's colour with --key\n");
}

void write_matte(const Matte& matte, const std::string& path) {
  Picture grey{matte.width, matte.height, 1, {}};
  for (int y = 0; y < matte.height; ++y)
    grey.pixels.insert(grey.pixels.end(), matte.row(y), matte.row(y) + matte.width);
  save_picture(grey, path);
}

void write_view(const Keyer& keyer, const FrameView& frame, const Matte& matte,
                const Arguments& arguments) {
  Picture shown{frame.width, frame.height, 4, {}};
  shown.pixels.resize(4 * static_cast<std::size_t>(frame.width) * frame.height);
  keyer.write_rgba(frame, matte, {0, 0, frame.width, frame.height}, arguments.view,
                   shown.pixels.data(), 4 * static_cast<std::ptrdiff_t>(frame.width));
  save_picture(shown, arguments.view_file);
}

// The colours that the key picked, and how clear its matte is.
void print_key(const KeyCalibration& c, const KeyScore& score) {
  const auto print_colour = [](const char* what, const Rgb& colour, double signal) {
    std::printf("%s (%d, %d, %d) 0x%02x%02x%02x with a key signal of %.0f", what, colour[0],
                colour[1], colour[2], colour[0], colour[1], colour[2], signal);
  };
  if (c.valid) {
    print_colour("key: screen", c.screen, c.screen_signal);
    print_colour(", foreground", c.foreground, c.foreground_signal);
    std::printf("\n");
  }
  std::printf(
      "matte: the subject is %.1f %% of the picture; doubtful are %.2f %% in it and %.2f %% "
      "of the screen: score %.1f of 100\n",
      100.0 * score.subject, 100.0 * score.doubtful_subject, 100.0 * score.doubtful_screen,
      score.score());
}

Json report(const Work& work, const Arguments& arguments, double seconds, const KeyCalibration& c,
            const KeyScore& score, const Result& result) {
  Stages s = result.stages;
  for (int i = 0; i < arguments.repeat; ++i) s.read.push_back(read_once(work.frame));
  time_stages(work.frame.view(), work.settings, arguments.repeat, s);
  return {{"picture", arguments.picture},
          {"width", work.picture.width},
          {"height", work.picture.height},
          {"format", arguments.format},
          {"repeat", arguments.repeat},
          {"threads", arguments.threads},
          {"frames_per_second", arguments.repeat * arguments.threads / seconds},
          {"milliseconds",
           {{"one_pass", median(s.whole)},
            {"read_once", median(s.read)},
            {"key", median(s.key)},
            {"blur", median(s.blur)},
            {"trace", median(s.trace)},
            {"approximate", median(s.approximate)}}},
          {"counts",
           {{"traced_points", result.counts.traced_points},
            {"traced_rings", result.counts.traced_rings},
            {"points", result.counts.points},
            {"rings", result.counts.rings},
            {"dropped_rings", result.counts.dropped_rings},
            {"crossings", result.counts.crossings}}},
          {"calibration",
           {{"valid", c.valid},
            {"screen", c.screen},
            {"foreground", c.foreground},
            {"screen_signal", c.screen_signal},
            {"foreground_signal", c.foreground_signal}}},
          {"matte",
           {{"score", score.score()},
            {"subject", score.subject},
            {"doubtful_subject", score.doubtful_subject},
            {"doubtful_screen", score.doubtful_screen}}}};
}

int run(const Arguments& arguments) {
  const Work work(arguments);
  const Stopwatch watch;
  const Result result = run_streams(work, arguments)[0];
  const double seconds = watch.seconds();
  const auto rings = [&] { return rings_json(result.rings, work.frame.width, work.frame.height); };
  if (arguments.output == "-")
    std::cout << rings() << "\n";
  else if (!arguments.output.empty())
    write_text(rings().dump(), arguments.output);
  warn_of(result.lacks, arguments.picture);

  Keyer keyer;
  keyer.set(work.settings.key);
  work.learn_plates(keyer);
  Matte matte;
  keyer.key(work.frame.view(), matte);
  if (!arguments.matte.empty()) write_matte(matte, arguments.matte);
  if (!arguments.view_file.empty()) write_view(keyer, work.frame.view(), matte, arguments);

  const KeyScore score = score_of(matte, keyer.active());
  if (arguments.json) {
    std::cout << report(work, arguments, seconds, keyer.calibration(), score, result).dump(2)
              << "\n";
  } else if (arguments.output != "-") {
    std::printf("%s: %u rings, %u vertices (traced %u), %.2f ms\n", arguments.picture.c_str(),
                result.counts.rings, result.counts.points, result.counts.traced_points,
                median(result.stages.whole));
    print_key(keyer.calibration(), score);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine command(
      "polyhull-silhouette",
      "Keys a picture, blurs the matte, traces its half level and writes the silhouette's "
      "polygons.");
  Arguments arguments;
  arguments.add_to(command);
  return command.run(argc, argv, [&] { return run(arguments); });
}
