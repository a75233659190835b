// SPDX-License-Identifier: LGPL-2.1-or-later
#include "builtin/room.h"

#include <array>
#include <cmath>
#include <numbers>

#include "base/error.h"
#include "builtin/kept_pictures.h"
#include "builtin/room_textures.h"
#include "builtin/shapes.h"

namespace polyhull {
namespace {

constexpr float half = room_half, ceiling = room_height;
constexpr float pi = std::numbers::pi_v<float>;

class Room {
 public:
  /// \p kept: the room's textures, perhaps, as they were computed before.
  explicit Room(std::vector<Picture> kept) : kept_(std::move(kept)) {}

  /// Whether a texture was not as it was before.
  bool painted() const { return painted_; }

  Scene build() {
    scene_.name = "builtin:room";
    shell();
    lamp();
    pillar();
    table();
    bookshelf();
    pictures();
    bench();
    plant();
    scene_.mirrors = find_mirrors(scene_);
    scene_.exposure = 1.8f;
    scene_.cameras.push_back(look_at({1.15, 1.5, 2.75}, {0.0, 0.98, 0.0}, 52.0, 1280, 720));
    scene_.cameras.back().name = "entrance";
    return std::move(scene_);
  }

 private:
  int material(const char* name, const Vec3f& colour, float roughness = 1.0f, int texture = -1) {
    Material material;
    material.name = name;
    material.base_colour = colour;
    material.roughness = roughness;
    material.base_colour_texture = texture;
    scene_.materials.push_back(std::move(material));
    return static_cast<int>(scene_.materials.size()) - 1;
  }

  /// The next texture as it was computed before, if it was.
  Picture kept() {
    const std::size_t next = scene_.textures.size();
    Picture out = next < kept_.size() ? std::move(kept_[next]) : Picture{};
    kept_pixels_ = out.pixels.data();
    return out;
  }

  int texture(Picture picture) {
    painted_ |= picture.pixels.data() != kept_pixels_;
    scene_.textures.push_back(std::move(picture));
    return static_cast<int>(scene_.textures.size()) - 1;
  }

  int add(SceneMesh mesh) {
    scene_.meshes.push_back(std::move(mesh));
    return static_cast<int>(scene_.meshes.size()) - 1;
  }

  void shell() {
    const float w = 2.0f * half;
    const int stone =
        material("polished stone", Vec3f(1.0f), 0.0f, texture(stone_texture(768, kept())));
    // Hard, dense stone under a coat of polish: about a seventh of the light is mirrored straight
    // on.
    scene_.materials[stone].ior = 2.2f;
    add(parallelogram("floor", stone, {-half, 0, half}, {w, 0, 0}, {0, 0, -w}, Vec2f(4.0f)));
    add(parallelogram("ceiling", material("ceiling", Vec3f(0.82f, 0.81f, 0.78f)),
                      {-half, ceiling, -half}, {w, 0, 0}, {0, 0, w}));
    const Vec3f up(0, ceiling, 0);
    add(parallelogram("wall -z", material("teal", {0.055f, 0.225f, 0.245f}), {-half, 0, -half},
                      {w, 0, 0}, up));
    add(parallelogram("wall +z", material("ochre", {0.62f, 0.39f, 0.14f}), {half, 0, half},
                      {-w, 0, 0}, up));
    add(parallelogram("wall -x", material("terracotta", {0.53f, 0.185f, 0.105f}), {-half, 0, half},
                      {0, 0, -w}, up));
    add(parallelogram("wall +x", material("cream", {0.74f, 0.68f, 0.56f}), {half, 0, -half},
                      {0, 0, w}, up));
    const int white = material("skirting", Vec3f(0.70f, 0.69f, 0.66f));
    const float h = 0.11f, d = 0.018f;
    SceneMesh skirting;
    append(skirting, box("skirting", white, {-half, 0, -half}, {half, h, -half + d}));
    append(skirting, box("skirting", white, {-half, 0, half - d}, {half, h, half}));
    append(skirting, box("skirting", white, {-half, 0, -half + d}, {-half + d, h, half - d}));
    append(skirting, box("skirting", white, {half - d, 0, -half + d}, {half, h, half - d}));
    add(std::move(skirting));
  }

