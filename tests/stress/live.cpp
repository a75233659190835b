// SPDX-License-Identifier: LGPL-2.1-or-later
// Live lines, started again and again, and what became of their instants. Prints a line per start
// and the sums; the exit status tells whether all sets were whole and of one instant each.
//   live [--cameras 4] [--rate 25] [--width 160] [--height 120] [--starts 20] [--seconds 20]
//        [--delays 0,20,80,150] [--jitter 15] [--busy-from 5 --busy-for 10] [--branch LINE]
//        [--hull PROPERTIES] [--tail LINE] [--share 0.999]
#include <ctime>

#include "command_line.h"
#include "support/live_line.h"

using namespace polyhull::test;

namespace {

double processor_seconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace

int main(int argc, char** argv) {
  gst_init(&argc, &argv);
  LiveOptions options;
  int starts = 20, busy_threads = 2;
  double seconds = 20, busy_from = -1, busy_for = 10, share = 0.0;
  bool words = false, timeline = false;
  polyhull::CommandLine command("live", "Live lines and what became of their instants");
  command.option("--cameras", &options.cameras);
  command.option("--rate", &options.rate);
  command.option("--width", &options.width);
  command.option("--height", &options.height);
  command.option("--starts", &starts);
  command.option("--seconds", &seconds);
  command.option("--delays", &options.delays).separated_by(',');
  command.option("--jitter", &options.jitter);
  command.option("--busy-from", &busy_from);
  command.option("--busy-for", &busy_for);
  command.option("--busy-threads", &busy_threads);
  command.option("--branch", &options.branch);
  command.option("--hull", &options.hull);
  command.option("--tail", &options.tail);
  command.option("--share", &share, "of the instants that must be shown by whole sets");
  command.flag("--figure", &options.figure, "the walking figure instead of a spindle");
  command.flag("--words", &words, "print warnings");
  command.flag("--timeline", &timeline, "print the whole sets of each second");
  if (const auto status = command.parse(argc, argv)) return *status;

  std::printf(
      "start  sets whole incomplete mixed split  of-instants  late overdue unwanted  "
      "latency-ms  cores\n");
  bool good = true;
  LiveFigures sum;
  for (int start = 0; start < starts; ++start) {
    LiveLine line(options);
    const double used = processor_seconds();
    const double first = busy_from > 0 ? busy_from : seconds;
    line.play(first);
    if (busy_from > 0) {
      auto load = LiveLine::load(busy_threads, busy_for);
      line.play(busy_for);
      for (std::thread& thread : load) thread.join();
      line.play(seconds - busy_from - busy_for);
    }
    const double cores = (processor_seconds() - used) / seconds;
    const double latency = line.latency();
    // What is still on its way has not been lost.
    const LiveFigures f = line.figures(1.0, line.now() - 0.8);
    const LiveFigures after = line.figures(busy_from + busy_for + 1.0, line.now() - 0.8);
    const guint64 late = line.statistic("hull", "views-late");
    const guint64 overdue = line.statistic("hull", "sets-overdue");
    const guint64 unwanted = line.statistic("hull", "sets-unwanted");
    if (words)
      for (const std::string& text : line.warnings()) std::printf("  %s\n", text.c_str());
    if (!line.error().empty()) std::printf("  ERROR %s\n", line.error().c_str());
    std::vector<int> line_figures;
    for (int second = 0; second < seconds; ++second)
      line_figures.push_back(line.figures(second, second + 1.0).shown);
    if (words)
      for (const char* name : {"hull", "composite", "room", "cam0", "cam1"}) {
        GstElement* element = line.element(name);
        if (element == nullptr) continue;
        GstStructure* stats = nullptr;
        g_object_get(element, "stats", &stats, nullptr);
        gchar* text = gst_structure_to_string(stats);
        std::printf("  %s: %s\n", name, text);
        g_free(text);
        gst_structure_free(stats);
        gst_object_unref(element);
      }
    line.stop();
    std::printf("%5d %5d %5d %10d %5d %5d %7d/%4d %6d %7d %8d %11.1f %6.2f", start, f.sets, f.shown,
                f.incomplete, f.mixed, f.split, f.shown, f.instants, static_cast<int>(late),
                static_cast<int>(overdue), static_cast<int>(unwanted), latency, cores);
    if (timeline)
      for (int second = 0; second < seconds; ++second)
        std::printf("%s%d", second == 0 ? "  per second: " : " ",
                    line_figures[static_cast<std::size_t>(second)]);
    if (busy_from > 0) std::printf("  after the load %d/%d", after.shown, after.instants);
    std::printf("\n");
    std::fflush(stdout);
    good = good && f.sets > 0 && f.incomplete == 0 && f.mixed == 0 && f.split == 0 &&
           f.share() >= share;
    sum.sets += f.sets;
    sum.shown += f.shown;
    sum.incomplete += f.incomplete;
    sum.mixed += f.mixed;
    sum.split += f.split;
    sum.instants += f.instants;
    sum.unreadable += f.unreadable;
  }
  std::printf(
      "all: %d sets, %d whole, %d incomplete, %d mixed, %d split; %d of %d instants shown "
      "(%.3f %%), %d labels not read\n",
      sum.sets, sum.shown, sum.incomplete, sum.mixed, sum.split, sum.shown, sum.instants,
      100.0 * sum.share(), sum.unreadable);
  return good ? 0 : 1;
}
