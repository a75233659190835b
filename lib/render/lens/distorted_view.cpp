// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/lens/distorted_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "base/error.h"
#include "base/thread_pool.h"
#include "render/lens/loops/resample_loops.h"
#include "render/projection.h"
#include "rig/lens.h"

namespace polyhull {
namespace {

constexpr double margin = 3.0;      // pixels beyond the outermost place, for the cubics
constexpr double widest = 20000.0;  // pixels of the overscan, before it is made coarser

void check_viewport(const Camera& camera) {
  bool usable = camera.width > 0 && camera.height > 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) usable = usable && std::isfinite(camera.K[i][j]);
  for (const double k : camera.distortion) usable = usable && std::isfinite(k);
  if (usable && camera.K[0][0] > 0.0 && camera.K[1][1] > 0.0) return;
  throw Error(Error::Kind::bad_input,
              "The viewport's lens cannot be used: it needs a picture, a focal length above 0, and "
              "finite coefficients of distortion. Look at what the background or its tracker "
              "announces, or at the properties distortion-k1 and on.");
}

}  // namespace

/// The cells with a corner that the lens's model has no place for. \p real_of is the way back.
template <typename Map>
void DistortedView::find_lost(const Map& real_of) {
  lost_.assign(
      static_cast<std::size_t>(to_pinhole_.columns) * static_cast<std::size_t>(to_pinhole_.rows),
      0);
  for (int j = 0; j <= to_pinhole_.rows; ++j)
    for (int i = 0; i <= to_pinhole_.columns; ++i) {
      if (glm::length(real_of(to_pinhole_.at(i, j)) - Vec2(cell * i, cell * j)) < 1e-3) continue;
      for (int row = std::max(j - 1, 0); row <= std::min(j, to_pinhole_.rows - 1); ++row)
        for (int column = std::max(i - 1, 0); column <= std::min(i, to_pinhole_.columns - 1);
             ++column)
          lost_[static_cast<std::size_t>(row * to_pinhole_.columns + column)] = 1;
    }
}

/// The camera whose picture holds all that the viewport shows.
void DistortedView::lay_out(const Camera& viewport) {
  const Lens lens(viewport);
  const double right = viewport.width - 0.5, bottom = viewport.height - 0.5;
  // The border's image holds that of the picture.
  Vec2 low(widest), high(-widest);
  const auto look = [&](const Vec2& real) {
    const Vec2 ideal = glm::clamp(lens.undistort(real), Vec2(-widest), Vec2(widest));
    low = glm::min(low, ideal);
    high = glm::max(high, ideal);
  };
  for (double x = -0.5; x < right + cell; x += cell)
    for (const double y : {-0.5, bottom}) look({std::min(x, right), y});
  for (double y = -0.5; y < bottom + cell; y += cell)
    for (const double x : {-0.5, right}) look({x, std::min(y, bottom)});
  low = glm::floor(low - margin);
  const Vec2 size = glm::ceil(high - low + margin);
  const double most = most_pixels * viewport.width * viewport.height;
  const double scale = std::min(1.0, std::sqrt(most / (size.x * size.y)));
  pinhole_ = viewport;
  pinhole_.distortion.clear();
  pinhole_.width = static_cast<int>(std::ceil(scale * size.x));
  pinhole_.height = static_cast<int>(std::ceil(scale * size.y));
  const Mat3 shrunk = from_rows({scale, 0, -scale * low.x, 0, scale, -scale * low.y, 0, 0, 1});
  pinhole_.K = shrunk * viewport.K;
  const auto moved = [&](const Vec2& ideal) { return scale * (ideal - low); };
  to_pinhole_ = grid_of(viewport.width, viewport.height,
                        [&](const Vec2& real) { return moved(lens.undistort(real)); });
  const auto real_of = [&](const Vec2& p) { return lens.distort(p / scale + low); };
  to_picture_ = grid_of(pinhole_.width, pinhole_.height, real_of);
  find_lost(real_of);
}

/// The nodes beyond the border: outside of the picture the inverse need not be smooth.
void DistortedView::Grid::extend() {
  const auto beyond = [](const Vec2& a, const Vec2& b, const Vec2& c) {
    return 3.0 * a - 3.0 * b + c;
  };
  for (int j = 0; j <= rows; ++j) {
    at(-1, j) = beyond(at(0, j), at(1, j), at(columns > 1 ? 2 : 0, j));
    at(columns + 1, j) =
        beyond(at(columns, j), at(columns - 1, j), at(columns > 1 ? columns - 2 : 1, j));
  }
  for (int i = -1; i <= columns + 1; ++i) {
    at(i, -1) = beyond(at(i, 0), at(i, 1), at(i, rows > 1 ? 2 : 0));
    at(i, rows + 1) = beyond(at(i, rows), at(i, rows - 1), at(i, rows > 1 ? rows - 2 : 1));
  }
}