  void lamp() {
    const Vec3f centre(0.45f, ceiling - 0.10f, 0.35f);
    const float a = 0.85f, b = 0.65f;  // half its length and width
    const int glow = material("lamp", Vec3f(0.8f));
    scene_.materials[glow].emission = Vec3f(12.5f, 11.6f, 10.3f);
    Light light;
    light.name = "lamp";
    light.centre = centre;
    light.u = Vec3f(a, 0, 0);
    light.v = Vec3f(0, 0, b);  // cross(u, v) = -y: it shines downwards
    light.radiance = scene_.materials[glow].emission;
    light.mesh = add(
        parallelogram("lamp", glow, centre - light.u - light.v, 2.0f * light.u, 2.0f * light.v));
    scene_.lights.push_back(light);
    const int metal = material("lamp frame", Vec3f(0.09f, 0.085f, 0.08f));
    const float low = centre.y, t = 0.03f;  // flush: a rim would shade the lamp everywhere a little
    SceneMesh frame;
    const Vec3f c = centre;
    append(frame, box("lamp frame", metal, {c.x - a - t, low, c.z - b - t},
                      {c.x + a + t, ceiling, c.z - b}));
    append(frame, box("lamp frame", metal, {c.x - a - t, low, c.z + b},
                      {c.x + a + t, ceiling, c.z + b + t}));
    append(frame,
           box("lamp frame", metal, {c.x - a - t, low, c.z - b}, {c.x - a, ceiling, c.z + b}));
    append(frame,
           box("lamp frame", metal, {c.x + a, low, c.z - b}, {c.x + a + t, ceiling, c.z + b}));
    add(std::move(frame));
  }

  void pillar() {
    const int marble = material("pillar", Vec3f(0.62f, 0.59f, 0.53f));
    const Vec3f foot(-1.25f, 0.0f, 1.05f);
    SceneMesh pillar;
    append(pillar,
           box("pillar", marble, foot - Vec3f(0.23f, 0, 0.23f), foot + Vec3f(0.23f, 0.09f, 0.23f)));
    const Vec2f c0(0.205f, 0.09f), c1(0.165f, 0.20f), c2(0.15f, ceiling - 0.24f);
    std::vector<Vec2f> profile = {c0, {0.215f, 0.115f}, {0.205f, 0.145f}, {0.178f, 0.155f}, c1};
    // The shaft in pieces of hand's length: long thin triangles would waste the cache of light.
    for (int i = 0; i <= 24; ++i) {
      const float t = static_cast<float>(i) / 24.0f;
      profile.emplace_back(std::lerp(c1.x, c2.x, t), std::lerp(c1.y, c2.y, t));
    }
    for (const Vec2f p : {Vec2f(0.175f, ceiling - 0.225f), Vec2f(0.175f, ceiling - 0.19f),
                          Vec2f(0.155f, ceiling - 0.18f), Vec2f(0.20f, ceiling - 0.09f)})
      profile.push_back(p);
    append(pillar, lathe("pillar", marble, foot, profile, 48));
    append(pillar, box("pillar", marble, foot + Vec3f(-0.22f, ceiling - 0.09f, -0.22f),
                       foot + Vec3f(0.22f, ceiling, 0.22f)));
    add(std::move(pillar));
  }

