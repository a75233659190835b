// SPDX-License-Identifier: LGPL-2.1-or-later
// The scene's light on a subject against paths: the true figure walks through the built-in room, below the
// lamp, into the pillar's shadow and a dark corner, and shows at each pixel of it
//   off      the studio's colour,
//   shade    that times what SubjectLight finds there,
//   form     shade, times what LightLattice says of the pixel's normal: light=relit with relight=1,
//   known    the same over the studio's own light, as if that were known instead of even,
//   even     the studio's colour times the same as shade found by paths: what `shade` approximates,
//   open     what the room's light makes of the figure's albedo, by paths that end on it with its normals
//            and go through it: what `known` approximates,
//   relit    the same where it shadows itself,
// each as bright as the studio in the stage's middle. PSNR over the figure's pixels in sRGB codes.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "base/srgb.h"
#include "base/thread_pool.h"
#include "builtin/default_rig.h"
#include "builtin/room.h"
#include "command_line.h"
#include "raytrace/path_tracer.h"
#include "raytrace/sampling.h"
#include "raytrace/traced_scene.h"
#include "render/frame.h"
#include "render/subject_light.h"
#include "studio/figure/light.h"
#include "studio/figure/subject.h"

namespace {

using namespace polyhull;

constexpr int width = 200, height = 300;
constexpr float mean_studio = 0.66f + 0.26f / 4.0f;  // of studio_light() over all normals

struct Stop {
  const char* name;
  Vec3 place;
  double seconds;
};
constexpr double far_corner = 2.35;
const Stop stops[] = {{"middle", {0, 0, 0}, 0.0},
                      {"below the lamp", {0.45, 0, 0.35}, 0.5},
                      {"towards the pillar", {-0.9, 0, 0.6}, 1.0},
                      {"its shadow's border", {-1.5, 0, 1.55}, 1.5},
                      {"its shadow", {-1.85, 0, 1.35}, 2.0},
                      {"dark wall", {-2.2, 0, -0.5}, 2.5},
                      {"dark corner", {far_corner, 0, -far_corner}, 3.0}};

/// The figure's surface behind a pixel.
struct Point {
  Vec3f place, normal, studio;  // studio: linear
};

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

struct Figure {
  TruthMesh mesh;
  RayCaster caster;

  Figure(double seconds, const Vec3& place)
      : mesh(truth_mesh(*open_subject(""), default_rig(), seconds)) {
    for (Vec3f& p : mesh.positions) p += Vec3f(place);
    caster.add_mesh(mesh.positions, mesh.triangles);
    caster.commit();
  }
  TracedSubject subject() const {
    return {mesh.positions, mesh.triangles,
            [this](std::uint32_t t, float u, float v, const Vec3f&) {
              return srgb_decoded(mixed(mesh.colours, t, u, v));
            }};
  }
  Vec3f mixed(const std::vector<Vec3f>& values, std::uint32_t triangle, float u, float v) const {
    const std::uint32_t* t = &mesh.triangles[3 * triangle];
    return (1.0f - u - v) * values[t[0]] + u * values[t[1]] + v * values[t[2]];
  }
  /// What \p camera sees of it before \p room, by pixel.
  std::vector<std::pair<int, Point>> points(const Camera& camera, const RayCaster& room) const {
    std::vector<std::pair<int, Point>> out;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        Ray ray;
        ray.origin = Vec3f(camera.centre());
        ray.direction = Vec3f(glm::normalize(camera.ray({x, y})));
        const RayHit hit = caster.intersect(ray);
        if (!hit.hit()) continue;
        const RayHit before = room.intersect(ray);
        if (before.hit() && before.distance < hit.distance) continue;
        const auto there = [&](const std::vector<Vec3f>& values) {
          return mixed(values, hit.triangle, hit.u, hit.v);
        };
        out.push_back({y * width + x,
                       {ray.origin + hit.distance * ray.direction,
                        glm::normalize(there(mesh.normals)), srgb_decoded(there(mesh.colours))}});
      }
    }
    return out;
  }
};

double code(float linear) {
  return 255.0 * srgb_encoded(std::clamp(linear, 0.0f, 1.0f));
}

