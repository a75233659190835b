// SPDX-License-Identifier: LGPL-2.1-or-later
// Silhouettes without a pipeline: a picture in, rings out, with times and counts.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>
#include <utility>

#include "base/error.h"
#include "base/picture.h"
#include "base/stopwatch.h"
#include "median.h"
#include "silhouette/silhouette.h"
#include "silhouette_options.h"

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

void write_file(const std::string& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
  if (!file.flush())
    throw Error(Error::Kind::io,
                "cannot write " + path + ": check that the folder exists and is writable");
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

int run(int argc, char** argv) {
  CLI::App app{
      "Keys a picture, blurs the matte, traces its half level and writes the silhouette's "
      "polygons."};
  std::string picture_path, output, matte_path, view_path, view = "composite", format = "RGBx";
  std::vector<std::string> plates;
  int repeat = 1, threads = 1;
  bool json = false;
  app.add_option("picture", picture_path, "PNG or JPEG file")->required();
  app.add_option("-o,--output", output, "rings as JSON; '-' writes them to the output");
  app.add_option("--matte", matte_path, "writes the matte before the blur as a grey PNG");
  app.add_option("--view-file", view_path, "writes the picture that --view chooses as PNG");
  app.add_option("--view", view, "composite, matte, status or spill")
      ->check(CLI::IsMember({"composite", "matte", "status", "spill"}));
  app.add_option("--format", format, "pixel format that the picture is given to the keyer in")
      ->check(CLI::IsMember({"RGBx", "BGRx", "RGB", "I420", "NV12", "YUY2", "UYVY"}));
  app.add_option("--plate", plates, "clean plates; several are averaged, with their variation");
  app.add_option("--repeat", repeat, "process the picture this many times")
      ->check(CLI::Range(1, 1000000));
  app.add_option("--threads", threads, "this many streams at a time")->check(CLI::Range(1, 256));
  app.add_flag("--json", json, "print times and counts as JSON");
  SilhouetteOptions options;
  options.add_to(app);
  CLI11_PARSE(app, argc, argv);

  SilhouetteSettings settings = options.settings();
  settings.keep_matte = false;
  settings.reuse = false;
  const Picture picture = load_picture(picture_path, 3);
  const FrameMemory memory = pack(picture, format);
  if (plates.size() == 1)
    settings.key.plate = std::make_shared<Picture>(load_picture(plates[0], 3));

  std::vector<FrameMemory> plate_frames;
  if (plates.size() > 1)
    for (const std::string& path : plates)
      plate_frames.push_back(pack(load_picture(path, 3), format));
  const auto prepare = [&](Keyer& keyer) {
    if (plate_frames.empty()) return;
    keyer.learn_plate(static_cast<int>(plate_frames.size()));
    for (const FrameMemory& frame : plate_frames) keyer.prepare(frame.view());
  };

  std::vector<Stages> stages(threads);
  std::vector<Rings> results(threads);
  std::vector<ApproximateCounts> counts(threads);
  std::vector<std::string> failures(threads);
  KeyLack lacks = KeyLack::nothing;
  const Stopwatch watch;
  const auto stream = [&](int t) {
    try {
      Silhouetter silhouetter;
      silhouetter.set(settings);
      prepare(silhouetter.keyer());
      for (int i = 0; i < repeat; ++i) {
        const Stopwatch one;
        results[t] = silhouetter.process(memory.view());
        stages[t].whole.push_back(one.milliseconds());
      }
      counts[t] = silhouetter.stats().last;
      if (t == 0) lacks = std::as_const(silhouetter).keyer().calibration().lacks;
    } catch (const std::exception& error) {
      failures[t] = error.what();
    }
  };
  if (threads == 1) {
    stream(0);
  } else {
    std::vector<std::thread> workers;
    for (int t = 0; t < threads; ++t) workers.emplace_back(stream, t);
    for (std::thread& worker : workers) worker.join();
  }
  const double seconds = watch.seconds();
  for (const std::string& failure : failures)
    if (!failure.empty()) throw Error(Error::Kind::bad_input, failure);
  for (int t = 1; t < threads; ++t)
    if (results[t] != results[0])
      throw Error(Error::Kind::bad_input, "the threads' rings differ: please report this");

  if (output == "-")
    std::cout << rings_json(results[0], picture.width, picture.height) << "\n";
  else if (!output.empty())
    write_file(output, rings_json(results[0], picture.width, picture.height).dump());

  if (lacks == KeyLack::screen)
    std::fprintf(stderr,
                 "polyhull-silhouette: no screen of the key's colour was found in %s, so all of it "
                 "is foreground; give its colour with --key or --screen\n",
                 picture_path.c_str());
  if (lacks == KeyLack::plate)
    std::fprintf(stderr,
                 "polyhull-silhouette: --method difference without --plate takes pure green or "
                 "blue for the background; give a picture of the empty stage with --plate, or the "
                 "background's colour with --key\n");

  Keyer keyer;
  keyer.set(settings.key);
  prepare(keyer);
  Matte matte;
  if (!matte_path.empty() || !view_path.empty() || json) keyer.key(memory.view(), matte);
  if (!matte_path.empty()) {
    Picture grey{picture.width, picture.height, 1, {}};
    for (int y = 0; y < picture.height; ++y)
      grey.pixels.insert(grey.pixels.end(), matte.row(y), matte.row(y) + picture.width);
    save_picture(grey, matte_path);
  }
  if (!view_path.empty()) {
    static const std::map<std::string, KeyView> views = {{"composite", KeyView::composite},
                                                         {"matte", KeyView::matte},
                                                         {"status", KeyView::status},
                                                         {"spill", KeyView::spill}};
    Picture shown{picture.width, picture.height, 4, {}};
    shown.pixels.resize(4 * static_cast<std::size_t>(picture.width) * picture.height);
    keyer.write_rgba(memory.view(), matte, {0, 0, picture.width, picture.height}, views.at(view),
                     shown.pixels.data(), 4 * static_cast<std::ptrdiff_t>(picture.width));
    save_picture(shown, view_path);
  }

  if (json) {
    Stages& s = stages[0];
    for (int i = 0; i < repeat; ++i) s.read.push_back(read_once(memory));
    time_stages(memory.view(), settings, repeat, s);
    const KeyCalibration c = keyer.calibration();
    std::cout << Json{{"picture", picture_path},
                      {"width", picture.width},
                      {"height", picture.height},
                      {"format", format},
                      {"repeat", repeat},
                      {"threads", threads},
                      {"frames_per_second", repeat * threads / seconds},
                      {"milliseconds",
                       {{"one_pass", median(s.whole)},
                        {"read_once", median(s.read)},
                        {"key", median(s.key)},
                        {"blur", median(s.blur)},
                        {"trace", median(s.trace)},
                        {"approximate", median(s.approximate)}}},
                      {"counts",
                       {{"traced_points", counts[0].traced_points},
                        {"traced_rings", counts[0].traced_rings},
                        {"points", counts[0].points},
                        {"rings", counts[0].rings},
                        {"dropped_rings", counts[0].dropped_rings},
                        {"crossings", counts[0].crossings}}},
                      {"calibration",
                       {{"valid", c.valid},
                        {"screen", c.screen},
                        {"foreground", c.foreground},
                        {"screen_signal", c.screen_signal},
                        {"foreground_signal", c.foreground_signal}}}}
                     .dump(2)
              << "\n";
  } else if (output != "-") {
    std::printf("%s: %u rings, %u vertices (traced %u), %.2f ms\n", picture_path.c_str(),
                counts[0].rings, counts[0].points, counts[0].traced_points,
                median(stages[0].whole));
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "polyhull-silhouette: %s\n", error.what());
    return 1;
  }
}
