// SPDX-License-Identifier: LGPL-2.1-or-later
#include "support/body_scenes.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <random>

#include "base/error.h"
#include "base/thread_pool.h"
#include "builtin/default_rig.h"
#include "hull/build/hull_builder.h"
#include "hull/build/stage.h"
#include "mesh/texture_mesh.h"
#include "render/processor/processor_renderer.h"
#include "silhouette/contour/contourer.h"
#include "studio/cameras/camera_picture.h"
#include "studio/cameras/coverage_raster.h"
#include "studio/plan/stage.h"
#include "support/camera_contours.h"
#include "support/mesh_checks.h"

namespace polyhull::test {
namespace {

constexpr double tolerance = 0.5;       // px, of the contours
constexpr std::uint8_t grey = 24;       // behind the bodies
constexpr std::size_t samples = 40000;  // points on each surface

/// A camera like those of the built-in rig, at \p degrees around the stage.
Camera camera_at(const Camera& like, double degrees) {
  const double angle = degrees * std::numbers::pi / 180.0;
  const Vec3 centre(3.0 * std::cos(angle), 1.2, 3.0 * std::sin(angle));
  const Vec3 forward = glm::normalize(Vec3(0.0, 0.95, 0.0) - centre);
  const Vec3 right = glm::normalize(glm::cross(forward, Vec3(0.0, 1.0, 0.0)));
  Camera camera = like;
  camera.R = glm::transpose(Mat3(right, glm::cross(forward, right), forward));
  camera.t = -(camera.R * centre);
  return camera;
}

/// Of the stage's axis, degrees.
double azimuth(const Camera& camera) {
  const Vec3 centre = camera.centre();
  return std::atan2(centre.z, centre.x) * 180.0 / std::numbers::pi;
}

TriangleSurface truth_of(const Rig& rig, const Body& body) {
  const TruthMesh mesh = truth_mesh(*body.subject, rig, body.seconds);
  TriangleSurface surface;
  surface.vertices.assign(mesh.positions.begin(), mesh.positions.end());
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3) {
    surface.triangles.push_back({mesh.triangles[t], mesh.triangles[t + 1], mesh.triangles[t + 2]});
  }
  return surface;
}

Rings contours_of(const Picture& picture) {
  Matte matte;
  load_matte(picture.pixels.data() + 3, 4 * picture.width, 4, picture.width, picture.height, matte);
  ContourSettings settings;
  settings.approximate.tolerance = tolerance;
  return Contourer().find(matte, settings);
}

/// Both over either, at half coverage; \p truth by its alpha.
double overlap_of(const Picture& coverage, const Picture& truth) {
  std::size_t both = 0, either = 0;
  for (std::size_t p = 0; p < coverage.pixels.size(); ++p) {
    const bool ours = coverage.pixels[p] >= 128, theirs = truth.pixels[4 * p + 3] >= 128;
    both += ours && theirs;
    either += ours || theirs;
  }
  return either ? static_cast<double>(both) / static_cast<double>(either) : 1.0;
}

/// Over the pixels that the body or the surface covers.
double psnr_of(const Picture& picture, const Picture& truth, const Picture& coverage) {
  double sum = 0.0, count = 0.0;
  for (std::size_t p = 0; p < coverage.pixels.size(); ++p) {
    if (coverage.pixels[p] == 0 && truth.pixels[4 * p + 3] == 0) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      const double off = picture.pixels[4 * p + c] - truth.pixels[4 * p + c];
      sum += off * off;
    }
    count += 3.0;
  }
  return sum > 0.0 ? 10.0 * std::log10(255.0 * 255.0 * count / sum) : 99.0;
}

/// What \p camera would see of the stage's part of its silhouette's cone: its contours' polygons,
/// drawn by the same hand as the surfaces.
Picture silhouette_of(const Camera& camera, const Rings& contours, const Bounds& stage) {
  HullBuilder builder;
  HullOptions options;
  options.bounds = stage;
  const Silhouette silhouette{&camera, &contours};
  return coverage_of(surface_of(builder.build({&silhouette, 1}, options)), camera);
}

