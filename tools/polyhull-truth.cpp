// SPDX-License-Identifier: LGPL-2.1-or-later
// Holds a picture of composite against the path-traced truth: the same scene, seen by the same
// camera, with rigtestsrc's true figure standing in it instead of the hull. The figure shows the
// colours of the studio (matched lighting), throws a shadow, is mirrored and blocks the light that
// walls reflect. Prints the PSNR of the whole picture and of the regions subject, mirror image and
// shadow, and writes picture, truth, their difference and the empty room side by side.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/picture.h"
#include "base/srgb.h"
#include "builtin/default_rig.h"
#include "builtin/room.h"
#include "command_line.h"
#include "raytrace/path_tracer.h"
#include "rig/rig.h"
#include "scene/changes/scene_changes.h"
#include "scene/scene.h"
#include "studio/figure/subject.h"

using namespace polyhull;

namespace {

enum class Region : std::uint8_t { room, subject, mirror_image, shadow };

// What a pixel's centre shows of the figure: itself, its image in a planar mirror, or nothing.
std::vector<Region> find_regions(const TracedScene& traced, const Camera& camera) {
  std::vector<Region> regions(static_cast<std::size_t>(camera.width) * camera.height, Region::room);
  const Vec3f eye(camera.centre());
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Vec3f direction(glm::normalize(camera.ray({x, y})));
      const RayHit hit = traced.caster().intersect({eye, 1e-3f, direction});
      if (!hit.hit()) continue;
      Region& region = regions[static_cast<std::size_t>(y) * camera.width + x];
      if (traced.is_subject(hit)) {
        region = Region::subject;
      } else if (traced.is_planar_mirror(hit.mesh)) {
        const Vec3f normal = glm::normalize(hit.normal);
        const RayHit next = traced.caster().intersect(
            {eye + hit.distance * direction, 1e-3f, glm::reflect(direction, normal)});
        if (next.hit() && traced.is_subject(next)) region = Region::mirror_image;
      }
    }
  }
  return regions;
}

// Room pixels that the figure changes visibly, by its shadow.
void mark_shadow(const Picture& truth, const Picture& empty, std::vector<Region>& regions) {
  constexpr int visible = 9;  // levels, all channels together
  for (std::size_t i = 0; i < regions.size(); ++i) {
    int difference = 0;
    for (int c = 0; c < 3; ++c)
      difference += std::abs(truth.pixels[4 * i + c] - empty.pixels[4 * i + c]);
    if (regions[i] == Region::room && difference > visible) regions[i] = Region::shadow;
  }
}

// The scene as scenesrc shows it with these changes of nodes and lights.
Scene changed_scene(const std::string& name, const std::string& nodes, const std::string& lights) {
  Scene scene = open_scene(name);
  std::string missing = pose_scene({.nodes = nodes}, scene);
  std::vector<Light> changed = scene.lights;
  missing += change_lights(parse_light_changes(lights), scene_bounds(scene), scene.name, changed);
  if (!missing.empty()) throw Error(Error::Kind::not_found, "{}", missing);
  for (std::size_t i = 0; i < changed.size(); ++i) set_light(scene, i, changed[i]);
  scene.mirrors = find_mirrors(scene);
  return scene;
}

// The figure in the default rig's world, moved in that of the scene: metres, y up.
TracedSubject true_figure(double seconds, const Vec3f& place) {
  const TruthMesh truth = truth_mesh(*open_subject(""), default_rig(), seconds);
  TracedSubject subject;
  for (const Vec3f& position : truth.positions) subject.positions.push_back(position + place);
  subject.triangles = truth.triangles;
  subject.colour = [colours = truth.colours, triangles = truth.triangles](std::uint32_t t, float u,
                                                                          float v, const Vec3f&) {
    const Vec3f c = (1.0f - u - v) * colours[triangles[3 * t]] + u * colours[triangles[3 * t + 1]] +
                    v * colours[triangles[3 * t + 2]];
    return srgb_decoded(c);
  };
  return subject;
}

// Averages factor x factor pixels in linear light. RGBA.
Picture shrink(const Picture& picture, int factor) {
  Picture out{picture.width / factor, picture.height / factor, 4, {}};
  out.pixels.assign(static_cast<std::size_t>(out.width) * out.height * 4, 255);
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        float sum = 0.0f;
        for (int dy = 0; dy < factor; ++dy) {
          for (int dx = 0; dx < factor; ++dx) {
            sum += srgb_decoded(
                static_cast<float>(picture.row(y * factor + dy)[4 * (x * factor + dx) + c]) /
                255.0f);
          }
        }
        const float mean = sum / static_cast<float>(factor * factor);
        out.row(y)[4 * x + c] =
            static_cast<std::uint8_t>(std::lround(255.0f * srgb_from_linear(mean)));
      }
    }
  }
  return out;
}

