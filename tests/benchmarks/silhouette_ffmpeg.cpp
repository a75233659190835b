// SPDX-License-Identifier: LGPL-2.1-or-later
/// Time of ffmpeg's key filters on the frames of the other benchmarks, where the program ffmpeg is
/// installed: user time of a run with the filter less that of one without, per frame. Writes
/// silhouette_ffmpeg.csv to the folder given.
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "benchmarks/measure.h"
#include "benchmarks/shapes.h"
#include "silhouette/silhouette.h"

using namespace polyhull;
using namespace polyhull::benchmark;

namespace {

constexpr int width = 1920;
constexpr int height = 1080;
constexpr int frames = 4;
constexpr int loops = 10;

/// User time in seconds as ffmpeg tells it, negative where it failed.
double user_time(const std::string& input, const std::string& filter) {
  const std::string command =
      "ffmpeg -nostdin -hide_banner -benchmark -threads 1 -filter_threads 1 -stream_loop " +
      std::to_string(loops - 1) + " " + input + " -vf " + filter + " -f null - 2>&1";
  std::FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return -1.0;
  double seconds = -1.0;
  char line[1024];
  while (std::fgets(line, sizeof line, pipe) != nullptr)
    std::sscanf(line, "bench: utime=%lf", &seconds);
  return pclose(pipe) == 0 ? seconds : -1.0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string folder = argc > 1 ? argv[1] : ".";
  const int rounds = argc > 2 ? std::atoi(argv[2]) : 3;
  if (std::system("ffmpeg -version > /dev/null 2>&1") != 0) {
    std::printf("left out: there is no program ffmpeg\n");
    return 77;
  }
  const Matte matte = matte_of(figure_of_17_percent(), width, height);
  const struct {
    FrameFormat format;
    const char* pixels;
    std::vector<std::string> filters;
  } jobs[] = {{FrameFormat::i420,
               "yuv420p",
               {"chromakey=0x1ebe3c:0.12:0.1", "chromakey=0x1ebe3c:0.12:0.1,despill=green"}},
              {FrameFormat::rgba, "rgba", {"colorkey=0x1ebe3c:0.3:0.1", "despill=green"}}};
  Table table(folder + "/silhouette_ffmpeg.csv", "filter,pixels,best ms per frame");
  Table ours(folder + "/silhouette_ffmpeg_ours.csv", "same job here,best ms per frame");
  for (const auto& job : jobs) {
    const std::string file = folder + "/silhouette_ffmpeg.raw";
    std::vector<Frame> kept;
    {
      std::ofstream out(file, std::ios::binary);
      for (int i = 0; i < frames; ++i) {
        kept.push_back(frame_of(matte, job.format, 1.0, static_cast<unsigned>(i)));
        out.write(reinterpret_cast<const char*>(kept.back().bytes.data()),
                  static_cast<std::streamsize>(kept.back().bytes.size()));
      }
    }
    const std::string input = std::string("-f rawvideo -pix_fmt ") + job.pixels + " -s " +
                              std::to_string(width) + "x" + std::to_string(height) + " -i " + file;
    for (const std::string& filter : job.filters) {
      double with = 1e9, without = 1e9;
      for (int round = 0; round < rounds; ++round) {
        const double a = user_time(input, filter), b = user_time(input, "null");
        if (a < 0.0 || b < 0.0) {
          std::fprintf(stderr, "ffmpeg failed at %s\n", filter.c_str());
          return 1;
        }
        with = std::min(with, a);
        without = std::min(without, b);
      }
      table.row("\"%s\",%s,%.2f", filter.c_str(), job.pixels,
                1000.0 * (with - without) / (frames * loops));
    }
    Keyer keyer;
    Matte keyed;
    std::vector<std::uint8_t> rgba(static_cast<std::size_t>(width) * height * 4);
    std::vector<Contender> contenders = {
        {"key", [&](int i) { keyer.key(kept[i % frames].view, keyed); }},
        {"key and despilled RGBA",
         [&](int i) {
           keyer.key(kept[i % frames].view, keyed);
           keyer.write_rgba(kept[i % frames].view, keyed, {0, 0, width, height}, KeyView::composite,
                            rgba.data(), 4 * width);
         }},
    };
    race(contenders, 20);
    for (const Contender& c : contenders)
      ours.row("%s %s,%.2f", c.name.c_str(), name_of(job.format), c.best());
    std::filesystem::remove(file);
  }
  return 0;
}
