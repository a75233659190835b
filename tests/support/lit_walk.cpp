// SPDX-License-Identifier: LGPL-2.1-or-later
#include "lit_walk.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/srgb.h"
#include "base/thread_pool.h"
#include "builtin/default_rig.h"
#include "builtin/room.h"
#include "mesh/mesh.h"
#include "raytrace/path_tracer.h"
#include "raytrace/sampling.h"
#include "render/light_lattice.h"
#include "render/projection.h"
#include "studio/figure/light.h"
#include "studio/figure/subject.h"

namespace polyhull::synthetic {
namespace {

constexpr float mean_studio = 0.66f + 0.26f / 4.0f;  // of studio_light() over all normals

/// Means of what paths bring to places in the room.
class Paths {
 public:
  /// Light that falls on a subject in the scene counts as \p stage.
  explicit Paths(const TracedScene& scene, const Vec3f& stage = Vec3f(0.0f))
      : scene_(scene), stage_(stage) {}

  /// The radiance from the room in a direction, without what comes straight from its lights.
  Vec3f bounced(const Vec3f& from, const Vec3f& direction, std::uint32_t index) const {
    Ray ray;
    ray.origin = from;
    ray.direction = direction;
    const RayHit hit = scene_.caster().intersect(ray);
    if (!hit.hit()) return scene_.scene().sky;
    if (scene_.is_subject(hit))
      return scene_.subject_colour(hit, direction) / mean_studio * stage_ /
             std::numbers::pi_v<float>;
    const Surface at = scene_.surface(ray, hit);
    Vec3f direct(0.0f);
    const Vec3f origin = at.lifted + scene_.epsilon() * at.geometric;
    for (const Light& light : scene_.scene().lights)
      direct += light_sample(scene_, light, sample_point(index, 77u), origin, at.normal);
    Vec3f share(1.0f);
    if (at.material->is_mirror())
      share = (Vec3f(1.0f) - fresnel(at.material->f0(), -glm::dot(direction, at.normal))) *
              (1.0f - at.material->metallic);
    const Vec3f glow = at.light < 0 ? at.emission : Vec3f(0.0f);
    return glow + share * scene_.base_colour(hit) / std::numbers::pi_v<float> * direct;
  }

  /// What a light gives from one of its places to a surface there; \p normal 0: the mean over all.
  Vec3f direct(const Vec3f& at, const Vec3f& normal, const Vec2f& square) const {
    Vec3f sum(0.0f);
    const auto facing = [&](const Light& light) {
      return normal != Vec3f(0.0f)
                 ? normal
                 : glm::normalize(light.centre + (2.0f * square.x - 1.0f) * light.u +
                                  (2.0f * square.y - 1.0f) * light.v - at);
    };
    const float share = normal != Vec3f(0.0f) ? 1.0f : 0.25f;
    for (const Light& light : scene_.scene().lights)
      sum += share * light_sample(scene_, light, square, at, facing(light));
    for (const MirroredLight& light : scene_.mirrored_lights())
      sum += share * mirrored_light_sample(scene_, light, square, at, facing(light.image));
    return sum;
  }

  /// E(x, n), or for \p normal 0 its mean over all.
  Vec3f irradiance(const Vec3f& at, const Vec3f& normal, std::uint32_t paths) const {
    Vec3f sum(0.0f);
    const auto [x, y] = tangents(normal != Vec3f(0.0f) ? normal : Vec3f(0, 1, 0));
    for (std::uint32_t k = 0; k < paths; ++k) {
      const Vec2f p = sample_point(k, 5u);
      Vec3f way = cosine_direction(p);
      if (normal != Vec3f(0.0f)) {
        way = way.x * x + way.y * y + way.z * normal;
      } else {
        const float z = 2.0f * p.y - 1.0f, r = std::sqrt(std::max(0.0f, 1.0f - z * z));
        const float a = 2.0f * std::numbers::pi_v<float> * p.x;
        way = Vec3f(r * std::cos(a), r * std::sin(a), z);
      }
      sum +=
          direct(at, normal, sample_point(k, 9u)) + std::numbers::pi_v<float> * bounced(at, way, k);
    }
    return sum / static_cast<float>(paths);
  }

 private:
  const TracedScene& scene_;
  Vec3f stage_;
};

/// The figure at a stop.
struct Figure {
  TruthMesh truth;
  RayCaster caster;
  Mesh mesh;  // of normals that are the truth's
  PlacedSubject placed;

