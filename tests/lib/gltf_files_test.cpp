// SPDX-License-Identifier: LGPL-2.1-or-later
// Scenes that other programs write: what the format allows, and what files in the wild have beside it.
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "base/picture.h"
#include "base/srgb.h"
#include "scene/assumed_light.h"
#include "scene_file.h"

namespace polyhull {
namespace {

const std::string red_pixel =
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGP4z8AAAAMBAQDJ/pLvAAAAAElFTkSuQmCC";

std::string bytes_of_base64(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned bits = 0, count = 0;
  for (const char c : text.substr(0, text.find('='))) {
    bits = bits << 6 | static_cast<unsigned>(digits.find(c));
    if (++count % 4 != 1) bytes += static_cast<char>(bits >> (8 - 2 * (count % 4)) % 8);
  }
  return bytes;
}

std::string base64(const std::string& bytes) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    unsigned bits = 0;
    for (std::size_t k = 0; k < 3; ++k)
      bits = bits << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k)
      text += i + k > bytes.size() ? '=' : digits[bits >> (18 - 6 * k) & 63];
  }
  return text;
}

template <typename T>
std::string raw(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

class GltfFiles : public SceneFile {
 protected:
  /// Appends \p bytes to data.bin and gives their buffer view.
  int add_view(json& root, const std::string& bytes) {
    const auto file = folder_ / "data.bin";
    const auto at = (std::filesystem::file_size(file) + 3) / 4 * 4;
    std::filesystem::resize_file(file, at);
    std::ofstream(file, std::ios::binary | std::ios::app) << bytes;
    root["buffers"][0]["byteLength"] = at + bytes.size();
    root["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", at}, {"byteLength", bytes.size()}});
    return static_cast<int>(root["bufferViews"].size()) - 1;
  }

  int add_accessor(json& root, json accessor) {
    root["accessors"].push_back(std::move(accessor));
    return static_cast<int>(root["accessors"].size()) - 1;
  }

  template <typename T>
  int add_values(json& root, const std::vector<T>& values, int type, const char* shape,
                 std::size_t components) {
    return add_accessor(root, {{"bufferView", add_view(root, raw(values))},
                               {"componentType", type},
                               {"count", values.size() / components},
                               {"type", shape}});
  }

  template <typename I, typename T>
  json sparse(json& root, const std::vector<I>& places, int place_type,
              const std::vector<T>& values) {
    return {
        {"count", places.size()},
        {"indices", {{"bufferView", add_view(root, raw(places))}, {"componentType", place_type}}},
        {"values", {{"bufferView", add_view(root, raw(values))}}}};
  }

  json& attributes(json& root) { return root["meshes"][0]["primitives"][0]["attributes"]; }

  /// triangle_file() with a texture whose image is \p image.
  json textured_file(const json& image) {
    json root = triangle_file();
    root["materials"] = json::array(
        {{{"name", "brick"}, {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}});
    root["textures"] = json::array({{{"source", 0}}});
    root["images"] = json::array({image});
    root["meshes"][0]["primitives"][0]["material"] = 0;
    return root;
  }

  /// triangle_file() as the JSON of a GLB and its binary data.
  std::pair<std::string, std::string> glb_parts() {
    json root = triangle_file();
    root["buffers"][0].erase("uri");
    std::ifstream in(folder_ / "data.bin", std::ios::binary);
    return {root.dump(), std::string((std::istreambuf_iterator<char>(in)), {})};
  }

  std::string write_bytes(const std::string& name, const std::string& bytes) {
    std::ofstream(folder_ / name, std::ios::binary | std::ios::trunc) << bytes;
    return (folder_ / name).string();
  }
};

std::string word(std::size_t value) {
  std::string bytes;
  for (int i = 0; i < 4; ++i) bytes += static_cast<char>(value >> 8 * i & 255);
  return bytes;
}

std::string chunk(const std::string& kind, const std::string& bytes) {
  return word(bytes.size()) + kind + bytes;
}

std::string glb(const std::string& chunks) {
  return "glTF" + word(2) + word(12 + chunks.size()) + chunks;
}

std::string padded(std::string bytes, char with) {
  bytes.resize((bytes.size() + 3) / 4 * 4, with);
  return bytes;
}

