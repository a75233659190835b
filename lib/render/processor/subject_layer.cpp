// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/processor/subject_layer.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <type_traits>
#include <utility>

namespace polyhull::processor {
namespace {

constexpr float infinite = std::numeric_limits<float>::infinity();
/// Of each set of a pixel's samples: how many they are, and their middle.
struct SampleSets {
  std::uint8_t count[256];
  float x[256], y[256];
  explicit SampleSets(int samples) {
    const float(*places)[2] = sample_places(samples);
    for (unsigned set = 0; set < 1u << samples; ++set) {
      float all_x = 0.0f, all_y = 0.0f;
      int all = 0;
      for (int s = 0; s < samples; ++s) {
        if (!(set >> s & 1)) continue;
        all_x += places[s][0];
        all_y += places[s][1];
        ++all;
      }
      count[set] = static_cast<std::uint8_t>(all);
      x[set] = all_x / static_cast<float>(all);
      y[set] = all_y / static_cast<float>(all);
    }
  }
};

/// The triangles that a pixel shows, in the order of their first samples, and which samples each has.
template <int samples>
struct ShownTriangles {
  int count = 0;
  unsigned all = 0;
  unsigned set[samples];
  std::uint32_t number[samples];

  explicit ShownTriangles(const std::uint32_t* ids) {
    for (int s = 0; s < samples; ++s) {
      if (all >> s & 1 || ids[s] == no_triangle) continue;
      set[count] = 0;
      for (int other = s; other < samples; ++other)
        set[count] |= static_cast<unsigned>(ids[s] == ids[other]) << other;
      all |= set[count];
      number[count++] = ids[s];
    }
  }
};

/// Calls \p act with how many samples a pixel has as a constant.
template <class Act>
void with_samples(int samples, Act&& act) {
  switch (samples) {
    case 8:
      return act(std::integral_constant<int, 8>());
    case 4:
      return act(std::integral_constant<int, 4>());
    case 2:
      return act(std::integral_constant<int, 2>());
    default:
      return act(std::integral_constant<int, 1>());
  }
}

}  // namespace

void SubjectLayer::Drawn::add(const std::vector<ReadySubject>& subjects, std::size_t subject,
                              const SubjectEye& eye, std::size_t first, std::size_t last,
                              Facing facing) {
  const Mat4& to_scene = subjects[subject].local_to_scene;
  const Mat4 from_local = eye.pixels_from_scene * to_scene;
  const Vec4 plane = eye.kept ? *eye.kept * to_scene : Vec4(0, 0, 0, 1);
  const Skin& skin = subjects[subject].skin;
  for (std::size_t v = first; v < last; v += 3) {
    std::array<Corner, 3> points;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec4 point(Vec3(skin.vertex(v + k).position), 1.0);
      points[k] = {Vec3(from_local * point), glm::dot(plane, point)};
    }
    triangles.add(points, static_cast<std::uint32_t>(origins.size()), facing);
    origins.push_back(
        {static_cast<std::uint32_t>(subject), static_cast<std::uint32_t>(v), skin.wide(v)});
    wide = wide || origins.back().wide;
    corners.resize(triangles.pieces(), reinterpret_cast<const SkinCorner*>(&skin.vertex(v)));
  }
}

void SubjectLayer::Drawn::clear(int width, int height) {
  triangles.begin(width, height);
  origins.clear();
  corners.clear();
  wide = false;
}

bool SubjectLayer::Drawn::joined(const std::vector<ReadySubject>& subjects, std::uint32_t a,
                                 std::uint32_t b) const {
  const Origin &own = origin(a), &other = origin(b);
  return own.subject == other.subject && subjects[own.subject].skin.joined(own.first, other.first);
}

