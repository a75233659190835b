// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/calibration/find_board.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "base/error.h"

namespace polyhull::calibration {
namespace {

const std::map<std::string, int> dictionaries = {
    {"4X4_50", cv::aruco::DICT_4X4_50},          {"4X4_100", cv::aruco::DICT_4X4_100},
    {"4X4_250", cv::aruco::DICT_4X4_250},        {"4X4_1000", cv::aruco::DICT_4X4_1000},
    {"5X5_50", cv::aruco::DICT_5X5_50},          {"5X5_100", cv::aruco::DICT_5X5_100},
    {"5X5_250", cv::aruco::DICT_5X5_250},        {"5X5_1000", cv::aruco::DICT_5X5_1000},
    {"6X6_50", cv::aruco::DICT_6X6_50},          {"6X6_100", cv::aruco::DICT_6X6_100},
    {"6X6_250", cv::aruco::DICT_6X6_250},        {"6X6_1000", cv::aruco::DICT_6X6_1000},
    {"7X7_50", cv::aruco::DICT_7X7_50},          {"7X7_100", cv::aruco::DICT_7X7_100},
    {"7X7_250", cv::aruco::DICT_7X7_250},        {"7X7_1000", cv::aruco::DICT_7X7_1000},
    {"ORIGINAL", cv::aruco::DICT_ARUCO_ORIGINAL}};

// The picture's pixels, which nobody writes to.
cv::Mat picture_matrix(const Picture& grey) {
  return {grey.height, grey.width, CV_8UC1, const_cast<std::uint8_t*>(grey.pixels.data())};
}

// How near edges come to a corner beside its own, px: the least height of the squares between corners,
// which a board seen from low down makes flat.
double least_height(const View& view, const Board& board) {
  std::vector<const Vec2*> at(board.count(), nullptr);
  for (std::size_t i = 0; i < view.ids.size(); ++i) at[view.ids[i]] = &view.corners[i];
  double least = 1e9;
  for (int i = 0; i + board.columns < board.count(); ++i) {
    if ((i + 1) % board.columns == 0 || !at[i] || !at[i + 1] || !at[i + board.columns]) continue;
    const Vec2 x = *at[i + 1] - *at[i], y = *at[i + board.columns] - *at[i];
    least = std::min(least, std::abs(cross(x, y)) / std::max(glm::length(x), glm::length(y)));
  }
  return least;
}

// Moves each corner to where its edges cross, within so many pixels; \p reach, a part of a square,
// must not come to the next corner or to a marker.
void refine(const cv::Mat& grey, View& view, const Board& board, double reach) {
  int window = std::min(static_cast<int>(reach * least_height(view, board)), 11);
  // OpenCV 4.6 leaves ChArUco's corners half a pixel off: any window is better than none.
  if (board.named)
    window = std::max(window, 2);
  else if (window < 3)
    return;  // too little to see beside the crossing
  std::vector<cv::Point2f> corners;
  for (const Vec2& p : view.corners)
    corners.emplace_back(static_cast<float>(p.x), static_cast<float>(p.y));
  cv::cornerSubPix(grey, corners, {window, window}, {-1, -1},
                   cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 60, 0.001));
  for (std::size_t i = 0; i < corners.size(); ++i)
    view.corners[i] = Vec2(corners[i].x, corners[i].y);
}

// Numbers the corners so that x to y turns as in the picture: boards are seen from their front.
void turn_to_front(std::vector<cv::Point2f>& corners, const Board& board) {
  const cv::Point2f x = corners[board.columns - 1] - corners[0];
  const cv::Point2f y = corners[board.count() - board.columns] - corners[0];
  if (x.cross(y) >= 0.0) return;
  for (int row = 0; row < board.rows; ++row) {
    const auto begin = corners.begin() + static_cast<std::ptrdiff_t>(row) * board.columns;
    std::reverse(begin, begin + board.columns);
  }
}

// By how many levels, on average, the squares between corners that are to be dark are brighter than
// the others.
double brightness_of_dark(const cv::Mat& grey, const std::vector<cv::Point2f>& corners,
                          const Board& board) {
  double sum[2] = {0.0, 0.0}, count[2] = {0.0, 0.0};
  for (int y = 0; y + 1 < board.rows; ++y) {
    for (int x = 0; x + 1 < board.columns; ++x) {
      const int i = y * board.columns + x;
      const cv::Point2f middle = 0.25f * (corners[i] + corners[i + 1] + corners[i + board.columns] +
                                          corners[i + board.columns + 1]);
      const int u = std::clamp(cvRound(middle.x), 0, grey.cols - 1);
      const int v = std::clamp(cvRound(middle.y), 0, grey.rows - 1);
      sum[(x + y) % 2] += grey.at<std::uint8_t>(v, u);
      count[(x + y) % 2] += 1.0;
    }
  }
  return sum[0] / count[0] - sum[1] / count[1];
}

// The picture made sx and sy times as large, or less, so that it has at most so many pixels: what looking
// for a board that is not there takes grows with them, and in noise faster.
cv::Mat resized(const cv::Mat& grey, double sx, double sy, double most_pixels) {
  const double less =
      std::min(1.0, std::sqrt(most_pixels / (sx * sy * static_cast<double>(grey.total()))));
  const cv::Size size(std::max(cvRound(less * sx * grey.cols), 1),
                      std::max(cvRound(less * sy * grey.rows), 1));
  cv::Mat out;
  cv::resize(grey, out, size, 0.0, 0.0, less * sy < 1.0 ? cv::INTER_AREA : cv::INTER_CUBIC);
  return out;
}

// Brings corners found in \p from to where they are in \p to, another size of it.
void take_over(std::vector<cv::Point2f>& corners, const cv::Mat& from, const cv::Mat& to) {
  const float sx = static_cast<float>(from.cols) / static_cast<float>(to.cols);
  const float sy = static_cast<float>(from.rows) / static_cast<float>(to.rows);
  for (cv::Point2f& p : corners) p = {(p.x + 0.5f) / sx - 0.5f, (p.y + 0.5f) / sy - 0.5f};
}

// By growing a lattice: A. Duda and U. Frese, "Accurate detection and localization of checkerboard
// corners for calibration", BMVC 2018.
bool find_lattice(const cv::Mat& grey, const Board& board, std::vector<cv::Point2f>& corners) {
  return cv::findChessboardCornersSB(grey, {board.columns, board.rows}, corners, 0);
}

// By quadrangles, of which noise makes thousands: in a small picture.
bool find_quadrangles(const cv::Mat& grey, const Board& board, std::vector<cv::Point2f>& corners) {
  constexpr double most_pixels = 640.0 * 480.0;
  const int flags =
      cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK;
  const cv::Mat small = resized(grey, 1.0, 1.0, most_pixels);
  if (!cv::findChessboardCorners(small, {board.columns, board.rows}, corners, flags)) return false;
  take_over(corners, small, grey);
  return true;
}

// In the picture stretched upwards, so that squares of a board on the floor look like squares.
bool find_flat_corners(const cv::Mat& grey, const Board& board, std::vector<cv::Point2f>& corners) {
  constexpr double most_pixels = 12e6;
  for (const auto& [sx, sy] : {std::pair{1.0, 3.0}, {2.0, 3.0}, {2.0, 5.0}, {3.0, 5.0}}) {
    const cv::Mat stretched = resized(grey, sx, sy, most_pixels);
    if (!find_lattice(stretched, board, corners)) continue;
    take_over(corners, stretched, grey);
    return true;
  }
  return false;
}

std::optional<View> find_chessboard(const cv::Mat& grey, const Board& board, bool flat) {
  std::vector<cv::Point2f> corners;
  if (!find_lattice(grey, board, corners) && !find_quadrangles(grey, board, corners) &&
      !(flat && find_flat_corners(grey, board, corners)))
    return {};
  turn_to_front(corners, board);
  if (!board.looks_same_turned() && brightness_of_dark(grey, corners, board) > 0.0)
    std::reverse(corners.begin(), corners.end());
  View view;
  for (int i = 0; i < board.count(); ++i) {
    view.ids.push_back(i);
    view.corners.emplace_back(corners[i].x, corners[i].y);
  }
  refine(grey, view, board, 0.6);
  return view;
}

// Whether x to y turns the other way in the picture.
bool is_reflected(const View& view, const Board& board) {
  const double n = static_cast<double>(view.ids.size());
  Vec2 from(0.0), to(0.0);
  for (std::size_t i = 0; i < view.ids.size(); ++i) {
    from += Vec2(board.corner(view.ids[i])) / n;
    to += view.corners[i] / n;
  }
  glm::dmat2 sum(0.0);
  for (std::size_t i = 0; i < view.ids.size(); ++i)
    sum += glm::outerProduct(view.corners[i] - to, Vec2(board.corner(view.ids[i])) - from);
  return glm::determinant(sum) < 0.0;
}

std::optional<View> find_charuco(const cv::Mat& grey, const Board& board,
                                 const cv::Ptr<cv::aruco::CharucoBoard>& charuco) {
  std::vector<std::vector<cv::Point2f>> markers, rejected;
  std::vector<int> marker_ids;
  const auto parameters = cv::aruco::DetectorParameters::create();
  cv::aruco::detectMarkers(grey, charuco->dictionary, markers, marker_ids, parameters, rejected);
  cv::aruco::refineDetectedMarkers(grey, charuco, markers, marker_ids, rejected);
  if (marker_ids.empty()) return {};
  std::vector<cv::Point2f> corners;
  std::vector<int> ids;
  cv::aruco::interpolateCornersCharuco(markers, marker_ids, grey, charuco, corners, ids);
  View view;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    view.ids.push_back(ids[i]);
    view.corners.emplace_back(corners[i].x, corners[i].y);
  }
  // Too few, or all in a row: no pose.
  const auto in_row = [&](auto line) {
    return std::ranges::all_of(view.ids, [&](int id) { return line(id) == line(view.ids[0]); });
  };
  if (view.ids.size() < 6 || in_row([&](int id) { return id / board.columns; }) ||
      in_row([&](int id) { return id % board.columns; }))
    return {};
  // OpenCV counts the rows from below.
  if (is_reflected(view, board))
    for (int& id : view.ids)
      id = (board.rows - 1 - id / board.columns) * board.columns + id % board.columns;
  refine(grey, view, board, 0.35 * (1.0 - charuco->getMarkerLength() / charuco->getSquareLength()));
  return view;
}

}  // namespace

