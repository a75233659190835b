// SPDX-License-Identifier: LGPL-2.1-or-later
#include "gltf/file.h"

#include <algorithm>
#include <climits>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>

#include "base/error.h"
#include "base/parse_json.h"
#include "base/plain_text.h"
#include "base/whole_file.h"
#include "gltf/accessor.h"
#include "gltf/data_uri.h"

namespace polyhull {
namespace {

using Json = nlohmann::json;

const char* const known_extensions[] = {
    "KHR_lights_punctual",   "KHR_materials_ior",       "KHR_materials_emissive_strength",
    "KHR_texture_transform", "KHR_mesh_quantization",   "KHR_materials_specular",
    "KHR_materials_unlit",   "EXT_mesh_gpu_instancing", "KHR_materials_pbrSpecularGlossiness",
    "KHR_node_visibility"};

Error unreadable_gltf(const std::string& path, const std::string& why) {
  return broken_scene(path, "is not a readable glTF 2.0 file: " + why);
}

std::string bytes_of(const std::filesystem::path& path, const std::string& source) {
  std::optional<std::string> bytes = whole_file(path);
  if (!bytes)
    throw Error(Error::Kind::io, "{}: '{}' cannot be read; check that you may read it.", source,
                path.string());
  return *std::move(bytes);
}

/// What a file's bytes hold; views of them.
struct Contents {
  std::string_view json;
  std::string_view binary;  // a GLB's chunk
};

std::uint32_t word(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (int i = 3; i >= 0; --i) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

/// The chunks of a GLB file. Writers pad chunks or not and say wrong lengths of the whole file:
/// what counts are the chunks' own lengths. Chunks of other kinds are passed over.
Contents open_glb(std::string_view bytes, const std::string& path) {
  constexpr std::size_t head = 12, chunk_head = 8;
  constexpr std::uint32_t json = 0x4E4F534A, binary = 0x004E4942;
  if (bytes.size() < head + chunk_head) throw unreadable_gltf(path, "it is cut short");
  if (const std::uint32_t version = word(bytes, 4); version != 2) {
    throw Error(Error::Kind::unsupported,
                "Scene '{}' is a GLB file of version {}; only version 2 (glTF 2.0) is read. Export "
                "it anew, or convert it.",
                path, version);
  }
  const auto kind = [&](std::size_t at) {
    return at + chunk_head <= bytes.size() ? word(bytes, at + 4) : 0;
  };
  const auto known = [&](std::size_t at) { return kind(at) == json || kind(at) == binary; };
  std::optional<std::string_view> found_json, found_binary;
  for (std::size_t at = head; at + chunk_head <= bytes.size();) {
    // A chunk may be followed by padding that its length does not count.
    if (const std::size_t padded = (at + 3) / 4 * 4; !known(at) && known(padded)) at = padded;
    const std::size_t length = word(bytes, at), begin = at + chunk_head;
    const std::string_view chunk = bytes.substr(begin, length);
    if (kind(at) == json && !found_json) {
      if (chunk.size() < length)
        throw unreadable_gltf(path, "it ends within its JSON chunk (the file is cut short)");
      found_json = chunk;
    } else if (kind(at) == binary && !found_binary) {
      found_binary = chunk;
    }
    at = begin + length;
  }
  if (!found_json) throw unreadable_gltf(path, "it has no JSON chunk");
  return {*found_json, found_binary.value_or("")};
}

Contents open_contents(std::string_view bytes, const std::string& path) {
  if (bytes.starts_with("glTF")) return open_glb(bytes, path);
  if (bytes.starts_with("\xFF\xFE") || bytes.starts_with("\xFE\xFF"))
    throw unreadable_gltf(path, "it is a text in UTF-16; save it as UTF-8");
  std::string_view text = bytes;
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  if (const std::size_t first = text.find_first_not_of(" \t\r\n");
      first == text.npos || text[first] != '{') {
    throw unreadable_gltf(path,
                          "it begins neither as a GLB file does (\"glTF\") nor as JSON (\"{\"); "
                          "perhaps it is a file of another kind or a failed download");
  }
  return {text, {}};
}

std::string text_of(const Json& object, const char* name) {
  const auto found = object.find(name);
  return found != object.end() && found->is_string() ? found->get<std::string>() : "";
}

/// The list \p name of \p root, taken out of it; empty where there is none.
Json take_list(Json& root, const char* name, const std::string& path) {
  const auto found = root.find(name);
  if (found == root.end()) return Json::array();
  Json list = std::move(*found);
  root.erase(found);
  if (!list.is_array() ||
      !std::all_of(list.begin(), list.end(), [](const Json& item) { return item.is_object(); }))
    throw unreadable_gltf(path, fmt::format("its \"{}\" is not a list of objects", name));
  return list;
}

/// Nothing where the file does not say it.
std::string version_of(const Json& root) {
  const Json asset = root.value("asset", Json::object());
  if (!asset.is_object()) return "";
  const Json version = asset.value("version", Json());
  return version.is_number() ? version.dump() : text_of(asset, "version");
}

void check_version_and_extensions(const Json& root, const std::string& path) {
  const std::string version = version_of(root);
  if (!version.empty() && !version.starts_with('2')) {
    throw Error(Error::Kind::unsupported,
                "Scene '{}' is a file of glTF {}; only glTF 2.0 is read. Export it anew, or "
                "convert it.",
                path, version);
  }
  for (const Json& required : root.value("extensionsRequired", Json::array())) {
    const std::string extension =
        required.is_string() ? required.get<std::string>() : required.dump();
    if (std::find(std::begin(known_extensions), std::end(known_extensions), extension) ==
        std::end(known_extensions)) {
      throw Error(Error::Kind::unsupported,
                  "Scene '{}' needs the glTF extension {}, which is not supported. Export it "
                  "without (for Blender: no compression).",
                  path, extension);
    }
  }
}

std::vector<tinygltf::Buffer> read_buffers(const Json& list, std::string_view binary,
                                           const std::string& path) {
  std::vector<tinygltf::Buffer> buffers(list.size());
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::string uri = text_of(list[i], "uri");
    if (!uri.empty()) {
      buffers[i].data = read_address(path, uri, fmt::format("buffer {}", i));
      if (buffers[i].data.empty() && !is_data_uri(uri)) {
        throw Error(
            Error::Kind::not_found,
            "Scene '{}': the file '{}' with its buffer {} is missing or empty. It is looked "
            "for beside the scene's file; a .glb file holds its buffers itself.",
            path, address_name(uri), i);
      }
    } else if (i == 0) {
      buffers[i].data.assign(binary.begin(), binary.end());
    }
  }
  return buffers;
}

std::vector<tinygltf::Image> read_images(const Json& list) {
  std::vector<tinygltf::Image> images(list.size());
  for (std::size_t i = 0; i < list.size(); ++i) {
    images[i].name = text_of(list[i], "name");
    images[i].uri = text_of(list[i], "uri");
    const auto view = list[i].find("bufferView");
    if (view != list[i].end() && view->is_number_unsigned())
      images[i].bufferView =
          static_cast<int>(std::min<std::uint64_t>(view->get<std::uint64_t>(), INT_MAX));
  }
  return images;
}

/// Materials of KHR_materials_pbrSpecularGlossiness, an older form, as glTF's own have them.
void replace_specular_glossiness(Json& materials) {
  for (Json& material : materials) {
    const Json extensions = material.value("extensions", Json::object());
    const auto found = extensions.find("KHR_materials_pbrSpecularGlossiness");
    if (found == extensions.end()) continue;
    Json own{{"metallicFactor", 0.0},
             {"baseColorFactor", found->value("diffuseFactor", Json{1.0, 1.0, 1.0, 1.0})}};
    // Where a texture says how glossy the surface is, not all of it is a mirror.
    if (!found->contains("specularGlossinessTexture"))
      own["roughnessFactor"] = 1.0 - found->value("glossinessFactor", 1.0);
    const Json specular = found->value("specularFactor", Json{1.0, 1.0, 1.0});
    if (found->contains("diffuseTexture")) {
      own["baseColorTexture"] = (*found)["diffuseTexture"];
    } else if (own.value("roughnessFactor", 1.0) < 0.05 &&
               std::any_of(specular.begin(), specular.end(),
                           [](const Json& part) { return part > 0.3; })) {
      // More than any glass mirrors: metal, in its specular colour.
      own["metallicFactor"] = 1.0;
      own["baseColorFactor"] = {specular.at(0), specular.at(1), specular.at(2), 1.0};
    }
    material["pbrMetallicRoughness"] = std::move(own);
  }
}

/// What writers leave out and tinygltf asks for.
void add_defaults(Json& root) {
  root["asset"] = {{"version", "2.0"}};
  const Json::json_pointer lights("/extensions/KHR_lights_punctual/lights");
  if (!root.contains(lights) || !root.at(lights).is_array()) return;
  for (Json& light : root.at(lights))
    if (light.is_object() && text_of(light, "type") == "spot" && !light.contains("spot"))
      light["spot"] = Json::object();
}

/// The distances between elements of \p views, taken out of them: tinygltf refuses those that are not
/// whole words. 0: it is not told.
std::vector<std::size_t> take_strides(Json& views) {
  std::vector<std::size_t> strides(views.size(), 0);
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (!views[i].is_object()) continue;
    const auto stride = views[i].find("byteStride");
    if (stride == views[i].end() || !stride->is_number_unsigned()) continue;
    strides[i] = stride->get<std::size_t>();
    views[i].erase(stride);
  }
  return strides;
}

/// The model of \p root, which tinygltf understands. It refuses indices without a buffer view, which
/// sparse ones may be: until it has read them they have one.
tinygltf::Model read_model(Json& root, const std::string& path) {
  add_defaults(root);
  Json& views = root["bufferViews"];
  if (!views.is_array()) views = Json::array();
  std::vector<std::size_t> without_view;
  if (const auto accessors = root.find("accessors");
      accessors != root.end() && accessors->is_array()) {
    for (std::size_t i = 0; i < accessors->size(); ++i) {
      Json& accessor = (*accessors)[i];
      if (!accessor.is_object() || accessor.contains("bufferView")) continue;
      accessor["bufferView"] = views.size();
      without_view.push_back(i);
    }
  }
  const std::vector<std::size_t> strides = take_strides(views);
  views.push_back({{"buffer", 0}, {"byteLength", 1}});
  if (const auto materials = root.find("materials"); materials != root.end())
    replace_specular_glossiness(*materials);
  const std::string text = root.dump();
  tinygltf::TinyGLTF reader;
  tinygltf::Model model;
  std::string problem, warning;
  if (!reader.LoadASCIIFromString(&model, &problem, &warning, text.c_str(),
                                  static_cast<unsigned>(text.size()), "")) {
    while (!problem.empty() && std::isspace(static_cast<unsigned char>(problem.back())))
      problem.pop_back();
    throw unreadable_gltf(path, problem.empty() ? "broken content" : problem);
  }
  model.bufferViews.pop_back();
  for (const std::size_t i : without_view) model.accessors.at(i).bufferView = -1;
  for (std::size_t i = 0; i < strides.size(); ++i) model.bufferViews[i].byteStride = strides[i];
  return model;
}

/// The one file of \p folder whose name is \p name but for capitals; nothing: there is none, or more.
std::filesystem::path spelt_otherwise(const std::filesystem::path& folder,
                                      const std::string& name) {
  std::filesystem::path found;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(
           folder.empty() ? std::filesystem::path(".") : folder, error)) {
    if (lower_case(entry.path().filename().string()) != lower_case(name) ||
        !entry.is_regular_file(error))
      continue;
    if (!found.empty()) return {};
    found = entry.path();
  }
  return found;
}