  explicit Figure(const Stop& stop)
      : truth(truth_mesh(*open_subject(""), default_rig(), stop.seconds)) {
    for (Vec3f& p : truth.positions) p += Vec3f(stop.place);
    caster.add_mesh(truth.positions, truth.triangles);
    caster.commit();
    mesh.hull.vertices = truth.positions;
    mesh.hull.normals = truth.normals;
    mesh.hull.triangles = truth.triangles;
    placed.mesh = &mesh;
    placed.points = truth.positions;
    placed.bounds = bounds_of(placed.points);
    placed.lighting = SubjectLighting::relit;
    placed.relight = 1.0f;
  }
  TracedSubject subject() const {
    return {truth.positions, truth.triangles,
            [this](std::uint32_t t, float u, float v, const Vec3f&) {
              return srgb_decoded(mixed(truth.colours, t, u, v));
            }};
  }
  Vec3f mixed(const std::vector<Vec3f>& values, std::uint32_t triangle, float u, float v) const {
    const std::uint32_t* t = &truth.triangles[3 * triangle];
    return (1.0f - u - v) * values[t[0]] + u * values[t[1]] + v * values[t[2]];
  }
};

/// The figure's surface behind a pixel.
struct Point {
  int pixel;
  Vec3f place, normal;
  Vec3f studio, form;  // linear; by PlacedSubject::form
};

/// What \p camera sees of \p figure before \p room.
std::vector<Point> points_of(const Figure& figure, const Camera& camera, const RayCaster& room) {
  std::vector<Point> out;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      Ray ray;
      ray.origin = Vec3f(camera.centre());
      ray.direction = Vec3f(glm::normalize(camera.ray({x, y})));
      const RayHit hit = figure.caster.intersect(ray);
      if (!hit.hit()) continue;
      const RayHit before = room.intersect(ray);
      if (before.hit() && before.distance < hit.distance) continue;
      const auto there = [&](const std::vector<Vec3f>& values) {
        return figure.mixed(values, hit.triangle, hit.u, hit.v);
      };
      out.push_back({y * camera.width + x, ray.origin + hit.distance * ray.direction,
                     glm::normalize(there(figure.truth.normals)),
                     srgb_decoded(there(figure.truth.colours)), there(figure.placed.form)});
    }
  }
  return out;
}

double code(float linear) {
  return 255.0 * srgb_encoded(std::clamp(linear, 0.0f, 1.0f));
}

}  // namespace

LitWalk::LitWalk(int width, int height, std::uint32_t paths)
    : width_(width),
      height_(height),
      paths_(paths),
      scene_(std::make_shared<const Scene>(room_scene())),
      traced_(*scene_),
      stage_(Paths(traced_).irradiance({0, 1, 0}, Vec3f(0.0f), 64 * paths)) {
  frame_.width = width;
  frame_.height = height;
  frame_.scene = scene_;
  frame_.lights = scene_->lights;
  frame_.exposure = scene_->exposure;
}

LitWalk::Shown LitWalk::at(const Stop& stop, const std::vector<WalkKind>& kinds) {
  Figure figure(stop);
  RenderPlan plan;
  figure.placed.shade = light_.around(figure.placed, frame_, traced_);
  plan.subjects.push_back(figure.placed);
  BodyTrees trees;
  find_forms(plan, trees);
  figure.placed.form = plan.subjects[0].form;
  const LightLattice& lattice = *figure.placed.shade;

  // From the room's middle, or before it.
  Vec3 aside = Vec3(0.3, 0, 0.9) - stop.place;
  aside = 2.3 * glm::normalize(Vec3(aside.x, 0, aside.z));
  const Camera camera = look_at(stop.place + aside + Vec3(0, 1.1, 0), stop.place + Vec3(0, 0.92, 0),
                                50.0, width_, height_);
  TracedScene with(*scene_);
  with.set_subjects({figure.subject()});
  const Paths through(traced_), onto(with, stage_);
  const std::vector<Point> points = points_of(figure, camera, traced_.caster());

  Shown out;
  for (auto& values : out.colours) values.resize(points.size());
  for (const Point& point : points) out.pixels.push_back(point.pixel);
  const auto wanted = [&](WalkKind kind) {
    return std::find(kinds.begin(), kinds.end(), kind) != kinds.end();
  };
  parallel_for(points.size(), 16, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Point& p = points[i];
      const auto shown = [&](WalkKind kind) -> Vec3f& {
        return out.colours[static_cast<std::size_t>(kind)][i];
      };
      const Vec3f albedo = p.studio / studio_light(p.normal) * mean_studio;
      const Vec3f here = lattice.at((p.place - lattice.origin) / lattice.cell);
      const Vec3f lifted = p.place + 2e-3f * p.normal;
      shown(WalkKind::off) = p.studio;
      shown(WalkKind::shade) = p.studio * here;
      shown(WalkKind::form) = p.studio * here * p.form;
      shown(WalkKind::known) = albedo * here * p.form;
      shown(WalkKind::clear) =
          albedo * here * find_form(lattice, {&p.place, 1}, {&p.normal, 1}, 1.0f, {})[0];
      if (wanted(WalkKind::even))
        shown(WalkKind::even) =
            p.studio * through.irradiance(p.place, Vec3f(0.0f), paths_) / stage_;
      if (wanted(WalkKind::open))
        shown(WalkKind::open) = albedo * through.irradiance(lifted, p.normal, paths_) / stage_;
      if (wanted(WalkKind::relit))
        shown(WalkKind::relit) = albedo * onto.irradiance(lifted, p.normal, paths_) / stage_;
    }
  });
  return out;
}

double psnr_of_codes(const std::vector<Vec3f>& a, const std::vector<Vec3f>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (int c = 0; c < 3; ++c) sum += std::pow(code(a[i][c]) - code(b[i][c]), 2.0);
  return 10.0 * std::log10(255.0 * 255.0 * 3.0 * static_cast<double>(a.size()) / sum);
}

}  // namespace polyhull::synthetic
