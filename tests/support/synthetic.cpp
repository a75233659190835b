// SPDX-License-Identifier: LGPL-2.1-or-later
#include "synthetic.h"

#include <algorithm>

#include "raytrace/ray_caster.h"

namespace polyhull::synthetic {

Picture photograph(const Hull& hull, const Camera& camera) {
  RayCaster caster;
  caster.add_mesh(hull.vertices, hull.triangles);
  caster.commit();
  Picture picture{camera.width, camera.height, 4, {}};
  picture.pixels.assign(static_cast<std::size_t>(camera.width) * camera.height * 4, 0);
  const Vec3f centre(camera.centre() - hull.origin);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Vec2 ideal = camera.undistort({x, y});
      const Vec3f direction(camera.ray(ideal));
      const RayHit hit = caster.intersect({centre, 0.0f, direction});
      std::uint8_t* out = picture.row(y) + 4 * x;
      out[1] = 200;
      if (!hit.hit()) continue;
      const Vec3f colour = paint(hull.origin + Vec3(centre + hit.distance * direction));
      for (int c = 0; c < 3; ++c)
        out[c] = static_cast<std::uint8_t>(std::lround(255.0f * colour[c]));
      out[3] = 255;
    }
  }
  return picture;
}

Photographed photographed(const Hull& hull, const std::vector<Camera>& cameras) {
  Photographed out;
  out.mesh.hull = hull;
  for (const Camera& camera : cameras) out.pictures.push_back(photograph(hull, camera));
  for (std::size_t k = 0; k < cameras.size(); ++k) {
    const Picture& picture = out.pictures[k];
    Rectangle roi{picture.width, picture.height, -picture.width, -picture.height};
    int x1 = 0, y1 = 0;
    for (int y = 0; y < picture.height; ++y) {
      for (int x = 0; x < picture.width; ++x) {
        if (picture.row(y)[4 * x + 3] == 0) continue;
        roi.x = std::min(roi.x, std::max(x - 3, 0));
        roi.y = std::min(roi.y, std::max(y - 3, 0));
        x1 = std::max(x1, std::min(x + 4, picture.width));
        y1 = std::max(y1, std::min(y + 4, picture.height));
      }
    }
    roi.width = x1 - roi.x;
    roi.height = y1 - roi.y;
    MeshView view;
    view.calibration = cameras[k];
    view.view.camera = cameras[k].name;
    view.view.width = picture.width;
    view.view.height = picture.height;
    if (roi.width > 0) {
      view.view.roi = roi;
      view.view.format = PixelFormat::rgba;
      view.view.stride = 4 * picture.width;
      const std::size_t first = (static_cast<std::size_t>(roi.y) * picture.width + roi.x) * 4;
      view.view.pixels =
          std::span(picture.pixels)
              .subspan(first, static_cast<std::size_t>(roi.height - 1) * 4 * picture.width +
                                  4 * roi.width);
    }
    out.mesh.views.push_back(std::move(view));
  }
  return out;
}

Scene small_room(bool polished) {
  Scene scene;
  scene.name = "test:room";
  const auto material = [&](const Vec3f& colour, float roughness) {
    Material m;
    m.base_colour = colour;
    m.roughness = roughness;
    m.ior = 2.2f;
    scene.materials.push_back(m);
    return static_cast<int>(scene.materials.size()) - 1;
  };
  const auto quad = [&](int m, Vec3f corner, Vec3f u, Vec3f v) {
    SceneMesh mesh;
    mesh.material = m;
    mesh.positions = {corner, corner + u, corner + u + v, corner + v};
    mesh.normals.assign(4, glm::normalize(glm::cross(u, v)));
    mesh.triangles = {0, 1, 2, 0, 2, 3};
    scene.meshes.push_back(mesh);
    return static_cast<int>(scene.meshes.size()) - 1;
  };
  const int floor = material({0.45f, 0.4f, 0.35f}, polished ? 0.0f : 1.0f);
  const int wall = material({0.35f, 0.5f, 0.6f}, 1.0f);
  const int red = material({0.6f, 0.2f, 0.15f}, 1.0f);
  quad(floor, {-3, 0, 3}, {6, 0, 0}, {0, 0, -6});
  quad(wall, {-3, 0, -2}, {6, 0, 0}, {0, 3, 0});
  quad(red, {-3, 0, 3}, {0, 0, -5}, {0, 3, 0});
  quad(wall, {-3, 3, -3}, {6, 0, 0}, {0, 0, 6});
  const int pillar = material({0.7f, 0.7f, 0.2f}, 1.0f);
  const Vec3f p(0.45f, 0.0f, 0.9f), s(0.2f, 3.0f, 0.2f);
  quad(pillar, p + Vec3f(0, 0, s.z), {s.x, 0, 0}, {0, s.y, 0});
  quad(pillar, p, {0, 0, s.z}, {0, s.y, 0});
  quad(pillar, p + Vec3f(s.x, 0, s.z), {0, 0, -s.z}, {0, s.y, 0});
  quad(pillar, p + Vec3f(s.x, 0, 0), {-s.x, 0, 0}, {0, s.y, 0});
  Light light;
  light.centre = {-0.6f, 2.9f, 0.8f};
  light.u = {0.35f, 0, 0};
  light.v = {0, 0, 0.35f};
  light.radiance = Vec3f(14.0f, 13.0f, 11.0f);
  scene.lights.push_back(light);
  scene.mirrors = find_mirrors(scene);
  scene.exposure = 0.8f;
  return scene;
}

}  // namespace polyhull::synthetic