Vec3f SubjectLayer::Drawn::form_at(const Skin& skin, const SkinSpot& spot) const {
  const ScreenTriangle& triangle = triangles.piece(spot.triangle);
  const auto at = [&](const ScreenPlane& plane) {
    return plane.value + spot.x * plane.dx + spot.y * plane.dy;
  };
  // As Loops::place() finds them.
  const double depth = 1.0 / at(triangle.inverse);
  double second = std::clamp(at(triangle.second) * depth, 0.0, 1.0);
  double third = std::clamp(at(triangle.third) * depth, 0.0, 1.0);
  const double over = std::max(second + third, 1.0);
  second /= over;
  third /= over;
  const std::size_t first = origins[triangle.id].first;
  return static_cast<float>(1.0 - second - third) * skin.form(first) +
         static_cast<float>(second) * skin.form(first + 1) +
         static_cast<float>(third) * skin.form(first + 2);
}

void SubjectLayer::Drawn::add_items(const ReadySubject& subject, const std::vector<SkinSpot>& spots,
                                    SkinItems& items) const {
  if (spots.empty()) return;
  const std::size_t before = items.size();
  items.resize(before + spots.size());
  Loops::best().place(spots.data(), static_cast<int>(spots.size()), &triangles.piece(0),
                      corners.data(), static_cast<float>(subject.scale), &items[before].place.x);
  const bool relit = subject.skin.relit();
  if (!wide) {
    for (std::size_t i = 0; relit && i < spots.size(); ++i)
      items.form.push_back(form_at(subject.skin, spots[i]));
    return;
  }
  // Points of wide triangles have the shares of their corners instead of views' weights.
  const std::vector<SkinItem> points(items.begin() + static_cast<std::ptrdiff_t>(before),
                                     items.end());
  items.resize(before);
  for (std::size_t i = 0; i < points.size(); ++i) {
    // Of all items that a point takes, the first's counts.
    if (relit) items.form.resize(items.size(), Vec3f(1.0f));
    if (relit) items.form.push_back(form_at(subject.skin, spots[i]));
    const Origin& from = origin(spots[i].triangle);
    if (!from.wide) {
      items.push_back(points[i]);
      continue;
    }
    const std::array<float, 4>& shares = points[i].weights;
    const auto list = subject.skin.list(subject.skin.vertex(from.first));
    for (std::size_t begin = 0; begin < list.size(); begin += 4) {
      SkinItem& item = items.emplace_back(points[i]);
      item.slots = 0;
      for (std::size_t k = 0; k < 4; ++k) {
        item.weights[k] = 0.0f;
        if (begin + k >= list.size()) continue;
        const auto& [a, b, c, slot] = list[begin + k];
        item.weights[k] = (shares[0] * a + shares[1] * b + shares[2] * c) * (1.0f / 65535.0f);
        item.slots |= static_cast<std::uint32_t>(slot) << (8 * k);
      }
      item.parts = begin == 0 ? static_cast<std::uint32_t>((list.size() + 3) / 4) : 0;
    }
  }
  if (relit) items.form.resize(items.size(), Vec3f(1.0f));
}

void SubjectLayer::fill(const std::vector<ReadySubject>& subjects, const SubjectEye& eye, int width,
                        int height) {
  for (Drawn* drawn : {&hulls_, &ribbons_}) drawn->clear(width, height);
  images_.fill(subjects, eye, width, height);
  for (std::size_t s = 0; s < subjects.size(); ++s) {
    const Skin& skin = subjects[s].skin;
    hulls_.add(subjects, s, eye, skin.first_vertex(eye.number), skin.last_vertex(eye.number),
               eye.facing);
    if (eye.number == 0)
      ribbons_.add(subjects, s, eye, skin.first_of_ribbon(), skin.last_of_ribbon(), Facing::both);
  }
}