struct BoardFinder::Private {
  Target target;
  cv::Ptr<cv::aruco::CharucoBoard> charuco;
};

BoardFinder::BoardFinder(const Target& target) {
  auto self = std::make_shared<Private>();
  self->target = target;
  const Board& board = target.board;
  if (board.named) {
    const auto found = dictionaries.find(target.dictionary);
    if (found == dictionaries.end())
      throw Error(Error::Kind::bad_input, "There is no dictionary of markers '{}'; there are {}.",
                  target.dictionary, [] {
                    std::string all;
                    for (const auto& [name, _] : dictionaries)
                      all += (all.empty() ? "" : ", ") + name;
                    return all;
                  }());
    if (!(target.marker > 0.0 && target.marker < 1.0))
      throw Error(Error::Kind::bad_input,
                  "A marker has {} of its square's side; between 0 and 1 is possible.",
                  target.marker);
    const auto dictionary = cv::aruco::getPredefinedDictionary(found->second);
    const int needed = (board.columns + 1) * (board.rows + 1) / 2;
    if (dictionary->bytesList.rows < needed)
      throw Error(Error::Kind::bad_input,
                  "The board has {} markers, the dictionary {} only {}; use a larger one.", needed,
                  target.dictionary, dictionary->bytesList.rows);
    self->charuco = cv::aruco::CharucoBoard::create(
        board.columns + 1, board.rows + 1, static_cast<float>(board.square),
        static_cast<float>(board.square * target.marker), dictionary);
  }
  self_ = std::move(self);
}

std::optional<View> BoardFinder::find(const Picture& grey, bool flat) const {
  const Board& board = self_->target.board;
  try {
    return board.named ? find_charuco(picture_matrix(grey), board, self_->charuco)
                       : find_chessboard(picture_matrix(grey), board, flat);
  } catch (const cv::Exception& error) {
    throw Error(Error::Kind::bad_input, "OpenCV cannot look for a board in the picture: {}.",
                error.err);
  }
}

Picture BoardFinder::draw(int square) const {
  const Board& board = self_->target.board;
  Picture out{(board.columns + 3) * square, (board.rows + 3) * square, 1, {}};
  out.pixels.assign(static_cast<std::size_t>(out.width) * out.height, 255);
  if (board.named) {
    cv::Mat drawn = picture_matrix(out);
    self_->charuco->draw({out.width, out.height}, drawn, square);
    return out;
  }
  for (int y = square; y < out.height - square; ++y)
    for (int x = square; x < out.width - square; ++x)
      if ((x / square + y / square) % 2 == 0) out.row(y)[x] = 0;
  return out;
}

}  // namespace polyhull::calibration
