// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/colours/local_colours.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace polyhull::silhouette {
namespace {

constexpr int inset = 6;  // px beside an edge that do not count: lens, chroma's interpolation
constexpr int tiles_beyond = 4;  // tiles beyond the subject that know its colours

// Of the screen's colour: by which it may be off the usual one, away from the subject and beside it.
constexpr float other_colour = 0.15f, other_colour_beside = 0.04f;
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

// Of a position in [-1, 1] x [-1, 1].
constexpr int terms = 6;
std::array<double, terms> powers(double u, double v) {
  return {1.0, u, v, u * u, u * v, v * v};
}

double place(int i, int count) {
  return (2.0 * i + 1.0) / count - 1.0;
}

// Solves the symmetric, positive definite system in place.
void solve(std::array<std::array<double, terms + 3>, terms>& rows) {
  for (int i = 0; i < terms; ++i) {
    for (int k = i + 1; k < terms; ++k) {
      const double factor = rows[k][i] / rows[i][i];
      for (int j = i; j < terms + 3; ++j) rows[k][j] -= factor * rows[i][j];
    }
  }
  for (int i = terms - 1; i >= 0; --i) {
    for (int j = terms; j < terms + 3; ++j) {
      for (int k = i + 1; k < terms; ++k) rows[i][j] -= rows[i][k] * rows[k][j];
      rows[i][j] /= rows[i][i];
    }
  }
}

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
    if (kind == subject) sum_solids(row, begin, end, colours);
    // Beside the row it goes on.
    const int from = begin == x0_ ? begin : begin + inset, to = end == x1_ ? end : end - inset;
    if (from >= to) continue;
    const std::uint8_t* const rgb = colours(y, from, to);
    if (kind == screen)
      sum_screen(row, from, to, rgb);
    else
      sum_subject(row, from, to, rgb);
  }
}

LocalColours::Row LocalColours::row_of(std::size_t row) const {
  const auto width = static_cast<std::size_t>(x1_ - x0_);
  const std::uint8_t* const kinds = kinds_.data() + row * width;
  return {signals_.data() + row * width, kinds, row > 0 ? kinds - width : kinds,
          row + 1 < rows_.size() ? kinds + width : kinds, rows_[row]};
}

void LocalColours::sum_solids(std::size_t row, int begin, int end, const Colours& colours) {
  const int from = begin + solid_inset, to = end - solid_inset;
  if (from >= to) return;
  const auto steepest = static_cast<int>(flat * screen_signal_ + 2.0 * noise_);
  const Row r = row_of(row);
  const std::uint8_t* rgb = colours(r.y, from, to);
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

void LocalColours::solid_colours(int column, int row, std::vector<Vec3f>& out) const {
  const auto across = static_cast<int>(solids_across());
  const int begin = std::max(column - 1, 0) * size() >> solid_shift;
  const int end = std::min((column + 2) * size() >> solid_shift, across);
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    if (std::abs((rows_[i] >> shift_) - row) > 1) continue;
    for (int k = begin; k < end; ++k)
      if (const Solid& solid = solids_[i * solids_across() + static_cast<std::size_t>(k)];
          solid.count > 1)
        out.push_back(solid.sum / static_cast<float>(solid.count));
  }
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
  find_screens();
  find_subjects();
  for (Tile& t : tiles_) t.plain = true;
  mark_beside([&](std::size_t i) { return shown_[i] != 0; },
              [&](std::size_t i) { tiles_[i].plain = false; });
}