const std::string json_kind = "JSON", bin_kind("BIN\0", 4);

TEST_F(GltfFiles, SparseValuesReplaceThoseOfTheBuffer) {
  json root = triangle_file();
  root["accessors"][0]["sparse"] =
      sparse(root, std::vector<std::uint16_t>{2}, 5123, std::vector<float>{0, 5, 1});
  const Scene scene = load_scene(write(root));
  EXPECT_EQ(scene.meshes[0].positions, (std::vector<Vec3f>{{0, 0, 0}, {1, 0, 0}, {0, 5, 1}}));
}

TEST_F(GltfFiles, SparseWithoutBufferViewBeginsWithZeros) {
  json root = triangle_file();
  const json places =
      sparse(root, std::vector<std::uint8_t>{1, 2}, 5121, std::vector<float>{3, 0, 0, 0, 4, 0});
  attributes(root)["POSITION"] = add_accessor(
      root, {{"componentType", 5126}, {"count", 3}, {"type", "VEC3"}, {"sparse", places}});
  const json coordinates =
      sparse(root, std::vector<std::uint32_t>{2}, 5125, std::vector<std::uint8_t>{255, 0});
  attributes(root)["TEXCOORD_0"] = add_accessor(root, {{"componentType", 5121},
                                                       {"normalized", true},
                                                       {"count", 3},
                                                       {"type", "VEC2"},
                                                       {"sparse", coordinates}});
  const json normals = sparse(root, std::vector<std::uint8_t>{0, 1, 2}, 5121,
                              std::vector<std::int8_t>{0, 127, 0, 0, 127, 0, 0, 0, 127});
  attributes(root)["NORMAL"] = add_accessor(root, {{"componentType", 5120},
                                                   {"normalized", true},
                                                   {"count", 3},
                                                   {"type", "VEC3"},
                                                   {"sparse", normals}});
  const json indices =
      sparse(root, std::vector<std::uint8_t>{1, 2}, 5121, std::vector<std::uint16_t>{1, 2});
  root["meshes"][0]["primitives"][0]["indices"] = add_accessor(
      root, {{"componentType", 5123}, {"count", 3}, {"type", "SCALAR"}, {"sparse", indices}});
  const Scene scene = load_scene(write(root));
  const SceneMesh& mesh = scene.meshes.at(0);
  EXPECT_EQ(mesh.positions, (std::vector<Vec3f>{{0, 0, 0}, {3, 0, 0}, {0, 4, 0}}));
  EXPECT_EQ(mesh.texture_coordinates, (std::vector<Vec2f>{{0, 0}, {0, 0}, {1, 0}}));
  EXPECT_EQ(mesh.normals, (std::vector<Vec3f>{{0, 1, 0}, {0, 1, 0}, {0, 0, 1}}));
  EXPECT_EQ(mesh.triangles, (std::vector<std::uint32_t>{0, 1, 2}));
}

TEST_F(GltfFiles, BrokenSparseAccessorsAreRefused) {
  const json whole = triangle_file();
  const auto with = [&](const json& part) {
    json root = whole;
    root["accessors"][0]["sparse"] = part;
    return failure(write(root));
  };
  json root = whole;
  const json part = sparse(root, std::vector<std::uint8_t>{3}, 5121, std::vector<float>{0, 5, 1});
  root["accessors"][0]["sparse"] = part;
  EXPECT_TRUE(contains(failure(write(root)), "replaces element 3 but has only 3"));
  root["accessors"][0]["sparse"]["count"] = 1000;
  EXPECT_TRUE(contains(failure(write(root)), "beyond its buffer"));
  root["accessors"][0]["sparse"]["count"] = -1;
  EXPECT_TRUE(contains(failure(write(root)), "positions of mesh 'thing'"));
  EXPECT_TRUE(contains(with({{"count", 1}}), "sparse"));
  root = whole;
  root["accessors"][0]["bufferView"] = root["bufferViews"].size();
  EXPECT_TRUE(contains(failure(write(root)), "buffer view 1 does not exist"));
  root = whole;
  root["accessors"][0].erase("bufferView");
  root["accessors"][0]["count"] = 4'000'000'000u;
  EXPECT_TRUE(contains(failure(write(root)), "no data"));
}

