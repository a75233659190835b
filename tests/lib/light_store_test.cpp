// SPDX-License-Identifier: LGPL-2.1-or-later
#include "raytrace/light_store.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <string>

#include "base/error.h"
#include "builtin/shapes.h"
#include "support/folder.h"
#include "support/refusal.h"

namespace polyhull {
namespace {

namespace fs = std::filesystem;

/// A red box on a floor under a lamp, one of them double-sided.
Scene small_scene() {
  Scene scene;
  scene.name = "small";
  scene.materials.resize(2);
  scene.materials[0].base_colour = {0.8f, 0.1f, 0.1f};
  scene.materials[1].double_sided = true;
  scene.meshes = {box("box", 0, {-0.3f, 0, -0.3f}, {0.3f, 0.6f, 0.3f}),
                  parallelogram("floor", 1, {-1, 0, 1}, {2, 0, 0}, {0, 0, -2})};
  Light lamp;
  lamp.centre = {0.2f, 2.0f, 0.1f};
  lamp.u = {0.3f, 0, 0};
  lamp.v = {0, 0, 0.3f};
  lamp.radiance = Vec3f(5.0f, 4.0f, 3.0f);
  scene.lights = {lamp};
  return scene;
}

class LightStore : public ::testing::Test {
 protected:
  fs::path only_file() const {
    EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 1);
    return fs::directory_iterator(folder)->path();
  }
  std::unique_ptr<LightCache> load() const { return load_light(scene, options, folder); }

  const test::Folder own;
  const fs::path folder = own / "light";
  TracedScene scene{small_scene()};
  LightCacheOptions options{.spacing = 0.1f, .bounce_spacing = 0.3f};
};

TEST_F(LightStore, WhatWasKeptIsTheSame) {
  EXPECT_EQ(load(), nullptr);
  const LightCache made(scene, options);
  store_light(made, scene, options, folder / "deeper" / "still");
  const auto found = load_light(scene, options, folder / "deeper" / "still");
  ASSERT_NE(found, nullptr);
  EXPECT_EQ(found->mean_bounced(), made.mean_bounced());
  EXPECT_EQ(found->rays(), 0u);
  EXPECT_EQ(found->nodes(), made.nodes());
  for (std::uint32_t mesh = 0; mesh < 2; ++mesh) {
    for (const bool back : {false, true}) {
      RayHit hit;
      hit.mesh = mesh;
      hit.triangle = 1;
      hit.u = 0.3f;
      hit.v = 0.2f;
      hit.distance = 1.0f;
      EXPECT_EQ(found->irradiance(hit, back), made.irradiance(hit, back)) << mesh << back;
      EXPECT_GT(made.irradiance(hit, back).x + static_cast<float>(back), 0.0f);
    }
  }
}

TEST_F(LightStore, AnotherSceneOrOptionIsNotFound) {
  store_light(LightCache(scene, options), scene, options, folder);
  EXPECT_NE(load(), nullptr);
  LightCacheOptions finer = options;
  finer.spacing = 0.09f;
  EXPECT_EQ(load_light(scene, finer, folder), nullptr);
  const auto found_after = [&](auto&& change) {
    Scene other = small_scene();
    change(other);
    const TracedScene traced(std::move(other));
    return load_light(traced, options, folder) != nullptr;
  };
  EXPECT_TRUE(found_after([](Scene& s) { s.exposure = 2.0f; }));  // which is no light
  EXPECT_FALSE(found_after([](Scene& s) { s.lights[0].centre.x += 0.01f; }));
  EXPECT_FALSE(found_after([](Scene& s) { s.lights[0].radiance.y *= 1.01f; }));
  EXPECT_FALSE(found_after([](Scene& s) { s.materials[0].base_colour.x = 0.7f; }));
  EXPECT_FALSE(found_after([](Scene& s) { s.materials[1].double_sided = false; }));
  EXPECT_FALSE(found_after([](Scene& s) { s.meshes[0].positions[3].y += 1e-3f; }));
}

TEST_F(LightStore, DamagedFilesAreNotUsed) {
  store_light(LightCache(scene, options), scene, options, folder);
  const fs::path path = only_file();
  const auto size = fs::file_size(path);
  for (const std::uintmax_t place :
       {std::uintmax_t{3}, std::uintmax_t{9}, std::uintmax_t{25}, std::uintmax_t{60}, size - 1}) {
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    file.seekg(static_cast<std::streamoff>(place));
    const int byte = file.get();
    file.seekp(static_cast<std::streamoff>(place));
    file.put(static_cast<char>(byte ^ 0x10));
    file.close();
    EXPECT_EQ(load(), nullptr) << "byte " << place;
    std::fstream again(path, std::ios::in | std::ios::out | std::ios::binary);
    again.seekp(static_cast<std::streamoff>(place));
    again.put(static_cast<char>(byte));
  }
  EXPECT_NE(load(), nullptr);
  for (const std::uintmax_t length : {size - 16, size / 2, std::uintmax_t{40}, std::uintmax_t{0}}) {
    fs::resize_file(path, length);
    EXPECT_EQ(load(), nullptr) << length << " bytes";
  }
  store_light(LightCache(scene, options), scene, options, folder);  // takes its place
  EXPECT_NE(load(), nullptr);
}

TEST_F(LightStore, SixteenAreKept) {
  const LightCache light(scene, options);
  LightCacheOptions other = options;
  for (int i = 0; i < 20; ++i) {
    other.first_samples = 1 + i;
    store_light(light, scene, other, folder);
    other.first_samples = 1;
    EXPECT_NE(load_light(scene, other, folder), nullptr) << "what is used stays";
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 16);
}

TEST_F(LightStore, WhatCannotBeWrittenIsSaid) {
  std::ofstream(folder) << "a file";
  test::expect_refused([&] { store_light(LightCache(scene, options), scene, options, folder); },
                       {folder.string(), "light-cache"});
}

}  // namespace
}  // namespace polyhull
