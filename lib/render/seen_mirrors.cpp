// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/seen_mirrors.h"

#include <algorithm>
#include <optional>

namespace polyhull {
namespace {

int area(const Rectangle& r) {
  return r.empty() ? 0 : r.width * r.height;
}

const Material& material_of(const Scene& scene, std::size_t mirror) {
  const SceneMesh& mesh = scene.meshes[static_cast<std::size_t>(scene.mirrors[mirror].mesh)];
  return scene.materials[static_cast<std::size_t>(mesh.material)];
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
/// its front.
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
  return out;
}

/// Adds to \p all the mirrors that \p outer shows, or the eye sees (null), and whose part the subjects'
/// image overlaps, or that show such ones.
void add(const MirrorSearch& search, const SeenMirror* outer, std::vector<SeenMirror>& all) {
  const std::size_t known = std::min(search.scene.mirrors.size(), most_known_mirrors);
  for (std::size_t i = 0; i < known; ++i) {
    if (outer && outer->way.back() == i) continue;
    const std::optional<SeenMirror> seen = see(search, outer, i);
    if (!seen) continue;
    const std::size_t before = all.size();
    all.push_back(*seen);
    if (static_cast<int>(seen->way.size()) < search.depth) add(search, &*seen, all);
    if (seen->image.empty() && all.size() == before + 1) all.pop_back();
  }
}

/// Whether \p seen shows \p other.
bool shows(const SeenMirror& seen, const SeenMirror& other) {
  return other.way.size() == seen.way.size() + 1 &&
         std::equal(seen.way.begin(), seen.way.end(), other.way.begin());
}

/// Leaves of \p all the largest, with those that show them.
void limit(std::vector<SeenMirror>& all) {
  while (all.size() > most_mirrors) {
    auto least = all.end();
    for (auto it = all.begin(); it != all.end(); ++it) {
      const bool needed =
          std::any_of(all.begin(), all.end(), [&](const auto& other) { return shows(*it, other); });
      if (!needed && (least == all.end() || area(it->image) < area(least->image))) least = it;
    }
    all.erase(least);
  }
}

}  // namespace

std::vector<SeenMirror> find_seen_mirrors(const MirrorSearch& search) {
  std::vector<SeenMirror> all;
  add(search, nullptr, all);
  limit(all);
  std::size_t sights = 0;
  for (SeenMirror& seen : all) {
    const auto outer =
        std::find_if(all.begin(), all.end(), [&](const auto& other) { return shows(other, seen); });
    if (outer != all.end()) seen.within = static_cast<int>(outer - all.begin());
    const auto framed = [&](std::span<const Vec3f> points) {
      return frames(mirror_of(search.scene, seen), seen.eye, points);
    };
    if (!search.skip)
      seen.image = {0, 0, search.width, search.height};
    else if (std::none_of(search.subjects.begin(), search.subjects.end(), framed))
      seen.image = {};
    if (!seen.image.empty()) seen.sight = ++sights;
  }
  return all;
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
    out.push_back({normal, material_of(scene, number).f0()});
  }
  return out;
}

bool only_mirrors(const Scene& scene, const SeenMirror& seen) {
  return std::all_of(seen.way.begin(), seen.way.end(),
                     [&](std::size_t number) { return material_of(scene, number).only_mirrors(); });
}

}  // namespace polyhull
