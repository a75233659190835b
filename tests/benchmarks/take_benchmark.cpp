// SPDX-License-Identifier: LGPL-2.1-or-later
// What takes cost: an hour of sets written as fast as it goes, with the memory it takes, the rate for
// views with large pictures, and random seeks.
#include <sys/resource.h>
#include <unistd.h>

#include <cstdlib>
#include <deque>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <random>

#include "measure.h"
#include "take/take_reader.h"
#include "take/take_writer.h"

using namespace polyhull;
using namespace polyhull::benchmark;

namespace {

constexpr std::int64_t frame = 40'000'000;

/// Memory of this process that lies in the machine's, MiB.
double resident() {
  long size = 0, pages = 0;
  std::ifstream("/proc/self/statm") >> size >> pages;
  return static_cast<double>(pages * sysconf(_SC_PAGESIZE)) / (1024.0 * 1024.0);
}

struct Written {
  double first_quarter = 0, end = 0;  // resident, MiB
  double wall = 0, processor = 0;     // s
  double worst = 0;                   // ms of one set
};

Written write(const std::string& path, int sets, int cameras, std::size_t size) {
  std::vector<std::uint8_t> bytes(size);
  std::mt19937 random(1);
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
  TakeWriter take(path, TakeWriter::Existing::replace);
  std::vector<std::int64_t> streams;
  for (int c = 0; c < cameras; ++c) streams.push_back(take.stream("sink_" + std::to_string(c)));
  Written result;
  const double wall = now(CLOCK_MONOTONIC), processor = now(CLOCK_PROCESS_CPUTIME_ID);
  for (int i = 0; i < sets; ++i) {
    const double begin = now(CLOCK_MONOTONIC);
    for (const std::int64_t stream : streams)
      take.write(stream, {"application/x-polyhull-view", i * frame, frame, 0, {}}, bytes);
    result.worst = std::max(result.worst, now(CLOCK_MONOTONIC) - begin);
    if (i == sets / 4) result.first_quarter = resident();
  }
  take.finish();
  result.wall = 1e-3 * (now(CLOCK_MONOTONIC) - wall);
  result.processor = 1e-3 * (now(CLOCK_PROCESS_CPUTIME_ID) - processor);
  result.end = resident();
  return result;
}

void seeks(const std::string& path, int sets) {
  const TakeContent content = read_take(path);
  std::deque<TakeCursor> cursors;
  for (const TakeStream& stream : content.streams) cursors.emplace_back(path, stream.id);
  std::mt19937 random(2);
  std::vector<double> times;
  for (int i = 0; i < 1000; ++i) {
    const auto to = static_cast<std::int64_t>(random() % static_cast<unsigned>(sets)) * frame;
    const double begin = now(CLOCK_MONOTONIC);
    for (TakeCursor& cursor : cursors) {
      cursor.seek(to);
      if (!cursor.next()) std::abort();
    }
    times.push_back(now(CLOCK_MONOTONIC) - begin);
  }
  std::sort(times.begin(), times.end());
  std::printf("1000 random seeks of all streams: median %.2f ms, 99 %% %.2f ms, worst %.2f ms\n",
              times[500], times[990], times.back());
}

void race(const std::string& folder, const char* what, int sets, int cameras, std::size_t size) {
  const std::string path = folder + "/benchmark.take";
  const Written written = write(path, sets, cameras, size);
  const double megabytes = 1e-6 * static_cast<double>(std::filesystem::file_size(path));
  std::printf(
      "%s: %d sets of %d buffers of %zu bytes, %.0f MB, %.1f %% more than the bytes: %.1f s (%.0f "
      "MB/s, %.1f times live), processor %.3f ms a set, worst set %.1f ms, memory %.1f MiB after a "
      "quarter, %.1f at the end\n",
      what, sets, cameras, size, megabytes,
      100.0 * (1e6 * megabytes / (static_cast<double>(sets) * cameras * static_cast<double>(size)) -
               1.0),
      written.wall, megabytes / written.wall, sets * 0.04 / written.wall,
      1e3 * written.processor / sets, written.worst, written.first_quarter, written.end);
  seeks(path, sets);
  std::filesystem::remove(path);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string folder = argc > 1 ? argv[1] : ".";
  race(folder, "an hour of contours", 90'000, 4, 12'000);
  race(folder, "a minute of pictures", 1'500, 4, 1'200'000);
}