template <typename Map>
DistortedView::Grid DistortedView::grid_of(int width, int height, const Map& map) {
  Grid grid;
  grid.columns = (width + cell - 1) / cell;
  grid.rows = (height + cell - 1) / cell;
  grid.places.resize(grid.index(grid.columns + 1, grid.rows + 1) + 1);
  parallel_each(grid.rows + 1, 4, 0, [&](int j) {
    for (int i = 0; i <= grid.columns; ++i) grid.at(i, j) = map(Vec2(cell * i, cell * j));
  });
  grid.extend();
  return grid;
}

bool DistortedView::set(const Camera& viewport) {
  // Most viewports have no lens, and cost nothing.
  if (viewport.distortion.empty()) return active_ = false;
  check_viewport(viewport);
  if (!Distortion(viewport).active()) return active_ = false;
  const bool same = active_ && viewport.K == viewport_.K && viewport.width == viewport_.width &&
                    viewport.height == viewport_.height &&
                    viewport.distortion == viewport_.distortion;
  if (!same) {
    make_alike();  // and so they stay, whatever size they get
    held_ = {};
    lay_out(viewport);
  }
  viewport_ = viewport;
  pinhole_.R = viewport.R;
  pinhole_.t = viewport.t;
  return active_ = true;
}

namespace {

/// The cubic through four nodes, evenly apart, as coefficients of t: 0 at the second, 1 at the third.
std::array<Vec2, 4> cubic_through(const Vec2& a, const Vec2& b, const Vec2& c, const Vec2& d) {
  return {b, (-2.0 * a - 3.0 * b + 6.0 * c - d) / 6.0, 0.5 * (a + c) - b,
          (d - a + 3.0 * (b - c)) / 6.0};
}

Vec2 on_cubic(const std::array<Vec2, 4>& c, double t) {
  return ((c[3] * t + c[2]) * t + c[1]) * t + c[0];
}

}  // namespace

/// Calls \p work for the runs of \p part, which is of the picture that \p grid's nodes are of, in
/// the cells that are \p wanted.
template <typename Wanted, typename Work>
void DistortedView::for_runs(const Grid& grid, const Rectangle& part, const Wanted& wanted,
                             const Work& work) {
  if (part.empty()) return;
  const int right = part.x + part.width, first = part.x / cell, last = (right - 1) / cell;
  parallel_for(
      static_cast<std::size_t>(part.height), cell, 0, [&](std::size_t begin, std::size_t end) {
        std::vector<Vec2> row(static_cast<std::size_t>(last - first) +
                              4);  // of nodes, from first - 1 on
        for (int y = part.y + static_cast<int>(begin); y < part.y + static_cast<int>(end); ++y) {
          const int j = y / cell;
          for (int i = first - 1; i <= last + 2; ++i)
            row[static_cast<std::size_t>(i - first + 1)] =
                on_cubic(cubic_through(grid.at(i, j - 1), grid.at(i, j), grid.at(i, j + 1),
                                       grid.at(i, j + 2)),
                         static_cast<double>(y % cell) / cell);
          for (int i = first; i <= last; ++i) {
            if (!wanted(i, j)) continue;
            const Vec2* node = &row[static_cast<std::size_t>(i - first)];
            const std::array<Vec2, 4> curve = cubic_through(node[0], node[1], node[2], node[3]);
            const int x = std::max(cell * i, part.x), next = std::min(cell * (i + 1), right);
            lens::PlaceRun run{{}, {}, x - cell * i, next - x};
            for (std::size_t k = 0; k < 4; ++k) {
              run.x[k] = static_cast<float>(curve[k].x);
              run.y[k] = static_cast<float>(curve[k].y);
            }
            work(x, y, run);
          }
        }
      });
}

namespace {

constexpr auto all_cells = [](int, int) { return true; };

}  // namespace

/// \p part and what a pixel that shows some of it is computed from, within the overscan.
Rectangle DistortedView::grown(const Rectangle& part) const {
  constexpr int reach = 4;
  if (part.empty()) return {};
  const int left = std::max(part.x - reach, 0), top = std::max(part.y - reach, 0);
  return {left, top, std::min(part.x + part.width + reach, pinhole_.width) - left,
          std::min(part.y + part.height + reach, pinhole_.height) - top};
}