/// Begins with the scene's depths in \p part, so that only what is nearer is drawn, and beside the mirror
/// with what nothing is nearer than.
void SubjectLayer::hide(const Rectangle& part, const SceneLayer& scene, const Aperture* mirror,
                        const SampleRows& rows) {
  with_samples(rows.samples, [&](auto samples) {
    for (int y = part.y; y < part.y + part.height; ++y) {
      const float* from[samples];
      for (int s = 0; s < samples; ++s) from[s] = scene.inverse(s, part.x, y);
      float* const to = rows.inverse + sample_index(rows, part.x, y, 0);
      for (int x = 0; x < part.width; ++x)
        for (int s = 0; s < samples; ++s) to[x * samples + s] = from[s][x];
      for (const Aperture* outer = mirror; outer != nullptr; outer = outer->within) {
        for (int s = 0; s < samples; ++s) {
          const std::uint8_t* seen = outer->layer.mirror(s, part.x, y);
          for (int x = 0; x < part.width; ++x)
            if (seen[x] != outer->mirror) to[x * samples + s] = infinite;
        }
      }
    }
  });
}

/// Of what is nearer than the scene, all samples of a pixel alike.
void SubjectLayer::hide(const Rectangle& part, const LayerView& view, const DepthPicture& depth,
                        const SampleRows& rows) {
  for (int y = part.y; y < part.y + part.height; ++y) {
    float* scene = rows.inverse + sample_index(rows, part.x, y, 0);
    for (int x = part.x; x < part.x + part.width; ++x) {
      const float found = depth.at(x, y, view.width, view.height);
      for (int s = 0; s < rows.samples; ++s, ++scene)
        if (found * (1.0f - depth_picture_ahead) > *scene) *scene = found;
    }
  }
}

/// Each triangle in a pixel is coloured once, in the middle of its samples; one that has more than half of
/// them also for those with which it has a corner in common.
void SubjectLayer::find_items(const std::vector<ReadySubject>& subjects, const SampleRows& rows,
                              const Drawn& drawn, const std::uint32_t* ids,
                              Scratch& scratch) const {
  scratch.spots.resize(subjects.size());
  for (std::vector<SkinSpot>& spots : scratch.spots) spots.clear();
  with_samples(rows.samples, [&](auto samples) {
    static const SampleSets sets(samples);
    constexpr unsigned all = (1u << samples) - 1;
    std::uint32_t pixel = 0;
    for (int row = rows.top; row < rows.bottom; ++row) {
      for (int column = rows.left; column < rows.right; ++column, ++pixel, ids += samples) {
        const auto add = [&](std::uint32_t number, unsigned set) {
          scratch.spots[drawn.origin(number).subject].push_back(
              {column + static_cast<double>(sets.x[set]), row + static_cast<double>(sets.y[set]),
               number, pixel, static_cast<float>(sets.count[set]) / samples});
        };
        std::uint32_t together = ids[0], others = 0;
        for (int s = 1; s < samples; ++s) together &= ids[s], others |= ids[s] ^ ids[0];
        if (together == no_triangle) continue;
        if (others == 0) {
          add(ids[0], all);
          continue;
        }
        const ShownTriangles<samples> shown(ids);
        unsigned open = shown.all;  // samples that are still to be coloured
        while (open != 0) {
          int leading = -1, first = -1;
          for (int i = shown.count - 1; i >= 0; --i) {
            if ((shown.set[i] & open) == 0) continue;
            first = i;
            if (2 * sets.count[shown.set[i]] > sets.count[open]) leading = i;
          }
          const int chosen = leading >= 0 ? leading : first;
          const std::uint32_t number = shown.number[chosen];
          unsigned set = shown.set[chosen];
          for (int i = first; leading >= 0 && i < shown.count; ++i)
            if (i != leading && (shown.set[i] & open) != 0 &&
                drawn.joined(subjects, number, shown.number[i]))
              set |= shown.set[i];
          add(number, set);
          open &= ~set;
        }
      }
    }
  });
  for (std::size_t i = 0; i < subjects.size(); ++i)
    drawn.add_items(subjects[i], scratch.spots[i], scratch.items[i]);
}