TEST_F(GltfFiles, InstancesAreDrawnEach) {
  json root = triangle_file();
  const float half = std::sqrt(0.5f);
  const int t = add_values(root, std::vector<float>{1, 0, 0, 0, 2, 0}, 5126, "VEC3", 3);
  const int r = add_values(
      root,
      std::vector<std::int16_t>{0, 0, 0, 32767, 0, 0, static_cast<std::int16_t>(half * 32767),
                                static_cast<std::int16_t>(half * 32767)},
      5122, "VEC4", 4);
  root["accessors"][r]["normalized"] = true;
  const int s = add_values(root, std::vector<float>{1, 1, 1, 2, 2, 2}, 5126, "VEC3", 3);
  const int id = add_values(root, std::vector<float>{7, 8, 9}, 5126, "SCALAR", 1);
  root["nodes"][0]["scale"] = {10, 10, 10};
  json& instances = root["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
  instances = {{"TRANSLATION", t}, {"ROTATION", r}, {"SCALE", s}, {"_ID", id}};
  root["extensionsRequired"] = {"EXT_mesh_gpu_instancing"};
  const Scene scene = load_scene(write(root));
  ASSERT_EQ(scene.meshes.size(), 2u);
  // The second: scaled by 2, turned from x to y, moved by 2 along y, then the node's scale.
  const Vec3f expected[2][3] = {{{10, 0, 0}, {20, 0, 0}, {10, 10, 0}},
                                {{0, 20, 0}, {0, 40, 0}, {-20, 20, 0}}};
  for (int m = 0; m < 2; ++m)
    for (int i = 0; i < 3; ++i)
      EXPECT_LT(glm::length(scene.meshes[m].positions[i] - expected[m][i]), 1e-3f) << m << i;

  instances.erase("SCALE");
  instances["TRANSLATION"] = id;
  EXPECT_TRUE(contains(failure(write(root)), "instances (TRANSLATION) of node 'thing'"));
  instances["TRANSLATION"] = add_values(root, std::vector<float>{1, 0, 0}, 5126, "VEC3", 3);
  EXPECT_TRUE(contains(failure(write(root)), "differ in length"));
  instances = {{"ROTATION", add_values(root, std::vector<float>{0, NAN, 0, 1}, 5126, "VEC4", 4)}};
  EXPECT_TRUE(contains(failure(write(root)), "transform that is not finite"));
}

TEST_F(GltfFiles, TooManyInstancesAreRefusedBeforeTheyFillTheMemory) {
  json root = triangle_file();
  const auto instances_of = [&](std::size_t count) {
    root["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["SCALE"] =
        add_values(root, std::vector<float>(3 * count, 1.0f), 5126, "VEC3", 3);
  };
  instances_of(100'001);
  EXPECT_TRUE(contains(failure(write(root)), "100001 instances"));
  instances_of(50'000);
  root["meshes"][0]["primitives"][0]["indices"] =
      add_values(root, std::vector<std::uint8_t>(3 * 250, 0), 5121, "SCALAR", 1);
  EXPECT_TRUE(
      contains(failure(write(root)), "50000 instances of mesh 'thing' (250 triangles each)"));
}

TEST_F(GltfFiles, TextureTransformChoosesTheCoordinates) {
  json root = textured_file({{"uri", "data:image/png;base64," + red_pixel}});
  attributes(root)["TEXCOORD_0"] =
      add_values(root, std::vector<float>{0, 0, 0, 0, 0, 0}, 5126, "VEC2", 2);
  attributes(root)["TEXCOORD_1"] =
      add_values(root, std::vector<float>{.5, .5, .5, .5, .5, .5}, 5126, "VEC2", 2);
  json& texture = root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
  const auto first = [&] { return load_scene(write(root)).meshes[0].texture_coordinates.at(0); };
  texture["texCoord"] = 1;
  EXPECT_EQ(first(), Vec2f(0.5f));
  texture["extensions"]["KHR_texture_transform"]["texCoord"] = 0;
  EXPECT_EQ(first(), Vec2f(0.0f));
  texture.erase("texCoord");
  texture["extensions"]["KHR_texture_transform"] = {{"texCoord", 1}, {"scale", {2, 4}}};
  EXPECT_EQ(first(), Vec2f(1.0f, 2.0f));
}

TEST_F(GltfFiles, EmbeddedPicturesOfAnyType) {
  std::string folded = red_pixel, url = red_pixel, escaped = red_pixel;
  folded.insert(70, "\r\n");
  folded.insert(20, "\n ");
  for (char& c : url) c = c == '+' ? '-' : c == '/' ? '_' : c;
  while (url.back() == '=') url.pop_back();
  for (std::size_t at; (at = escaped.find_first_of("/+=")) != escaped.npos;)
    escaped.replace(at, 1, escaped[at] == '/' ? "%2F" : escaped[at] == '+' ? "%2b" : "%3D");
  for (const std::string& uri :
       {"data:image/png;base64," + red_pixel, "data:image/jpg;base64," + red_pixel,
        "data:IMAGE/PNG;base64," + red_pixel, "DATA:image/png;BASE64," + red_pixel,
        "data:;base64," + red_pixel, "data:image/png;charset=utf-8;base64," + red_pixel,
        "data:image/png; base64, " + red_pixel, "data:text/html;base64," + red_pixel,
        "data:image/webp;base64," + folded, "data:image/png;base64," + url,
        "data:image/png;base64," + escaped}) {
    const json image = {{"uri", uri}, {"mimeType", "image/other"}};
    EXPECT_EQ(failure(write(textured_file(image))), "") << uri.substr(0, 40);
    const Scene scene = load_scene(write(textured_file(image)));
    ASSERT_EQ(scene.textures.size(), 1u);
    EXPECT_EQ(scene.textures[0]->pixels, (std::vector<std::uint8_t>{255, 0, 0, 255}));
  }
}

TEST_F(GltfFiles, APictureIsWhatItsFirstBytesSay) {
  const std::vector<std::uint8_t> jpeg =
      encode_jpeg({8, 8, 3, std::vector<std::uint8_t>(192, 128)}, 95);
  for (const char* type : {"data:image/png;base64,", "data:image/jpg;base64,"}) {
    const Scene scene = load_scene(write(textured_file({{"uri", type + base64(raw(jpeg))}})));
    EXPECT_EQ(scene.textures.at(0)->width, 8);
    EXPECT_NEAR(scene.textures.at(0)->pixels.at(0), 128, 2);
  }
  // The same from a buffer view, without a type.
  json root = textured_file(json::object());
  root["images"][0]["bufferView"] = add_view(root, raw(jpeg));
  EXPECT_EQ(load_scene(write(root)).textures.at(0)->width, 8);
}

TEST_F(GltfFiles, EmbeddedBuffersOfAnyType) {
  json root = triangle_file();
  std::ifstream in(folder_ / "data.bin", std::ios::binary);
  const std::string data = base64(std::string((std::istreambuf_iterator<char>(in)), {}));
  const Scene plain = load_scene(write(root));
  for (const char* type :
       {"data:application/octet-stream;base64,", "data:;base64,", "data:model/gltf+bin;base64,",
        "data:application/gltf-buffer;charset=x;base64,",
        "Data:Application/Octet-Stream;Base64,"}) {
    root["buffers"][0]["uri"] = type + data;
    EXPECT_EQ(failure(write(root)), "") << type;
    EXPECT_EQ(load_scene(write(root)).meshes[0].positions, plain.meshes[0].positions) << type;
  }
}

TEST_F(GltfFiles, MessagesAboutPicturesNameThemAndShowNoData) {
  const std::string type = "data:image/png;base64,";
  std::string damaged = red_pixel;
  damaged[30] = '*';
  const std::string webp = base64("RIFF1234WEBPVP8 ");
  struct Case {
    std::string uri;
    const char* reason;
  };
  for (const Case& c :
       {Case{type + damaged, "character 31"}, Case{type + red_pixel.substr(0, 41), "cut short"},
        Case{type + red_pixel.substr(0, 80), "not a readable PNG or JPEG"},
        Case{"data:image/png;base64" + red_pixel, "no comma"}, Case{type, "no data"},
        Case{"data:image/png;base64," + webp, "WebP"},
        Case{"data:image/png;base64,SGVsbG8sIHRoaXMgaXMgYSB0ZXh0", "not a readable PNG or JPEG"}}) {
    for (const bool named : {false, true}) {
      json image = {{"uri", c.uri}};
      if (named) image["name"] = "wall";
      const std::string message = failure(write(textured_file(image)));
      EXPECT_TRUE(contains(message, c.reason)) << message;
      EXPECT_TRUE(contains(message, named ? "'wall'" : "'image 0'")) << message;
      EXPECT_TRUE(contains(message, "'brick'")) << message;
      EXPECT_FALSE(contains(message, "base64,") || contains(message, red_pixel.substr(0, 12)))
          << message;
      EXPECT_LT(message.size(), 400u);
    }
  }
  // Addresses whose begin is misspelt are taken for files' names.
  for (const std::string& uri : {"dat:image/png;base64," + red_pixel, std::string(5000, 'A')}) {
    const std::string message = failure(write(textured_file({{"uri", uri}})));
    EXPECT_TRUE(contains(message, "missing or empty")) << message;
    EXPECT_FALSE(contains(message, red_pixel.substr(0, 12)) || message.size() > 600) << message;
  }
  // A text cut short within the data of a picture or a buffer.
  std::string text = textured_file({{"uri", type + red_pixel}}).dump();
  text.resize(text.find(red_pixel) + 50);
  const std::string cut = failure(write_bytes("cut.gltf", text));
  EXPECT_TRUE(contains(cut, "not JSON at line 1")) << cut;
  EXPECT_FALSE(contains(cut, red_pixel.substr(0, 12))) << cut;
  json root = triangle_file();
  root["buffers"][0]["uri"] = "data:application/octet-stream;base64,AAAAAAAAAAA=AAAA";
  const std::string buffer = failure(write(root));
  EXPECT_TRUE(contains(buffer, "buffer 0") && contains(buffer, "character 13")) << buffer;
  EXPECT_FALSE(contains(buffer, "AAAA")) << buffer;
}

TEST_F(GltfFiles, PicturesInFilesByAnySpellingOfTheirNames) {
  std::filesystem::create_directories(folder_ / "my pictures");
  for (const char* name : {"my pictures/red wall.png", "100%25.png"})
    write_bytes(name, bytes_of_base64(red_pixel));
  for (const char* uri : {"my%20pictures/red%20wall.png", "my pictures/red wall.png",
                          "my%20pictures\\red wall.png", "100%25.png"})
    EXPECT_EQ(failure(write(textured_file({{"uri", uri}}))), "") << uri;
  // Pictures that nothing draws are not asked for.
  json root = triangle_file();
  root["images"] = json::array({{{"uri", "nowhere.png"}}, {{"uri", "data:image/png;base64,*"}}});
  EXPECT_EQ(failure(write(root)), "");
  root = triangle_file();
  root["buffers"][0]["uri"] = "nowhere.bin";
  EXPECT_TRUE(
      contains(failure(write(root)), "the file 'nowhere.bin' with its buffer 0 is missing"));
}

TEST_F(GltfFiles, EmissiveTexturesGlowByTheirMean) {
  const Picture half{2, 1, 3, {255, 0, 0, 0, 0, 128}};
  json root = textured_file({{"uri", "data:image/png;base64," + base64(raw(encode_png(half)))}});
  json& material = root["materials"][0];
  material["emissiveFactor"] = {1.0, 1.0, 0.5};
  EXPECT_EQ(load_scene(write(root)).materials[0].emission, Vec3f(1.0f, 1.0f, 0.5f));
  material["emissiveTexture"] = {{"index", 0}};
  material["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = 4.0;
  const Scene scene = load_scene(write(root));
  EXPECT_EQ(scene.materials[0].emission, Vec3f(2.0f, 0.0f, srgb_to_linear(128)));
  EXPECT_TRUE(contains(scene.left_out, "emissive textures")) << scene.left_out;
  EXPECT_EQ(scene.textures.size(), 1u);
  material["emissiveTexture"]["index"] = 3;
  EXPECT_TRUE(contains(failure(write(root)), "whose emissive colour texture does not exist"));
  material["emissiveFactor"] = {0.0, 0.0, 0.0};
  EXPECT_EQ(failure(write(root)), "");
}

TEST_F(GltfFiles, SpecularGlossinessIsReadAsGltfsOwnMaterials) {
  json root = textured_file({{"uri", "data:image/png;base64," + red_pixel}});
  json& material = root["materials"][0];
  const auto read = [&](const json& extension) {
    material["pbrMetallicRoughness"] = json::object();
    material["extensions"]["KHR_materials_pbrSpecularGlossiness"] = extension;
    root["extensionsUsed"] = root["extensionsRequired"] = {"KHR_materials_pbrSpecularGlossiness"};
    return load_scene(write(root));
  };
  const json texture = {{"index", 0}, {"texCoord", 1}};
  const Scene scene = read({{"diffuseTexture", texture},
                            {"diffuseFactor", {0.5, 0.25, 1.0, 1.0}},
                            {"specularGlossinessTexture", texture}});
  EXPECT_EQ(scene.textures.size(), 1u);
  EXPECT_EQ(scene.materials[0].base_colour_texture, 0);
  EXPECT_EQ(scene.materials[0].base_colour, Vec3f(0.5f, 0.25f, 1.0f));
  EXPECT_EQ(scene.materials[0].roughness, 1.0f);
  EXPECT_EQ(scene.materials[0].metallic, 0.0f);
  const Material matt =
      read({{"glossinessFactor", 0.25}, {"diffuseFactor", {0, 0.5, 0, 1}}}).materials[0];
  EXPECT_EQ(matt.base_colour, Vec3f(0.0f, 0.5f, 0.0f));
  EXPECT_EQ(matt.roughness, 0.75f);
  const Material mirror =
      read({{"specularFactor", {0.9, 0.6, 0.3}}, {"diffuseFactor", {0, 0, 0, 1}}}).materials[0];
  EXPECT_TRUE(mirror.only_mirrors());
  EXPECT_EQ(mirror.f0(), Vec3f(0.9f, 0.6f, 0.3f));
  for (const json& broken : {json{0.9}, json("white"), json(nullptr), json::object()}) {
    material["extensions"]["KHR_materials_pbrSpecularGlossiness"] = {{"specularFactor", broken}};
    failure(write(root));
    material["extensions"]["KHR_materials_pbrSpecularGlossiness"] = {{"diffuseFactor", broken}};
    failure(write(root));
    material["extensions"]["KHR_materials_pbrSpecularGlossiness"] = broken;
    failure(write(root));
  }
  material["extensions"]["KHR_materials_pbrSpecularGlossiness"] = {{"specularFactor", {0.9}}};
  EXPECT_NE(failure(write(root)), "");
}

TEST_F(GltfFiles, WhatIsNotDrawnIsSaid) {
  json root = triangle_file();
  EXPECT_EQ(load_scene(write(root)).left_out, "");
  root["materials"] = json::array({{{"alphaMode", "MASK"}}});
  root["nodes"][0]["skin"] = 0;
  root["skins"] = json::array({{{"joints", {0}}}});
  root["animations"] = json::array({{{"channels", json::array()}, {"samplers", json::array()}}});
  attributes(root)["COLOR_0"] = 0;
  EXPECT_EQ(load_scene(write(root)).left_out,
            "skins (their meshes stand as they were modelled), transparency, vertex colours");
}

TEST_F(GltfFiles, CompressedWithoutFallbackIsRefusedByName) {
  const json whole = triangle_file();
  for (const char* extension : {"EXT_meshopt_compression", "KHR_draco_mesh_compression",
                                "KHR_texture_basisu", "MY_own_extension"}) {
    json root = whole;
    root["extensionsRequired"] = {"KHR_mesh_quantization", extension};
    EXPECT_TRUE(contains(failure(write(root)), extension));
  }
  // The same where it is only said to be used.
  json root = whole;
  root["extensionsUsed"] = {"EXT_meshopt_compression"};
  root["buffers"].push_back({{"byteLength", 36}});
  root["bufferViews"][0]["buffer"] = 1;
  root["bufferViews"][0]["extensions"]["EXT_meshopt_compression"] = {{"buffer", 0}};
  EXPECT_TRUE(contains(failure(write(root)), "EXT_meshopt_compression"));
  root["bufferViews"][0]["buffer"] = 0;
  EXPECT_EQ(failure(write(root)), "") << "a fallback";

  root = whole;
  root["extensionsUsed"] = {"KHR_draco_mesh_compression"};
  json& primitive = root["meshes"][0]["primitives"][0];
  primitive["extensions"]["KHR_draco_mesh_compression"] = {{"bufferView", 0}};
  EXPECT_EQ(failure(write(root)), "") << "a fallback";
  root["accessors"][0].erase("bufferView");
  EXPECT_TRUE(contains(failure(write(root)), "KHR_draco_mesh_compression"));

  root = textured_file({{"uri", "wall.webp"}});
  root["textures"][0] = {{"extensions", {{"EXT_texture_webp", {{"source", 0}}}}}};
  EXPECT_TRUE(contains(failure(write(root)), "EXT_texture_webp"));
}

TEST_F(GltfFiles, GlbContainersAsTheyComeInTheWild) {
  const auto [text, data] = glb_parts();
  const std::string spaced = padded(text, ' ');
  std::string longer = text, odd_buffer = text;
  longer.replace(longer.find("\"byteLength\":36}],\"mesh"), 15, "\"byteLength\":39");
  ASSERT_NE(longer, text);
  std::string claims_more = glb(chunk(json_kind, spaced) + chunk(bin_kind, data));
  claims_more.replace(8, 4, word(1000));
  std::string zero_length = claims_more;
  zero_length.replace(8, 4, word(0));
  const std::string usual = glb(chunk(json_kind, spaced) + chunk(bin_kind, data));
  const Scene plain = load_scene(write_bytes("usual.glb", usual));
  for (const auto& [name, bytes] : std::initializer_list<std::pair<const char*, std::string>>{
           {"nothing padded", glb(chunk(json_kind, text + " ") + chunk(bin_kind, data + "x"))},
           {"padding not counted",
            glb(padded(chunk(json_kind, text + std::string(1 + text.size() % 2, ' ')), ' ') +
                chunk(bin_kind, data))},
           {"JSON padded with zeros",
            glb(chunk(json_kind, padded(text, '\0')) + chunk(bin_kind, data))},
           {"buffer longer than the chunk by padding",
            glb(chunk(json_kind, padded(longer, ' ')) + chunk(bin_kind, data))},
           {"trailing bytes", usual + "more"},
           {"many trailing bytes", usual + std::string(100, '\xFF')},
           {"a third chunk",
            glb(chunk(json_kind, spaced) + chunk(bin_kind, data) + chunk("ABCD", "12345678"))},
           {"a chunk between",
            glb(chunk(json_kind, spaced) + chunk("ABCD", "12345678") + chunk(bin_kind, data))},
           {"the data first", glb(chunk(bin_kind, data) + chunk(json_kind, spaced))},
           {"a wrong length", claims_more},
           {"length 0", zero_length},
           {"a byte order mark",
            glb(chunk(json_kind, padded("\xEF\xBB\xBF" + text, ' ')) + chunk(bin_kind, data))}}) {
    const std::string path = write_bytes("odd.glb", bytes);
    ASSERT_EQ(failure(path), "") << name;
    EXPECT_EQ(load_scene(path).meshes[0].positions, plain.meshes[0].positions) << name;
  }
  // Without the data.
  for (const std::string& bytes :
       {glb(chunk(json_kind, spaced)), glb(chunk(json_kind, spaced) + chunk(bin_kind, "")),
        glb(chunk(json_kind, spaced) + chunk(bin_kind, data.substr(0, 32)))}) {
    const std::string message = failure(write_bytes("odd.glb", bytes));
    EXPECT_TRUE(contains(message, "beyond its buffer 0")) << message;
  }
  json embedded = triangle_file();
  embedded["buffers"][0]["uri"] = "data:;base64," + base64(data);
  EXPECT_EQ(failure(write_bytes("odd.glb", glb(chunk(json_kind, padded(embedded.dump(), ' ')) +
                                               chunk(bin_kind, "")))),
            "");
  std::string old = usual;
  old[4] = 1;
  EXPECT_TRUE(contains(failure(write_bytes("odd.glb", old)), "version 1"));
  EXPECT_TRUE(contains(failure(write_bytes("odd.glb", usual.substr(0, 50))), "cut short"));
  EXPECT_TRUE(contains(failure(write_bytes("odd.glb", glb(chunk(bin_kind, data)))), "no JSON"));
}

TEST_F(GltfFiles, TheContentCountsNotTheEnding) {
  const auto [text, data] = glb_parts();
  const std::string binary = glb(chunk(json_kind, padded(text, ' ')) + chunk(bin_kind, data));
  EXPECT_EQ(failure(write_bytes("binary.gltf", binary)), "");
  EXPECT_EQ(failure(write_bytes("text.GLB", triangle_file().dump())), "");
  std::string lines = triangle_file().dump(1);
  for (std::size_t at = 0; (at = lines.find('\n', at)) != lines.npos; at += 2)
    lines.insert(at, "\r");
  EXPECT_EQ(failure(write_bytes("windows.gltf", "\xEF\xBB\xBF" + lines)), "");
  EXPECT_TRUE(contains(failure(write_bytes("wide.gltf", "\xFF\xFE{")), "UTF-16"));
  EXPECT_TRUE(contains(failure(write_bytes("page.glb", "<html>")), "begins neither"));
  EXPECT_TRUE(contains(failure(write_bytes("empty.glb", "")), "begins neither"));
  json old = triangle_file();
  old["asset"]["version"] = "1.0";
  EXPECT_TRUE(contains(failure(write(old)), "glTF 1.0"));
  old["asset"]["version"] = "2";
  EXPECT_EQ(failure(write(old)), "");
}

TEST_F(GltfFiles, MembersOfOtherKindsNeverCrash) {
  const json whole = textured_file({{"uri", "data:image/png;base64," + red_pixel}});
  for (const char* name :
       {"asset", "buffers", "bufferViews", "accessors", "images", "textures", "nodes", "scenes",
        "meshes", "materials", "cameras", "extensionsRequired"}) {
    for (const json& value : {json(7), json("text"), json::array({7}), json::object(),
                              json::array({json::object()}), json(nullptr)}) {
      json root = whole;
      root[name] = value;
      failure(write(root));
    }
  }
  for (const json& value : {json(-1), json(1e300), json("0"), json(1u << 31)}) {
    json root = whole;
    root["images"][0] = {{"bufferView", value}};
    EXPECT_NE(failure(write(root)), "");
    root = whole;
    root["accessors"][0]["bufferView"] = value;
    failure(write(root));
  }
}

TEST_F(GltfFiles, WithoutADefaultSceneTheFirstWithNodesIsTaken) {
  json root = triangle_file();
  root.erase("scene");
  root["scenes"].insert(root["scenes"].begin(), json{{"name", "empty"}});
  EXPECT_EQ(load_scene(write(root)).meshes.size(), 1u);
  root["scene"] = 0;
  EXPECT_TRUE(contains(failure(write(root)), "no geometry"));
}

TEST_F(GltfFiles, AGivenExposureStaysWithAnAssumedLight) {
  json root = triangle_file();
  const auto exposure = [](Scene scene) {
    assume_light(scene);
    return scene.exposure;
  };
  const float automatic = exposure(load_scene(write(root)));
  EXPECT_NE(automatic, 1.0f);
  const std::string saved = (folder_ / "saved.glb").string();
  save_scene(load_scene(write(root)), saved);
  EXPECT_FLOAT_EQ(exposure(load_scene(saved)), automatic);
  for (const float given : {0.25f, 1.0f}) {
    root["scenes"][0]["extras"]["exposure"] = given;
    EXPECT_EQ(exposure(load_scene(write(root))), given);
    save_scene(load_scene(write(root)), saved);
    EXPECT_EQ(exposure(load_scene(saved)), given);
  }
}

TEST_F(GltfFiles, EachCameraHasANameOfItsOwn) {
  json root = triangle_file();
  const json perspective = {{"type", "perspective"},
                            {"perspective", {{"yfov", 1.0}, {"znear", 0.1}}}};
  root["cameras"] = json::array({perspective, perspective});
  root["cameras"][0]["name"] = "main";
  for (const json& node : {json{{"camera", 0}}, json{{"camera", 1}}, json{{"camera", 0}},
                           json{{"camera", 1}, {"name", "side"}}}) {
    root["scenes"][0]["nodes"].push_back(root["nodes"].size());
    root["nodes"].push_back(node);
  }
  std::vector<std::string> names;
  for (const Camera& camera : load_scene(write(root)).cameras) names.push_back(camera.name);
  EXPECT_EQ(names, (std::vector<std::string>{"main", "camera 1", "main (2)", "side"}));
}

}  // namespace
}  // namespace polyhull