double psnr(const std::vector<Vec3f>& a, const std::vector<Vec3f>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (int c = 0; c < 3; ++c) sum += std::pow(code(a[i][c]) - code(b[i][c]), 2.0);
  return 10.0 * std::log10(255.0 * 255.0 * 3.0 * static_cast<double>(a.size()) / sum);
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine command("subject_light_benchmark", "The scene's light on a subject against paths");
  std::string folder;
  int paths = 256;
  command.option("--output", &folder,
                 "folder for pictures of each stop: the kinds from left to right");
  command.option("--paths", &paths, "of a pixel");
  if (const auto status = command.parse(argc, argv)) return *status;
  const auto scene = std::make_shared<const Scene>(room_scene());
  const TracedScene traced(*scene);
  const Paths truth(traced);
  RenderFrame frame;
  frame.width = width;
  frame.height = height;
  frame.scene = scene;
  frame.lights = scene->lights;
  frame.exposure = scene->exposure;
  const auto many = static_cast<std::uint32_t>(paths);
  const Vec3f stage = truth.irradiance({0, 1, 0}, Vec3f(0.0f), 64 * many);
  SubjectLight light;
  std::printf("%-20s | even:           | relit:%38s | open:\n", "dB against", "");
  std::printf("%-20s |%8s%8s |%8s%8s%8s%8s%8s%8s |%8s%8s%8s\n", "", "off", "shade", "off", "shade",
              "form", "known", "even", "open", "off", "shade", "known");
  for (const Stop& stop : stops) {
    const Figure figure(stop.seconds, stop.place);
    // From the room's middle, or before it.
    Vec3 aside = Vec3(0.3, 0, 0.9) - stop.place;
    aside = 2.3 * glm::normalize(Vec3(aside.x, 0, aside.z));
    frame.viewport = look_at(stop.place + aside + Vec3(0, 1.1, 0), stop.place + Vec3(0, 0.92, 0),
                             50.0, width, height);
    TracedScene with(*scene);
    with.set_subjects({figure.subject()});
    const Paths onto(with, stage);
    PlacedSubject placed;
    placed.points = figure.mesh.positions;
    const auto lattice = light.around(placed, frame, traced);
    const auto points = figure.points(frame.viewport, traced.caster());
    enum { off, shade, form, known, even, open, relit, kinds };
    std::vector<Vec3f> shown[kinds];
    for (auto& values : shown) values.resize(points.size());
    parallel_for(points.size(), 16, 0, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const Point& p = points[i].second;
        const Vec3f in_cells = (p.place - lattice->origin) / lattice->cell;
        const Vec3f albedo = p.studio / studio_light(p.normal) * mean_studio;
        const Vec3f light_here = lattice->at(in_cells),
                    faced = lattice->form_at(in_cells, p.normal);
        shown[off][i] = p.studio;
        shown[shade][i] = p.studio * light_here;
        shown[form][i] = p.studio * light_here * faced;
        shown[known][i] = albedo * light_here * faced;
        shown[even][i] = p.studio * truth.irradiance(p.place, Vec3f(0.0f), many) / stage;
        const Vec3f lifted = p.place + 2e-3f * p.normal;
        shown[open][i] = albedo * truth.irradiance(lifted, p.normal, many) / stage;
        shown[relit][i] = albedo * onto.irradiance(lifted, p.normal, many) / stage;
      }
    });
    const auto against = [&](int a, int b) { return psnr(shown[a], shown[b]); };
    std::printf("%-20s |%8.2f%8.2f |", stop.name, against(off, even), against(shade, even));
    for (const int kind : {off, shade, form, known, even, open})
      std::printf("%8.2f", against(kind, relit));
    std::printf(" |%8.2f%8.2f%8.2f\n", against(off, open), against(shade, open),
                against(known, open));
    if (folder.empty()) continue;
    Picture picture{kinds * width, height, 4, {}};
    picture.pixels.assign(static_cast<std::size_t>(4) * kinds * width * height, 60);
    for (int k = 0; k < kinds; ++k)
      for (std::size_t i = 0; i < points.size(); ++i)
        for (int c = 0; c < 4; ++c)
          picture.row(points[i].first / width)[4 * (k * width + points[i].first % width) + c] =
              c == 3 ? 255 : static_cast<std::uint8_t>(std::lround(code(shown[k][i][c])));
    save_picture(picture, folder + "/light-" + std::to_string(&stop - stops) + ".png");
  }
  return 0;
}
