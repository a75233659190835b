// SPDX-License-Identifier: LGPL-2.1-or-later
#include "view/raster_view.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>

#include "base/instruction_set.h"
#include "base/srgb.h"
#include "builtin/room.h"
#include "builtin/shapes.h"
#include "raytrace/loops/view_loops.h"
#include "raytrace/path_tracer.h"
#include "support/picture_error.h"
#include "support/quick_light.h"

namespace polyhull {
namespace {

struct Lit {
  explicit Lit(Scene scene) : traced(std::move(scene)), light(traced, synthetic::quick_light(32)) {}
  TracedScene traced;
  LightCache light;

  std::vector<Vec3f> raster(const Camera& camera, const ViewOptions& options = {},
                            ViewStatistics* statistics = nullptr) const {
    std::vector<Vec3f> picture(static_cast<std::size_t>(camera.width) * camera.height);
    RasterView(traced, light).draw(camera, options, picture, statistics);
    return picture;
  }
  /// Eight rays in every pixel.
  std::vector<Vec3f> rays(const Camera& camera) const {
    std::vector<Vec3f> picture(static_cast<std::size_t>(camera.width) * camera.height);
    ViewOptions options;
    options.contrast = -1.0f;
    render_view(traced, light, camera, options, picture);
    return picture;
  }
};

double psnr(const std::vector<Vec3f>& a, const std::vector<Vec3f>& b, const Camera& camera) {
  return synthetic::psnr(develop(a, 1.0f, camera.width, camera.height),
                         develop(b, 1.0f, camera.width, camera.height));
}

/// The share of pixels that differ by more than \p levels of sRGB in a colour.
double share_off(const std::vector<Vec3f>& a, const std::vector<Vec3f>& b, const Camera& camera,
                 int levels) {
  const Picture p = develop(a, 1.0f, camera.width, camera.height);
  const Picture q = develop(b, 1.0f, camera.width, camera.height);
  int off = 0;
  for (std::size_t i = 0; i < p.pixels.size(); i += 4) {
    int most = 0;
    for (std::size_t k = 0; k < 3; ++k)
      most = std::max(most, std::abs(p.pixels[i + k] - q.pixels[i + k]));
    off += most > levels;
  }
  return off / static_cast<double>(a.size());
}

/// A floor of \p floor, a box, a sheet of which both sides are seen, and a lamp.
Scene simple_scene(const Material& floor) {
  Scene scene;
  scene.materials.resize(4);
  scene.materials[0] = floor;
  scene.materials[1].base_colour = {0.7f, 0.2f, 0.1f};
  scene.materials[2].base_colour = {0.2f, 0.6f, 0.3f};
  scene.materials[2].double_sided = true;
  scene.materials[3].emission = Vec3f(0.4f);
  scene.meshes = {parallelogram("floor", 0, {-2, 0, 2}, {4, 0, 0}, {0, 0, -4}),
                  box("box", 1, {-0.8f, 0.02f, -0.4f}, {-0.2f, 0.7f, 0.2f}),
                  parallelogram("sheet", 2, {0.2f, 0.4f, -0.6f}, {0.9f, 0, 0}, {0, 0.2f, 0.9f}),
                  parallelogram("lamp", 3, {-0.5f, 1.6f, -0.4f}, {1, 0, 0}, {0, 0, 0.8f})};
  Light lamp;
  lamp.centre = {0, 1.6f, 0};
  lamp.u = {0.5f, 0, 0};
  lamp.v = {0, 0, 0.4f};
  lamp.radiance = Vec3f(6.0f);
  lamp.mesh = 3;
  scene.lights = {lamp};
  scene.mirrors = find_mirrors(scene);
  return scene;
}

Material polished(float metallic) {
  Material material;
  material.base_colour = {0.5f, 0.6f, 0.7f};
  material.roughness = 0.0f;
  material.metallic = metallic;
  return material;
}

const Camera above = look_at({1.1, 1.3, 2.0}, {0, 0.4, 0}, 50, 200, 120);

TEST(RasterView, IsTheRaysPicture) {
  // From above, from below the sheet and the floor, and of the lamp's dark back.
  const Lit lit(simple_scene(Material{}));
  for (const Vec3& eye : {Vec3(1.1, 1.3, 2.0), Vec3(0.9, 0.1, 1.5), Vec3(-0.4, -0.8, 1.6),
                          Vec3(0.3, 2.6, 0.9), Vec3(0.0, 1.5, 0.1)}) {
    const Camera camera = look_at(eye, {0, 0.4, 0}, 60, 200, 120);
    const auto raster = lit.raster(camera), rays = lit.rays(camera);
    EXPECT_GT(psnr(raster, rays, camera), 39.0) << eye.x << " " << eye.y;
    EXPECT_LT(share_off(raster, rays, camera, 2), 0.022) << eye.x << " " << eye.y;
  }
}

// Some millimetres large, and that far from the eye.
TEST(RasterView, SmallScenesAreWhole) {
  constexpr float scale = 0.003f;
  Scene scene = simple_scene(Material{});
  for (SceneMesh& mesh : scene.meshes)
    for (Vec3f& position : mesh.positions) position *= scale;
  for (Vec3f* vector : {&scene.lights[0].centre, &scene.lights[0].u, &scene.lights[0].v})
    *vector *= scale;
  const Lit lit(std::move(scene));
  const Camera camera =
      look_at(double{scale} * Vec3(1.1, 1.3, 2.0), double{scale} * Vec3(0, 0.4, 0), 60, 200, 120);
  const auto raster = lit.raster(camera), rays = lit.rays(camera);
  EXPECT_GT(psnr(raster, rays, camera), 39.0);
  EXPECT_LT(share_off(raster, rays, camera, 2), 0.022);
}

TEST(RasterView, PlanarMirrorsAreRasterised) {
  for (const float metallic : {0.0f, 1.0f}) {
    const Lit lit(simple_scene(polished(metallic)));
    ASSERT_EQ(lit.traced.scene().mirrors.size(), 1u);
    ViewStatistics statistics;
    const auto raster = lit.raster(above, {}, &statistics), rays = lit.rays(above);
    EXPECT_EQ(statistics.rays, 0u);
    EXPECT_GT(statistics.smoothed, 100u);
    EXPECT_GT(psnr(raster, rays, above), 44.0) << metallic;
    EXPECT_LT(share_off(raster, rays, above, 2), 0.012) << metallic;
    ViewOptions none;
    none.mirror_depth = 0;
    std::vector<Vec3f> without(raster.size());
    none.contrast = -1.0f;
    render_view(lit.traced, lit.light, above, none, without);
    EXPECT_GT(psnr(lit.raster(above, none), without, above), 44.0) << metallic;
    EXPECT_GT(share_off(raster, without, above, 2), 0.02) << "that the mirror shows something";
  }
}

TEST(RasterView, OtherMirrorsAreTraced) {
  // A mirror from behind; a mirror that stands on a mirror; a ball; a mirror that is but a sliver.
  Scene scene = simple_scene(polished(0.5f));
  scene.materials.push_back(polished(0.9f));
  scene.meshes.push_back(parallelogram("wall", 4, {-1.5f, 0.1f, -1.2f}, {3, 0, 0}, {0, 1.2f, 0}));
  scene.meshes.push_back(sphere("ball", 4, {0.3f, 0.25f, 0.7f}, 0.25f, 24));
  scene.meshes.push_back(
      parallelogram("sliver", 4, {-1.2f, 0.3f, 0.6f}, {0.3f, 0, 0.05f}, {0, 0.05f, 0.0f}));
  scene.mirrors = find_mirrors(scene);
  ASSERT_EQ(scene.mirrors.size(), 3u);
  const Lit lit(scene);
  for (const Vec3& eye : {Vec3(1.1, 1.3, 2.0), Vec3(-0.6, 0.9, -2.0), Vec3(0.4, -0.7, 2.0)}) {
    const Camera camera = look_at(eye, {0, 0.4, 0}, 60, 200, 120);
    ViewStatistics statistics;
    const auto raster = lit.raster(camera, {}, &statistics), rays = lit.rays(camera);
    EXPECT_GT(statistics.rays, 0u);
    EXPECT_LT(statistics.rays, 60000u) << "of 192000 camera rays";
    EXPECT_GT(psnr(raster, rays, camera), 42.0) << eye.x << " " << eye.y;
    EXPECT_LT(share_off(raster, rays, camera, 3), 0.02) << eye.x << " " << eye.y;
  }
}

TEST(RasterView, TheRoomOnOneThreadOrManyAndMovedALittle) {
  const Lit lit(room_scene());
  const auto at = [](double x) {
    return look_at({1.15 + x, 1.5, 2.75}, {x, 0.98, 0}, 52, 320, 180);
  };
  const auto many = lit.raster(at(0.0));
  ViewOptions one;
  one.threads = 1;
  EXPECT_EQ(lit.raster(at(0.0), one), many);
  const auto rays = lit.rays(at(0.0));
  EXPECT_GT(psnr(many, rays, at(0.0)), 45.0);
  EXPECT_LT(share_off(many, rays, at(0.0), 4), 0.03);
  // A tenth of a pixel on: no pixel jumps, as noise would.
  const auto moved = lit.raster(at(0.0005));
  EXPECT_GT(psnr(many, moved, at(0.0)), 51.0);
  EXPECT_LT(share_off(many, moved, at(0.0), 16), 0.001);
}

TEST(RasterView, OddSizesAndPlaces) {
  const Lit lit(simple_scene(polished(0.0f)));
  for (const auto& [width, height] : {std::pair(1, 1), std::pair(3, 40), std::pair(133, 17)}) {
    const Camera camera = look_at({1.1, 1.3, 2.0}, {0, 0.4, 0}, 50, width, height);
    for (const Vec3f& value : lit.raster(camera)) EXPECT_TRUE(std::isfinite(value.x + value.y));
  }
  // In the box, in the mirror's plane, in the lamp's, far away, and with nothing in sight.
  for (const Vec3& eye : {Vec3(-0.5, 0.3, 0), Vec3(1.5, 0, 1.5), Vec3(0.1, 1.6, 2),
                          Vec3(3e4, 2e4, 4e4), Vec3(1e-3, 0.4, 1e-3)}) {
    for (const Vec3f& value : lit.raster(look_at(eye, {0, 0.4, 0}, 50, 60, 40)))
      EXPECT_TRUE(std::isfinite(value.x + value.y + value.z)) << eye.x;
  }
  Camera away = above;
  away.t = -(away.R * Vec3(0, 50, 0));
  away.R = look_at({0, 0, 0}, {0, 5, 1}, 50, 1, 1).R;
  away.t = -(away.R * Vec3(0, 50, 0));
  for (const Vec3f& value : lit.raster(away)) EXPECT_EQ(value, Vec3f(0.0f));
}

TEST(ViewLoops, SameBitsForEveryInstructionSet) {
#if defined(__x86_64__)
  if (!has_avx2()) GTEST_SKIP() << "this machine has no AVX2";
  std::mt19937 random(7);
  const auto number = [&](float low, float high) {
    return std::uniform_real_distribution<float>(low, high)(random);
  };
  Picture picture{37, 21, 4, std::vector<std::uint8_t>(37 * 21 * 4)};
  for (auto& byte : picture.pixels) byte = static_cast<std::uint8_t>(random());
  const FilteredTexture texture(picture);
  std::vector<Float4> nodes(20 * 11);
  for (Float4& node : nodes) node = Float4{number(0, 2), number(0, 2), number(0, 2), 0.0f};
  std::vector<Float4> borders(3 * border_nodes);
  for (Float4& node : borders) node = Float4{number(0, 2), number(0, 2), number(0, 2), 0.0f};
  for (int i = 0; i < 60; ++i) nodes[random() % nodes.size()][3] = static_cast<float>(1 + i % 3);
  const ViewLoops &a = ViewLoops::baseline(), &b = ViewLoops::avx2();
  for (int round = 0; round < 200; ++round) {
    constexpr int most = 104;
    const int count = 1 + static_cast<int>(random() % most);
    float depth[most], right[most], down[most], depths[2][most] = {};
    for (float& d : depth) d = number(0.3f, 20.0f);
    for (float& r : right) r = number(-0.5f, 0.5f);
    for (float& d : down) d = number(-0.5f, 0.5f);
    const PlaceRow places{count, right, down};
    std::uint32_t ids[8 * most];
    for (std::uint32_t& id : ids) id = 7;
    std::uint8_t same[2][most] = {};
    std::uint32_t one[2][most] = {};
    for (int k = 0; k < most; k += 1 + static_cast<int>(random() % 5))
      ids[8 * k + random() % 8] = 9;
    const auto course = [&] {
      return RowCourse{number(-3, 3), number(-.1f, .1f), number(-.1f, .1f)};
    };
    std::vector<Float4> values[2] = {{most, Float4{}}, {most, Float4{}}},
                        looks[2] = {values[0], values[0]};
    float fifth[2][most] = {}, pictures[2][3 * most] = {};
    const LightRow light{depth, course(), course(), nodes.data(),  borders.data(),
                         20,    19,       10,       round % 2 == 1};
    const RowCourse inverse = course();
    const TextureRow row{count, depth, course(), course(), course()};
    RayRow rays{count, {}, {}, {0.0f, 0.6f, 0.8f}};
    for (int k = 0; k < 3; ++k)
      rays.direction[k] = number(-1, 1), rays.step[k] = number(-.01f, .01f);
    for (int i = 0; i < 2; ++i) {
      const ViewLoops& loops = i == 0 ? a : b;
      loops.depths(inverse, places, depths[i]);
      loops.light(light, places, values[i].data());
      loops.texture(texture.levels(), row, places, values[i].data());
      loops.alike(ids, count, same[i], one[i]);
      loops.texels(texture.levels(), row, looks[i].data());
      loops.fresnel(rays, fifth[i]);
      ColourRow colours{count, {.5f, .6f, .7f, 0}, {.1f, .1f, .2f, 0},
                        depth, fifth[i],           {.1f, .2f, .3f, 0},
                        .5f,   fifth[i],           {.4f, .3f, .2f, 0}};
      loops.add(colours, values[i].data(), pictures[i]);
    }
    EXPECT_EQ(std::memcmp(depths[0], depths[1], sizeof depths[0]), 0);
    EXPECT_EQ(std::memcmp(same[0], same[1], sizeof same[0]), 0);
    for (int k = 0; k < count; ++k) {
      EXPECT_EQ(same[0][k] != 0, std::count(ids + 8 * k, ids + 8 * k + 8, ids[8 * k]) == 8);
      EXPECT_EQ(one[0][k], ids[8 * k]);
      EXPECT_EQ(one[1][k], ids[8 * k]);
    }
    EXPECT_EQ(std::memcmp(values[0].data(), values[1].data(), count * sizeof(Float4)), 0);
    EXPECT_EQ(std::memcmp(looks[0].data(), looks[1].data(), count * sizeof(Float4)), 0);
    EXPECT_EQ(std::memcmp(fifth[0], fifth[1], sizeof fifth[0]), 0);
    EXPECT_EQ(std::memcmp(pictures[0], pictures[1], sizeof pictures[0]), 0);
  }
#endif
}

TEST(ViewLoops, EncodesAsSingleNumbersAre) {
  std::vector<float> picture{-1.0f, 0.0f, -0.0f, 1.0f, 2.0f, NAN, INFINITY, -INFINITY, 1e-9f};
  std::mt19937 random(3);
  while (picture.size() < 3 * 131) picture.push_back(std::ldexp(1.1f * (random() % 4096), -12));
  std::vector<const ViewLoops*> sets{&ViewLoops::baseline()};
#if defined(__x86_64__)
  if (has_avx2()) sets.push_back(&ViewLoops::avx2());
#endif
  for (const ViewLoops* loops : sets)
    for (const int red : {0, 2})
      for (const int count : {1, 3, 64, 130}) {
        std::vector<std::uint8_t> pixels(4 * 131, 7);
        loops->encode(picture.data(), count, linear_to_srgb_table(), red, pixels.data());
        for (int i = 0; i < count; ++i) {
          EXPECT_EQ(pixels[4 * i + red], linear_to_srgb(picture[3 * i])) << i;
          EXPECT_EQ(pixels[4 * i + 1], linear_to_srgb(picture[3 * i + 1])) << i;
          EXPECT_EQ(pixels[4 * i + 2 - red], linear_to_srgb(picture[3 * i + 2])) << i;
          EXPECT_EQ(pixels[4 * i + 3], 255);
        }
        EXPECT_EQ(pixels[4 * count], 7);
      }
}

// A run's place beside a pixel's middle looks up what another run has in its middle.
TEST(ViewLoops, PlacesMayLieBesideTheMiddles) {
  Picture picture{64, 64, 4, std::vector<std::uint8_t>(64 * 64 * 4, 255)};
  for (int i = 0; i < 64 * 64; ++i)
    for (int k = 0; k < 3; ++k)
      picture.pixels[4 * i + k] = static_cast<std::uint8_t>(3 * (i % 64) + (i / 64) % (20 * k + 5));
  const FilteredTexture texture(picture);
  std::vector<Float4> nodes(9 * 9);
  for (std::size_t i = 0; i < nodes.size(); ++i)
    nodes[i] = Float4{static_cast<float>(i % 9), static_cast<float>(i / 9), 1.0f, 0.0f};
  constexpr int count = 11;
  const RowCourse inverse{0.5f, 0.01f, -0.02f}, u{0.1f, 0.004f, 0.001f}, v{0.2f, -0.002f, 0.005f};
  const RowCourse x{1.0f, 0.1f, 0.03f}, y{2.0f, -0.05f, 0.2f};
  const float right = 0.3f, down = -0.4f;
  const auto moved = [&](const RowCourse& c) {
    return RowCourse{c.start + right * c.dx + down * c.dy, c.dx, c.dy};
  };
  constexpr int room = 16;
  const std::vector<float> none(room), across(room, right), below(room, down);
  const auto look = [&](bool by_places) {
    const auto course = [&](const RowCourse& c) { return by_places ? c : moved(c); };
    const PlaceRow places{count, (by_places ? across : none).data(),
                          (by_places ? below : none).data()};
    std::vector<float> depth(room);
    std::vector<Float4> values(count);
    ViewLoops::best().depths(course(inverse), places, depth.data());
    ViewLoops::best().light(
        {depth.data(), course(x), course(y), nodes.data(), nullptr, 9, 8, 8, false}, places,
        values.data());
    ViewLoops::best().texture(texture.levels(),
                              {count, depth.data(), course(inverse), course(u), course(v)}, places,
                              values.data());
    return values;
  };
  const std::vector<Float4> beside = look(true), middles = look(false);
  for (int i = 0; i < count; ++i)
    for (int k = 0; k < 3; ++k) {
      EXPECT_GT(middles[i][k], 0.02f);
      EXPECT_NEAR(beside[i][k], middles[i][k], 1e-4f) << i << " " << k;
    }
}

TEST(FilteredTexture, IsThePictureAndItsMean) {
  Picture picture{5, 3, 4, std::vector<std::uint8_t>(5 * 3 * 4)};
  for (int i = 0; i < 15; ++i) {
    for (int k = 0; k < 3; ++k)
      picture.pixels[4 * i + k] = static_cast<std::uint8_t>(17 * i + 5 * k);
  }
  const FilteredTexture texture(picture);
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 5; ++x) {
      const std::uint8_t* p = picture.row(y) + 4 * x;
      const Vec3f expected(srgb_to_linear(p[0]), srgb_to_linear(p[1]), srgb_to_linear(p[2]));
      // At texels' middles, repeats away, and between two texels across the picture's border.
      const Vec2f uv((static_cast<float>(x) + 0.5f) / 5.0f, (static_cast<float>(y) + 0.5f) / 3.0f);
      EXPECT_LT(glm::length(texture.at(uv) - expected), 0.003f) << x << " " << y;
      EXPECT_LT(glm::length(texture.at(uv + Vec2f(-7.0f, 12.0f)) - expected), 0.003f);
    }
  }
  const Vec3f seam = 0.5f * (texture.at({0.1f, 0.5f}) + texture.at({0.9f, 0.5f}));
  EXPECT_LT(glm::length(texture.at({0.0f, 0.5f}) - seam), 0.001f);
  EXPECT_LT(glm::length(texture.at({1.0f, 0.5f}) - seam), 0.001f);
  const Vec3f far = texture.over({0.3f, 0.3f}, {4.0f, 0.0f}, {0.0f, 4.0f});
  EXPECT_LT(glm::length(far - texture.over({0.8f, 0.1f}, {4.0f, 0.0f}, {0.0f, 4.0f})), 1e-5f);
  EXPECT_TRUE(std::isfinite(far.x));
}

