// SPDX-License-Identifier: LGPL-2.1-or-later
// The tiles' colours from the samples of a frame.
#include <algorithm>
#include <array>
#include <cmath>

#include "silhouette/colours/local_colours.h"

namespace polyhull::silhouette {
namespace {

constexpr int tiles_beyond = 4;  // tiles beyond the subject that know its colours
// Of the screen's colour: by which it may be off the usual one, away from the subject and beside it.
constexpr float other_colour = 0.15f, other_colour_beside = 0.04f;

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

void LocalColours::find_screens() {
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