void LocalColours::find_screens() {
  beside_subject_.assign(tiles_.size(), 0);
  mark_beside([&](std::size_t i) { return subjects_[i].weight > 0.0f; },
              [&](std::size_t i) { beside_subject_[i] = 1; });
  const float least = 0.5f * static_cast<float>(size());  // samples
  const double alike = 2.0 * noise_ + 0.02 * screen_signal_;
  bool any = false;
  before_ = tiles_;
  for (std::size_t i = 0; i < tiles_.size(); ++i) {
    const Sum& sum = screens_[i];
    if (sum.weight < least || variance(sum) > alike * alike) continue;
    tiles_[i].screen = sum.colour / sum.weight;
    tiles_[i].spread = 0.0f;
    tiles_[i].varies = false;
    tiles_[i].seen = any = true;
  }
  if (!any) return;
  has_screen_ = true;
  evaluate(fitted());
  // More or less light on the screen is of its colour; what is not shows something else, too.
  const auto of_its_colour = [&](const Vec3f& colour, std::size_t at) {
    const Vec3f usual = values_[at];
    const Vec3f other = colour - glm::dot(colour, usual) / glm::dot(usual, usual) * usual;
    const float share = beside_subject_[at] != 0 ? other_colour_beside : other_colour;
    return glm::length(other) <= share * glm::length(usual) + 1.0f;
  };
  bool again = false;
  for (std::size_t i = 0; i < tiles_.size(); ++i) {
    Tile& t = tiles_[i];
    const bool is_new = t.seen && screens_[i].weight > 0.0f;
    if (!is_new || of_its_colour(t.screen, i)) continue;
    t = before_[i];
    again = true;
  }
  if (again) {
    has_screen_ = std::any_of(tiles_.begin(), tiles_.end(), [](const Tile& t) { return t.seen; });
    if (!has_screen_) return;
    evaluate(fitted());
  }
  // Away from the subject: edges of shadows and folds, and light that falls off steeply, vary within a tile.
  const double steep = 0.008 * screen_signal_;
  for (std::size_t i = 0; i < tiles_.size(); ++i) {
    Tile& t = tiles_[i];
    const Sum& sum = screens_[i];
    if (sum.weight < least || beside_subject_[i] != 0) continue;
    if (t.seen && variance(sum) <= 2.5 * noise_ * noise_ + steep * steep) continue;
    if (!of_its_colour(sum.colour / sum.weight, i)) continue;
    t.screen = sum.colour / sum.weight;
    t.spread = beyond_noise(sum);
    t.varies |= !t.seen;
    t.seen = true;
  }
  // Beside the subject shadows cannot be told from dark hair: there the light varies as elsewhere.
  float squares = 0.0f, count = 0.0f;
  for (std::size_t i = 0; i < tiles_.size(); ++i)
    if (tiles_[i].seen && beside_subject_[i] == 0)
      squares += tiles_[i].spread * tiles_[i].spread, count += 1.0f;
  const float elsewhere = 2.0f * std::sqrt(squares / std::max(count, 1.0f));
  for (std::size_t i = 0; i < tiles_.size(); ++i)
    if (beside_subject_[i] != 0) tiles_[i].spread = elsewhere;
  spread_screens();
}

LocalColours::Polynomial LocalColours::fitted() const {
  std::array<std::array<double, terms + 3>, terms> rows{};
  int count = 0;
  for (int j = 0; j < down_; ++j)
    for (int i = 0; i < across_; ++i) {
      const Tile& t = tile(i, j);
      if (!t.seen || t.varies) continue;
      ++count;
      const auto p = powers(place(i, across_), place(j, down_));
      for (int k = 0; k < terms; ++k) {
        for (int l = 0; l < terms; ++l) rows[k][l] += p[k] * p[l];
        for (int c = 0; c < 3; ++c) rows[k][terms + c] += p[k] * t.screen[c];
      }
    }
  if (count == 0) return {};
  // Few tiles, or those of a corner, do not say how the rest bends.
  for (int k = 0; k < terms; ++k) rows[k][k] += k == 0 ? 1e-9 : k < 3 ? 0.01 * count : 0.03 * count;
  solve(rows);
  Polynomial out;
  for (int k = 0; k < terms; ++k)
    for (int c = 0; c < 3; ++c) out[k][c] = static_cast<float>(rows[k][terms + c]);
  return out;
}

void LocalColours::evaluate(const Polynomial& fit) {
  values_.resize(tiles_.size());
  for (int j = 0; j < down_; ++j)
    for (int i = 0; i < across_; ++i) {
      const auto p = powers(place(i, across_), place(j, down_));
      Vec3f out(0.0f);
      for (int k = 0; k < terms; ++k) out += static_cast<float>(p[k]) * fit[k];
      values_[index(i, j)] = glm::clamp(out, 1.0f, 255.0f);
    }
}

