// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/seen_mirrors.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace polyhull {
namespace {

/// Of how many mirrors on how many ways it is asked whether they show anybody.
constexpr std::size_t most_tried = 256;

int area(const Rectangle& r) {
  return r.empty() ? 0 : r.width * r.height;
}

/// Whether the frame of \p mirror, as \p eye (its image behind it) looks through it, may show any of
/// \p points: not where all of them lie beyond one of its edges.
bool frames(const Mirror& mirror, const Vec3& eye, std::span<const Vec3f> points) {
  Vec3 middle(0.0);
  for (const Vec3f& corner : mirror.outline) middle += Vec3(corner);
  middle /= static_cast<double>(mirror.outline.size());
  for (std::size_t i = 0; i < mirror.outline.size(); ++i) {
    const Vec3 a(mirror.outline[i]), b(mirror.outline[(i + 1) % mirror.outline.size()]);
    Vec3 inwards = glm::cross(a - eye, b - eye);
    if (glm::dot(inwards, middle - eye) < 0.0) inwards = -inwards;
    const double margin = 1e-6 * glm::length(inwards);
    const auto within = [&](const Vec3f& point) {
      const Vec3 way = Vec3(point) - eye;
      return glm::dot(inwards, way) >= -margin * glm::length(way);
    };
    if (std::none_of(points.begin(), points.end(), within)) return false;
  }
  return true;
}

/// The pixels, of those in which \p seen may be seen, that the subjects' image may touch.
Rectangle image_in(const MirrorSearch& search, const SeenMirror& seen) {
  const Mirror& mirror = mirror_of(search.scene, seen);
  const Mat4 clip = search.clip_from_scene * seen.turned;
  Rectangle images;
  for (const std::span<const Vec3f> points : search.subjects) {
    const bool in_front = std::any_of(points.begin(), points.end(), [&](const Vec3f& p) {
      return glm::dot(mirror.normal, p) > mirror.offset;
    });
    if (in_front)
      images = bounding(images, screen_rectangle(points, clip, search.width, search.height));
  }
  return intersection(images, seen.seen);
}

/// Mirror \p number as \p outer shows it, or as the eye sees it (null); none where it is not seen from
/// its front. SeenMirror::sight is 1 where it may show somebody, and not only a shadow.
std::optional<SeenMirror> see(const MirrorSearch& search, const SeenMirror* outer,
                              std::size_t number) {
  const Mirror& mirror = search.scene.mirrors[number];
  const Vec3 eye = outer ? outer->eye : search.eye;
  if (glm::dot(Vec3(mirror.normal), eye) <= mirror.offset) return std::nullopt;
  const Mat4 turned = outer ? outer->turned : Mat4(1.0);
  const Mat4 turn = reflection(Vec3(mirror.normal), mirror.offset);
  SeenMirror out;
  const std::vector<Vec3> outline(mirror.outline.begin(), mirror.outline.end());
  out.seen =
      screen_rectangle(outline, search.clip_from_scene * turned, search.width, search.height);
  if (outer) {
    out.way = outer->way;
    out.seen = intersection(out.seen, outer->seen);
  }
  if (out.seen.empty()) return std::nullopt;
  out.way.push_back(number);
  out.turned = turned * turn;
  out.eye = Vec3(turn * Vec4(eye, 1.0));
  out.rays = reflected(outer ? outer->rays : search.rays, mirror.normal);
  out.image = image_in(search, out);
  const bool framed =
      !out.image.empty() &&
      std::any_of(search.subjects.begin(), search.subjects.end(),
                  [&](std::span<const Vec3f> points) { return frames(mirror, out.eye, points); });
  out.sight = framed ? 1 : 0;
  return out;
}

/// The mirrors that are seen by way of MirrorSearch::depth at most, each after the one that shows it; of
/// very many those behind the fewest others.
std::vector<SeenMirror> all_seen(const MirrorSearch& search) {
  const std::size_t known = std::min(search.scene.mirrors.size(), most_known_mirrors);
  std::vector<SeenMirror> all;
  const auto look = [&](int within) {
    for (std::size_t i = 0; i < known && all.size() < most_tried; ++i) {
      const SeenMirror* outer = within < 0 ? nullptr : &all[static_cast<std::size_t>(within)];
      if ((outer && outer->way.back() == i) || (i < search.left_out.size() && search.left_out[i]))
        continue;
      std::optional<SeenMirror> seen = see(search, outer, i);
      if (!seen) continue;
      seen->within = within;
      all.push_back(std::move(*seen));
    }
  };
  look(-1);
  for (std::size_t k = 0; k < all.size(); ++k)
    if (static_cast<int>(all[k].way.size()) < search.depth) look(static_cast<int>(k));
  return all;
}

/// Which of \p all show somebody, in the largest parts of the picture, or the shadow alone, and which show
/// these.
std::vector<bool> chosen_of(const std::vector<SeenMirror>& all) {
  std::vector<std::size_t> largest;
  for (std::size_t k = 0; k < all.size(); ++k)
    if (!all[k].image.empty()) largest.push_back(k);
  std::stable_sort(largest.begin(), largest.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(all[a].sight, area(all[a].image)) >
           std::pair(all[b].sight, area(all[b].image));
  });
  std::vector<bool> chosen(all.size());
  std::size_t count = 0;
  for (const std::size_t k : largest) {
    std::vector<std::size_t> missing;
    for (int i = static_cast<int>(k); i >= 0 && !chosen[static_cast<std::size_t>(i)];
         i = all[static_cast<std::size_t>(i)].within)
      missing.push_back(static_cast<std::size_t>(i));
    if (count + missing.size() > most_mirrors) continue;
    count += missing.size();
    for (const std::size_t i : missing) chosen[i] = true;
  }
  return chosen;
}

}  // namespace

std::vector<SeenMirror> find_seen_mirrors(const MirrorSearch& search) {
  std::vector<SeenMirror> all = all_seen(search);
  const std::vector<bool> chosen = chosen_of(all);
  std::vector<SeenMirror> out;
  std::vector<int> place(all.size(), -1);
  std::size_t sights = 0;
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (!chosen[k]) continue;
    place[k] = static_cast<int>(out.size());
    SeenMirror& seen = out.emplace_back(std::move(all[k]));
    if (seen.within >= 0) seen.within = place[static_cast<std::size_t>(seen.within)];
    if (!search.skip)
      seen.image = {0, 0, search.width, search.height};
    else if (seen.sight == 0)
      seen.image = {};
    seen.sight = seen.image.empty() ? 0 : ++sights;
  }
  return out;
}

const Mirror& mirror_of(const Scene& scene, const SeenMirror& seen) {
  return scene.mirrors[seen.way.back()];
}

Vec4 kept_side(const Mirror& mirror) {
  return Vec4(Vec3(mirror.normal), -mirror.offset - 1e-4f);
}

std::vector<MirrorSurface> surfaces_of(const Scene& scene, const SeenMirror& seen) {
  std::vector<MirrorSurface> out;
  for (const std::size_t number : seen.way) {
    Vec3f normal = scene.mirrors[number].normal;
    for (std::size_t i = out.size(); i-- > 0;)
      normal = glm::reflect(normal, scene.mirrors[seen.way[i]].normal);
    out.push_back({normal, material_of(scene, scene.mirrors[number]).f0()});
  }
  return out;
}

bool only_mirrors(const Scene& scene, const SeenMirror& seen) {
  return std::all_of(seen.way.begin(), seen.way.end(), [&](std::size_t number) {
    return material_of(scene, scene.mirrors[number]).only_mirrors();
  });
}

}  // namespace polyhull
