// SPDX-License-Identifier: LGPL-2.1-or-later
#include "support/scenes.h"

#include <algorithm>
#include <cmath>

#include "support/figure.h"

namespace polyhull::test {
namespace {

float snapped(double pixel) {
  return static_cast<float>(std::round(pixel * 16.0) / 16.0);
}

Vec2 image_of_origin(const Camera& camera) {
  const Vec3 h = camera.K * camera.t;
  return h.z > 1e-9 ? Vec2(h) / h.z : Vec2(camera.width / 2, camera.height / 2);
}

/// Puts the centres of \p rig's cameras into one of the special positions.
void arrange(Dice& dice, std::vector<Vec3>& centres) {
  const Vec3 axis = dice.direction();
  const std::size_t n = centres.size();
  switch (dice.whole(0, 5)) {
    case 0:  // two at the same place
      centres[n - 1] = centres[0];
      break;
    case 1:  // nearly
      centres[n - 1] = centres[0] + axis * 1e-6;
      break;
    case 2:  // opposite each other
      centres[n - 1] = -centres[0];
      break;
    case 3:  // on a line
      for (std::size_t i = 0; i < n; ++i) centres[i] = centres[0] + axis * (double(i) - n / 2.0);
      break;
    case 4:  // in a plane
      for (Vec3& c : centres) c.z = 0.0;
      break;
    default:  // on whole numbers
      for (Vec3& c : centres) c = glm::round(c);
      break;
  }
}

}  // namespace

Vec3 Dice::direction() {
  for (;;) {
    const double x = between(-1, 1), y = between(-1, 1), z = between(-1, 1);
    const double length2 = x * x + y * y + z * z;
    if (length2 > 1e-3 && length2 <= 1.0) return Vec3(x, y, z) / std::sqrt(length2);
  }
}

Camera look_at(const std::string& name, const Vec3& centre, const Vec3& target, double focal,
               int width, int height, double roll) {
  Camera camera;
  camera.name = name;
  camera.width = width;
  camera.height = height;
  camera.K = from_rows({focal, 0, width / 2.0, 0, focal, height / 2.0, 0, 0, 1});
  const Vec3 forward = glm::normalize(target - centre);
  const Vec3 helper = std::abs(forward.z) < 0.99 ? Vec3(0, 0, 1) : Vec3(0, 1, 0);
  const Vec3 right0 = glm::normalize(glm::cross(forward, helper));
  const Vec3 down0 = glm::cross(forward, right0);
  const Vec3 right = std::cos(roll) * right0 + std::sin(roll) * down0;
  const Vec3 down = glm::cross(forward, right);
  camera.R = glm::transpose(Mat3(right, down, forward));
  camera.t = -(camera.R * centre);
  return camera;
}

Rig ring_of_cameras(int count, double distance) {
  Rig rig;
  rig.up = Vec3(0, 0, 1);
  for (int i = 0; i < count; ++i) {
    const double angle = 2.0 * M_PI * (i + 0.13 * (i % 3)) / count;
    const double height = distance * (0.1 + 0.35 * ((i * 7) % 5) / 5.0);
    const double flat = std::sqrt(distance * distance - height * height);
    const Vec3 centre(flat * std::cos(angle), flat * std::sin(angle), height);
    rig.cameras.push_back(look_at("cam" + std::to_string(i), centre, Vec3(0.0), 1100.0));
  }
  return rig;
}

std::vector<Vec2f> star(Dice& dice, Vec2 centre, double smallest, double largest, int vertices) {
  std::vector<Vec2f> ring;
  for (int i = 0; i < vertices; ++i) {
    const double angle =
        -2.0 * M_PI * (i + dice.between(0.0, 0.4)) / vertices;  // counter-clockwise on screen
    const double radius = dice.between(smallest, largest);
    ring.emplace_back(snapped(centre.x + radius * std::cos(angle)),
                      snapped(centre.y + radius * std::sin(angle)));
  }
  return ring;
}

void add_ring(Rings& rings, const std::vector<Vec2f>& ring) {
  rings.points.insert(rings.points.end(), ring.begin(), ring.end());
  rings.ends.push_back(static_cast<std::uint32_t>(rings.points.size()));
}

Rings random_region(Dice& dice, Vec2 centre, double size) {
  Rings rings;
  const int parts = dice.whole(1, 3);
  for (int part = 0; part < parts; ++part) {
    // Parts stand side by side, so that they cannot meet.
    const Vec2 middle =
        centre + Vec2(2.2 * size * (part - (parts - 1) / 2.0), dice.between(-0.3, 0.3) * size);
    const bool with_hole = dice.chance(0.4);
    // From five corners on a star keeps clear of its middle by 0.6 of its smallest radius.
    add_ring(rings, star(dice, middle, 0.55 * size, size, dice.whole(with_hole ? 5 : 3, 14)));
    if (!with_hole) continue;
    std::vector<Vec2f> hole = star(dice, middle, 0.08 * size, 0.14 * size, dice.whole(5, 8));
    std::reverse(hole.begin(), hole.end());
    add_ring(rings, hole);
    if (dice.chance(0.4))
      add_ring(rings, star(dice, middle, 0.01 * size, 0.02 * size, dice.whole(3, 5)));
  }
  return rings;
}

Rings wild_rings(Dice& dice, int width, int height) {
  Rings rings;
  const double grid = dice.chance(0.5) ? 16.0 : 64.0;  // coarse grids make many coincidences
  const int count = dice.whole(1, 3);
  for (int r = 0; r < count; ++r) {
    std::vector<Vec2f> ring;
    const int n = dice.whole(1, 12);
    for (int i = 0; i < n; ++i) {
      const int what = ring.empty() ? 0 : dice.whole(0, 9);
      const Vec2f last = ring.empty() ? Vec2f(0) : ring.back();
      if (what == 1) {
        ring.push_back(last);  // the same vertex again
      } else if (what == 2 && ring.size() >= 2) {
        ring.push_back(ring[ring.size() - 2]);  // a spike
      } else if (what == 3) {
        ring.push_back(ring[static_cast<std::size_t>(dice.whole(0, int(ring.size()) - 1))]);
      } else if (what == 4 && ring.size() >= 2) {
        ring.push_back((last + ring[ring.size() - 2]) * 0.5f);  // back along the last edge
      } else {
        ring.emplace_back(std::round(dice.between(0, width) / grid) * grid,
                          std::round(dice.between(0, height) / grid) * grid);
      }
    }
    add_ring(rings, ring);
  }
  return rings;
}

HullScene random_scene(std::uint64_t seed) {
  Dice dice(seed);
  HullScene scene;
  scene.name = "random " + std::to_string(seed);
  const int count = dice.whole(2, 7);
  std::vector<Vec3> centres;
  for (int i = 0; i < count; ++i) centres.push_back(dice.direction() * dice.between(1.5, 6.0));
  if (dice.chance(0.5)) arrange(dice, centres);
  const bool parallel = dice.chance(0.08);
  const Vec3 common = dice.direction();
  for (int i = 0; i < count; ++i) {
    const double distance = std::max(glm::length(centres[i]), 0.3);
    const double focal = dice.chance(0.1) ? dice.between(20, 200) : dice.between(500, 2000);
    const Vec3 off = dice.direction() * dice.between(0, 0.2);
    Vec3 target = parallel ? centres[i] + common : off;
    if (glm::length(target - centres[i]) < 0.1) target = centres[i] + common;
    scene.rig.cameras.push_back(look_at("cam" + std::to_string(i), centres[i], target, focal, 1024,
                                        768, dice.between(-3, 3)));
    const double size = focal * dice.between(0.1, 0.5) / distance;
    scene.silhouettes.push_back(
        random_region(dice, image_of_origin(scene.rig.cameras.back()), size));
  }
  const double reach = dice.between(0.5, 3.0);
  scene.rig.bounds = Bounds{Vec3(-reach), Vec3(reach, reach * 0.9, reach * 1.1)};
  return scene;
}

HullScene tiny_scene(std::uint64_t seed) {
  Dice dice(seed);
  HullScene scene;
  scene.name = "tiny " + std::to_string(seed);
  const int count = dice.whole(2, 3);
  for (int i = 0; i < count; ++i) {
    const Vec3 centre = dice.direction() * dice.between(3.0, 5.0);
    scene.rig.cameras.push_back(look_at("cam" + std::to_string(i), centre, dice.direction() * 0.2,
                                        1000, 1024, 768, dice.between(-3, 3)));
    const Vec2 middle = image_of_origin(scene.rig.cameras.back());
    Rings rings;
    const bool hole = dice.chance(0.2);
    add_ring(rings, star(dice, middle, 100, 250, dice.whole(hole ? 5 : 3, 8)));
    if (hole) {
      std::vector<Vec2f> inner = star(dice, middle, 20, 50, 3);
      std::reverse(inner.begin(), inner.end());
      add_ring(rings, inner);
    }
    scene.silhouettes.push_back(rings);
  }
  const double reach = dice.between(0.6, 1.5);
  scene.rig.bounds = Bounds{Vec3(-reach), Vec3(reach, reach * 0.9, reach * 1.1)};
  return scene;
}

HullScene wild_scene(std::uint64_t seed) {
  Dice dice(seed);
  HullScene scene;
  scene.name = "wild " + std::to_string(seed);
  const int count = dice.whole(2, 5);
  for (int i = 0; i < count; ++i) {
    const Vec3 centre = dice.direction() * dice.between(2.0, 5.0);
    scene.rig.cameras.push_back(look_at("cam" + std::to_string(i), centre, dice.direction() * 0.1,
                                        1000, 1024, 768, dice.between(-3, 3)));
    scene.silhouettes.push_back(wild_rings(dice, 1024, 768));
  }
  scene.rig.bounds = Bounds{Vec3(-2.0), Vec3(2.0)};
  return scene;
}

HullScene figure_scene(int cameras, double step, double time) {
  HullScene scene;
  scene.name = "figure N" + std::to_string(cameras);
  scene.rig = ring_of_cameras(cameras);
  scene.rig.bounds = Bounds{Vec3(-1.2, -1.0, -1.2), Vec3(1.2, 1.0, 1.2)};
  const auto body = walking_figure(time);
  for (const Camera& camera : scene.rig.cameras)
    scene.silhouettes.push_back(silhouette_of(body, camera, step));
  return scene;
}

HullScene knot_scene(int cameras, double step) {
  HullScene scene;
  scene.name = "knot N" + std::to_string(cameras);
  scene.rig = ring_of_cameras(cameras);
  scene.rig.bounds = Bounds{Vec3(-1.2), Vec3(1.2)};
  const auto body = torus_knot();
  for (const Camera& camera : scene.rig.cameras)
    scene.silhouettes.push_back(silhouette_of(body, camera, step));
  return scene;
}

HullScene moved(const HullScene& scene, double factor, const Vec3& shift) {
  HullScene result = scene;
  for (Camera& camera : result.rig.cameras) {
    const Vec3 centre = -(glm::transpose(camera.R) * camera.t) * factor + shift;
    camera.t = -(camera.R * centre);
  }
  if (result.rig.bounds) {
    result.rig.bounds->min = result.rig.bounds->min * factor + shift;
    result.rig.bounds->max = result.rig.bounds->max * factor + shift;
  }
  if (result.reference_volume) *result.reference_volume *= factor * factor * factor;
  return result;
}

}  // namespace polyhull::test
