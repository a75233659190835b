// SPDX-License-Identifier: LGPL-2.1-or-later
#include "scene/gltf_materials.h"

#include <cmath>
#include <map>

namespace polyhull {
namespace {

class MaterialReader {
 public:
  MaterialReader(const GltfSource& source, Scene& scene) : source_(source), scene_(scene) {}

  void add_material(const tinygltf::Material& in) {
    Material out;
    out.name = in.name;
    const tinygltf::PbrMetallicRoughness& pbr = in.pbrMetallicRoughness;
    for (int k = 0; k < 3; ++k) {
      out.base_colour[k] = static_cast<float>(pbr.baseColorFactor.at(k));
      out.emission[k] = static_cast<float>(
          in.emissiveFactor.at(k) *
          gltf_number(in.extensions, "KHR_materials_emissive_strength", "emissiveStrength", 1.0));
    }
    out.metallic = static_cast<float>(pbr.metallicFactor);
    out.roughness = static_cast<float>(pbr.roughnessFactor);
    out.ior = static_cast<float>(gltf_number(in.extensions, "KHR_materials_ior", "ior", 1.5));
    out.double_sided = in.doubleSided;
    for (const float value :
         {out.base_colour.x, out.base_colour.y, out.base_colour.z, out.metallic, out.roughness,
          out.ior, out.emission.x, out.emission.y, out.emission.z}) {
      if (!std::isfinite(value) || value < 0.0f) {
        throw broken_scene(
            source_.path,
            fmt::format("has a material '{}' with a number that is not finite or is below 0.",
                        in.name));
      }
    }
    out.base_colour = glm::min(out.base_colour, Vec3f(1.0f));
    if (pbr.baseColorTexture.index >= 0)
      out.base_colour_texture = add_texture(pbr.baseColorTexture, in.name);
    scene_.materials.push_back(std::move(out));
  }

  int add_texture(const tinygltf::TextureInfo& info, const std::string& material) {
    if (static_cast<std::size_t>(info.index) >= source_.model.textures.size() ||
        source_.model.textures[info.index].source < 0 ||
        static_cast<std::size_t>(source_.model.textures[info.index].source) >=
            source_.model.images.size()) {
      throw broken_scene(
          source_.path,
          fmt::format("has a material '{}' whose base colour texture does not exist.", material));
    }
    const int source = source_.model.textures[info.index].source;
    if (const auto known = textures_.find(source); known != textures_.end()) return known->second;
    const tinygltf::Image& image = source_.model.images[source];
    const std::string name =
        image.uri.empty() ? (image.name.empty() ? fmt::format("image {}", source) : image.name)
                          : image.uri;
    GltfBytes bytes{image.image.data(), image.image.size()};
    if (image.bufferView >= 0)
      bytes = read_view(source_, image.bufferView, fmt::format("texture '{}'", name));
    if (bytes.size == 0) {
      throw Error(Error::Kind::not_found,
                  "Scene '{}': the texture '{}' of material '{}' is missing. It is looked for "
                  "beside the scene's file; a .glb file holds its textures itself.",
                  source_.path, name, material);
    }
    scene_.textures.push_back(
        decode_picture({bytes.data, bytes.size}, 4,
                       fmt::format("texture '{}' of scene '{}'", name, source_.path)));
    const int index = static_cast<int>(scene_.textures.size()) - 1;
    textures_[source] = index;
    return index;
  }

 private:
  const GltfSource& source_;
  Scene& scene_;
  std::map<int, int> textures_;  // glTF image to Scene::textures
};

}  // namespace

void add_materials(const GltfSource& source, Scene& scene) {
  MaterialReader reader(source, scene);
  for (const tinygltf::Material& material : source.model.materials) reader.add_material(material);
}

}  // namespace polyhull
