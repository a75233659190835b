// SPDX-License-Identifier: LGPL-2.1-or-later
// Holds composite against the path-traced truth: the same scene with the true figure standing in
// it. Reads a mesh as hulltexture sends it, for example from
//   ... hullbuild name=hull ! hulltexture ! filesink location=mesh.bin   (one mesh)
// prints the PSNR of the whole picture and of the regions subject, mirror image and shadow, and
// writes composite, truth, difference and background side by side.
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <memory>

#include "base/error.h"
#include "figure/subject.h"
#include "gl_context.h"
#include "raytrace/background.h"
#include "raytrace/path_tracer.h"
#include "render/compositor.h"
#include "simple_trace.h"
#include "synthetic.h"
#include "wire/mesh_payload.h"

using namespace polyhull;

namespace {

/// What a pixel's centre shows: 0 nothing of the figure, 1 the figure, 2 its image in a mirror.
std::vector<int> regions(const TracedScene& traced, const Camera& camera) {
  std::vector<int> out(static_cast<std::size_t>(camera.width) * camera.height, 0);
  const Vec3f eye(camera.centre());
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Vec3f direction(glm::normalize(camera.ray({x, y})));
      const RayHit hit = traced.caster().intersect({eye, 1e-3f, direction});
      if (!hit.hit()) continue;
      int& region = out[static_cast<std::size_t>(y) * camera.width + x];
      if (traced.is_subject(hit)) {
        region = 1;
      } else if (traced.is_planar_mirror(hit.mesh)) {
        const Vec3f normal = glm::normalize(hit.normal);
        const RayHit next = traced.caster().intersect(
            {eye + hit.distance * direction, 1e-3f, glm::reflect(direction, normal)});
        if (next.hit() && traced.is_subject(next)) region = 2;
      }
    }
  }
  return out;
}

TracedSubject true_figure(const Rig& rig, double seconds, const Mat4& to_scene) {
  const TruthMesh truth = truth_mesh(*open_subject(""), rig, seconds);
  TracedSubject out;
  for (const Vec3f& p : truth.positions) out.positions.emplace_back(to_scene * Vec4(Vec3(p), 1.0));
  out.triangles = truth.triangles;
  out.colour = [colours = truth.colours, triangles = truth.triangles](std::uint32_t t, float u,
                                                                      float v, const Vec3f&) {
    const Vec3f c = (1.0f - u - v) * colours[triangles[3 * t]] + u * colours[triangles[3 * t + 1]] +
                    v * colours[triangles[3 * t + 2]];
    return Vec3f(linear_from_srgb(c.x), linear_from_srgb(c.y), linear_from_srgb(c.z));
  };
  return out;
}

Picture side_by_side(const Picture& a, const Picture& b, const Picture& background) {
  Picture out{2 * a.width, 2 * a.height, 3, {}};
  out.pixels.resize(static_cast<std::size_t>(out.width) * out.height * 3);
  for (int y = 0; y < a.height; ++y) {
    for (int x = 0; x < a.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        const int va = a.row(y)[4 * x + c], vb = b.row(y)[4 * x + c];
        out.row(y)[3 * x + c] = static_cast<std::uint8_t>(va);
        out.row(y)[3 * (x + a.width) + c] = static_cast<std::uint8_t>(vb);
        out.row(y + a.height)[3 * x + c] =
            static_cast<std::uint8_t>(std::clamp(128 + 4 * (va - vb), 0, 255));
        out.row(y + a.height)[3 * (x + a.width) + c] = background.row(y)[4 * x + c];
      }
    }
  }
  return out;
}

int run(int argc, char** argv) {
  CLI::App app("Holds composite against the path-traced truth.");
  std::string mesh_file, output = "composite_truth.png";
  double seconds = 0.0;
  int width = 480, height = 270;
  std::uint32_t samples = 16;
  Vec3 eye(1.15, 1.5, 2.75), target(0.0, 0.98, 0.0);
  double field = 52.0;
  app.add_option("mesh", mesh_file, "File with one mesh payload")->required();
  app.add_option("--seconds", seconds, "Instant of the figure");
  app.add_option("--output", output, "Picture to write");
  app.add_option("--width", width, "Pixels");
  app.add_option("--height", height, "Pixels");
  app.add_option("--samples", samples, "Paths per pixel");
  app.add_option("--eye-x", eye.x, "Metres");
  app.add_option("--eye-y", eye.y, "Metres");
  app.add_option("--eye-z", eye.z, "Metres");
  app.add_option("--field-of-view", field, "Degrees");
  CLI11_PARSE(app, argc, argv);

  std::ifstream file(mesh_file, std::ios::binary);
  const std::vector<char> bytes((std::istreambuf_iterator<char>(file)), {});
  const Mesh mesh =
      read_mesh(Bytes(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()));
  const auto scene = std::make_shared<const Scene>(room_scene());
  const Camera camera = synthetic::look_at(eye, target, width, height, field);
  PathOptions options;
  options.light_samples = 4;
  TracedScene traced(*scene);
  const Picture background = trace_picture(traced, camera, samples, options);

  RenderFrame frame;
  frame.width = width;
  frame.height = height;
  frame.viewport = camera;
  frame.scene = scene;
  frame.lights = scene->lights;
  frame.exposure = scene->exposure;
  Background light(*scene);
  light.update(synthetic::look_at(eye, target, 64, 36, field), scene->lights, scene->exposure);
  frame.ambient = light.announcement().ambient;
  frame.subjects.push_back({&mesh, {}, 0});
  testing::HeadlessContext context(false);
  if (!context.ready()) throw Error(Error::Kind::unsupported, context.why());
  Picture composite = background;
  {
    Compositor compositor;
    const RenderPlan plan = compositor.plan(frame, {});
    compositor.render(frame, plan, {}, background.pixels.data(), 4 * width, composite.pixels.data(),
                      4 * width);
  }
  traced.set_subjects({true_figure(default_rig(), seconds, place_in_scene(mesh, {}))});
  const Picture truth = trace_picture(traced, camera, samples, options);
  const std::vector<int> region = regions(traced, camera);

  // Where the hull is drawn though the figure is not there, neither shadow nor mirror image is
  // judged.
  RayCaster hull;
  const RenderPlan placed = plan_frame(frame, {}, {});
  hull.add_mesh(placed.subjects.at(0).points, mesh.hull.triangles);
  hull.commit();
  const auto hull_stands = [&](int x, int y) {
    return hull.intersect({Vec3f(camera.centre()), 0.0f, Vec3f(camera.ray({x, y}))}).hit();
  };
  const auto at = [&](int x, int y) { return region[static_cast<std::size_t>(y) * width + x]; };
  const auto shaded = [&](int x, int y) {
    if (at(x, y) != 0 || hull_stands(x, y)) return false;
    int difference = 0;
    for (int c = 0; c < 3; ++c)
      difference += std::abs(truth.row(y)[4 * x + c] - background.row(y)[4 * x + c]);
    return difference > 9;
  };
  const auto print = [&](const char* name, auto counts) {
    std::printf("%-14s %6.2f dB   (background alone %6.2f dB)\n", name,
                synthetic::psnr(composite, truth, counts),
                synthetic::psnr(background, truth, counts));
  };
  print("whole picture", [](int, int) { return true; });
  print("subject", [&](int x, int y) { return at(x, y) == 1; });
  print("mirror image", [&](int x, int y) { return at(x, y) == 2 && !hull_stands(x, y); });
  print("shadow", shaded);
  save_picture(side_by_side(composite, truth, background), output);
  std::printf("%s: composite and truth, their difference (times 4) and the background\n",
              output.c_str());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
