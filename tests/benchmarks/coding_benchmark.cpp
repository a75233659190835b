// SPDX-License-Identifier: LGPL-2.1-or-later
// Packed pixels of the views in takes: bytes, processor time and error of each coding, how long a
// view takes over links of three speeds, and what viewencode's coding=auto would choose.
#include <cmath>
#include <cstdio>
#include <vector>

#include "measure.h"
#include "take_pixels.h"
#include "wire/coded_view.h"
#include "wire/coding_choice.h"

using namespace polyhull;
using namespace polyhull::benchmark;

namespace {

constexpr double links[] = {100, 1000, 10'000};  // Mbit/s

struct Result {
  double raw = 0, bytes = 0, pack = 0, unpack = 0;  // of all frames; ms
  double squares = 0, samples = 0;                  // of the colours inside the matte
  std::vector<double> total[3];                     // ms of each frame over each link
  double psnr() const {
    return squares > 0 ? 10 * std::log10(255 * 255 * samples / squares) : INFINITY;
  }
};

Result run(const std::vector<Frame>& frames, PixelCoding coding, int quality) {
  Result result;
  PixelEncoder encoder;
  PixelDecoder decoder;
  std::vector<std::uint8_t> back;
  for (int round = 0; round < 2; ++round) {
    result = {};
    for (const Frame& frame : frames) {
      back.resize(frame.pixels.size());
      const double begin = now(CLOCK_PROCESS_CPUTIME_ID);
      const auto block =
          encoder.encode(coding, frame.shape, frame.pixels, 4 * frame.shape.width, quality);
      const double packed = now(CLOCK_PROCESS_CPUTIME_ID);
      decoder.decode(coding, frame.shape, block, back);
      const double end = now(CLOCK_PROCESS_CPUTIME_ID);
      result.raw += static_cast<double>(frame.pixels.size());
      result.bytes += static_cast<double>(block.size());
      result.pack += packed - begin;
      result.unpack += end - packed;
      for (int l = 0; l < 3; ++l)
        result.total[l].push_back(end - begin +
                                  static_cast<double>(block.size()) * 8e-3 / links[l]);
      for (std::size_t i = 0; i < back.size(); i += 4)
        for (std::size_t c = 0; c < 3 && back[i + 3] == 255; ++c, ++result.samples)
          result.squares += std::pow(back[i + c] - frame.pixels[i + c], 2);
    }
  }
  return result;
}

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

/// What `auto` costs over one link: the frames in turn, each by the coding chosen, with its trials.
double automatic(const std::vector<Frame>& frames, const Result (&codings)[4], int link,
                 bool loss) {
  PixelEncoder encoder;
  PixelDecoder decoder;
  std::vector<std::uint8_t> back;
  CodingChoice choice;
  std::vector<double> times;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Frame& frame = frames[i];
    if (choice.trial_due()) {
      back.resize(frame.pixels.size());
      for (const PixelCoding coding : {PixelCoding::lz4, PixelCoding::zstd, PixelCoding::jpeg}) {
        const double begin = now(CLOCK_PROCESS_CPUTIME_ID);
        const auto block = encoder.encode(coding, frame.shape, frame.pixels, 4 * frame.shape.width);
        const double packed = now(CLOCK_PROCESS_CPUTIME_ID);
        decoder.decode(coding, frame.shape, block, back);
        choice.note(coding, {frame.pixels.size(), block.size(), packed - begin,
                             now(CLOCK_PROCESS_CPUTIME_ID) - packed});
      }
    }
    const auto chosen = choice.choose(frame.pixels.size(), links[link], loss);
    times.push_back(codings[static_cast<int>(chosen)].total[link][i]);
  }
  return mean(times);
}

void report(const char* path) {
  const std::vector<Frame> frames = read_frames(path);
  if (frames.empty()) {
    std::printf("%s: no views with colours\n", path);
    return;
  }
  const auto count = static_cast<double>(frames.size());
  Result results[4];
  std::printf("%s: %zu views of %.0f bytes on average\n", path, frames.size(),
              run(frames, PixelCoding::lz4, 90).raw / count);
  std::printf("%-9s %9s %8s %9s %10s %9s %9s %9s %9s\n", "coding", "bytes", "share", "pack ms",
              "unpack ms", "PSNR dB", "100 Mb/s", "1 Gb/s", "10 Gb/s");
  const auto print = [&](const char* name, const Result& r) {
    std::printf("%-9s %9.0f %7.1f%% %9.2f %10.2f %9.1f %9.2f %9.2f %9.2f\n", name, r.bytes / count,
                100 * r.bytes / r.raw, r.pack / count, r.unpack / count, r.psnr(), mean(r.total[0]),
                mean(r.total[1]), mean(r.total[2]));
  };
  for (const Frame& frame : frames)
    for (int l = 0; l < 3; ++l)
      results[0].total[l].push_back(static_cast<double>(frame.pixels.size()) * 8e-3 / links[l]);
  for (const Frame& frame : frames) results[0].raw += static_cast<double>(frame.pixels.size());
  results[0].bytes = results[0].raw;
  print("none", results[0]);
  const char* names[] = {"none", "lz4", "zstd", "jpeg"};
  for (int c = 1; c < 4; ++c) {
    results[c] = run(frames, static_cast<PixelCoding>(c), 90);
    print(names[c], results[c]);
  }
  for (const int quality : {75, 97})
    print(quality == 75 ? "jpeg 75" : "jpeg 97", run(frames, PixelCoding::jpeg, quality));
  // From which link on packing costs more time than it spares.
  for (int c = 1; c < 4; ++c)
    std::printf("%s pays below %.0f Mbit/s\n", names[c],
                (results[c].raw - results[c].bytes) * 8e-3 / (results[c].pack + results[c].unpack));
  for (const bool loss : {false, true})
    for (int l = 0; l < 3; ++l) {
      double best = mean(results[0].total[l]);
      for (int c = 1; c < (loss ? 4 : 3); ++c) best = std::min(best, mean(results[c].total[l]));
      std::printf("auto, %s, %5.0f Mbit/s: %.3f of the best\n", loss ? "with loss" : "lossless",
                  links[l], automatic(frames, results, l, loss) / best);
    }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: coding_benchmark TAKE...   (takes of views, from takesink)\n");
    return 2;
  }
  for (int i = 1; i < argc; ++i) report(argv[i]);
  return 0;
}
