// SPDX-License-Identifier: LGPL-2.1-or-later
/// Time of key, blur, trace and approximate on a 1920x1080 frame from memory, against OpenCV's
/// operators and against reading the frame once. Writes silhouette_chain.csv to the folder given.
#include <opencv2/imgproc.hpp>

#include <cstdlib>
#include <cstring>

#include "benchmarks/measure.h"
#include "benchmarks/shapes.h"
#include "silhouette/silhouette.h"

using namespace polyhull;
using namespace polyhull::benchmark;

namespace {

constexpr int width = 1920;
constexpr int height = 1080;
constexpr int frames = 12;  // 100 MB of BGRx: more than the caches hold

std::uint64_t read_once(const std::vector<std::uint8_t>& bytes) {
  std::uint64_t sums[8] = {};
  const std::size_t words = bytes.size() / 8;
  const auto* p = reinterpret_cast<const std::uint64_t*>(bytes.data());
  for (std::size_t i = 0; i + 8 <= words; i += 8) {
    for (int k = 0; k < 8; ++k) sums[k] += p[i + k];
  }
  std::uint64_t sum = 0;
  for (const std::uint64_t s : sums) sum += s;
  return sum;
}

/// The prototype's chain with OpenCV's operators.
struct OpenCvChain {
  cv::Mat channels[3], larger, difference, matte, blurred, binary;
  std::vector<std::vector<cv::Point>> contours, polygons;

  void key(const Frame& frame) {
    const cv::Mat bgrx(height, width, CV_8UC4, const_cast<std::uint8_t*>(frame.bytes.data()));
    for (int c = 0; c < 3; ++c) cv::extractChannel(bgrx, channels[c], c);
    cv::max(channels[0], channels[2], larger);
    cv::subtract(channels[1], larger, difference);
    cv::threshold(difference, matte, 30, 255, cv::THRESH_BINARY_INV);
  }
  void blur() { cv::GaussianBlur(matte, blurred, cv::Size(), 2.0); }
  void trace() {
    cv::threshold(blurred, binary, 127, 255, cv::THRESH_BINARY);
    cv::findContours(binary, contours, cv::RETR_CCOMP, cv::CHAIN_APPROX_NONE);
  }
  void approximate() {
    polygons.resize(contours.size());
    for (std::size_t i = 0; i < contours.size(); ++i) {
      cv::approxPolyDP(contours[i], polygons[i], 1.0, true);
    }
  }
  void all(const Frame& frame) {
    key(frame);
    blur();
    trace();
    approximate();
  }
};

/// The library's stages called one after the other on whole planes.
struct Stages {
  Keyer keyer;
  Blur blur;
  Tracer tracer;
  Approximator approximator;
  Matte matte;
  Field field;
  Rings traced, rings;
  std::vector<std::int32_t> parents;

  void run(const FrameView& frame, int last) {
    keyer.key(frame, matte);
    if (last >= 1) blur.apply(matte, field);
    if (last >= 2) tracer.trace(field, {TraceMethod::subpixel, 2.0}, traced, &parents);
    if (last >= 3) approximator.approximate(traced, parents, {}, rings);
  }
};

SilhouetteSettings settings_for(bool reuse) {
  SilhouetteSettings settings;
  settings.blur.sigma = 2.0;
  settings.approximate.tolerance = 1.0;
  settings.reuse = reuse;
  if (!reuse) settings.steadiness = 0.0;  // each round is to find its contours
  return settings;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string folder = argc > 1 ? argv[1] : ".";
  const int rounds = argc > 2 ? std::atoi(argv[2]) : 60;
  cv::setNumThreads(1);
  const Shape figure = figure_of_17_percent();
  const Matte matte = matte_of(figure, width, height);
  std::vector<Frame> bgrx, nv12;
  for (int i = 0; i < frames; ++i) {
    bgrx.push_back(frame_of(matte, FrameFormat::bgrx, 1.0, i));
    nv12.push_back(frame_of(matte, FrameFormat::nv12, 1.0, i));
  }

  Silhouetter one_bgrx, one_nv12, unchanged, with_pixels;
  one_bgrx.set(settings_for(false));
  one_nv12.set(settings_for(false));
  with_pixels.set(settings_for(false));
  unchanged.set(settings_for(true));
  Stages stages[4], stages_nv12;
  OpenCvChain opencv, opencv_warm;
  opencv_warm.all(bgrx[0]);
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(width) * height * 4);
  std::vector<std::uint8_t> plane(static_cast<std::size_t>(width) * height, 3), plane_copy = plane;