/// Draws the nearest ribbon of each sample where no hull is.
void SubjectLayer::draw_ribbons(int band, const SampleRows& rows, Scratch& scratch) const {
  scratch.ribbon_ids.assign(scratch.ids.size(), no_triangle);
  SampleRows own = rows;
  own.id = scratch.ribbon_ids.data();
  ribbons_.triangles.draw(band, own);
  for (std::size_t i = 0; i < scratch.ids.size(); ++i)
    if (scratch.ids[i] != no_triangle) scratch.ribbon_ids[i] = no_triangle;
}

/// What of band \p band and \p part triangles touch, with the columns beside that are drawn together.
Rectangle SubjectLayer::painted(int band, const Rectangle& part) const {
  Rectangle rows;
  if (part.empty()) return rows;  // there may be no bands
  for (const Drawn* drawn : {&hulls_, &ribbons_}) {
    const ScreenTriangles::Columns columns = drawn->triangles.columns(band);
    if (!columns.empty())
      rows =
          bounding(rows, {columns.first, band * band_rows, columns.end - columns.first, band_rows});
  }
  rows = intersection(bounding(rows, images_.painted(band)), part);
  const int right = (rows.x + rows.width + packed_samples - 1) & -packed_samples;
  rows.x &= -packed_samples;
  if (!rows.empty()) rows.width = right - rows.x;
  return rows;
}

Rectangle SubjectLayer::paint(const std::vector<ReadySubject>& subjects, int band,
                              const Rectangle& part, const SceneLayer& scene,
                              const Aperture* mirror, bool drawn, const DepthPicture* depth,
                              Scratch& scratch, std::vector<glm::vec4>& into) const {
  const Rectangle rows = painted(band, part);
  if (rows.empty()) return rows;
  const auto pixels = static_cast<std::size_t>(rows.width) * static_cast<std::size_t>(rows.height);
  const int samples = scene.view().samples;
  into.assign(pixels, glm::vec4(0.0f));
  scratch.inverse.resize(static_cast<std::size_t>(samples) * pixels);
  scratch.ids.assign(static_cast<std::size_t>(samples) * pixels, no_triangle);
  const SampleRows sample_rows{rows.x,
                               rows.x + rows.width,
                               rows.y,
                               rows.y + rows.height,
                               samples,
                               sample_places(samples),
                               scratch.inverse.data(),
                               scratch.ids.data(),
                               true};
  const Rectangle own = intersection(rows, part);
  for (int y = own.y; y < own.y + own.height; ++y) {
    // Nothing is drawn beside the part.
    float* const row = sample_rows.inverse + sample_index(sample_rows, rows.x, y, 0);
    const int before = samples * (own.x - rows.x), inside = samples * own.width;
    std::fill_n(row, before, infinite);
    if (!drawn) std::fill_n(row + before, inside, 0.0f);
    std::fill(row + before + inside, row + samples * rows.width, infinite);
  }
  if (drawn) hide(own, scene, mirror, sample_rows);
  if (depth != nullptr) hide(own, scene.view(), *depth, sample_rows);
  hulls_.triangles.draw(band, sample_rows);
  scratch.items.resize(subjects.size());
  for (SkinItems& items : scratch.items) items.forget();
  images_.draw(subjects, sample_rows, scratch.images);
  find_items(subjects, sample_rows, hulls_, scratch.ids.data(), scratch);
  images_.find_items(subjects, sample_rows, scratch.images, scratch.items);
  for (SkinItems& items : scratch.items) items.first_of_ribbon = items.size();
  if (ribbons_.triangles.pieces() > 0) {
    draw_ribbons(band, sample_rows, scratch);
    find_items(subjects, sample_rows, ribbons_, scratch.ribbon_ids.data(), scratch);
  }
  for (std::size_t s = 0; s < subjects.size(); ++s)
    subjects[s].skin.paint(scratch.items[s], subjects[s].light, scratch.skin, into.data());
  return rows;
}

}  // namespace polyhull::processor
