// SPDX-License-Identifier: LGPL-2.1-or-later
#include "support/mask_trial.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "support/ring_checks.h"

namespace polyhull::test {
namespace {

class Bytes {
 public:
  explicit Bytes(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  bool empty() const { return bytes_.empty(); }
  int next() {
    if (bytes_.empty()) return 0;
    const int value = bytes_[0];
    bytes_ = bytes_.subspan(1);
    return value;
  }
  template <class T, std::size_t n>
  T of(const std::array<T, n>& choices) {
    return choices[static_cast<std::size_t>(next()) % n];
  }

 private:
  std::span<const std::uint8_t> bytes_;
};

void draw(MaskTrial& trial, Bytes& in) {
  const int w = trial.width, h = trial.height;
  const auto flip = [&](int x, int y) {
    if (x < 0 || y < 0 || x >= w || y >= h) return;
    std::uint8_t& level = trial.levels[static_cast<std::size_t>(y) * w + x];
    level = static_cast<std::uint8_t>(255 - level);
  };
  switch (in.next() % 5) {
    case 0:  // a bit per pixel
      for (std::size_t i = 0; i < trial.levels.size() && !in.empty(); i += 8) {
        const int bits = in.next();
        for (std::size_t k = 0; k < 8 && i + k < trial.levels.size(); ++k)
          trial.levels[i + k] = (bits >> k & 1) != 0 ? 255 : 0;
      }
      break;
    case 1:  // a level per pixel, the half level itself among them
      for (std::uint8_t& level : trial.levels) level = static_cast<std::uint8_t>(in.next());
      break;
    case 2:  // rectangles that exchange in and out
      while (!in.empty()) {
        const int x = in.next() % w, y = in.next() % h, size = in.next();
        for (int j = 0; j <= size / 16; ++j)
          for (int i = 0; i <= size % 16; ++i) flip(x + i, y + j);
      }
      break;
    case 3:  // ways of single steps, straight and across
      while (!in.empty()) {
        int x = in.next() % w, y = in.next() % h;
        const int turns = in.next();
        for (int k = 0; k < 16; ++k) {
          flip(x, y);
          const int direction = in.next() % 8;
          x += direction % 3 - 1;
          y += (direction + turns) % 3 - 1;
        }
      }
      break;
    default:  // soft disks, the larger alpha wins or is taken away
      while (!in.empty()) {
        const double cx = in.next() * w / 255.0, cy = in.next() * h / 255.0;
        const int size = in.next();
        const double radius = size % 64 / 3.0;
        for (int y = 0; y < h; ++y)
          for (int x = 0; x < w; ++x) {
            const double a = std::clamp(radius - std::hypot(x - cx, y - cy) + 0.5, 0.0, 1.0) * 255;
            std::uint8_t& level = trial.levels[static_cast<std::size_t>(y) * w + x];
            level = static_cast<std::uint8_t>(size < 160 ? std::max<double>(level, a)
                                                         : std::min<double>(level, 255 - a));
          }
      }
  }
}

std::string parents_fault(const Rings& rings, const std::vector<std::int32_t>& parents) {
  if (parents.size() != rings.size()) return "not every ring has a parent entry";
  for (std::size_t i = 0; i < rings.size(); ++i) {
    std::int32_t best = -1;
    const Vec2f p = rings.ring(i)[0];
    for (std::size_t j = 0; j < rings.size(); ++j)
      if (i != j && contains(rings.ring(j), p.x, p.y) &&
          (best < 0 || std::abs(ring_area(rings.ring(j))) <
                           std::abs(ring_area(rings.ring(static_cast<std::size_t>(best))))))
        best = static_cast<std::int32_t>(j);
    if (parents[i] != best)
      return "ring " + std::to_string(i) + " has parent " + std::to_string(parents[i]) +
             " instead of " + std::to_string(best);
  }
  return {};
}

// The area against a reference that does not trace.
std::string area_fault(const MaskTrial& trial, const Field& field, const Rings& rings) {
  AreaBounds want{};
  double allowed = 0.0;
  if (trial.trace.method == TraceMethod::subpixel) {
    // Vertices keep to multiples of 1/512 px and off the pixels' centres.
    want = marching_area(field);
    allowed = 1e-6 + 3e-3 * static_cast<double>(rings.points.size());
  } else {
    bool touches = false;
    const auto in = [&](int x, int y) { return field.row(y)[x] >= field_half; };
    for (int y = 0; y < field.height; ++y)
      for (int x = 0; x < field.width; ++x) {
        want.least += in(x, y);
        touches |= x > 0 && y > 0 && in(x, y) == in(x - 1, y - 1) && in(x - 1, y) == in(x, y - 1) &&
                   in(x, y) != in(x - 1, y);
      }
    want.most = want.least;
    // Where two pixels touch at a corner, rings keep 1/16 px to their own side of it.
    allowed = 1e-6 + (touches ? total_length(rings) / 8.0 : 0.0);
  }
  const double got = total_area(rings);
  if (want.excess(got) <= allowed) return {};
  return "area " + std::to_string(got) + " instead of " + std::to_string(want.least) + " to " +
         std::to_string(want.most);
}

}  // namespace

std::string MaskTrial::describe() const {
  char text[256];
  std::snprintf(text, sizeof text,
                "%dx%d, sigma %g, method %d, corrected for %g, tolerance %g, min edges %d, min "
                "area %g, min hole area %g, keep %d",
                width, height, blur.sigma, static_cast<int>(trace.method), trace.corrected_sigma,
                approximate.tolerance, approximate.min_edges, approximate.min_area,
                approximate.min_hole_area, approximate.keep_largest);
  return text;
}

MaskTrial mask_from_bytes(std::span<const std::uint8_t> bytes) {
  Bytes in(bytes);
  MaskTrial trial;
  trial.width = 1 + in.next() % 48;
  trial.height = 1 + in.next() % 40;
  trial.blur.sigma = in.of(std::array{0.0, 0.0, 0.0, 0.4, 0.8, 1.3, 2.0, 5.0});
  trial.blur.method = in.of(std::array{BlurMethod::fir, BlurMethod::fir, BlurMethod::fir,
                                       BlurMethod::box, BlurMethod::recursive});
  trial.blur.threshold = in.of(std::array{0, 0, 0, 100});
  trial.trace.method =
      in.of(std::array{TraceMethod::subpixel, TraceMethod::subpixel, TraceMethod::binary});
  if (in.next() % 2 != 0 && trial.blur.threshold == 0)
    trial.trace.corrected_sigma = trial.blur.sigma;
  trial.approximate.tolerance = in.of(std::array{0.0, 0.1, 0.5, 1.0, 2.0, 4.0, 15.0, 100.0});
  trial.approximate.min_edges = in.of(std::array{3, 3, 4, 7});
  trial.approximate.min_area = in.of(std::array{0.0, 0.0, 3.0, 16.0});
  trial.approximate.min_hole_area = in.of(std::array{0.0, 0.0, 5.0});
  trial.approximate.keep_largest = in.of(std::array{0, 0, 0, 2});
  trial.levels.assign(static_cast<std::size_t>(trial.width) * trial.height, 0);
  draw(trial, in);
  return trial;
}

std::string fault_of(const MaskTrial& trial) {
  Matte matte;
  load_matte(trial.levels.data(), trial.width, 1, trial.width, trial.height, matte);
  Blur blur;
  blur.set(trial.blur);
  Field field;
  blur.apply(matte, field);
  Tracer tracer;
  Rings traced;
  std::vector<std::int32_t> parents;
  tracer.trace(field, trial.trace, traced, &parents);
  const auto named = [](const char* what, const std::string& fault) {
    return fault.empty() ? fault : std::string(what) + ": " + fault;
  };
  if (std::string f = named("traced", meeting_edges(traced)); !f.empty()) return f;
  if (std::string f = named("traced", nesting_fault(traced)); !f.empty()) return f;
  if (std::string f = named("traced", parents_fault(traced, parents)); !f.empty()) return f;
  if (trial.trace.corrected_sigma == 0.0) {
    if (std::string f = named("traced", misplaced_pixel(traced, field)); !f.empty()) return f;
    if (std::string f = named("traced", area_fault(trial, field, traced)); !f.empty()) return f;
  }

  Approximator approximator;
  Rings polygons, again;
  approximator.approximate(traced, parents, trial.approximate, polygons);
  if (std::string f = named("polygons", meeting_edges(polygons)); !f.empty()) return f;
  if (std::string f = named("polygons", nesting_fault(polygons)); !f.empty()) return f;
  const double allowed = trial.approximate.tolerance + 1e-6;
  const double there = polygons.empty() ? 0.0 : one_sided_distance(polygons, traced, 0.37);
  if (there > allowed) return "polygons: " + std::to_string(there) + " px from what was traced";
  if (polygons.size() == traced.size() && !traced.empty()) {
    const double back = one_sided_distance(traced, polygons, 0.37);
    if (back > allowed) return "traced: " + std::to_string(back) + " px from the polygons";
  }
  approximator.approximate(traced, {}, trial.approximate, again);
  if (!(again == polygons)) return "polygons: not the same a second time, parents not given";
  return {};
}

}  // namespace polyhull::test
