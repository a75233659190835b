// SPDX-License-Identifier: LGPL-2.1-or-later
#include "scene/gltf_materials.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>

#include "base/srgb.h"
#include "gltf/data_uri.h"
#include "gltf/file.h"

namespace polyhull {
namespace {

/// The kind of picture that \p bytes begin as, where it is known and none that can be read.
const char* other_picture(std::string_view bytes) {
  using namespace std::literals;
  if (bytes.starts_with("RIFF") && bytes.substr(0, 12).ends_with("WEBP")) return "a WebP picture";
  if (bytes.starts_with("\xABKTX 20"sv)) return "a KTX2 (Basis Universal) picture";
  if (bytes.starts_with("GIF8")) return "a GIF picture";
  if (bytes.starts_with("BM")) return "a BMP picture";
  if (bytes.starts_with("DDS ")) return "a DDS picture";
  if (bytes.starts_with("II*\0"sv) || bytes.starts_with("MM\0*"sv)) return "a TIFF picture";
  if (bytes.starts_with("#?RADIANCE") || bytes.starts_with("v/1\1")) return "an HDR picture";
  if (bytes.substr(0, 12).find("ftypavi") == 4) return "an AVIF picture";
  if (bytes.substr(0, 12).find("ftyp") == 4) return "a HEIF picture or a film";
  if (bytes.starts_with("<")) return "a text (SVG or a web page)";
  return nullptr;
}

/// The mean of \p picture, which is RGBA and sRGB, in linear light.
Vec3f mean_of(const Picture& picture) {
  Vec3 sum(0.0);
  for (std::size_t i = 0; i < picture.pixels.size(); i += 4)
    for (int k = 0; k < 3; ++k) sum[k] += srgb_to_linear(picture.pixels[i + k]);
  return Vec3f(sum / (picture.pixels.size() / 4.0));
}

class MaterialReader {
 public:
  MaterialReader(const GltfSource& source, Scene& scene, std::set<std::string>& left_out)
      : source_(source), scene_(scene), left_out_(left_out) {}

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
      out.base_colour_texture = add_texture(pbr.baseColorTexture.index, in.name);
    if (in.emissiveTexture.index >= 0 && out.emission != Vec3f(0.0f)) {
      out.emission *= mean_glow(in.emissiveTexture.index, in.name);
      left_out_.insert("emissive textures (a material glows evenly, by its texture's mean)");
    }
    if ((!in.alphaMode.empty() && in.alphaMode != "OPAQUE") ||
        in.extensions.contains("KHR_materials_transmission"))
      left_out_.insert("transparency");
    if (in.extensions.contains("KHR_materials_unlit"))
      left_out_.insert("unlit materials (the scene lights them)");
    scene_.materials.push_back(std::move(out));
  }

 private:
  int add_texture(int texture, const std::string& material) {
    const int image = image_of(texture, material, "base colour");
    const auto [at, is_new] = textures_.emplace(image, static_cast<int>(scene_.textures.size()));
    if (is_new) scene_.textures.push_back(decode(image, material));
    return at->second;
  }

  Vec3f mean_glow(int texture, const std::string& material) {
    const int image = image_of(texture, material, "emissive colour");
    const auto [at, is_new] = glows_.emplace(image, Vec3f(0.0f));
    if (is_new) at->second = mean_of(decode(image, material));
    return at->second;
  }

  /// The image of \p texture, which is the \p kind texture of \p material.
  int image_of(int texture, const std::string& material, const char* kind) const {
    const std::vector<tinygltf::Texture>& textures = source_.model.textures;
    const bool known = static_cast<std::size_t>(texture) < textures.size();
    if (known && textures[texture].source < 0 && !textures[texture].extensions.empty())
      throw compressed(source_, fmt::format("{}s of material '{}'", kind, material),
                       textures[texture].extensions.begin()->first);
    if (!known || textures[texture].source < 0 ||
        static_cast<std::size_t>(textures[texture].source) >= source_.model.images.size()) {
      throw broken_scene(
          source_.path,
          fmt::format("has a material '{}' whose {} texture does not exist.", material, kind));
    }
    return textures[texture].source;
  }