/// The shares missing and outside, by what each pixel is covered.
void silhouettes(const TriangleSurface& surface, const BodyScene& scene, BodyError& error) {
  double missing = 0.0, outside = 0.0, area = 0.0;
  for (std::size_t k = 0; k < scene.cameras.size(); ++k) {
    const Picture coverage = coverage_of(surface, scene.cameras[k]);
    for (std::size_t p = 0; p < coverage.pixels.size(); ++p) {
      const int theirs = scene.silhouettes[k].pixels[p], ours = coverage.pixels[p];
      missing += std::max(theirs - ours, 0);
      outside += std::max(ours - theirs, 0);
      area += theirs;
    }
  }
  error.missing = missing / area;
  error.outside = outside / area;
}

/// The hull with the scene's pictures as views.
Mesh textured_mesh(const Hull& hull, const BodyScene& scene, const TextureSettings& settings) {
  Mesh mesh = mesh_of(hull, scene);
  texture_mesh(mesh, settings);
  return mesh;
}

TextureSettings by_viewing_angle() {
  TextureSettings settings;
  settings.metric = TextureMetric::viewing_angle;
  return settings;
}

Picture empty_picture(const Camera& camera, int channels) {
  Picture out{camera.width, camera.height, channels, {}};
  out.pixels.assign(static_cast<std::size_t>(out.width) * out.height * channels, grey);
  return out;
}

/// Draws textured meshes from one camera after the other.
class Painter {
 public:
  explicit Painter(const Mesh& mesh) {
    frame_.subjects.push_back({&mesh, {}, 1});
    settings_.edge_samples = 8;
  }
  Picture draw(const Camera& camera) {
    frame_.width = camera.width;
    frame_.height = camera.height;
    frame_.viewport = camera;
    const Picture background = empty_picture(camera, 4);
    Picture out = background;
    const RenderPlan plan = renderer_.plan(frame_, settings_);
    renderer_.render(frame_, plan, settings_, background.pixels.data(), 4 * out.width,
                     out.pixels.data(), 4 * out.width);
    return out;
  }

 private:
  ProcessorRenderer renderer_;
  RenderFrame frame_;
  RenderSettings settings_;
};

}  // namespace

std::vector<Body> study_bodies(const std::string& data) {
  std::vector<Body> bodies;
  for (const double seconds : {0.0, 3.0, 7.0}) {
    bodies.push_back(
        {"figure-" + std::to_string(static_cast<int>(seconds)), open_subject("figure"), seconds});
  }
  const std::string path = data + "/meshes/makehuman_body_metres.obj";
  if (!std::filesystem::exists(path)) return bodies;
  const auto body = open_subject(path);  // turns once in ten seconds
  for (const int degrees : {15, 60}) {
    bodies.push_back({"makehuman-" + std::to_string(degrees), body, degrees / 36.0});
  }
  return bodies;
}

Rig body_rig(const std::vector<double>& azimuths) {
  Rig rig = default_rig();
  const Camera like = rig.cameras.front();
  rig.cameras.clear();
  for (const double degrees : azimuths) {
    rig.cameras.push_back(camera_at(like, degrees));
    rig.cameras.back().name = "cam" + std::to_string(rig.cameras.size() - 1);
  }
  return rig;
}

Rig body_rig(const std::string& name) {
  if (name.ends_with(".json")) return load_rig(name);
  if (name == "4far") return body_rig(std::vector<double>{0.0, 90.0, 225.0, 315.0});
  int count = 0;
  const char* end = name.data() + name.size();
  const auto read = std::from_chars(name.data(), end, count);
  if (read.ec != std::errc() || read.ptr != end || count < 2 || count > 64) {
    throw Error(Error::Kind::bad_input, "Rig '{}' is neither 4far nor a number from 2 to 64.",
                name);
  }
  std::vector<double> azimuths;
  for (int k = 0; k < count; ++k) azimuths.push_back(360.0 * k / count);
  return body_rig(azimuths);
}

std::vector<Camera> cameras_between(const std::vector<Camera>& cameras, double share) {
  std::vector<Camera> between;
  for (const Camera& camera : cameras) {
    double step = 360.0;  // to the next, which need not follow in the list
    for (const Camera& other : cameras) {
      const double way = azimuth(other) - azimuth(camera);
      if (&other != &camera) step = std::min(step, way > 0.0 ? way : way + 360.0);
    }
    between.push_back(camera_at(camera, azimuth(camera) + share * step));
  }
  return between;
}

