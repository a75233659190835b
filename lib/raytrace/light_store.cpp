// SPDX-License-Identifier: LGPL-2.1-or-later
#include "raytrace/light_store.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstring>
#include <fstream>
#include <span>
#include <system_error>
#include <vector>

#include "base/content_hash.h"
#include "base/error.h"
#include "environment/environment.h"

namespace polyhull {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t version = 3;  // another one for other contents, and for another light
constexpr std::size_t most_files = 16;

/// What a file begins with; the values follow, Float4 by Float4, first the fronts'.
struct Header {
  std::array<char, 8> magic = {'p', 'h', 'l', 'i', 'g', 'h', 't', '\n'};
  std::uint64_t key = 0;
  std::uint64_t content = 0;  // a hash of the values
  std::uint64_t nodes[2] = {};
  float mean_bounced[3] = {};
  std::array<std::uint32_t, 3> unused = {};
};
static_assert(sizeof(Header) == 64 && sizeof(Header) % alignof(Float4) == 0, "it is mapped");

void add_material(ContentHash& hash, const Material& material) {
  hash.add(material.base_colour);
  hash.add(material.base_colour_texture);
  for (const float number : {material.metallic, material.roughness, material.ior}) hash.add(number);
  hash.add(material.emission);
  hash.add(material.double_sided);
}

std::uint64_t key_of(const Scene& scene, const LightCacheOptions& options) {
  ContentHash hash;
  hash.add(version);
  hash.add(options.spacing);
  hash.add(options.bounce_spacing);
  hash.add(options.first_samples);
  hash.add(options.light_samples);
  hash.add(options.bounce_samples);
  hash.add(options.most_nodes);
  hash.add(options.borders);
  for (const SceneMesh& mesh : scene.meshes) {
    hash.add(mesh.material);
    hash.add(mesh.positions);
    hash.add(mesh.normals);
    hash.add(mesh.texture_coordinates);
    hash.add(mesh.triangles);
  }
  for (const Material& material : scene.materials) add_material(hash, material);
  for (const SharedPicture& texture : scene.textures) {
    hash.add(texture->width);
    hash.add(texture->height);
    hash.add(texture->pixels);
  }
  for (const Light& light : scene.lights) {
    for (const Vec3f& v : {light.centre, light.u, light.v, light.radiance}) hash.add(v);
    hash.add(light.mesh);
    if (light.is_spot()) hash.add(Vec2f(light.inner_cone, light.outer_cone));
  }
  if (scene.sky != Vec3f(0.0f)) hash.add(scene.sky);
  if (scene.environment) hash.add(scene.environment->content());
  return hash.value();
}

fs::path file_of(const fs::path& folder, std::uint64_t key) {
  return folder / fmt::format("{:016x}.light", key);
}

template <class Sides>
std::uint64_t content_of(const Sides& sides) {
  ContentHash hash;
  for (const std::span<const Float4> side : sides) {
    hash.add(side.size());
    hash.add_bytes(side.data(), side.size_bytes());
  }
  return hash.value();
}

struct MappedFile {
  std::shared_ptr<const std::byte> bytes;  // null: there are none
  std::size_t size = 0;
};

/// The file as it lies on the disk, for reading; it stays what it is when another one takes its name. Nothing where
/// it cannot be.
MappedFile mapped(const fs::path& path) {
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return {};
  struct stat status = {};
  const auto size = fstat(file, &status) == 0 ? static_cast<std::size_t>(status.st_size) : 0;
  void* bytes = mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file, 0);  // refuses size 0
  close(file);
  if (bytes == MAP_FAILED) return {};
  return {{static_cast<const std::byte*>(bytes),
           [size](const std::byte* first) { munmap(const_cast<std::byte*>(first), size); }},
          size};
}

/// Leaves the files that were used last.
void remove_old(const fs::path& folder) {
  std::vector<std::pair<fs::file_time_type, fs::path>> files;
  std::error_code ignored;  // another process may remove them, too
  for (fs::directory_iterator entry(folder, ignored); entry != fs::directory_iterator();
       entry.increment(ignored)) {
    const fs::path& path = entry->path();
    const bool unfinished = path.stem().extension() == ".light";  // of who was killed, perhaps
    if (path.extension() == ".light" || unfinished)
      files.emplace_back(entry->last_write_time(ignored), path);
  }
  std::sort(files.rbegin(), files.rend());
  for (std::size_t i = most_files; i < files.size(); ++i) fs::remove(files[i].second, ignored);
}

}  // namespace

std::unique_ptr<LightCache> load_light(const TracedScene& scene, const LightCacheOptions& options,
                                       const fs::path& folder) {
  const std::uint64_t key = key_of(scene.scene(), options);
  const fs::path path = file_of(folder, key);
  const MappedFile file = mapped(path);
  Header header;
  if (file.size < sizeof header) return nullptr;
  std::memcpy(&header, file.bytes.get(), sizeof header);
  const std::uint64_t rest = file.size - sizeof header;
  if (header.magic != Header{}.magic || header.key != key || header.unused != Header{}.unused ||
      header.nodes[0] > rest / sizeof(Float4) || header.nodes[1] > rest / sizeof(Float4) ||
      rest != (header.nodes[0] + header.nodes[1]) * sizeof(Float4))
    return nullptr;
  MappedLight values{
      file.bytes, {}, {header.mean_bounced[0], header.mean_bounced[1], header.mean_bounced[2]}};
  const auto* first = reinterpret_cast<const Float4*>(file.bytes.get() + sizeof header);
  for (int side = 0; side < 2; ++side) {
    values.sides[side] = {first, header.nodes[side]};
    first += header.nodes[side];
  }
  if (content_of(values.sides) != header.content) return nullptr;
  auto light = std::make_unique<LightCache>(scene, options, std::move(values));
  if (!light->usable()) return nullptr;
  light->rest();  // not all that was held against the hash is looked at
  std::error_code ignored;
  fs::last_write_time(path, fs::file_time_type::clock::now(), ignored);  // it is in use
  return light;
}

void store_light(const LightCache& light, const TracedScene& scene,
                 const LightCacheOptions& options, const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  Header header;
  header.key = key_of(scene.scene(), options);
  const std::array sides{light.side(0), light.side(1)};
  header.content = content_of(sides);
  for (int k = 0; k < 3; ++k) header.mean_bounced[k] = light.mean_bounced()[k] / light.gain()[k];
  for (int side = 0; side < 2; ++side) header.nodes[side] = sides[side].size();
  // Under another name until it is whole.
  const fs::path path = file_of(folder, header.key);
  fs::path unfinished = path;
  static std::atomic<unsigned> number = 0;  // several at once in one process
  unfinished += fmt::format(".{}-{}", getpid(), number++);
  std::ofstream file(unfinished, std::ios::binary);
  file.write(reinterpret_cast<const char*>(&header), sizeof header);
  for (const std::span<const Float4> side : sides)
    file.write(reinterpret_cast<const char*>(side.data()),
               static_cast<std::streamsize>(side.size_bytes()));
  file.close();
  if (file) fs::rename(unfinished, path, error);
  if (!file || error) {
    fs::remove(unfinished, error);
    throw Error(Error::Kind::bad_input,
                "The light of scene '{}' could not be kept in {}: look at the folder's rights and "
                "the room on its disk, or switch light-cache off.",
                scene.scene().name, folder.string());
  }
  remove_old(folder);
}

}  // namespace polyhull