/// Takes out of drawn_ what was drawn.
void DistortedView::make_alike() {
  for (int y = written_.y; y < written_.y + written_.height; ++y) {
    const std::size_t at =
        4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(pinhole_.width) +
             static_cast<std::size_t>(written_.x));
    std::memcpy(&drawn_[at], &before_[at], 4 * static_cast<std::size_t>(written_.width));
  }
  written_ = {};
}

/// Whether \p picture is the one that was taken last; from now on it is.
bool DistortedView::remember(const std::uint8_t* picture, int stride) {
  const std::size_t row = 4 * static_cast<std::size_t>(viewport_.width);
  const auto rows = static_cast<std::size_t>(viewport_.height);
  bool same = picture_.size() == row * rows;
  picture_.resize(row * rows);
  for (std::size_t y = 0; y < rows; ++y) {
    const std::uint8_t* from =
        picture + static_cast<std::ptrdiff_t>(y) * static_cast<std::ptrdiff_t>(stride);
    same = same && std::memcmp(&picture_[row * y], from, row) == 0;
    if (!same) std::memcpy(&picture_[row * y], from, row);
  }
  return same;
}

void DistortedView::resample(const Rectangle& part) {
  const std::size_t row = static_cast<std::size_t>(stride());
  const lens::PictureSource from{picture_.data(), 4 * static_cast<std::ptrdiff_t>(viewport_.width),
                                 viewport_.width, viewport_.height};
  for_runs(to_picture_, part, all_cells, [&](int x, int y, const lens::PlaceRun& run) {
    const std::size_t at = row * static_cast<std::size_t>(y) + 4 * static_cast<std::size_t>(x);
    lens::ResampleLoops::best().resample(from, run, &before_[at]);
    std::memcpy(&drawn_[at], &before_[at], 4 * static_cast<std::size_t>(run.count));
  });
}

void DistortedView::take(const std::uint8_t* picture, int stride, const Rectangle& part) {
  make_alike();
  before_.resize(static_cast<std::size_t>(this->stride()) *
                 static_cast<std::size_t>(pinhole_.height));
  drawn_.resize(before_.size());
  written_ = part;
  Rectangle wanted = grown(part);
  if (!remember(picture, stride))
    held_ = {};
  else if (intersection(held_, wanted) != wanted)
    wanted = {0, 0, pinhole_.width, pinhole_.height};
  if (intersection(held_, wanted) == wanted) return;
  resample(wanted);
  held_ = wanted;
}

std::shared_ptr<const DepthPicture> DistortedView::take(const DepthPicture& depth) const {
  auto taken = std::make_shared<DepthPicture>();
  taken->width = pinhole_.width;
  taken->height = pinhole_.height;
  const auto columns = static_cast<std::size_t>(pinhole_.width);
  const auto right = static_cast<float>(viewport_.width - 1),
             bottom = static_cast<float>(viewport_.height - 1);
  taken->inverse.assign(columns * static_cast<std::size_t>(pinhole_.height), 0.0f);
  for_runs(
      to_picture_, {0, 0, pinhole_.width, pinhole_.height}, all_cells,
      [&](int x, int y, const lens::PlaceRun& run) {
        float* to =
            &taken->inverse[columns * static_cast<std::size_t>(y) + static_cast<std::size_t>(x)];
        for (int i = 0; i < run.count; ++i) {
          const float t = static_cast<float>(run.first + i) / cell;
          const auto along = [t](const auto& c) {
            return std::floor(((c[3] * t + c[2]) * t + c[1]) * t + c[0] + 0.5f);
          };
          const float column = along(run.x), row = along(run.y);
          // What is no number is at the border, too.
          const int px = column > 0.0f ? static_cast<int>(std::min(column, right)) : 0;
          const int py = row > 0.0f ? static_cast<int>(std::min(row, bottom)) : 0;
          to[i] = depth.at(px, py, viewport_.width, viewport_.height);
        }
      });
  return taken;
}

/// The pinhole's pixels that those of the picture's cell (i, j) are computed from, and some more;
/// empty where the cell is lost.
Rectangle DistortedView::seen(int i, int j) const {
  if (lost_[static_cast<std::size_t>(j * to_pinhole_.columns + i)]) return {};
  const Vec2 a = to_pinhole_.at(i, j), b = to_pinhole_.at(i + 1, j), c = to_pinhole_.at(i, j + 1),
             d = to_pinhole_.at(i + 1, j + 1);
  // Two pixels for the cubics, and what a side can be bent.
  const Vec2 end(pinhole_.width, pinhole_.height);
  const Vec2 low = glm::clamp(glm::min(glm::min(a, b), glm::min(c, d)) - 4.0, Vec2(0.0), end);
  const Vec2 high = glm::clamp(glm::max(glm::max(a, b), glm::max(c, d)) + 5.0, Vec2(0.0), end);
  const int left = static_cast<int>(low.x), top = static_cast<int>(low.y);
  return {left, top, static_cast<int>(std::ceil(high.x)) - left,
          static_cast<int>(std::ceil(high.y)) - top};
}

