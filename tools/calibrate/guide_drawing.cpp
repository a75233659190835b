// SPDX-License-Identifier: LGPL-2.1-or-later
#include "calibrate/guide_drawing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace polyhull::calibrate_tool {
namespace {

using calibration::BoardGuide;
constexpr int width = 1280, words_height = 34;
const cv::Scalar green(90, 200, 90), orange(255, 160, 40), white(240, 240, 240), grey(60, 60, 60);

/// Laid over the picture, so that it stays to be seen.
void tint(cv::Mat part, const cv::Scalar& colour) {
  cv::addWeighted(part, 0.7, cv::Mat(part.size(), part.type(), colour), 0.3, 0.0, part);
}

void draw_camera(cv::Mat tile, const BoardGuide& guide, std::size_t c, const std::string& name,
                 const Picture& picture, const std::optional<calibration::View>& view) {
  cv::Mat image = tile.rowRange(0, tile.rows - words_height);
  if (!picture.empty()) {
    const cv::Mat from(picture.height, picture.width, CV_8UC1,
                       const_cast<std::uint8_t*>(picture.pixels.data()));
    cv::Mat small;
    cv::resize(from, small, image.size(), 0.0, 0.0, cv::INTER_AREA);
    cv::cvtColor(small, image, cv::COLOR_GRAY2RGB);
  }
  const auto cell = [&](int column, int row, int columns, int rows) {
    const int x = column * image.cols / columns, y = row * image.rows / rows;
    return cv::Rect(x, y, (column + 1) * image.cols / columns - x,
                    (row + 1) * image.rows / rows - y);
  };
  for (int y = 0; y < BoardGuide::rows; ++y)
    for (int x = 0; x < BoardGuide::columns; ++x)
      if (guide.covered(c, x, y))
        tint(image(cell(x, y, BoardGuide::columns, BoardGuide::rows)), green);
  const std::string wish = guide.wish(c);
  const BoardGuide::Place place = guide.next_place(c);
  if (!wish.empty()) cv::rectangle(image, cell(place.column, place.row, 3, 3), orange, 3);
  if (view && !picture.empty())
    for (const Vec2& corner : view->corners)
      cv::circle(image,
                 cv::Point(static_cast<int>(corner.x * image.cols / picture.width),
                           static_cast<int>(corner.y * image.rows / picture.height)),
                 3, orange, cv::FILLED, cv::LINE_AA);
  const std::string words =
      fmt::format("{}: {} views, {:.0f} %{}", name, guide.views(c), 100.0 * guide.coverage(c),
                  wish.empty() ? ", done" : ": " + wish);
  cv::putText(tile, words, cv::Point(8, tile.rows - 11), cv::FONT_HERSHEY_SIMPLEX,
              std::min(0.6, tile.cols / 700.0), wish.empty() ? green : white, 1, cv::LINE_AA);
}

}  // namespace

Picture draw_guide(const BoardGuide& guide, const std::vector<std::string>& names,
                   const std::vector<Picture>& pictures,
                   const std::vector<std::optional<calibration::View>>& views) {
  const int count = static_cast<int>(names.size());
  const int across = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(count))));
  const int down = (count + across - 1) / across;
  double ratio = 0.75;
  for (const Picture& picture : pictures)
    if (!picture.empty()) ratio = static_cast<double>(picture.height) / picture.width;
  const int tile_width = width / across;
  const int tile_height =
      std::clamp(static_cast<int>(tile_width * ratio), 32, 4 * width) + words_height;
  Picture drawing{width, down * tile_height, 3, {}};
  drawing.pixels.resize(static_cast<std::size_t>(drawing.width) * drawing.height * 3);
  cv::Mat all(drawing.height, drawing.width, CV_8UC3, drawing.pixels.data());
  all.setTo(grey);
  for (int c = 0; c < count; ++c) {
    const auto i = static_cast<std::size_t>(c);
    const cv::Rect place(c % across * tile_width + 2, c / across * tile_height + 2, tile_width - 4,
                         tile_height - 4);
    draw_camera(all(place), guide, i, names[i], pictures[i], views[i]);
  }
  return drawing;
}

}  // namespace polyhull::calibrate_tool