  Picture decode(int source, const std::string& material) const {
    const tinygltf::Image& image = source_.model.images[source];
    const bool in_file = !image.uri.empty() && !is_data_uri(image.uri);
    const std::string name = in_file              ? address_name(image.uri)
                             : image.name.empty() ? fmt::format("image {}", source)
                                                  : image.name;
    const std::string what = fmt::format("texture '{}' of material '{}'", name, material);
    std::vector<unsigned char> of_address;
    GltfBytes bytes{nullptr, 0};
    if (image.bufferView >= 0) {
      bytes = read_view(source_, image.bufferView, what);
    } else if (!image.uri.empty()) {
      of_address = read_address(source_.path, image.uri, what);
      bytes = {of_address.data(), of_address.size()};
    }
    if (bytes.size == 0 && in_file) {
      throw Error(Error::Kind::not_found,
                  "Scene '{}': the {} is missing or empty. It is looked for beside the scene's "
                  "file; a .glb file holds its textures itself.",
                  source_.path, what);
    }
    if (bytes.size == 0) {
      throw Error(Error::Kind::bad_input, "Scene '{}': the {} has no data: export it anew.",
                  source_.path, what);
    }
    if (const char* kind = other_picture({reinterpret_cast<const char*>(bytes.data), bytes.size})) {
      throw Error(Error::Kind::unsupported,
                  "Scene '{}': the {} is {}, not a readable PNG or JPEG. Save it as one of these.",
                  source_.path, what, kind);
    }
    return decode_picture({bytes.data, bytes.size}, 4,
                          fmt::format("{} of scene '{}'", what, source_.path));
  }

  const GltfSource& source_;
  Scene& scene_;
  std::set<std::string>& left_out_;
  std::map<int, int> textures_;  // glTF image to Scene::textures
  std::map<int, Vec3f> glows_;   // and to its mean
};

}  // namespace

void add_materials(const GltfSource& source, Scene& scene, std::set<std::string>& left_out) {
  MaterialReader reader(source, scene, left_out);
  for (const tinygltf::Material& material : source.model.materials) reader.add_material(material);
}

int texture_set(const GltfSource& source, int material) {
  if (material < 0 || static_cast<std::size_t>(material) >= source.model.materials.size()) return 0;
  const tinygltf::TextureInfo& texture =
      source.model.materials[material].pbrMetallicRoughness.baseColorTexture;
  const double set =
      gltf_number(texture.extensions, "KHR_texture_transform", "texCoord", texture.texCoord);
  return static_cast<int>(std::clamp(set, 0.0, 1e6));
}

void apply_texture_transform(const GltfSource& source, int material, SceneMesh& mesh) {
  if (material < 0 || static_cast<std::size_t>(material) >= source.model.materials.size()) return;
  const tinygltf::ExtensionMap& extensions =
      source.model.materials[material].pbrMetallicRoughness.baseColorTexture.extensions;
  const auto found = extensions.find("KHR_texture_transform");
  if (found == extensions.end()) return;
  const auto pair = [&](const char* name, float otherwise) {
    Vec2f value(otherwise);
    if (!found->second.Has(name) || found->second.Get(name).ArrayLen() != 2) return value;
    for (int k = 0; k < 2; ++k)
      value[k] = static_cast<float>(found->second.Get(name).Get(k).GetNumberAsDouble());
    return value;
  };
  const Vec2f offset = pair("offset", 0.0f), scale = pair("scale", 1.0f);
  const auto angle =
      static_cast<float>(gltf_number(extensions, "KHR_texture_transform", "rotation", 0.0));
  const float c = std::cos(angle), s = std::sin(angle);
  for (Vec2f& t : mesh.texture_coordinates) {
    const Vec2f scaled = t * scale;
    t = Vec2f(c * scaled.x + s * scaled.y, -s * scaled.x + c * scaled.y) + offset;
  }
}

}  // namespace polyhull
