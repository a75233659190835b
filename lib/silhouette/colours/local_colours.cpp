// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/colours/local_colours.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace polyhull::silhouette {
namespace {

constexpr int inset = 6;  // px beside an edge that do not count: lens, chroma's interpolation

// Of the screen's signal: what has less is subject, what has more is screen.
constexpr double screen_above = 0.5;

constexpr int solid_shift = 2;  // px that count as one solid colour, as a power of 2: less noise
constexpr int solid_inset = 2;  // px beside an edge that do not
// Of the screen's signal: by which the neighbours of a solid pixel differ at most beside noise. On edges
// of strong colours, which look like subject in most of their width, they differ by more.
constexpr double flat = 0.08;

constexpr double plain_above = 0.85;  // of the screen's signal: no pixel of a plain tile has less

constexpr float unsure = 0.2f;  // weight of what may be an edge's

enum Kind : std::uint8_t { between, subject, screen };

}  // namespace

void LocalColours::begin(int width, int height) {
  shift_ = height <= 540 ? 4 : height <= 1200 ? 5 : 6;
  across_ = ((width - 1) >> shift_) + 1;
  down_ = ((height - 1) >> shift_) + 1;
  const std::size_t count = static_cast<std::size_t>(across_) * static_cast<std::size_t>(down_);
  tiles_.assign(count, {});
  screens_.resize(count);
  subjects_.resize(count);
  known_.reserve(count);
  has_screen_ = false;
}

void LocalColours::begin_frame(int x0, int x1, int screen_signal, double noise) {
  x0_ = x0, x1_ = x1;
  screen_signal_ = screen_signal;
  noise_ = noise;
  std::fill(screens_.begin(), screens_.end(), Sum{});
  std::fill(subjects_.begin(), subjects_.end(), Sum{});
  mixed_.clear();
  solid_ = nearly_solid_ = 0;
  rows_.clear();
  signals_.clear();
  kinds_.clear();
}

void LocalColours::add_row(int y, const std::int16_t* signal) {
  const auto below = static_cast<std::int16_t>(std::max(subject_below_ * screen_signal_, 1.0));
  const auto above = static_cast<std::int16_t>(screen_above * screen_signal_);
  const auto width = static_cast<std::size_t>(x1_ - x0_);
  rows_.push_back(y);
  signals_.insert(signals_.end(), signal, signal + width);
  kinds_.resize(kinds_.size() + width);
  std::uint8_t* const kinds = kinds_.data() + kinds_.size() - width;
  for (std::size_t i = 0; i < width; ++i)
    kinds[i] = static_cast<std::uint8_t>((signal[i] < below) | (signal[i] > above) << 1);
}

void LocalColours::sum_row(std::size_t row, const Colours& colours) {
  const auto [signal, kinds, upper, lower, y] = row_of(row);
  for (int begin = x0_, end; begin < x1_; begin = end) {
    const std::uint8_t kind = kinds[begin - x0_];
    // The run of this kind, eight at a time.
    const std::uint64_t eight = 0x0101010101010101u * kind;
    std::uint64_t next;
    for (end = begin + 1; end + 8 <= x1_; end += 8) {
      std::memcpy(&next, kinds + (end - x0_), 8);
      if (next != eight) break;
    }
    while (end < x1_ && kinds[end - x0_] == kind) ++end;
    for (int i = begin >> shift_; kind != screen && i <= (end - 1) >> shift_; ++i)
      shown_[index(i, y >> shift_)] = 1;
    if (kind == between) {
      for (int x = begin + inset; x < end - inset; ++x)
        nearly_solid_ += upper[x - x0_] != screen && lower[x - x0_] != screen;
      const std::uint8_t* rgb = end - begin <= 2 * size() ? colours(y, begin, end) : nullptr;
      for (int x = begin; rgb != nullptr && x < end; ++x, rgb += 4)
        mixed_.push_back({index(x >> shift_, y >> shift_), Vec3f(rgb[0], rgb[1], rgb[2])});
      continue;
    }
    // Beside the row it goes on.
    const int from = begin == x0_ ? begin : begin + inset, to = end == x1_ ? end : end - inset;
    if (kind == screen) {
      if (from < to) sum_screen(row, from, to, colours(y, from, to));
      continue;
    }
    const std::uint8_t* const rgb = colours(y, begin, end);
    sum_solids(row, begin + solid_inset, end - solid_inset, rgb + 4 * solid_inset);
    sum_subject(row, from, to, rgb + 4 * (from - begin));
  }
}