std::vector<Picture> pictures_of(const Rig& rig, const std::vector<Camera>& cameras,
                                 const Body& body) {
  Rig with = rig;
  with.cameras = cameras;
  PictureLook look;
  std::fill_n(look.screen.colour, 3, grey);
  look.linear_light = true;
  std::vector<Picture> pictures(cameras.size());
  parallel_for(cameras.size(), 1, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      CameraPicture camera(with, static_cast<int>(k), body.subject, PictureQuality::exact);
      camera.set_time(body.seconds);
      Picture& out = pictures[k];
      out = {cameras[k].width, cameras[k].height, 4, {}};
      out.pixels.resize(static_cast<std::size_t>(out.width) * out.height * 4);
      camera.picture(look, 0, true, out.pixels.data(), 4 * out.width);
    }
  });
  return pictures;
}

BodyScene body_scene(const Rig& rig, const Body& body, bool between) {
  BodyScene scene;
  scene.name = body.name;
  scene.truth = truth_of(rig, body);
  scene.cameras = rig.cameras;
  scene.pictures = pictures_of(rig, scene.cameras, body);
  if (between) {
    scene.between = cameras_between(rig.cameras, 0.5);
    scene.seen = pictures_of(rig, scene.between, body);
  }
  scene.contours.resize(scene.cameras.size());
  scene.silhouettes.resize(scene.cameras.size());
  parallel_for(scene.cameras.size(), 1, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      scene.contours[k] = contours_of(scene.pictures[k]);
      scene.silhouettes[k] = silhouette_of(scene.cameras[k], scene.contours[k], *rig.bounds);
    }
  });
  return scene;
}

std::vector<BodyScene> body_scenes(const Rig& rig, const std::vector<Body>& bodies) {
  std::vector<BodyScene> scenes;
  for (const Body& body : bodies) scenes.push_back(body_scene(rig, body));
  return scenes;
}

BodyScene with_noise(const BodyScene& scene, double pixels, std::uint64_t seed) {
  BodyScene out = scene;
  std::mt19937_64 random(seed);
  const auto unit = [&] { return (static_cast<double>(random() >> 11) + 0.5) * 0x1p-53; };
  for (Rings& rings : out.contours) {
    for (Vec2f& p : rings.points) {  // Box and Muller's two numbers
      const double reach = pixels * std::sqrt(-2.0 * std::log(unit()));
      const double angle = 2.0 * std::numbers::pi * unit();
      p += Vec2f(reach * std::cos(angle), reach * std::sin(angle));
    }
  }
  return out;
}

std::vector<ViewPixels> view_pixels(const BodyScene& scene) {
  std::vector<ViewPixels> pictures;
  for (const Picture& p : scene.pictures)
    pictures.push_back({p.pixels.data(), 4 * p.width, 4, {0, 0, p.width, p.height}});
  return pictures;
}

const Hull& hull_of(const BodyScene& scene, HullStage& stage, int threads) {
  const std::vector<CameraContours> views = camera_contours(scene.cameras, scene.contours);
  HullOptions options;
  options.threads = threads;
  options.reuse = false;
  return stage.build(views, options, 0.0);
}

BodyError measure(const Hull& hull, const BodyScene& scene, bool psnr) {
  const TriangleSurface surface = surface_of(hull);
  BodyError error;
  error.unsound = check_mesh(hull).manifold() ? 0.0 : 1.0;
  error.volume = volume_of(surface) / volume_of(scene.truth);
  const SurfaceDistance out = distance_between(surface, scene.truth, samples);
  const SurfaceDistance in = distance_between(scene.truth, surface, samples);
  error.mean = 500.0 * (out.mean + in.mean);
  error.hausdorff = 1000.0 * std::max(out.p95, in.p95);

  silhouettes(surface, scene, error);
  const Mesh mesh = psnr ? textured_mesh(hull, scene, by_viewing_angle()) : Mesh();
  Painter painter(mesh);
  const auto views = static_cast<double>(scene.between.size());
  for (std::size_t k = 0; k < scene.between.size(); ++k) {
    const Picture coverage = coverage_of(surface, scene.between[k]);
    error.overlap += overlap_of(coverage, scene.seen[k]) / views;
    if (!psnr) continue;
    error.psnr += psnr_of(painter.draw(scene.between[k]), scene.seen[k], coverage) / views;
  }
  return error;
}