/// The file that \p uri means in \p folder; nothing: there is none. Some writers escape, some do not,
/// some write Windows' separators; on Windows capitals do not count, and many write where a file was
/// when they had it: then it is looked for beside the scene.
std::filesystem::path file_at(const std::filesystem::path& folder, const std::string& uri) {
  std::string slashes = unescape(uri);
  std::replace(slashes.begin(), slashes.end(), '\\', '/');
  for (const std::string& name : {unescape(uri), uri, slashes}) {
    std::error_code error;
    if (std::filesystem::is_regular_file(folder / name, error)) return folder / name;
  }
  const std::filesystem::path path(slashes);
  const std::string name = path.filename().string();
  if (const auto found = spelt_otherwise((folder / path).parent_path(), name); !found.empty())
    return found;
  return spelt_otherwise(folder, name);
}

}  // namespace

tinygltf::Model read_gltf(const std::string& path) {
  const std::string bytes = bytes_of(path, fmt::format("Scene '{}'", path));
  const Contents contents = open_contents(bytes, path);
  Json root =
      parse_json(contents.json, fmt::format("Scene '{}' is not a readable glTF 2.0 file", path));
  if (!root.is_object()) throw unreadable_gltf(path, "its JSON is not an object");
  std::string problem;
  try {
    check_version_and_extensions(root, path);
    const Json buffers = take_list(root, "buffers", path), images = take_list(root, "images", path);
    tinygltf::Model model = read_model(root, path);
    model.buffers = read_buffers(buffers, contents.binary, path);
    model.images = read_images(images);
    return model;
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    problem = error.what();
  }
  throw unreadable_gltf(path, problem);
}

std::vector<unsigned char> read_address(const std::string& path, const std::string& uri,
                                        const std::string& what) {
  const std::string source = fmt::format("Scene '{}': the {} cannot be read", path, what);
  if (is_data_uri(uri)) return decode_data_uri(uri, source);
  const std::filesystem::path found = file_at(std::filesystem::path(path).parent_path(), uri);
  if (found.empty()) return {};
  const std::string bytes = bytes_of(found, source);
  return {bytes.begin(), bytes.end()};
}

}  // namespace polyhull