LocalColours::Row LocalColours::row_of(std::size_t row) const {
  const auto width = static_cast<std::size_t>(x1_ - x0_);
  const std::uint8_t* const kinds = kinds_.data() + row * width;
  return {signals_.data() + row * width, kinds, row > 0 ? kinds - width : kinds,
          row + 1 < rows_.size() ? kinds + width : kinds, rows_[row]};
}

void LocalColours::sum_solids(std::size_t row, int from, int to, const std::uint8_t* rgb) {
  const auto steepest = static_cast<int>(flat * screen_signal_ + 2.0 * noise_);
  const Row r = row_of(row);
  for (int x = from; x < to; ++x, rgb += 4) {
    if (std::abs(r.signal[x + 1 - x0_] - r.signal[x - 1 - x0_]) > steepest) continue;
    Solid& solid = solids_[row * solids_across() + static_cast<std::size_t>(x >> solid_shift)];
    solid.sum += Vec3f(rgb[0], rgb[1], rgb[2]);
    ++solid.count;
  }
}

// Of the screen, which is most of the picture, every second pixel is enough.
void LocalColours::sum_screen(std::size_t row, int from, int to, const std::uint8_t* rgb) {
  const Row r = row_of(row);
  for (int x = from; x < to;) {
    const int column = x >> shift_, stop = std::min((column + 1) << shift_, to);
    int sums[3] = {}, count = 0, signals = 0, least = 32767;
    std::int64_t squares = 0;
    for (; x < stop; x += 2, rgb += 8) {
      const int i = x - x0_, d = r.signal[i];
      least = std::min(least, d);
      if (r.upper[i] != screen || r.lower[i] != screen) continue;
      for (int c = 0; c < 3; ++c) sums[c] += rgb[c];
      ++count;
      signals += d;
      squares += d * d;
    }
    const std::size_t at = index(column, r.y >> shift_);
    if (least < plain_above * screen_signal_) shown_[at] = 1;
    Sum& sum = screens_[at];
    sum.colour += Vec3f(sums[0], sums[1], sums[2]);
    sum.weight += static_cast<float>(count);
    sum.count += static_cast<float>(count);
    sum.signal += static_cast<float>(signals);
    sum.square += static_cast<float>(squares);
  }
}

void LocalColours::sum_subject(std::size_t row, int from, int to, const std::uint8_t* rgb) {
  const auto below = static_cast<float>(std::max(subject_below_ * screen_signal_, 1.0));
  const Row r = row_of(row);
  for (int x = from; x < to; ++x, rgb += 4) {
    Sum& sum = subjects_[index(x >> shift_, r.y >> shift_)];
    const int i = x - x0_;
    const auto d = static_cast<float>(r.signal[i]);
    // Where the next sampled rows show something else an edge may lie along this one: what is surely
    // the subject's counts most.
    const bool sure = r.upper[i] == subject && r.lower[i] == subject;
    const float solid = std::min(below - d, below) / below;
    const float weight = sure ? solid : unsure * solid;
    sum.colour += weight * Vec3f(rgb[0], rgb[1], rgb[2]);
    sum.weight += weight;
    if (!sure) continue;
    solid_ += 1.0;
    sum.count += 1.0f;
    sum.signal += d;
    sum.square += d * d;
  }
}

float LocalColours::variance(const Sum& sum) {
  if (sum.count == 0.0f) return 0.0f;
  const float mean = sum.signal / sum.count;
  return std::max(sum.square / sum.count - mean * mean, 0.0f);
}

float LocalColours::beyond_noise(const Sum& sum) const {
  return std::sqrt(std::max(variance(sum) - static_cast<float>(noise_ * noise_), 0.0f));
}