  void table() {
    const int wood = material("table", Vec3f(1.0f), 1.0f, texture(wood_texture(512, kept())));
    const Vec3f foot(1.45f, 0.0f, -1.30f);
    const float top = 0.74f, radius = 0.52f;
    const std::array<Vec2f, 18> profile = {
        Vec2f{0.0f, 0.0f},      {0.30f, 0.0f},           {0.30f, 0.0f},    {0.30f, 0.022f},
        {0.27f, 0.035f},        {0.09f, 0.06f},          {0.05f, 0.10f},   {0.04f, 0.20f},
        {0.055f, 0.36f},        {0.035f, 0.52f},         {0.035f, 0.62f},  {0.11f, 0.70f},
        {0.11f, 0.70f},         {radius - 0.02f, 0.70f}, {radius, 0.712f}, {radius, 0.728f},
        {radius - 0.012f, top}, {radius - 0.012f, top}};
    add(lathe("table", wood, foot, profile, 64));
    // The top is flat and has the grain of one board.
    SceneMesh disc = lathe("table top", wood, foot,
                           std::array{Vec2f(radius - 0.012f, top), Vec2f(0.0f, top)}, 64);
    for (std::size_t i = 0; i < disc.positions.size(); ++i) {
      disc.normals[i] = Vec3f(0, 1, 0);
      disc.texture_coordinates[i] = {0.9f * (disc.positions[i].x - foot.x),
                                     0.9f * disc.positions[i].z};
    }
    add(std::move(disc));

    const int glaze = material("vase", Vec3f(0.075f, 0.30f, 0.42f));
    const std::array<Vec2f, 16> vase = {
        Vec2f{0.0f, 0.0f}, {0.055f, 0.0f},   {0.055f, 0.0f},   {0.085f, 0.04f},
        {0.110f, 0.09f},   {0.118f, 0.14f},  {0.105f, 0.20f},  {0.075f, 0.25f},
        {0.042f, 0.30f},   {0.034f, 0.34f},  {0.040f, 0.375f}, {0.055f, 0.395f},
        {0.050f, 0.40f},   {0.034f, 0.375f}, {0.028f, 0.34f},  {0.0f, 0.33f}};
    add(lathe("vase", glaze, foot + Vec3f(0.16f, top, -0.14f), vase, 40));

    const int bowl = material("bowl", Vec3f(0.70f, 0.66f, 0.58f));
    const std::array<Vec2f, 12> bowl_profile = {
        Vec2f{0.0f, 0.0f}, {0.06f, 0.0f},   {0.06f, 0.0f},    {0.055f, 0.015f},
        {0.11f, 0.045f},   {0.145f, 0.09f}, {0.148f, 0.095f}, {0.142f, 0.096f},
        {0.138f, 0.09f},   {0.10f, 0.052f}, {0.05f, 0.03f},   {0.0f, 0.027f}};
    const Vec3f bowl_foot = foot + Vec3f(-0.15f, top, 0.13f);
    add(lathe("bowl", bowl, bowl_foot, bowl_profile, 40));
    const int orange = material("orange", Vec3f(0.80f, 0.30f, 0.035f));
    const int apple = material("apple", Vec3f(0.48f, 0.045f, 0.035f));
    const int lime = material("lime", Vec3f(0.36f, 0.50f, 0.07f));
    add(sphere("fruit", orange, bowl_foot + Vec3f(-0.042f, 0.078f, 0.024f), 0.041f, 24));
    add(sphere("fruit", orange, bowl_foot + Vec3f(0.044f, 0.078f, 0.022f), 0.040f, 24));
    add(sphere("fruit", apple, bowl_foot + Vec3f(0.002f, 0.080f, -0.050f), 0.041f, 24));
    add(sphere("fruit", lime, bowl_foot + Vec3f(0.001f, 0.132f, 0.004f), 0.034f, 24));
  }

  void bookshelf() {
    const int board = material("shelf", Vec3f(0.235f, 0.125f, 0.062f));
    const float x0 = half - 0.34f, x1 = half - 0.02f, z0 = 0.25f, z1 = 2.05f, top = 2.1f,
                t = 0.028f;
    SceneMesh shelf;
    append(shelf, box("bookshelf", board, {x0, 0, z0}, {x1, top, z0 + t}));
    append(shelf, box("bookshelf", board, {x0, 0, z1 - t}, {x1, top, z1}));
    append(shelf, box("bookshelf", board, {x1 - 0.01f, 0, z0 + t}, {x1, top, z1 - t}));
    constexpr int shelves = 6;
    const float pitch = (top - t - 0.08f) / (shelves - 1);
    for (int i = 0; i < shelves; ++i) {
      const float y = 0.08f + pitch * static_cast<float>(i);
      append(shelf, box("bookshelf", board, {x0, y, z0 + t}, {x1 - 0.01f, y + t, z1 - t}));
    }
    add(std::move(shelf));

    const std::array<Vec3f, 9> cloths = {
        Vec3f{0.42f, 0.07f, 0.055f}, {0.06f, 0.13f, 0.26f}, {0.60f, 0.45f, 0.20f},
        {0.08f, 0.22f, 0.13f},       {0.66f, 0.60f, 0.48f}, {0.20f, 0.08f, 0.14f},
        {0.05f, 0.24f, 0.27f},       {0.55f, 0.24f, 0.07f}, {0.10f, 0.10f, 0.11f}};
    std::vector<SceneMesh> books(cloths.size());
    std::vector<int> materials;
    for (const Vec3f& cloth : cloths) materials.push_back(material("book", cloth));
    std::uint32_t state = 12345;
    const auto random = [&](float low, float high) {
      state = state * 1664525u + 1013904223u;
      return low + (high - low) * static_cast<float>(state >> 8) * 0x1p-24f;
    };
    for (int i = 0; i + 1 < shelves; ++i) {
      const float y = 0.08f + pitch * static_cast<float>(i) + t;
      float z = z0 + t + random(0.005f, 0.05f);
      const float end = z1 - t - random(0.02f, 0.55f);
      while (true) {
        const float thick = random(0.022f, 0.062f);
        if (z + thick > end) break;
        const float tall = random(0.62f, 0.90f) * (pitch - t), deep = random(0.17f, 0.24f);
        const auto which = static_cast<std::size_t>(random(0.0f, 8.999f));
        append(books[which], box("books", materials[which], {x1 - 0.012f - deep, y, z},
                                 {x1 - 0.012f, y + tall, z + thick - 0.002f}));
        z += thick;
      }
    }
    for (std::size_t i = 0; i < books.size(); ++i) {
      books[i].material = materials[i];
      if (!books[i].triangles.empty()) add(std::move(books[i]));
    }
  }

