// SPDX-License-Identifier: LGPL-2.1-or-later
#include "files/mesh_files.h"

#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "base/error.h"
#include "base/picture.h"
#include "base/srgb.h"
#include "builtin/default_rig.h"
#include "rig/rig.h"
#include "scene/scene.h"
#include "support/obj_reader.h"
#include "support/refusal.h"
#include "wire_examples.h"

namespace polyhull {
namespace {

std::filesystem::path folder() {
  const auto path = std::filesystem::temp_directory_path() / "polyhull_mesh_files";
  std::filesystem::create_directories(path);
  return path;
}

std::string content(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream out;
  out << file.rdbuf();
  return out.str();
}

// A 1 m cube around (0, 1, 0) seen by two cameras of the default rig, whose pictures code the
// pixel's place in colours: red is x / 4, green is y / 4.
struct Example {
  std::vector<std::uint8_t> pixels[2];
  Mesh mesh;
};

Example textured_cube() {
  Example example;
  Mesh& mesh = example.mesh;
  mesh.hull.origin = Vec3(0, 1, 0);
  for (int i = 0; i < 8; ++i)
    mesh.hull.vertices.emplace_back(i & 1 ? 0.5f : -0.5f, i & 2 ? 0.5f : -0.5f,
                                    i & 4 ? 0.5f : -0.5f);
  mesh.hull.triangles = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                         2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  const Rig rig = default_rig();
  for (int v = 0; v < 2; ++v) {
    View view;
    view.camera = rig.cameras[v].name;
    view.width = 1024;
    view.height = 768;
    view.roi = {40, 30, 920, 700};
    view.format = PixelFormat::rgba;
    view.stride = 920 * 4;
    for (int y = 0; y < 700; ++y)
      for (int x = 0; x < 920; ++x)
        for (const int c : {(x + 40) / 4, (y + 30) / 4, 0, 255})
          example.pixels[v].push_back(static_cast<std::uint8_t>(c));
    view.pixels = example.pixels[v];
    mesh.views.push_back({rig.cameras[v], view});
  }
  mesh.views[1].calibration.distortion = {-0.1, 0.02, 0, 0};
  Texturing texturing;
  texturing.best.assign(12, 0);
  for (int i = 4; i < 8; ++i) texturing.best[i] = 1;
  texturing.best[10] = texturing.best[11] = -1;
  texturing.visible.assign(12, 3);
  texturing.visible[10] = texturing.visible[11] = 0;
  texturing.weights.assign(16, 0.5f);
  texturing.normals.assign(8, Vec3f(0, 1, 0));
  mesh.texturing = texturing;
  return example;
}

tinygltf::Model load_gltf(const std::filesystem::path& path) {
  tinygltf::TinyGLTF loader;
  tinygltf::Model model;
  std::string error, warning;
  EXPECT_TRUE(loader.LoadBinaryFromFile(&model, &error, &warning, path.string())) << error;
  EXPECT_EQ(error, "");
  EXPECT_EQ(warning, "");
  return model;
}

template <class T>
std::vector<T> read_accessor(const tinygltf::Model& model, int index) {
  const tinygltf::Accessor& accessor = model.accessors.at(index);
  const tinygltf::BufferView& view = model.bufferViews.at(accessor.bufferView);
  EXPECT_EQ(view.byteLength, accessor.count * sizeof(T));
  EXPECT_EQ(view.byteOffset % 4, 0u);
  std::vector<T> result(accessor.count);
  std::memcpy(static_cast<void*>(result.data()),
              model.buffers.at(view.buffer).data.data() + view.byteOffset, view.byteLength);
  return result;
}

TEST(Glb, PlainMeshKeepsWorldCoordinates) {
  Mesh mesh = textured_cube().mesh;
  mesh.texturing.reset();
  const auto path = folder() / "plain.glb";
  write_mesh_file(mesh, path.string());
  const tinygltf::Model model = load_gltf(path);
  ASSERT_EQ(model.meshes.size(), 1u);
  ASSERT_EQ(model.meshes[0].primitives.size(), 1u);
  const tinygltf::Primitive& primitive = model.meshes[0].primitives[0];
  EXPECT_EQ(read_accessor<Vec3f>(model, primitive.attributes.at("POSITION")), mesh.hull.vertices);
  EXPECT_EQ(read_accessor<std::uint32_t>(model, primitive.indices), mesh.hull.triangles);
  EXPECT_EQ(model.nodes[0].translation, (std::vector<double>{0, 1, 0}));
  EXPECT_TRUE(model.nodes[0].rotation.empty() && model.nodes[0].scale.empty());
  EXPECT_TRUE(model.images.empty());
}

// Every point of every textured triangle shows the pixel that the camera has there.
TEST(Glb, TexturesAreTheCamerasPictures) {
  const Example example = textured_cube();
  for (const int quality : {0, 95}) {
    MeshFileOptions options;
    options.jpeg_quality = quality;
    const auto path = folder() / "textured.GLB";
    write_mesh_file(example.mesh, path.string(), options);
    const tinygltf::Model model = load_gltf(path);
    ASSERT_EQ(model.images.size(), 2u);
    ASSERT_EQ(model.meshes.at(0).primitives.size(), 3u);
    double area = 0.0;
    for (const tinygltf::Primitive& primitive : model.meshes[0].primitives) {
      const auto positions = read_accessor<Vec3f>(model, primitive.attributes.at("POSITION"));
      const auto triangles = read_accessor<std::uint32_t>(model, primitive.indices);
      const tinygltf::Material& material = model.materials.at(primitive.material);
      const int texture = material.pbrMetallicRoughness.baseColorTexture.index;
      for (std::size_t i = 0; i + 2 < triangles.size(); i += 3)
        area +=
            0.5 * glm::length(glm::cross(positions[triangles[i + 1]] - positions[triangles[i]],
                                         positions[triangles[i + 2]] - positions[triangles[i]]));
      if (texture < 0) {
        EXPECT_EQ(material.name, "unseen");
        EXPECT_GE(triangles.size(), 6u);  // split along with its neighbours
        continue;
      }
      const auto coordinates = read_accessor<Vec2f>(model, primitive.attributes.at("TEXCOORD_0"));
      ASSERT_EQ(coordinates.size(), positions.size());
      const tinygltf::Image& image = model.images.at(model.textures.at(texture).source);
      ASSERT_EQ(image.width, 920);
      ASSERT_EQ(image.height, 700);
      const Camera& camera =
          example.mesh.views[image.name == example.mesh.views[0].view.camera ? 0 : 1].calibration;
      EXPECT_EQ(camera.name, image.name);
      for (std::size_t i = 0; i + 2 < triangles.size(); i += 3) {
        for (const Vec3f b : {Vec3f(1, 0, 0), Vec3f(0.3f, 0.3f, 0.4f), Vec3f(0.5f, 0.5f, 0)}) {
          Vec3f position(0.0f);
          Vec2f coordinate(0.0f);
          for (int c = 0; c < 3; ++c) {
            position += b[c] * positions[triangles[i + c]];
            coordinate += b[c] * coordinates[triangles[i + c]];
          }
          const auto pixel = camera.project(example.mesh.hull.origin + Vec3(position));
          const double u = coordinate.x * 920 - 0.5 + 40, v = coordinate.y * 700 - 0.5 + 30;
          EXPECT_NEAR(u, pixel->x, 1.0);
          EXPECT_NEAR(v, pixel->y, 1.0);
          const int x = static_cast<int>(u - 40 + 0.5), y = static_cast<int>(v - 30 + 0.5);
          const unsigned char* colour = &image.image[(y * 920 + x) * image.component];
          EXPECT_NEAR(colour[0], pixel->x / 4, quality ? 6 : 1.5);
          EXPECT_NEAR(colour[1], pixel->y / 4, quality ? 6 : 1.5);
        }
      }
    }
    EXPECT_NEAR(area, 6.0, 1e-5);
  }
}

// The pictures in files are those that a renderer would show: gains and all.
TEST(Glb, GainsAreInThePictures) {
  Example example = textured_cube();
  const auto path = folder() / "gains.glb";
  MeshFileOptions options;
  options.jpeg_quality = 0;
  write_mesh_file(example.mesh, path.string(), options);
  const tinygltf::Model plain = load_gltf(path);
  const Vec3f gains[] = {{2.0f, 0.5f, 1.0f}, {1.0f, 1.25f, 0.8f}};
  example.mesh.texturing->gains.assign(std::begin(gains), std::end(gains));
  write_mesh_file(example.mesh, path.string(), options);
  const tinygltf::Model model = load_gltf(path);
  ASSERT_EQ(model.images.size(), 2u);
  for (std::size_t k = 0; k < 2; ++k) {
    ASSERT_EQ(model.images[k].name, example.mesh.views[k].view.camera);
    const std::vector<unsigned char>&before = plain.images[k].image, &after = model.images[k].image;
    ASSERT_EQ(before.size(), after.size());
    const int channels = model.images[k].component;
    for (std::size_t i = 0; i < before.size(); ++i) {
      const std::size_t c = i % static_cast<std::size_t>(channels);
      const std::size_t pixel = i / static_cast<std::size_t>(channels);
      const View& view = example.mesh.views[k].view;
      const std::size_t width = static_cast<std::size_t>(view.roi.width);
      const std::uint8_t* from = &view.pixels[pixel / width * view.stride + 4 * (pixel % width)];
      if (c > 2 || from[3] < 128) continue;  // of others the subject's colour is spread
      ASSERT_EQ(after[i], linear_to_srgb(gains[k][static_cast<int>(c)] * srgb_to_linear(before[i])))
          << k << " " << i;
    }
  }
}

// Readers that heed nodes see metres with y up, whatever the rig's unit and axes; the coordinates
// in the buffers stay the rig's.
TEST(Glb, OpensInMetresWithYUp) {
  Mesh rig = textured_cube().mesh;
  rig.texturing.reset();
  write_mesh_file(rig, (folder() / "metres.glb").string());
  const Scene expected = load_scene((folder() / "metres.glb").string());
  // y -> z, z -> -y: where up is +z, the turn back takes (x, -z, y) to (x, y, z).
  for (const double unit : {1.0, 0.001}) {
    for (const bool z_up : {false, true}) {
      Mesh mesh = rig;
      mesh.metres_per_unit = unit;
      const auto turned = [&](const Vec3& p) { return (z_up ? Vec3(p.x, -p.z, p.y) : p) / unit; };
      if (z_up) mesh.up = Vec3(0, 0, 1);
      mesh.hull.origin = turned(rig.hull.origin);
      for (Vec3f& vertex : mesh.hull.vertices) vertex = Vec3f(turned(Vec3(vertex)));
      const auto path = folder() / "other.glb";
      write_mesh_file(mesh, path.string());
      const tinygltf::Model model = load_gltf(path);
      const auto positions = read_accessor<Vec3f>(
          model, model.meshes.at(0).primitives.at(0).attributes.at("POSITION"));
      EXPECT_EQ(positions, mesh.hull.vertices);
      EXPECT_EQ(model.nodes.size(), z_up || unit != 1.0 ? 2u : 1u);
      const Scene scene = load_scene(path.string());
      ASSERT_EQ(scene.meshes.size(), 1u);
      ASSERT_EQ(scene.meshes[0].positions.size(), expected.meshes[0].positions.size());
      for (std::size_t i = 0; i < scene.meshes[0].positions.size(); ++i) {
        EXPECT_LT(glm::length(scene.meshes[0].positions[i] - expected.meshes[0].positions[i]),
                  1e-5f)
            << "vertex " << i << ", unit " << unit << (z_up ? ", z up" : "");
      }
    }
  }
}

TEST(Glb, EmptyMeshIsAValidFile) {
  Mesh mesh;
  const auto path = folder() / "empty.glb";
  write_mesh_file(mesh, path.string());
  const tinygltf::Model model = load_gltf(path);
  EXPECT_TRUE(model.meshes.empty());
  EXPECT_EQ(model.nodes.size(), 1u);
}

TEST(Glb, BackgroundDoesNotBleedIn) {
  Example example = textured_cube();
  // Background (alpha 0) is pure green but for a disk.
  for (int y = 0; y < 700; ++y)
    for (int x = 0; x < 920; ++x) {
      std::uint8_t* p = &example.pixels[0][(y * 920 + x) * 4];
      const bool inside = std::hypot(x - 460, y - 350) < 200;
      const std::uint8_t subject[] = {200, 20, 30, 255}, screen[] = {0, 255, 0, 0};
      std::memcpy(p, inside ? subject : screen, 4);
    }
  MeshFileOptions options;
  options.jpeg_quality = 0;
  const auto path = folder() / "bleed.glb";
  write_mesh_file(example.mesh, path.string(), options);
  const tinygltf::Model model = load_gltf(path);
  const tinygltf::Image& image = model.images.at(0);
  const auto red = [&](int x) { return image.image[(350 * 920 + x) * image.component]; };
  EXPECT_EQ(red(460 + 199), 200);
  EXPECT_EQ(red(460 + 202), 200);  // outside, the subject's colour goes on
  EXPECT_EQ(red(460 + 220), 0);
}

TEST(Ply, BinaryDoublesAndFloats) {
  const Mesh mesh = textured_cube().mesh;
  for (const bool precise : {true, false}) {
    MeshFileOptions options;
    options.double_precision = precise;
    const auto path = folder() / "cube.ply";
    write_mesh_file(mesh, path.string(), options);
    const std::string bytes = content(path);
    EXPECT_NE(bytes.find(precise ? "property double x" : "property float x"), std::string::npos);
    EXPECT_NE(bytes.find("element vertex 8\n"), std::string::npos);
    EXPECT_NE(bytes.find("element face 12\n"), std::string::npos);
    const std::size_t body = bytes.find("end_header\n") + 11;
    const std::size_t number = precise ? 8 : 4;
    ASSERT_EQ(bytes.size() - body, 8 * 3 * number + 12 * 13);
    double x = 0, y = 0;
    float xf = 0, yf = 0;
    std::memcpy(&x, &bytes[body + 3 * 3 * 8], precise ? 8 : 0);
    std::memcpy(&y, &bytes[body + (3 * 3 + 1) * 8], precise ? 8 : 0);
    std::memcpy(&xf, &bytes[body + 3 * 3 * 4], 4);
    std::memcpy(&yf, &bytes[body + (3 * 3 + 1) * 4], 4);
    EXPECT_EQ(precise ? x : xf, 0.5);
    EXPECT_EQ(precise ? y : yf, 1.5);
    EXPECT_EQ(bytes[body + 24 * number], 3);
  }
}

TEST(Ply, FarOriginLosesNothing) {
  Mesh mesh = textured_cube().mesh;
  mesh.hull.origin = Vec3(1e9, 0, 0);
  mesh.hull.vertices[0].x = 0.015625f;
  const auto path = folder() / "far.ply";
  write_mesh_file(mesh, path.string());
  const std::string bytes = content(path);
  double x = 0;
  std::memcpy(&x, &bytes[bytes.find("end_header\n") + 11], 8);
  EXPECT_EQ(x, 1e9 + 0.015625);
}

TEST(Obj, ComesBackThroughTheReader) {
  const Example example = textured_cube();
  const auto path = folder() / "cube.obj";
  write_mesh_file(example.mesh, path.string());
  const ObjModel model = read_obj(path.string());
  EXPECT_GE(model.triangles.size(), 36u);
  ASSERT_EQ(model.material_list.size(), 3u);
  ASSERT_EQ(model.materials.size() * 3, model.triangles.size());
  double volume = 0.0;  // closed, outside out
  for (std::size_t i = 0; i < model.triangles.size(); i += 3) {
    const Vec3f &a = model.positions[model.triangles[i]],
                &b = model.positions[model.triangles[i + 1]],
                &c = model.positions[model.triangles[i + 2]];
    volume += glm::dot(a, glm::cross(b, c)) / 6.0;
  }
  EXPECT_NEAR(volume, 1.0, 1e-5);
  for (const ObjMaterial& material : model.material_list) {
    if (material.name == "unseen") continue;
    const Picture picture = load_picture(material.texture, 3);
    EXPECT_EQ(picture.width, 920);
  }
  MeshFileOptions plain;
  plain.textured = false;
  write_mesh_file(example.mesh, path.string(), plain);
  const ObjModel untextured = read_obj(path.string());
  EXPECT_EQ(untextured.triangles, example.mesh.hull.triangles);
  EXPECT_EQ(untextured.positions[3], Vec3f(0.5f, 1.5f, -0.5f));
}

std::vector<std::string> words_after(const std::string& text, const std::string& keyword) {
  std::vector<std::string> found;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with(keyword + " ")) found.push_back(line.substr(keyword.size() + 1));
  return found;
}

// Plain readers cut names at blanks and take # for a comment; files of other names stay their own.
TEST(Obj, NamesBesideItArePlainAndItsOwn) {
  Example example = textured_cube();
  for (MeshView& view : example.mesh.views) view.view.roi.width = view.view.roi.height = 8;
  std::map<std::string, std::string> library_of;
  for (const char* name : {"my hull.obj", "my_hull.obj", "hull.obj", "hull.OBJ", "-hull #1.obj"}) {
    const auto path = folder() / name;
    write_mesh_file(example.mesh, path.string());
    const auto libraries = words_after(content(path), "mtllib");
    ASSERT_EQ(libraries.size(), 1u);
    for (const auto& [other, library] : library_of)
      EXPECT_NE(libraries[0], library) << name << other;
    library_of[name] = libraries[0];
    ASSERT_TRUE(std::filesystem::exists(folder() / libraries[0])) << libraries[0];
    const auto pictures = words_after(content(folder() / libraries[0]), "map_Kd");
    EXPECT_EQ(pictures.size(), 2u);
    for (const std::string& word : {libraries[0], pictures.at(0), pictures.at(1)}) {
      EXPECT_EQ(word.find_first_of(" \t#"), std::string::npos) << word;
      EXPECT_NE(word[0], '-') << word;
      EXPECT_TRUE(std::filesystem::exists(folder() / word)) << word;
    }
    EXPECT_EQ(read_obj(path.string()).material_list.size(), 3u);
  }
  EXPECT_EQ(library_of["hull.obj"], "hull.mtl");
  EXPECT_EQ(library_of["my_hull.obj"], "my_hull.mtl");
  EXPECT_EQ(library_of["my hull.obj"].rfind("my_hull-", 0), 0u);
}

TEST(Obj, NumbersHaveNoExponents) {
  Example example = textured_cube();
  for (MeshView& view : example.mesh.views) view.view.roi.width = view.view.roi.height = 8;
  Mesh& mesh = example.mesh;
  mesh.metres_per_unit = 1e-6;
  mesh.hull.origin = Vec3(0.0, 1e21, 1e-30);
  mesh.hull.vertices[0] = Vec3f(1.9e-8f, 0.0f, 1e-30f);
  for (const bool textured : {false, true}) {
    if (textured) mesh.hull.origin = Vec3(0, 1, 0);
    MeshFileOptions options;
    options.textured = textured;
    const auto path = folder() / "tiny.obj";
    write_mesh_file(mesh, path.string(), options);
    const std::string text = content(path);
    for (const char* keyword : {"v", "vt", "# metres per unit"})
      for (const std::string& numbers : words_after(text, keyword))
        EXPECT_EQ(numbers.find_first_not_of("0123456789.- "), std::string::npos) << numbers;
    const ObjModel model = read_obj(path.string());
    const auto small = std::count_if(model.positions.begin(), model.positions.end(),
                                     [](const Vec3f& p) { return p.x == 1.9e-8f; });
    EXPECT_GE(small, 1);
  }
}

// A smooth surface has normals, also where triangles are split; a polyhedron has none.
TEST(MeshFiles, NormalsOfSmoothSurfaces) {
  Example example = textured_cube();
  for (MeshView& view : example.mesh.views) view.view.roi.width = view.view.roi.height = 8;
  Mesh& mesh = example.mesh;
  for (const bool smooth : {false, true}) {
    if (smooth)
      for (const Vec3f& vertex : mesh.hull.vertices)
        mesh.hull.normals.push_back(glm::normalize(vertex));
    for (const bool textured : {false, true}) {
      MeshFileOptions options;
      options.textured = textured;
      write_mesh_file(mesh, (folder() / "smooth.glb").string(), options);
      const tinygltf::Model model = load_gltf(folder() / "smooth.glb");
      for (const tinygltf::Primitive& primitive : model.meshes.at(0).primitives) {
        ASSERT_EQ(primitive.attributes.count("NORMAL"), smooth ? 1u : 0u);
        if (!smooth) continue;
        const auto positions = read_accessor<Vec3f>(model, primitive.attributes.at("POSITION"));
        const auto normals = read_accessor<Vec3f>(model, primitive.attributes.at("NORMAL"));
        ASSERT_EQ(normals.size(), positions.size());
        for (std::size_t i = 0; i < normals.size(); ++i) {
          EXPECT_NEAR(glm::length(normals[i]), 1.0f, 1e-5f);
          EXPECT_GT(glm::dot(normals[i], positions[i]), 0.0f);
        }
      }
      write_mesh_file(mesh, (folder() / "smooth.obj").string(), options);
      const ObjModel obj = read_obj((folder() / "smooth.obj").string());
      ASSERT_EQ(obj.normals.size(), smooth ? obj.triangles.size() : 0u);
      for (std::size_t i = 0; i < obj.normals.size(); ++i)
        EXPECT_GT(glm::dot(obj.normals[i], obj.positions[obj.triangles[i]] - Vec3f(0, 1, 0)), 0.0f);
    }
  }
}

TEST(Obj, SaysUnitAndUpWhereTheyAreUnusual) {
  Mesh mesh = textured_cube().mesh;
  mesh.texturing.reset();
  const auto path = folder() / "unit.obj";
  write_mesh_file(mesh, path.string());
  EXPECT_EQ(content(path).find("# up"), std::string::npos);
  mesh.metres_per_unit = 0.001;
  mesh.up = Vec3(0, 0, -1);
  write_mesh_file(mesh, path.string());
  EXPECT_NE(content(path).find("# metres per unit 0.001\n# up 0 0 -1\n"), std::string::npos);
  EXPECT_EQ(read_obj(path.string()).triangles, mesh.hull.triangles);
}

TEST(Obj, RealFile) {
  const char* data = std::getenv("POLYHULL_DATA");
  const std::string path = std::string(data ? data : "") + "/meshes/spot.obj";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "needs meshes under $POLYHULL_DATA";
  const ObjModel model = read_obj(path);
  EXPECT_EQ(model.triangles.size() / 3, 5856u);
  EXPECT_EQ(model.coordinates.size(), model.triangles.size());
}

TEST(Obj, BadFilesAreRefused) {
  EXPECT_THROW(read_obj("/nowhere/x.obj"), Error);
  EXPECT_THROW(read_obj("/tmp"), Error);
  const auto path = folder() / "bad.obj";
  for (const char* text : {"", "v 0 0 0\nv 1 0 0\nv 0 1 0\n",
                           "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "hello\nworld\n"}) {
    std::ofstream(path) << text;
    EXPECT_THROW(read_obj(path.string()), Error) << text;
  }
}

TEST(MeshFiles, UnwritableAndUnknown) {
  const Example example = textured_cube();
  const Mesh& mesh = example.mesh;
  for (const char* path : {"/nowhere/hull.glb", "/nowhere/hull.ply", "/nowhere/hull.obj"}) {
    test::expect_refused([&] { write_mesh_file(mesh, path); }, {"/nowhere/hull"}, Error::Kind::io);
  }
  EXPECT_THROW(write_mesh_file(mesh, (folder() / "hull.unknown").string()), Error);
  EXPECT_TRUE(is_mesh_file_name("a/B.GLB"));
  EXPECT_FALSE(is_mesh_file_name("glb"));
  EXPECT_EQ(mesh_file_endings(), ".glb, .ply or .obj");
  EXPECT_THROW(write_mesh_file(mesh, "/dev/full/x.ply"), Error);
}

}  // namespace
}  // namespace polyhull