// Peak signal-to-noise ratio over the pixels of a region (all: the whole picture), dB.
double psnr(const Picture& a, const Picture& b, const std::vector<Region>& regions, bool all,
            Region wanted) {
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < regions.size(); ++i) {
    if (!all && regions[i] != wanted) continue;
    for (int c = 0; c < 3; ++c) {
      const double d = static_cast<double>(a.pixels[4 * i + c]) - b.pixels[4 * i + c];
      sum += d * d;
    }
    count += 3;
  }
  if (count == 0) return NAN;
  return sum > 0.0 ? 10.0 * std::log10(255.0 * 255.0 * static_cast<double>(count) / sum) : INFINITY;
}

// Above: picture and truth; below: their difference times 4 around grey, and the empty room.
Picture side_by_side(const Picture& picture, const Picture& truth, const Picture& empty) {
  Picture out{2 * picture.width, 2 * picture.height, 3, {}};
  out.pixels.resize(static_cast<std::size_t>(out.width) * out.height * 3);
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        const int ours = picture.row(y)[4 * x + c], exact = truth.row(y)[4 * x + c];
        const int right = 3 * (x + picture.width) + c;
        out.row(y)[3 * x + c] = static_cast<std::uint8_t>(ours);
        out.row(y)[right] = static_cast<std::uint8_t>(exact);
        out.row(y + picture.height)[3 * x + c] =
            static_cast<std::uint8_t>(std::clamp(128 + 4 * (ours - exact), 0, 255));
        out.row(y + picture.height)[right] = empty.row(y)[4 * x + c];
      }
    }
  }
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine command("polyhull-truth",
                      "Holds a picture of composite over a scene against the path-traced truth.");
  std::string picture_file, scene_name, nodes, lights, output = "truth.png";
  double seconds = 0.0, fov = 52.0;
  int shrink_by = 2;
  std::uint32_t samples = 24;
  std::vector<double> eye{0.0, 1.5, 2.7}, target{0.0, 0.98, 0.0}, place{0.0, 0.0, 0.0};
  command.option("picture", &picture_file, "PNG of composite").required();
  command.option("--seconds", &seconds, "Stream time of the picture: the instant of the figure");
  command.option("--scene", &scene_name, "As of scenesrc; the built-in room where it is not given");
  command.option("--nodes", &nodes, "As of scenesrc");
  command.option("--lights", &lights, "As of scenesrc");
  command.option("--place", &place, "Where the stage's middle is in the scene: x y z, metres")
      .expected(3)
      .shown();
  command.option("--eye", &eye, "Viewport: x y z, metres").expected(3).shown();
  command.option("--target", &target, "Middle of the picture: x y z, metres").expected(3);
  command.option("--fov", &fov, "Angle from lower to upper edge, degrees").shown();
  command.option("--shrink", &shrink_by, "Compare at 1/N of the size").range(1, 16);
  command.option("--samples", &samples, "Paths per pixel").shown();
  command.option("-o,--output", &output, "Picture to write").shown();
  return command.run(argc, argv, [&] {
    const Picture picture = shrink(load_picture(picture_file, 4), shrink_by);
    const Camera camera = look_at({eye[0], eye[1], eye[2]}, {target[0], target[1], target[2]}, fov,
                                  picture.width, picture.height);
    TracedScene traced(changed_scene(scene_name, nodes, lights));
    PathOptions options;
    options.light_samples = 4;
    const Picture empty = trace_picture(traced, camera, samples, options);
    traced.set_subjects({true_figure(seconds, {place[0], place[1], place[2]})});
    const Picture truth = trace_picture(traced, camera, samples, options);
    std::vector<Region> regions = find_regions(traced, camera);
    mark_shadow(truth, empty, regions);

    const auto print = [&](const char* name, bool all, Region region) {
      std::printf("%-14s %6.2f dB   (empty room %6.2f dB)\n", name,
                  psnr(picture, truth, regions, all, region),
                  psnr(empty, truth, regions, all, region));
    };
    print("whole picture", true, Region::room);
    print("subject", false, Region::subject);
    print("mirror image", false, Region::mirror_image);
    print("shadow", false, Region::shadow);
    print("untouched room", false, Region::room);
    save_picture(side_by_side(picture, truth, empty), output);
    std::printf("%s: picture, truth; difference times 4, empty room\n", output.c_str());
    return 0;
  });
}