  const auto next = [&](const std::vector<Frame>& from, int i) -> const Frame& {
    return from[i % frames];
  };
  std::vector<Contender> contenders = {
      {"read BGRx once", [&](int i) { keep(read_once(next(bgrx, i).bytes)); }},
      {"read NV12 once", [&](int i) { keep(read_once(next(nv12, i).bytes)); }},
      {"memcpy of the plane",
       [&](int) {
         std::memcpy(plane_copy.data(), plane.data(), plane.size());
         keep(plane_copy);
       }},
      {"key", [&](int i) { stages[0].run(next(bgrx, i).view, 0); }},
      {"key blur", [&](int i) { stages[1].run(next(bgrx, i).view, 1); }},
      {"key blur trace", [&](int i) { stages[2].run(next(bgrx, i).view, 2); }},
      {"key blur trace approximate", [&](int i) { stages[3].run(next(bgrx, i).view, 3); }},
      {"the same NV12", [&](int i) { stages_nv12.run(next(nv12, i).view, 3); }},
      {"one pass BGRx", [&](int i) { keep(one_bgrx.process(next(bgrx, i).view)); }},
      {"one pass NV12", [&](int i) { keep(one_nv12.process(next(nv12, i).view)); }},
      {"one pass BGRx with pixels",
       [&](int i) {
         const FrameView& frame = next(bgrx, i).view;
         const Rectangle roi = bounding_rectangle(with_pixels.process(frame), width, height);
         with_pixels.write_rgba(frame, roi, pixels.data(), roi.width * 4);
       }},
      {"OpenCV key", [&](int i) { opencv_warm.key(next(bgrx, i)); }},
      {"OpenCV chain", [&](int i) { opencv.all(next(bgrx, i)); }},
  };
  race(contenders, rounds);

  // An unchanged picture: the same frame in two memories, taken from memory (others pass between).
  std::vector<Frame> same;
  for (int i = 0; i < frames; ++i) same.push_back(frame_of(matte, FrameFormat::bgrx, 1.0, 77));
  std::vector<Contender> still = {
      {"read again", [&](int i) { keep(read_once(next(same, i + 5).bytes)); }},
      {"unchanged picture", [&](int i) { keep(unchanged.process(next(same, i).view)); }},
  };
  race(still, rounds);

  Table table(folder + "/silhouette_chain.csv", "step,median ms,best ms,reads of the frame");
  const double read = best_of(contenders, "read BGRx once");
  for (const auto* group : {&contenders, &still}) {
    for (const Contender& c : *group) {
      table.row("%s,%.3f,%.3f,%.2f", c.name.c_str(), c.median(), c.best(), c.best() / read);
    }
  }
  const ContourError ours = contour_error(one_bgrx.process(bgrx[0].view), figure);
  opencv.all(bgrx[0]);
  Rings theirs;
  for (const auto& polygon : opencv.polygons) {
    for (const cv::Point& p : polygon) theirs.points.emplace_back(p.x, p.y);
    theirs.ends.push_back(static_cast<std::uint32_t>(theirs.points.size()));
  }
  const ContourError peer = contour_error(theirs, figure);
  Table errors(folder + "/silhouette_chain_error.csv", "chain,vertices,mean absolute px,bias px");
  errors.row("one pass,%zu,%.4f,%.4f", ours.vertices, ours.mean_absolute, ours.bias);
  errors.row("OpenCV,%zu,%.4f,%.4f", peer.vertices, peer.mean_absolute, peer.bias);

  const double one = best_of(contenders, "one pass BGRx");
  const double reads = one / read;
  const double faster = best_of(contenders, "OpenCV chain") / one;
  const double nv12_time = best_of(contenders, "one pass NV12");
  const double unchanged_reads = best_of(still, "unchanged picture") / best_of(still, "read again");
  Table bars(folder + "/silhouette_chain_bars.csv", "bar,asked,measured,held");
  bars.row("one pass in reads of the frame,<= 4,%.2f,%s", reads, bar(reads <= 4.0));
  bars.row("one pass faster than OpenCV,>= 7,%.2f,%s", faster, bar(faster >= 7.0));
  bars.row("NV12 over BGRx,< 1,%.2f,%s", nv12_time / one, bar(nv12_time < one));
  bars.row("unchanged picture in reads,<= 2.5,%.2f,%s", unchanged_reads,
           bar(unchanged_reads <= 2.5));
  return 0;
}