void LocalColours::spread_screens() {
  // What the tiles differ from it, in coarser and coarser cells.
  const auto cell = [&](std::size_t level, int i, int j) -> Sum& {
    const int across = ((across_ - 1) >> level) + 1;
    return levels_[level][static_cast<std::size_t>(j) * static_cast<std::size_t>(across) +
                          static_cast<std::size_t>(i)];
  };
  std::size_t count = 0;  // of levels
  do {
    const std::size_t across = static_cast<std::size_t>((across_ - 1) >> count) + 1;
    const std::size_t down = static_cast<std::size_t>((down_ - 1) >> count) + 1;
    if (levels_.size() == count) levels_.emplace_back();
    levels_[count].assign(across * down, {});
  } while (levels_[count++].size() > 1);
  for (int j = 0; j < down_; ++j)
    for (int i = 0; i < across_; ++i)
      if (const Tile& t = tile(i, j); t.seen)
        for (std::size_t level = 0; level < count; ++level) {
          Sum& sum = cell(level, i >> level, j >> level);
          sum.colour += t.screen - values_[index(i, j)], sum.weight += 1.0f;
        }
  for (int j = 0; j < down_; ++j)
    for (int i = 0; i < across_; ++i) {
      Tile& t = tiles_[index(i, j)];
      if (t.seen) continue;
      std::size_t level = 0;
      while (level + 1 < count && cell(level, i >> level, j >> level).weight == 0.0f) ++level;
      const Sum& around = cell(level, i >> level, j >> level);
      t.screen = values_[index(i, j)] + around.colour / std::max(around.weight, 1.0f);
    }
}

void LocalColours::find_subjects() {
  // 1, 2, 1 across and down, and what is enough of it.
  const auto at = [&](const std::vector<Sum>& sums, int i, int j) -> Sum {
    return i < 0 || j < 0 || i >= across_ || j >= down_ ? Sum{} : sums[index(i, j)];
  };
  const auto three = [](const Sum& a, const Sum& b, const Sum& c) -> Sum {
    const auto sum = [&](auto member) { return 0.5f * (a.*member + c.*member) + b.*member; };
    return {sum(&Sum::colour), sum(&Sum::weight), sum(&Sum::count), sum(&Sum::signal),
            sum(&Sum::square)};
  };
  // Only beside it there is any.
  smooth_.assign(tiles_.size(), {});
  const auto each = [&](const auto& function) {
    for (int j = 0; j < down_; ++j)
      for (int i = 0; i < across_; ++i)
        if (beside_subject_[index(i, j)] != 0) function(i, j);
  };
  each([&](int i, int j) {
    smooth_[index(i, j)] =
        three(at(subjects_, i - 1, j), at(subjects_, i, j), at(subjects_, i + 1, j));
  });
  for (Tile& t : tiles_) t.has_subject = false, t.subject_spread = 0.0f;
  const float least = 0.25f * static_cast<float>(size());
  known_.clear();
  each([&](int i, int j) {
    const Sum sum = three(at(smooth_, i, j - 1), at(smooth_, i, j), at(smooth_, i, j + 1));
    if (sum.weight < least) return;
    Tile& t = tiles_[index(i, j)];
    t.has_subject = true;
    t.subject = sum.colour / sum.weight;
    t.subject_spread = beyond_noise(sum);
    known_.push_back({i, j});
  });
  for (int round = 1; round < tiles_beyond; ++round) {
    beside_.assign(tiles_.size(), {});
    const std::size_t count = known_.size();
    for (std::size_t k = 0; k < count; ++k) {
      const auto [i, j] = known_[k];
      for (int l = std::max(j - 1, 0); l <= std::min(j + 1, down_ - 1); ++l)
        for (int m = std::max(i - 1, 0); m <= std::min(i + 1, across_ - 1); ++m) {
          if (tile(m, l).has_subject) continue;
          Sum& sum = beside_[index(m, l)];
          if (sum.weight == 0.0f) known_.push_back({m, l});
          sum.colour += tile(i, j).subject, sum.weight += 1.0f;
        }
    }
    for (std::size_t k = count; k < known_.size(); ++k) {
      const std::size_t at = index(known_[k].column, known_[k].row);
      tiles_[at].subject = beside_[at].colour / beside_[at].weight;
      tiles_[at].has_subject = true;
    }
  }
}

}  // namespace polyhull::silhouette
