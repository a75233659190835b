// SPDX-License-Identifier: LGPL-2.1-or-later
/// Time and error of the blur of a 1920x1080 mask over sigma, against OpenCV and the exact
/// Gaussian. Writes silhouette_blur.csv to the folder given.
#include <opencv2/imgproc.hpp>

#include <cmath>
#include <cstdlib>
#include <cstring>

#include "benchmarks/measure.h"
#include "benchmarks/shapes.h"
#include "silhouette/blur/blur.h"

using namespace polyhull;
using namespace polyhull::benchmark;

namespace {

constexpr int width = 1920;
constexpr int height = 1080;

/// The Gaussian in double precision: OpenCV's separable filter with a kernel of 8 sigma each side.
cv::Mat exact_blur(const cv::Mat& mask, double sigma) {
  cv::Mat wide, result;
  mask.convertTo(wide, CV_64F);
  const int radius = static_cast<int>(std::ceil(8 * sigma)) + 1;
  cv::Mat kernel(2 * radius + 1, 1, CV_64F);
  double sum = 0.0;
  for (int i = -radius; i <= radius; ++i) {
    sum += kernel.at<double>(i + radius) = std::exp(-0.5 * i * i / (sigma * sigma));
  }
  kernel /= sum;
  cv::sepFilter2D(wide, result, CV_64F, kernel, kernel, cv::Point(-1, -1), 0, cv::BORDER_REPLICATE);
  return result;
}

struct Error {
  double largest = 0.0;       ///< grey levels
  double displacement = 0.0;  ///< px, 99.9 percentile at the half level
};

/// Along rows and columns, how far the half level lies from where the exact blur has it.
void crossings(const cv::Mat& exact, const cv::Mat& got, std::vector<double>& displacements) {
  for (int y = 0; y < exact.rows; ++y) {
    for (int x = 0; x + 1 < exact.cols; ++x) {
      const double a = exact.at<double>(y, x) - 127.5;
      const double b = exact.at<double>(y, x + 1) - 127.5;
      if ((a < 0.0) == (b < 0.0) || std::abs(a - b) < 8.0) continue;
      const double c = got.at<double>(y, x) - 127.5;
      const double d = got.at<double>(y, x + 1) - 127.5;
      if ((c < 0.0) == (d < 0.0)) continue;  // moved to the next pixel: seen from there
      displacements.push_back(std::abs(a / (a - b) - c / (c - d)));
    }
  }
}

Error error_of(const cv::Mat& exact, const cv::Mat& got) {
  Error error;
  cv::Mat difference;
  cv::absdiff(exact, got, difference);
  cv::minMaxLoc(difference, nullptr, &error.largest);
  std::vector<double> displacements;
  crossings(exact, got, displacements);
  crossings(exact.t(), got.t(), displacements);
  if (displacements.empty()) return error;
  std::sort(displacements.begin(), displacements.end());
  error.displacement = displacements[static_cast<std::size_t>(0.999 * (displacements.size() - 1))];
  return error;
}

cv::Mat levels_of(const Field& field) {
  cv::Mat levels(field.height, field.width, CV_64F);
  for (int y = 0; y < field.height; ++y) {
    for (int x = 0; x < field.width; ++x) {
      levels.at<double>(y, x) = static_cast<double>(field.row(y)[x]) / field_scale;
    }
  }
  return levels;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string folder = argc > 1 ? argv[1] : ".";
  const int rounds = argc > 2 ? std::atoi(argv[2]) : 9;
  cv::setNumThreads(1);
  const Matte matte = matte_of(figure_of_17_percent(), width, height);
  cv::Mat mask(height, width, CV_8U);
  for (int y = 0; y < height; ++y) std::memcpy(mask.ptr(y), matte.row(y), width);
  cv::Mat copy = mask.clone();

  Table table(folder + "/silhouette_blur.csv",
              "sigma,method,best ms,largest error,displacement px,memcpys of the plane");
  Table bars(folder + "/silhouette_blur_bars.csv", "bar,asked,measured,held");
  for (const double sigma :
       {0.3, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0, 32.0, 50.0, 100.0}) {
    Field fields[3];
    Blur blurs[3];
    const BlurMethod methods[] = {BlurMethod::fir, BlurMethod::box, BlurMethod::recursive};
    const char* names[] = {"fir", "box", "recursive"};
    for (int i = 0; i < 3; ++i) blurs[i].set({methods[i], sigma, 3, 0});
    cv::Mat peer, peer_float, mask_float;
    mask.convertTo(mask_float, CV_32F);
    std::vector<Contender> contenders = {
        {"memcpy",
         [&](int) {
           std::memcpy(copy.data, mask.data, mask.total());
           keep(copy.data);
         }},
        {"fir", [&](int) { blurs[0].apply(matte, fields[0]); }},
        {"box", [&](int) { blurs[1].apply(matte, fields[1]); }},
        {"recursive", [&](int) { blurs[2].apply(matte, fields[2]); }},
        {"OpenCV u8",
         [&](int) {
           cv::GaussianBlur(mask, peer, cv::Size(), sigma, sigma, cv::BORDER_REPLICATE);
         }},
    };
    if (sigma <= 16.0) {
      contenders.push_back({"OpenCV f32", [&](int) {
                              cv::GaussianBlur(mask_float, peer_float, cv::Size(), sigma, sigma,
                                               cv::BORDER_REPLICATE);
                            }});
    }
    race(contenders, sigma > 30.0 ? std::min(rounds, 3) : rounds);
    const double copy_time = best_of(contenders, "memcpy");
    const cv::Mat exact = exact_blur(mask, sigma);
    Error errors[3];
    for (int i = 0; i < 3; ++i) {
      errors[i] = error_of(exact, levels_of(fields[i]));
      const double ms = best_of(contenders, names[i]);
      table.row("%g,%s,%.3f,%.3f,%.4f,%.1f", sigma, names[i], ms, errors[i].largest,
                errors[i].displacement, ms / copy_time);
    }
    const auto add_peer = [&](const char* name, const cv::Mat& result) {
      cv::Mat wide;
      result.convertTo(wide, CV_64F);
      const Error e = error_of(exact, wide);
      const double ms = best_of(contenders, name);
      table.row("%g,%s,%.3f,%.3f,%.4f,%.1f", sigma, name, ms, e.largest, e.displacement,
                ms / copy_time);
    };
    add_peer("OpenCV u8", peer);
    if (sigma <= 16.0) add_peer("OpenCV f32", peer_float);

    const double fir = best_of(contenders, "fir");
    const double opencv = best_of(contenders, "OpenCV u8");
    const double recursive = best_of(contenders, "recursive");
    if (sigma == 2.0) {
      bars.row("sigma 2 in memcpys,<= 10,%.2f,%s", fir / copy_time, bar(fir <= 10 * copy_time));
      bars.row("sigma 2 faster than OpenCV u8,>= 3,%.2f,%s", opencv / fir, bar(opencv >= 3 * fir));
      bars.row("sigma 2 largest error,<= 0.15,%.3f,%s", errors[0].largest,
               bar(errors[0].largest <= 0.15));
      bars.row("sigma 2 displacement p99.9 px,<= 0.01,%.4f,%s", errors[0].displacement,
               bar(errors[0].displacement <= 0.01));
    }
    bars.row("sigma %g fir largest error,<= 0.5,%.3f,%s", sigma, errors[0].largest,
             bar(errors[0].largest <= 0.5));
    bars.row("sigma %g recursive largest error,<= 0.5,%.3f,%s", sigma, errors[2].largest,
             bar(errors[2].largest <= 0.5));
    bars.row("sigma %g fir over OpenCV u8,<= 1,%.2f,%s", sigma, fir / opencv, bar(fir <= opencv));
    bars.row("sigma %g recursive over OpenCV u8,(told),%.2f,", sigma, recursive / opencv);
  }
  return 0;
}