  /// A flat picture with a frame around it: \p low is its lower left corner on the wall, \p across
  /// and \p up its edges, \p out the way from the wall into the room.
  void framed(const char* name, int canvas, int wood, const Vec3f& low, const Vec3f& across,
              const Vec3f& up, const Vec3f& out, float border) {
    add(parallelogram(name, canvas, low + 0.03f * out, across, up));
    add(picture_frame("picture frame", wood, low, across, up, 0.055f * out, border));
  }

  void pictures() {
    const int canvas =
        material("painting", Vec3f(0.92f), 1.0f, texture(painting_texture(768, 432, kept())));
    const int gilt = material("picture frame", Vec3f(0.36f, 0.235f, 0.085f));
    framed("painting", canvas, gilt, {-1.75f, 1.02f, -half}, {1.8f, 0, 0}, {0, 1.01f, 0}, {0, 0, 1},
           0.05f);
    const int black = material("print frame", Vec3f(0.035f));
    const char* const names[] = {"print 1", "print 2", "print 3"};
    for (int i = 0; i < 3; ++i) {
      const int print =
          material("print", Vec3f(1.0f), 1.0f,
                   texture(print_texture(320, 448, static_cast<unsigned>(i), kept())));
      framed(names[i], print, black, {1.62f - 0.78f * static_cast<float>(i), 1.22f, half},
             {-0.5f, 0, 0}, {0, 0.7f, 0}, {0, 0, -1}, 0.028f);
    }
    const int weave =
        material("tapestry", Vec3f(1.0f), 1.0f, texture(tapestry_texture(384, 512, kept())));
    add(parallelogram("tapestry", weave, {-half + 0.02f, 0.72f, 0.75f}, {0, 0, -1.35f},
                      {0, 1.8f, 0}));
    add(box("tapestry rod", gilt, {-half, 2.52f, -0.66f}, {-half + 0.035f, 2.55f, 0.81f}));
  }

  void bench() {
    const int oak = material("bench", Vec3f(0.30f, 0.155f, 0.07f));
    SceneMesh bench;
    const float z0 = half - 0.40f, z1 = half - 0.04f;
    append(bench, box("bench", oak, {-0.75f, 0.40f, z0}, {1.45f, 0.45f, z1}));
    for (const float x : {-0.62f, 1.25f})
      append(bench, box("bench", oak, {x, 0.0f, z0 + 0.04f}, {x + 0.07f, 0.40f, z1 - 0.04f}));
    append(bench, box("bench", oak, {-0.55f, 0.16f, half - 0.24f}, {1.25f, 0.21f, half - 0.20f}));
    add(std::move(bench));
    const int red = material("cushion", Vec3f(0.40f, 0.05f, 0.06f));
    add(box("cushion", red, {-0.70f, 0.45f, z0 + 0.01f}, {1.40f, 0.495f, z1 - 0.01f}));
  }

