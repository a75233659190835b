// SPDX-License-Identifier: LGPL-2.1-or-later
/// Error of contours against analytic shapes, of polygons over the tolerance, and under noise,
/// against OpenCV. Writes silhouette_contours.csv, silhouette_tolerance.csv and
/// silhouette_noise.csv.
#include <opencv2/imgproc.hpp>

#include <cmath>
#include <cstring>

#include "benchmarks/measure.h"
#include "benchmarks/shapes.h"
#include "silhouette/silhouette.h"

using namespace polyhull;
using namespace polyhull::benchmark;

namespace {

struct Named {
  const char* name;
  Shape shape;
  int width, height;
  bool barred;  // R >= 20: the bias bar holds for it
};

Rings traced(const Matte& matte, double sigma, bool correct) {
  Blur blur;
  blur.set({BlurMethod::fir, sigma, 3, 0});
  Field field;
  blur.apply(matte, field);
  Tracer tracer;
  Rings rings;
  tracer.trace(field, {TraceMethod::subpixel, correct ? sigma : 0.0}, rings);
  return rings;
}

Rings opencv_contours(const Matte& matte, double sigma, double tolerance) {
  cv::Mat mask(matte.height, matte.width, CV_8U);
  for (int y = 0; y < matte.height; ++y) std::memcpy(mask.ptr(y), matte.row(y), matte.width);
  cv::Mat blurred, binary;
  cv::GaussianBlur(mask, blurred, cv::Size(), sigma);
  cv::threshold(blurred, binary, 127, 255, cv::THRESH_BINARY);
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(binary, contours, cv::RETR_CCOMP, cv::CHAIN_APPROX_NONE);
  Rings rings;
  for (std::vector<cv::Point>& contour : contours) {
    if (tolerance > 0.0)
      cv::approxPolyDP(std::vector<cv::Point>(contour), contour, tolerance, true);
    for (const cv::Point& p : contour) rings.points.emplace_back(p.x, p.y);
    rings.ends.push_back(static_cast<std::uint32_t>(rings.points.size()));
  }
  return rings;
}

void shapes_table(const std::string& folder) {
  const Named shapes[] = {
      {"disk R=10", {60.3, 60.7, 10}, 120, 120, false},
      {"disk R=20", {60.3, 60.7, 20}, 120, 120, true},
      {"disk R=50", {80.3, 80.7, 50}, 160, 160, true},
      {"disk R=100", {130.3, 130.7, 100}, 260, 260, true},
      {"disk R=300", {330.3, 330.7, 300}, 660, 660, true},
      {"ellipse 200x120", {230.3, 230.7, 200, 0, 0, 0.6}, 460, 460, true},
      {"smooth star R=250", {330.3, 330.7, 250, 50, 5}, 660, 660, true},
      {"star of 12 teeth", {330.3, 330.7, 230, 70, 12}, 660, 660, true},
  };
  Table table(folder + "/silhouette_contours.csv",
              "shape,method,mean absolute px,bias px,p99.9 px,largest px");
  Table bars(folder + "/silhouette_contours_bars.csv", "bar,asked,measured,held");
  for (const Named& s : shapes) {
    const Matte matte = matte_of(s.shape, s.width, s.height);
    const auto add = [&](const char* method, const Rings& rings) {
      const ContourError e = contour_error(rings, s.shape);
      table.row("%s,%s,%.4f,%.4f,%.4f,%.4f", s.name, method, e.mean_absolute, e.bias, e.p999,
                e.hausdorff);
      return e;
    };
    add("OpenCV", opencv_contours(matte, 2.0, 0.0));
    add("traced", traced(matte, 2.0, false));
    const ContourError e = add("corrected", traced(matte, 2.0, true));
    bars.row("%s mean absolute px,<= 0.02,%.4f,%s", s.name, e.mean_absolute,
             bar(e.mean_absolute <= 0.02));
    if (s.barred) {
      bars.row("%s bias px,<= 0.005,%.4f,%s", s.name, e.bias, bar(std::abs(e.bias) <= 0.005));
    }
  }
}

void tolerance_table(const std::string& folder) {
  Table table(folder + "/silhouette_tolerance.csv",
              "shape,tolerance px,chain,vertices,mean absolute px,bias px,distance to traced px");
  Table bars(folder + "/silhouette_tolerance_bars.csv", "bar,asked,measured,held");
  const Named shapes[] = {{"smooth star R=250", {330.3, 330.7, 250, 50, 5}, 660, 660, true},
                          {"figure", figure_of_17_percent(), 1920, 1080, true},
                          {"disk R=200", {230.3, 230.7, 200}, 460, 460, true}};
  for (const Named& s : shapes) {
    const Matte matte = matte_of(s.shape, s.width, s.height);
    const Rings line = traced(matte, 2.0, true);
    for (const double tolerance : {0.5, 1.0, 2.0, 4.0}) {
      ApproximateSettings settings;
      settings.tolerance = tolerance;
      Approximator approximator;
      Rings polygon;
      approximator.approximate(line, {}, settings, polygon);
      const ContourError ours = contour_error(polygon, s.shape);
      const double distance = hausdorff(polygon.ring(0), line.ring(0));
      const Rings peer = opencv_contours(matte, 2.0, tolerance);
      const ContourError theirs = contour_error(peer, s.shape);
      table.row("%s,%g,ours,%zu,%.4f,%.4f,%.4f", s.name, tolerance, ours.vertices,
                ours.mean_absolute, ours.bias, distance);
      table.row("%s,%g,OpenCV,%zu,%.4f,%.4f,", s.name, tolerance, theirs.vertices,
                theirs.mean_absolute, theirs.bias);
      bars.row("%s tolerance %g bias px,<= 0.05,%.4f,%s", s.name, tolerance, ours.bias,
               bar(std::abs(ours.bias) <= 0.05));
      bars.row("%s tolerance %g Hausdorff px,<= %g,%.4f,%s", s.name, tolerance, tolerance, distance,
               bar(distance <= tolerance));
      bars.row("%s tolerance %g vertices,<= %zu,%zu,%s", s.name, tolerance, theirs.vertices,
               ours.vertices, bar(ours.vertices <= theirs.vertices));
    }
  }
}

/// What noise and a subject's own colours do to the contour: an ellipse, plain or textured.
void noise_table(const std::string& folder) {
  Table table(folder + "/silhouette_noise.csv",
              "format,subject,noise sd,method,mean absolute px,bias px,p99.9 px");
  Table bars(folder + "/silhouette_noise_bars.csv", "bar,asked,measured,held");
  const Shape shape{330.3, 330.7, 250, 0, 0, 0.7};
  const Matte matte = matte_of(shape, 660, 660);
  const auto run = [&](FrameFormat format, double texture, double noise, KeyMethod method) {
    SilhouetteSettings settings;
    settings.key.method = method;
    settings.key.strength = 40;
    settings.approximate.tolerance = 0.0;
    settings.approximate.min_area = 100.0;
    Silhouetter silhouetter;
    silhouetter.set(settings);
    const Frame frame = frame_of(matte, format, noise, 5, texture);
    const ContourError e = contour_error(silhouetter.process(frame.view), shape);
    const char* subject = texture > 0.0 ? "textured" : "plain";
    table.row("%s,%s,%g,%s,%.4f,%.4f,%.4f", name_of(format), subject, noise,
              method == KeyMethod::soft ? "soft" : "prototype", e.mean_absolute, e.bias, e.p999);
    if (noise != 4.0 || method != KeyMethod::soft) return;
    bars.row("%s %s subject noise 4 mean absolute px,<= 0.03,%.4f,%s", name_of(format), subject,
             e.mean_absolute, bar(e.mean_absolute <= 0.03));
  };
  for (const FrameFormat format : {FrameFormat::bgrx, FrameFormat::i420, FrameFormat::nv12}) {
    for (const double texture : {0.0, 12.0}) {
      for (const double noise : {0.0, 2.0, 4.0, 8.0}) {
        run(format, texture, noise, KeyMethod::threshold);
        run(format, texture, noise, KeyMethod::soft);
      }
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::string folder = argc > 1 ? argv[1] : ".";
  shapes_table(folder);
  tolerance_table(folder);
  noise_table(folder);
  return 0;
}