double distance_mm(const TriangleSurface& a, const TriangleSurface& b) {
  return 500.0 * (distance_between(a, b, samples).mean + distance_between(b, a, samples).mean);
}

Picture coverage_of(const TriangleSurface& surface, const Camera& camera) {
  const std::vector<Vec3f> positions(surface.vertices.begin(), surface.vertices.end());
  std::vector<std::uint32_t> triangles;
  for (const auto& t : surface.triangles) triangles.insert(triangles.end(), t.begin(), t.end());
  return polyhull::coverage_of(positions, triangles, camera);
}

Picture plaster(const TriangleSurface& surface, const Camera& camera) {
  const std::vector<Vec3f> positions(surface.vertices.begin(), surface.vertices.end());
  std::vector<std::uint32_t> triangles;
  for (const auto& t : surface.triangles) triangles.insert(triangles.end(), t.begin(), t.end());
  const Vec3 lamp = glm::normalize(glm::transpose(camera.R) * Vec3(-0.5, -0.6, -1.0));
  Picture out = empty_picture(camera, 3);
  CoverageRaster::Mesh mesh;
  mesh.positions = positions;
  mesh.triangles = triangles;
  CoverageRaster().draw(camera, mesh, [&](int y, std::span<const CoveredPixel> pixels) {
    for (const CoveredPixel& pixel : pixels) {
      double light = 0.0;
      for (int i = 0; i < pixel.fragment_count; ++i) {
        const auto& t = surface.triangles[pixel.fragments[i].triangle];
        const Vec3& a = surface.vertices[t[0]];
        const Vec3 normal = glm::cross(surface.vertices[t[1]] - a, surface.vertices[t[2]] - a);
        const double length = glm::length(normal);
        const double facing = length > 0.0 ? glm::dot(normal, lamp) / length : 0.0;
        light += pixel.fragments[i].weight * std::max(facing, 0.0);
      }
      const double value = pixel.coverage * (30.0 + 215.0 * light) + (1.0 - pixel.coverage) * grey;
      std::fill_n(out.row(y) + 3 * pixel.x, 3, static_cast<std::uint8_t>(std::lround(value)));
    }
  });
  return out;
}

Mesh mesh_of(const Hull& hull, const BodyScene& scene) {
  Mesh mesh;
  mesh.hull = hull;
  for (std::size_t k = 0; k < scene.cameras.size(); ++k) {
    const Picture& picture = scene.pictures[k];
    MeshView out;
    out.calibration = scene.cameras[k];
    out.view.camera = out.calibration.name;
    out.view.width = picture.width;
    out.view.height = picture.height;
    out.view.roi = {0, 0, picture.width, picture.height};
    out.view.contours = scene.contours[k];
    out.view.format = PixelFormat::rgba;
    out.view.stride = 4 * picture.width;
    out.view.pixels = picture.pixels;
    mesh.views.push_back(std::move(out));
  }
  return mesh;
}

Picture drawn(const Mesh& mesh, const Camera& camera) {
  return Painter(mesh).draw(camera);
}

Picture textured(const Hull& hull, const BodyScene& scene, const Camera& camera) {
  const Mesh mesh = textured_mesh(hull, scene, by_viewing_angle());
  return Painter(mesh).draw(camera);
}

std::vector<double> psnr_from(const Hull& hull, const BodyScene& scene,
                              const TextureSettings& settings, const std::vector<Camera>& cameras,
                              const std::vector<Picture>& seen) {
  const TriangleSurface surface = surface_of(hull);
  const Mesh mesh = textured_mesh(hull, scene, settings);
  Painter painter(mesh);
  std::vector<double> out;
  for (std::size_t k = 0; k < cameras.size(); ++k)
    out.push_back(psnr_of(painter.draw(cameras[k]), seen[k], coverage_of(surface, cameras[k])));
  return out;
}

}  // namespace polyhull::test
