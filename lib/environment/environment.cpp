// SPDX-License-Identifier: LGPL-2.1-or-later
#include "environment/environment.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/content_hash.h"
#include "base/error.h"
#include "base/srgb.h"
#include "base/thread_pool.h"

namespace polyhull {
namespace {

constexpr double pi = std::numbers::pi;
constexpr int most_rows_seen = 2048;                 // some 130 MB with all levels
constexpr int least_rows = 64, most_rows_lit = 512;  // of what lights
constexpr int last_rows = 8;                         // of the last level
constexpr int normals = 65;                          // of the irradiance, on each side
constexpr float brightest = 1e9f;

/// How much of the sphere lies between two heights of a picture, 0 to 1 from its top, over 2 pi.
double band(double from, double to) {
  return std::cos(pi * from) - std::cos(pi * to);
}

/// \p from with \p rows rows and twice as many columns, each pixel the mean over the solid angle that it is of.
RadiancePicture resized_picture(const RadiancePicture& from, int rows) {
  RadiancePicture out{2 * rows, rows, {}};
  const auto width = static_cast<std::size_t>(out.width);
  out.pixels.resize(width * static_cast<std::size_t>(rows));
  const double step = static_cast<double>(from.height) / rows;  // the same across
  parallel_for(static_cast<std::size_t>(rows), 16, 0, [&](std::size_t begin, std::size_t end) {
    std::vector<Vec3> columns(static_cast<std::size_t>(from.width));
    for (std::size_t y = begin; y < end; ++y) {
      const double top = static_cast<double>(y) * step, bottom = top + step;
      const double whole = band(top / from.height, bottom / from.height);
      std::fill(columns.begin(), columns.end(), Vec3(0.0));
      for (int j = static_cast<int>(top); j < from.height && j < bottom; ++j) {
        const double part = band(std::max<double>(top, j) / from.height,
                                 std::min<double>(bottom, j + 1) / from.height) /
                            whole;
        for (std::size_t i = 0; i < columns.size(); ++i)
          columns[i] += part * Vec3(from.pixels[static_cast<std::size_t>(j) * columns.size() + i]);
      }
      for (std::size_t x = 0; x < width; ++x) {
        const double left = static_cast<double>(x) * step, right = left + step;
        Vec3 sum(0.0);
        for (int i = static_cast<int>(left); i < from.width && i < right; ++i)
          sum += (std::min<double>(right, i + 1) - std::max<double>(left, i)) / step *
                 columns[static_cast<std::size_t>(i)];
        out.pixels[y * width + x] = Vec3f(sum);
      }
    }
  });
  return out;
}

void check_radiance(const RadiancePicture& picture, const std::string& name) {
  if (picture.width != 2 * picture.height || picture.height < 1)
    throw Error(Error::Kind::bad_input,
                "The environment picture '{}' has {}x{} pixels; one of all directions "
                "(equirectangular) is twice as "
                "wide as high. Give it as such, neither cropped nor as a cube or a ball.",
                name, picture.width, picture.height);
  const auto wrong = std::find_if(picture.pixels.begin(), picture.pixels.end(), [](const Vec3f& v) {
    return !(v.x >= 0.0f && v.y >= 0.0f && v.z >= 0.0f && v.x <= brightest && v.y <= brightest &&
             v.z <= brightest);
  });
  if (wrong == picture.pixels.end()) return;
  const std::ptrdiff_t at = wrong - picture.pixels.begin();
  throw Error(Error::Kind::bad_input,
              "The environment picture '{}' has the colour ({:g}, {:g}, {:g}) in column {}, row "
              "{}; radiances from "
              "0 to {:g} were expected. Mend the pixel.",
              name, wrong->x, wrong->y, wrong->z, at % picture.width, at / picture.width,
              brightest);
}

/// The sums of \p weights up to each, over the sum of all, which it returns; all 0 where there is none.
double sum_up(std::vector<double>& weights) {
  double sum = 0.0;
  for (double& weight : weights) sum = weight += sum;
  if (sum > 0.0)
    for (double& weight : weights) weight /= sum;
  return sum;
}

/// Which of \p sums, the last of which is 1, a number in [0, 1) falls into, where within it, and how likely that is.
struct Choice {
  std::size_t index;
  float within, likelihood;
};
Choice choose(const float* sums, std::size_t count, float number) {
  const auto index = static_cast<std::size_t>(std::upper_bound(sums, sums + count, number) - sums);
  const float before = index > 0 ? sums[index - 1] : 0.0f, likelihood = sums[index] - before;
  return {index, std::min((number - before) / likelihood, 1.0f), likelihood};
}

/// A unit vector from the place of the unit square that the octahedral map gives it (Cigolle et al., "A Survey of
/// Efficient Representations for Independent Unit Vectors", JCGT 3(2), 2014), and the reverse.
Vec3f from_octahedron(const Vec2f& place) {
  const Vec2f p = 2.0f * place - 1.0f;
  Vec3f v(p.x, 1.0f - std::abs(p.x) - std::abs(p.y), p.y);
  if (v.y < 0.0f) {
    v.x = std::copysign(1.0f - std::abs(p.y), p.x);
    v.z = std::copysign(1.0f - std::abs(p.x), p.y);
  }
  return glm::normalize(v);
}
Vec2f to_octahedron(const Vec3f& v) {
  Vec2f p = Vec2f(v.x, v.z) / (std::abs(v.x) + std::abs(v.y) + std::abs(v.z));
  if (v.y < 0.0f)
    p = {std::copysign(1.0f - std::abs(p.y), p.x), std::copysign(1.0f - std::abs(p.x), p.y)};
  return 0.5f * p + 0.5f;
}

}  // namespace

Vec3 Environment::Cell::moment() const {
  const Vec3& weights = luminance_weights<double>;
  return weights.x * moments[0] + weights.y * moments[1] + weights.z * moments[2];
}

void Environment::Cell::add(const Cell& other) {
  for (std::size_t k = 0; k < moments.size(); ++k) moments[k] += other.moments[k];
  luminous += other.luminous;
}

Environment::Environment(const RadiancePicture& picture, double degrees, const std::string& name)
    : turn_(static_cast<float>(degrees / 360.0 - std::floor(degrees / 360.0))) {
  check_radiance(picture, name);
  ContentHash hash;
  hash.add(picture.width);
  hash.add(picture.pixels);
  hash.add(turn_);
  content_ = hash.value();
  levels_.push_back(picture.height <= most_rows_seen ? picture
                                                     : resized_picture(picture, most_rows_seen));
  while (levels_.back().height >= 2 * last_rows)
    levels_.push_back(resized_picture(levels_.back(), levels_.back().height / 2));
  const RadiancePicture& seen = levels_.front();
  lighting_ = seen.height >= least_rows && seen.height <= most_rows_lit
                  ? seen
                  : resized_picture(seen, std::clamp(seen.height, least_rows, most_rows_lit));
  make_distribution();
  make_cells();
  make_irradiance();
}

/// \p u from the picture's left, \p cosine of the angle to the y axis.
Vec3f Environment::direction(double u, double cosine) const {
  const double angle = 2.0 * pi * (u - 0.5 - turn_);
  const double flat = std::sqrt(std::max(1.0 - cosine * cosine, 0.0));
  return Vec3f(Vec3(flat * std::cos(angle), cosine, flat * std::sin(angle)));
}

Vec3f Environment::at(const RadiancePicture& level, const Vec3f& direction) const {
  const float length = glm::length(direction);
  if (!(length > 0.0f)) return Vec3f(0.0f);
  constexpr float half_turn = std::numbers::pi_v<float>;
  const float u = std::atan2(direction.z, direction.x) / (2.0f * half_turn) + 0.5f + turn_;
  const float v = std::acos(std::clamp(direction.y / length, -1.0f, 1.0f)) / half_turn;
  const float x = u * static_cast<float>(level.width) - 0.5f,
              y = v * static_cast<float>(level.height) - 0.5f;
  const float left = std::floor(x), top = std::floor(y);
  const auto pixel = [&](float column, float row) {
    const int i = static_cast<int>(column),
              j = std::clamp(static_cast<int>(row), 0, level.height - 1);
    return level.pixels[static_cast<std::size_t>(j) * static_cast<std::size_t>(level.width) +
                        static_cast<std::size_t>((i + level.width) % level.width)];
  };
  return glm::mix(glm::mix(pixel(left, top), pixel(left + 1.0f, top), x - left),
                  glm::mix(pixel(left, top + 1.0f), pixel(left + 1.0f, top + 1.0f), x - left),
                  y - top);
}

Vec3f Environment::radiance(const Vec3f& direction, float solid_angle) const {
  // Bilinear look-ups reach over two pixels.
  const auto fits = [&](const RadiancePicture& level) {
    return static_cast<float>(level.pixels.size()) * solid_angle <=
           8.0f * std::numbers::pi_v<float>;
  };
  const auto level = std::find_if(levels_.begin(), levels_.end() - 1, fits);
  return at(*level, direction);
}

void Environment::make_distribution() {
  const auto width = static_cast<std::size_t>(lighting_.width),
             height = static_cast<std::size_t>(lighting_.height);
  std::vector<double> rows(height), row(width);
  columns_.resize(width * height);
  for (std::size_t y = 0; y < height; ++y) {
    for (std::size_t x = 0; x < width; ++x)
      row[x] = glm::dot(luminance_weights<double>, Vec3(lighting_.pixels[y * width + x]));
    rows[y] = sum_up(row) * band(static_cast<double>(y) / lighting_.height,
                                 static_cast<double>(y + 1) / lighting_.height);
    std::copy(row.begin(), row.end(), columns_.begin() + static_cast<std::ptrdiff_t>(y * width));
  }
  sum_up(rows);
  rows_.assign(rows.begin(), rows.end());
}

EnvironmentSample Environment::sample(const Vec2f& square) const {
  EnvironmentSample out;
  if (!(rows_.back() > 0.0f)) return out;
  const auto width = static_cast<std::size_t>(lighting_.width);
  const Choice row = choose(rows_.data(), rows_.size(), square.y);
  const Choice column = choose(columns_.data() + row.index * width, width, square.x);
  const double top = static_cast<double>(row.index) / lighting_.height;
  const double height = band(top, static_cast<double>(row.index + 1) / lighting_.height);
  out.direction = direction((static_cast<double>(column.index) + column.within) / lighting_.width,
                            std::cos(pi * top) - height * row.within);
  out.radiance = lighting_.pixels[row.index * width + column.index];
  out.density = static_cast<float>(static_cast<double>(row.likelihood) * column.likelihood *
                                   lighting_.width / (2.0 * pi * height));
  return out;
}

void Environment::make_irradiance() {
  irradiance_.resize(static_cast<std::size_t>(normals) * normals);
  std::vector<std::array<Vec3f, 3>> moments;
  for (const std::vector<Cell>& layer : cells_)
    for (const Cell& cell : layer)
      if (cell.luminous > 0.0)
        moments.push_back({Vec3f(cell.moments[0]), Vec3f(cell.moments[1]), Vec3f(cell.moments[2])});
  parallel_each(irradiance_.size(), 64, 0, [&](std::size_t i) {
    const Vec3f normal =
        from_octahedron(Vec2f(i % normals, i / normals) / static_cast<float>(normals - 1));
    Vec3f sum(0.0f);
    for (const std::array<Vec3f, 3>& moment : moments)
      for (int k = 0; k < 3; ++k)
        sum[k] += std::max(glm::dot(normal, moment[static_cast<std::size_t>(k)]), 0.0f);
    irradiance_[i] = sum;
  });
}

Vec3f Environment::irradiance(const Vec3f& normal) const {
  const Vec2f at = to_octahedron(normal) * static_cast<float>(normals - 1);
  const int x = std::clamp(static_cast<int>(at.x), 0, normals - 2),
            y = std::clamp(static_cast<int>(at.y), 0, normals - 2);
  const Vec2f within = at - Vec2f(x, y);
  const Vec3f* first = &irradiance_[static_cast<std::size_t>(y * normals + x)];
  return glm::mix(glm::mix(first[0], first[1], within.x),
                  glm::mix(first[normals], first[normals + 1], within.x), within.y);
}

std::shared_ptr<const Environment> load_environment(const std::string& path, double degrees) {
  return std::make_shared<const Environment>(load_radiance(path), degrees, path);
}

}  // namespace polyhull