Rectangle DistortedView::reach(const Rectangle& part) const {
  if (part.empty()) return {};
  int left = viewport_.width, top = viewport_.height, right = 0, bottom = 0;
  for (int j = 0; j < to_pinhole_.rows; ++j)
    for (int i = 0; i < to_pinhole_.columns; ++i) {
      if (intersection(seen(i, j), part).empty()) continue;
      left = std::min(left, cell * i);
      right = std::max(right, std::min(cell * (i + 1), viewport_.width));
      top = std::min(top, cell * j);
      bottom = std::max(bottom, std::min(cell * (j + 1), viewport_.height));
    }
  return right > left ? Rectangle{left, top, right - left, bottom - top} : Rectangle{};
}

/// By cell of the picture: whether its pixels may show something that differs from before().
std::vector<char> DistortedView::cells_changed(const Rectangle& changed) const {
  // Sums over the pinhole's cells that differ, above and to the left of each.
  const int columns = to_picture_.columns, rows = to_picture_.rows;
  const auto across = static_cast<std::size_t>(columns) + 1;
  std::vector<int> sums(across * (static_cast<std::size_t>(rows) + 1), 0);
  const auto sum = [&](int i, int j) -> int& {
    return sums[across * static_cast<std::size_t>(j) + static_cast<std::size_t>(i)];
  };
  const int right = changed.x + changed.width, bottom = changed.y + changed.height;
  parallel_each(rows, 4, 0, [&](int j) {
    for (int y = std::max(cell * j, changed.y); y < std::min(cell * (j + 1), bottom); ++y)
      for (int i = changed.x / cell; cell * i < right; ++i) {
        const int x = std::max(cell * i, changed.x), next = std::min(cell * (i + 1), right);
        const std::size_t at = static_cast<std::size_t>(stride()) * static_cast<std::size_t>(y) +
                               4 * static_cast<std::size_t>(x);
        if (std::memcmp(&before_[at], &drawn_[at], 4 * static_cast<std::size_t>(next - x)) != 0)
          sum(i + 1, j + 1) = 1;
      }
  });
  for (int j = 1; j <= rows; ++j)
    for (int i = 1; i <= columns; ++i)
      sum(i, j) += sum(i - 1, j) + sum(i, j - 1) - sum(i - 1, j - 1);
  std::vector<char> found;
  for (int j = 0; j < to_pinhole_.rows; ++j)
    for (int i = 0; i < to_pinhole_.columns; ++i) {
      const Rectangle part = seen(i, j);
      const int left = part.x / cell, top = part.y / cell;
      const int end = (part.x + part.width + cell - 1) / cell,
                low = (part.y + part.height + cell - 1) / cell;
      found.push_back(!part.empty() &&
                      sum(end, low) - sum(left, low) - sum(end, top) + sum(left, top) > 0);
    }
  return found;
}

void DistortedView::give(const Rectangle& changed, std::uint8_t* target, int stride) const {
  if (changed.empty()) return;
  const lens::PictureSource from{drawn_.data(), this->stride(), pinhole_.width, pinhole_.height};
  const std::vector<char> shows = cells_changed(changed);
  const auto wanted = [&](int i, int j) {
    return shows[static_cast<std::size_t>(j * to_pinhole_.columns + i)] != 0;
  };
  for_runs(to_pinhole_, reach(changed), wanted, [&](int x, int y, const lens::PlaceRun& run) {
    lens::ResampleLoops::best().resample_changed(
        from, before_.data(), run,
        target + static_cast<std::ptrdiff_t>(y) * stride + 4 * std::ptrdiff_t{x});
  });
}

Vec2 DistortedView::place(int x, int y) const {
  Vec2 found(0.0);
  for_runs(to_pinhole_, {x, y, 1, 1}, all_cells, [&](int, int, const lens::PlaceRun& run) {
    const double t = static_cast<double>(run.first) / cell;
    for (std::size_t k = 4; k-- > 0;) found = found * t + Vec2(run.x[k], run.y[k]);
  });
  return found;
}

}  // namespace polyhull