double LocalColours::spread(const std::vector<Sum>& sums, double quantile) const {
  std::vector<float> all;
  for (std::size_t i = 0; i < sums.size(); ++i)
    if (sums[i].count >= static_cast<float>(size()) && (&sums != &screens_ || tiles_[i].seen))
      all.push_back(variance(sums[i]));
  if (all.empty()) return 0.0;
  const auto at =
      all.begin() + static_cast<std::ptrdiff_t>(quantile * static_cast<double>(all.size() - 1));
  std::nth_element(all.begin(), at, all.end());
  return std::sqrt(*at);
}

void LocalColours::assume_screen(const Vec3f& colour) {
  for (Tile& t : tiles_) t.screen = colour;
}

void LocalColours::assume_subject(const Vec3f& colour) {
  for (Tile& t : tiles_) t.subject = colour, t.has_subject = true, t.subject_spread = 0.0f;
}

std::optional<Vec3f> LocalColours::mean_subject() const {
  Sum all;
  for (const Sum& sum : subjects_) all.colour += sum.colour, all.weight += sum.weight;
  if (all.weight < static_cast<float>(size())) return std::nullopt;
  return all.colour / all.weight;
}

std::size_t LocalColours::solids_across() const {
  return static_cast<std::size_t>(across_ << shift_ >> solid_shift);
}

void LocalColours::find_solids() {
  solid_colours_.clear();
  solids_from_.clear();
  const int tile_solids = size() >> solid_shift;
  const Solid* solid = solids_.data();
  for (const int y : rows_)
    for (int column = 0; column < across_; ++column, solid += tile_solids) {
      solids_from_.push_back(solid_colours_.size());
      if (shown_[index(column, y >> shift_)] == 0) continue;  // screen alone
      for (int k = 0; k < tile_solids; ++k)
        if (solid[k].count > 1)
          solid_colours_.push_back(solid[k].sum / static_cast<float>(solid[k].count));
    }
  solids_from_.push_back(solid_colours_.size());
}

void LocalColours::solid_colours(int column, int row, std::vector<Vec3f>& out) const {
  const int begin = std::max(column - 1, 0), end = std::min(column + 2, across_);
  const auto at = [&](std::size_t i, int tile) {
    return solid_colours_.begin() +
           static_cast<std::ptrdiff_t>(solids_from_[i * static_cast<std::size_t>(across_) +
                                                    static_cast<std::size_t>(tile)]);
  };
  const auto first = std::lower_bound(rows_.begin(), rows_.end(), (row - 1) * size());
  for (auto i = static_cast<std::size_t>(first - rows_.begin());
       i < rows_.size() && rows_[i] < (row + 2) * size(); ++i)
    out.insert(out.end(), at(i, begin), at(i, end));
}

template <class Counts, class Mark>
void LocalColours::mark_beside(const Counts& counts, const Mark& mark) const {
  for (int row = 0; row < down_; ++row)
    for (int column = 0; column < across_; ++column) {
      if (!counts(index(column, row))) continue;
      for (int j = std::max(row - 1, 0); j <= std::min(row + 1, down_ - 1); ++j)
        for (int i = std::max(column - 1, 0); i <= std::min(column + 1, across_ - 1); ++i)
          mark(index(i, j));
    }
}

void LocalColours::finish_frame(const Colours& colours) {
  solids_.assign(rows_.size() * solids_across(), {});
  shown_.assign(tiles_.size(), 0);
  for (std::size_t row = 0; row < rows_.size(); ++row) sum_row(row, colours);
  find_solids();
  beside_subject_.assign(tiles_.size(), 0);
  mark_beside([&](std::size_t i) { return subjects_[i].weight > 0.0f; },
              [&](std::size_t i) { beside_subject_[i] = 1; });
  find_screens();
  find_subjects();
  for (Tile& t : tiles_) t.plain = true;
  mark_beside([&](std::size_t i) { return shown_[i] != 0; },
              [&](std::size_t i) { tiles_[i].plain = false; });
}

}  // namespace polyhull::silhouette
