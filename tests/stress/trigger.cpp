// SPDX-License-Identifier: LGPL-2.1-or-later
// Pulses on a pseudo-terminal, cameras that answer each after a delay with jitter, and threads that
// keep the machine busy. Prints how evenly the pulses came and what became of the frames; the exit
// status tells whether every frame got its own pulse's number, and every pulse has its frames.
//   trigger [--pulses 10000] [--rate 60/1] [--cameras 4] [--busy 4] [--delay 8] [--jitter 2]
//           [--transfer 40] [--lost 0]
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <thread>

#include "command_line.h"
#include "support/triggered_line.h"

using namespace polyhull::test;

namespace {

constexpr std::uint64_t none = ~std::uint64_t{0};

void print_stats(GstElement* element) {
  GstStructure* stats = nullptr;
  g_object_get(element, "stats", &stats, nullptr);
  gchar* text = gst_structure_to_string(stats);
  std::printf("%s: %s\n", GST_OBJECT_NAME(element), text);
  g_free(text);
  gst_structure_free(stats);
}

/// Prints the share of latenesses up to some marks, us.
void print_lateness(std::vector<gint64> all) {
  if (all.empty()) return;
  for (gint64& lateness : all) lateness = std::abs(lateness);
  std::sort(all.begin(), all.end());
  const auto at = [&](double share) {
    const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(all.size())));
    return static_cast<double>(all[std::max<std::size_t>(rank, 1) - 1]) * 1e-3;
  };
  std::printf("lateness of %zu pulses, us: median %.1f, p99 %.1f, p99.9 %.1f, largest %.1f\n",
              all.size(), at(0.5), at(0.99), at(0.999), at(1.0));
}

}  // namespace

int main(int argc, char** argv) {
  gst_init(&argc, &argv);
  std::uint64_t pulses = 10000;
  std::string rate = "60/1";
  int cameras = 4, busy = 4, lost = 0;
  double delay = 8, jitter = 2, transfer = 40;
  polyhull::CommandLine command("trigger", "Trigger pulses and the frames that answer them");
  command.option("--pulses", &pulses);
  command.option("--rate", &rate);
  command.option("--cameras", &cameras);
  command.option("--busy", &busy, "threads that compute all the time");
  command.option("--delay", &delay, "ms from a pulse to its frame's time");
  command.option("--jitter", &jitter, "ms to both sides");
  command.option("--transfer", &transfer, "ms from a frame's time to its arrival");
  command.option("--lost", &lost, "frames in a thousand that are never sent");
  if (const auto status = command.parse(argc, argv)) return *status;

  TriggeredOptions options;
  options.cameras = cameras;
  options.trigger = "pulse=1000000 rate=" + rate;
  const auto ns = [](double ms) { return static_cast<std::int64_t>(ms * 1e6); };
  options.stamp = "delay=" + std::to_string(ns(delay - jitter)) +
                  " window=" + std::to_string(ns(2 * jitter + 1));
  options.delay = ns(delay);
  options.jitter = ns(jitter);
  options.transfer = ns(transfer);
  options.frames = [lost](int camera, std::uint64_t pulse) {
    const std::uint64_t hash = (pulse * 31 + static_cast<std::uint64_t>(camera) * 17) * 2654435761u;
    return static_cast<int>(hash / 65536 % 1000) < lost ? 0 : 1;
  };

  std::atomic<bool> stop{false};
  std::vector<std::thread> load;
  for (int i = 0; i < busy; ++i)
    load.emplace_back([&stop] {
      for (volatile double x = 1.0; !stop;) x = x * 1.0000001;
    });
  TriggeredLine line(options);
  line.play();
  bool good = line.wait_for_pulses(pulses, 1e6);
  line.finish();
  g_usleep(static_cast<gulong>(transfer * 1000) + 200000);
  stop = true;
  for (std::thread& thread : load) thread.join();

  print_lateness(line.latenesses());
  print_stats(line.element("trigger"));
  for (int camera = 0; camera < cameras; ++camera) {
    print_stats(line.element("stamp" + std::to_string(camera)));
    std::uint64_t sent = 0, right = 0, wrong = 0, without = 0;
    for (std::uint64_t pulse = 0; pulse < line.pulses(); ++pulse)
      sent += static_cast<std::uint64_t>(options.frames(camera, pulse));
    for (const StampedFrame& frame : line.frames(camera))
      ++(frame.number == none ? without : frame.number == frame.pulse ? right : wrong);
    std::printf(
        "camera %d: %llu pulses, %llu frames sent, %llu with their pulse's number, %llu with "
        "another, %llu without\n",
        camera, static_cast<unsigned long long>(line.pulses()),
        static_cast<unsigned long long>(sent), static_cast<unsigned long long>(right),
        static_cast<unsigned long long>(wrong), static_cast<unsigned long long>(without));
    good = good && right == sent && wrong == 0 && without == 0;
  }
  return good ? 0 : 1;
}