  void plant() {
    const Vec3f foot(-2.55f, 0.0f, -2.50f);
    const int clay = material("pot", Vec3f(0.66f, 0.63f, 0.58f));
    const std::array<Vec2f, 9> pot = {Vec2f{0.0f, 0.0f}, {0.15f, 0.0f},  {0.15f, 0.0f},
                                      {0.20f, 0.20f},    {0.22f, 0.40f}, {0.22f, 0.40f},
                                      {0.205f, 0.40f},   {0.20f, 0.36f}, {0.0f, 0.36f}};
    add(lathe("pot", clay, foot, pot, 40));
    const int leaf = material("leaf", Vec3f(0.085f, 0.235f, 0.055f));
    scene_.materials[leaf].double_sided = true;
    SceneMesh leaves;
    leaves.name = "leaves";
    leaves.material = leaf;
    constexpr int count = 26, steps = 10;
    for (int i = 0; i < count; ++i) {
      const float n = static_cast<float>(i);
      const float turn = 2.399963f * n;  // the golden angle, as plants do
      const float age = n / (count - 1);
      const float reach = std::lerp(0.16f, 0.62f, age), rise = std::lerp(1.25f, 0.55f, age);
      const Vec3f out(std::cos(turn), 0.0f, std::sin(turn)), side(-out.z, 0.0f, out.x);
      const auto base = static_cast<std::uint32_t>(leaves.positions.size());
      for (int k = 0; k <= steps; ++k) {
        const float t = static_cast<float>(k) / steps;
        const Vec3f spine = foot + Vec3f(0, 0.34f, 0) + reach * t * out +
                            Vec3f(0, rise * (1.9f * t - (0.75f + 0.9f * age) * t * t), 0);
        const float width = 0.052f * std::sin(pi * std::pow(t, 0.75f)) + 0.004f;
        const Vec3f along = glm::normalize(
            reach * out + Vec3f(0, rise * (1.9f - 2.0f * (0.75f + 0.9f * age) * t), 0));
        const Vec3f normal = glm::normalize(glm::cross(side, along)) *
                             (glm::cross(side, along).y < 0.0f ? -1.0f : 1.0f);
        // A fold along the spine catches the light on one half.
        for (const float s : {-1.0f, 0.0f, 1.0f}) {
          leaves.positions.push_back(spine + s * width * side +
                                     std::abs(s) * 0.35f * width * normal);
          leaves.normals.push_back(glm::normalize(normal - 0.33f * s * side));
          leaves.texture_coordinates.emplace_back(0.5f * (s + 1.0f), t);
        }
      }
      for (std::uint32_t k = 0; k < steps; ++k) {
        for (std::uint32_t s = 0; s < 2; ++s) {
          const std::uint32_t a = base + 3 * k + s;
          leaves.triangles.insert(leaves.triangles.end(), {a, a + 1, a + 4, a, a + 4, a + 3});
        }
      }
    }
    add(std::move(leaves));
  }

  std::vector<Picture> kept_;
  const std::uint8_t* kept_pixels_ = nullptr;  // of the last of them that was asked for
  bool painted_ = false;
  Scene scene_;
};

}  // namespace

Scene room_scene(const std::filesystem::path& folder) {
  static const Scene room = [&] {  // whose textures take a while
    if (folder.empty()) return Room({}).build();
    const std::filesystem::path path = folder / "room.pictures";
    Room built(kept_pictures(path));
    Scene scene = built.build();
    if (built.painted()) {
      std::vector<Picture> pictures;
      for (const SharedPicture& texture : scene.textures) pictures.push_back(*texture);
      keep_pictures(pictures, path);
    }
    return scene;
  }();
  return room;
}

bool is_builtin_scene(const std::string& name) {
  return name.empty() || name.starts_with("builtin:");
}

Scene open_scene(const std::string& name, const std::filesystem::path& folder) {
  if (!is_builtin_scene(name)) return load_scene(name);
  if (name.empty() || name == "builtin:room") return room_scene(folder);
  if (name == "builtin:apartment") return apartment_scene(folder);
  throw Error(Error::Kind::not_found,
              "There is no scene '{}': those that ship are builtin:room and builtin:apartment",
              name);
}

}  // namespace polyhull