TEST(FilteredTexture, OneLookIsAsCoarseAsThePixel) {
  // Columns black and white: the finest level has them, the others their mean.
  Picture picture{64, 64, 4, std::vector<std::uint8_t>(64 * 64 * 4, 255)};
  for (int i = 0; i < 64 * 64; ++i)
    if (i % 2) std::fill_n(&picture.pixels[4 * i], 3, std::uint8_t{0});
  const FilteredTexture texture(picture);
  const auto look = [&](float columns, float rows, float depth) {
    // At the middle of texel (6, 3), a pixel as large as so many texels; all but at depth 1 the
    // steps grow with it.
    const float u = 6.5f / 64.0f, v = 3.5f / 64.0f;
    Float4 value;
    ViewLoops::best().texels(texture.levels(),
                             {1,
                              &depth,
                              {1.0f / depth, 0.0f, 0.0f},
                              {u / depth, columns / 64.0f / depth, 0.0f},
                              {v / depth, 0.0f, rows / 64.0f / depth}},
                             &value);
    return value[0];
  };
  for (const float depth : {0.5f, 1.0f, 7.0f}) {
    EXPECT_NEAR(look(0.1f, 0.1f, depth), 1.0f, 0.01f) << depth;
    EXPECT_NEAR(look(1.3f, 1.3f, depth), 1.0f, 0.01f) << depth;  // nearer to a texel than to two
    EXPECT_NEAR(look(1.6f, 1.6f, depth), 0.5f, 0.01f) << depth;
    EXPECT_NEAR(look(0.8f, 3.2f, depth), 0.5f, 0.01f) << depth;  // the same area
    EXPECT_NEAR(look(1e6f, 1e6f, depth), 0.5f, 0.01f) << depth;
  }
}

}  // namespace
}  // namespace polyhull
