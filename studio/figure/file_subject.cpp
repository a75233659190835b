// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/figure/file_subject.h"

#include <tiny_obj_loader.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "base/error.h"
#include "base/picture.h"
#include "base/srgb.h"
#include "studio/figure/polygons/polygonise.h"

namespace polyhull {
namespace {

constexpr double turn_period = 10.0;  // seconds

/// The picture \p name of an OBJ file in \p folder: exporters write paths of their own machine, with
/// the separators of Windows too; the picture then lies beside the file. Where there is none: as named.
std::string picture_file(const std::string& folder, const std::string& name) {
  std::string slashes = name;
  std::replace(slashes.begin(), slashes.end(), '\\', '/');
  const std::string alone = slashes.substr(slashes.rfind('/') + 1);
  for (const std::string& known : {name, slashes, alone}) {
    const auto path = std::filesystem::path(folder) / known;
    std::error_code error;
    if (std::filesystem::is_regular_file(path, error)) return path.string();
  }
  return folder + name;
}

class FileSubject : public Subject {
 public:
  FileSubject(const std::string& path, double height) {
    if (!std::ifstream(path)) {
      throw Error(
          Error::Kind::not_found,
          "Subject '{}' cannot be opened for reading. Give 'figure' or the path of an OBJ file.",
          path);
    }
    tinyobj::ObjReaderConfig config;
    config.triangulate = true;
    config.vertex_color = true;
    tinyobj::ObjReader reader;
    if (!reader.ParseFromFile(path, config)) {
      throw Error(Error::Kind::bad_input, "Subject '{}' is not a readable OBJ file. {}", path,
                  reader.Error());
    }
    take_geometry(path, reader);
    take_materials(path, reader);
    place(path, height);
    make_normals();
    report(path);
  }

  void pose(double seconds, SubjectFrame& frame) const override {
    const double angle = 2.0 * std::numbers::pi * std::fmod(seconds, turn_period) / turn_period;
    const auto c = static_cast<float>(std::cos(angle)), s = static_cast<float>(std::sin(angle));
    const auto turn = [&](const Vec3f& p) {
      return Vec3f(c * p.x + s * p.z, p.y, c * p.z - s * p.x);
    };
    frame.positions.resize(vertex_count_);
    frame.normals.resize(vertex_count_);
    for (std::size_t i = 0; i < vertex_count_; ++i) {
      frame.positions[i] = turn(positions_[i]);
      frame.normals[i] = turn(normals_[i]);
    }
  }

  Vec3f albedo(std::uint32_t triangle, const Vec3f& at, float width) const override {
    const std::uint32_t* v = &triangles_[3 * static_cast<std::size_t>(triangle)];
    const int material = materials_[triangle];
    if (material >= 0) {
      const Picture& picture = pictures_[material];
      if (!picture.empty() && !texture_coordinates_.empty()) {
        const Vec2f* corner = &texture_coordinates_[3 * static_cast<std::size_t>(triangle)];
        const Vec2f uv = corner[0] * at.x + corner[1] * at.y + corner[2] * at.z;
        if (std::isfinite(uv.x + uv.y)) return look_up(picture, uv);
      }
      return diffuse_[material];
    }
    if (!colours_.empty())
      return colours_[v[0]] * at.x + colours_[v[1]] * at.y + colours_[v[2]] * at.z;
    return pattern(positions_[v[0]] * at.x + positions_[v[1]] * at.y + positions_[v[2]] * at.z,
                   width);
  }

 private:
  void take_geometry(const std::string& path, const tinyobj::ObjReader& reader) {
    const tinyobj::attrib_t& attributes = reader.GetAttrib();
    for (std::size_t i = 0; i + 2 < attributes.vertices.size(); i += 3) {
      const Vec3f p(attributes.vertices[i], attributes.vertices[i + 1], attributes.vertices[i + 2]);
      if (!std::isfinite(p.x + p.y + p.z)) {
        throw Error(Error::Kind::bad_input, "Subject '{}': vertex {} is not three finite numbers.",
                    path, i / 3 + 1);
      }
      positions_.push_back(p);
    }
    vertex_count_ = positions_.size();
    // tinyobj fills in white where a file has no colours.
    const auto& colours = attributes.colors;
    if (std::any_of(colours.begin(), colours.end(), [](float c) { return c != 1.0f; })) {
      for (std::size_t i = 0; i + 2 < colours.size(); i += 3)
        colours_.push_back(srgb_decoded(Vec3f(colours[i], colours[i + 1], colours[i + 2])));
      colours_.resize(vertex_count_, Vec3f(0.5f));
    }
    for (const tinyobj::shape_t& shape : reader.GetShapes()) {
      const auto& indices = shape.mesh.indices;
      for (std::size_t t = 0; t + 2 < indices.size(); t += 3) {
        for (int k = 0; k < 3; ++k) {
          const tinyobj::index_t& index = indices[t + k];
          if (index.vertex_index < 0 ||
              static_cast<std::size_t>(index.vertex_index) >= vertex_count_) {
            throw Error(Error::Kind::bad_input,
                        "Subject '{}': a face uses vertex {}, but the file has {} vertices.", path,
                        index.vertex_index + 1, vertex_count_);
          }
          triangles_.push_back(static_cast<std::uint32_t>(index.vertex_index));
          Vec2f uv(NAN);  // a face without its own has its material's plain colour
          const auto at = 2 * static_cast<std::size_t>(std::max(index.texcoord_index, 0));
          if (index.texcoord_index >= 0 && at + 1 < attributes.texcoords.size())
            uv = {attributes.texcoords[at], attributes.texcoords[at + 1]};
          texture_coordinates_.push_back(uv);
        }
        const std::size_t face = t / 3;
        materials_.push_back(face < shape.mesh.material_ids.size() ? shape.mesh.material_ids[face]
                                                                   : -1);
      }
    }
    if (attributes.texcoords.empty()) texture_coordinates_.clear();
    if (triangles_.empty()) {
      throw Error(Error::Kind::bad_input,
                  "Subject '{}' has no faces. An OBJ file with a closed surface is expected.",
                  path);
    }
  }

  void take_materials(const std::string& path, const tinyobj::ObjReader& reader) {
    const std::string folder =
        path.find('/') == std::string::npos ? "" : path.substr(0, path.rfind('/') + 1);
    for (const tinyobj::material_t& material : reader.GetMaterials()) {
      diffuse_.emplace_back(material.diffuse[0], material.diffuse[1], material.diffuse[2]);
      pictures_.emplace_back();
      if (!material.diffuse_texname.empty()) {
        try {
          pictures_.back() = load_picture(picture_file(folder, material.diffuse_texname), 3);
        } catch (const Error& error) {
          add_warning(fmt::format("Subject '{}': {}", path, error.what()));
        }
      }
    }
    for (int& material : materials_)
      if (material >= static_cast<int>(diffuse_.size())) material = -1;
    // Other warnings may hold materials' names.
    if (reader.Warning().find("] not found in ") == std::string::npos) return;
    std::string lines = reader.Warning();
    std::replace(lines.begin(), lines.end(), '\n', ' ');
    add_warning(fmt::format(
        "Subject '{}': colours of materials are missing, so that those of vertices or a "
        "pattern stand for them ({}). Put the .mtl file that its line mtllib names beside it.",
        path, lines.substr(0, lines.find_last_not_of(' ') + 1)));
  }

  void place(const std::string& path, double height) {
    Vec3f min = positions_[triangles_[0]], max = min;
    for (const std::uint32_t v : triangles_) {
      min = glm::min(min, positions_[v]);
      max = glm::max(max, positions_[v]);
    }
    if (height > 0.0 && !(max.y > min.y)) {
      throw Error(Error::Kind::bad_input,
                  "Subject '{}' is flat in y and cannot be scaled to a height; turn it to y up, or "
                  "give no height.",
                  path);
    }
    const float scale = height > 0.0 ? static_cast<float>(height) / (max.y - min.y) : 1.0f;
    const Vec3f base(0.5f * (min.x + max.x), min.y, 0.5f * (min.z + max.z));
    for (Vec3f& p : positions_) p = (p - base) * scale;
    size_ = std::max((max.y - min.y) * scale, 1e-6f);
  }

  void make_normals() {
    normals_.assign(vertex_count_, Vec3f(0.0f));
    for (std::size_t t = 0; t < triangles_.size(); t += 3) {
      const Vec3f &a = positions_[triangles_[t]], &b = positions_[triangles_[t + 1]],
                  &c = positions_[triangles_[t + 2]];
      const Vec3f n = glm::cross(b - a, c - a);
      for (int k = 0; k < 3; ++k) normals_[triangles_[t + k]] += n;
    }
    for (Vec3f& n : normals_) {
      const float length = glm::length(n);
      n = length > 0.0f ? n / length : Vec3f(0, 1, 0);
    }
  }

  void report(const std::string& path) {
    const ManifoldDefects defects = manifold_defects(triangles_, vertex_count_);
    closed_ = defects.none();
    if (closed_) return;
    add_warning(fmt::format(
        "Subject '{}' is not a closed surface: {} open edges, {} edges with more than two faces, "
        "{} "
        "pinched vertices, {} faces with a vertex twice. It is shown, but its matte may have "
        "holes.",
        path, defects.open_edges, defects.crowded_edges, defects.pinched_vertices,
        defects.empty_triangles));
  }

  void add_warning(const std::string& text) { warning_ += (warning_.empty() ? "" : " ") + text; }

  static Vec3f look_up(const Picture& picture, const Vec2f& uv) {
    const auto texel = [&](int x, int y) {
      x = (x % picture.width + picture.width) % picture.width;
      y = (y % picture.height + picture.height) % picture.height;
      const std::uint8_t* p = picture.row(y) + 3 * static_cast<std::size_t>(x);
      return srgb_decoded(Vec3f(p[0], p[1], p[2]) / 255.0f);
    };
    const float x = (uv.x - std::floor(uv.x)) * static_cast<float>(picture.width) - 0.5f;
    const float y = (1.0f - (uv.y - std::floor(uv.y))) * static_cast<float>(picture.height) - 0.5f;
    const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
    const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
    return glm::mix(glm::mix(texel(x0, y0), texel(x0 + 1, y0), fx),
                    glm::mix(texel(x0, y0 + 1), texel(x0 + 1, y0 + 1), fx), fy);
  }

  /// Rings along the height in warm colours with dark meridians, sharp so that shifts show.
  Vec3f pattern(const Vec3f& p, float width) const {
    static constexpr Vec3f light(0.72f, 0.42f, 0.20f), red(0.50f, 0.06f, 0.05f),
        dark(0.10f, 0.05f, 0.04f);
    const float w = std::max(width, 1e-4f);
    const auto edge = [&](float x) { return std::clamp(0.5f - x / w, 0.0f, 1.0f); };
    const float ring = size_ / 16.0f;
    const float phase = p.y / ring - std::floor(p.y / ring);
    const float on = edge(std::abs(phase - 0.5f) * ring - 0.25f * ring);
    Vec3f colour = glm::mix(light, red, on);
    const float radius = std::sqrt(p.x * p.x + p.z * p.z);
    constexpr float sector = static_cast<float>(std::numbers::pi) / 6.0f;
    const float angle = std::atan2(p.x, p.z) / sector;
    const float meridian = (std::abs(angle - std::round(angle)) - 0.06f) * sector * radius;
    return glm::mix(colour, dark, edge(meridian));
  }

  std::vector<Vec3f> positions_, normals_, colours_, diffuse_;
  std::vector<Vec2f> texture_coordinates_;  // three per triangle
  std::vector<int> materials_;              // per triangle, -1: none
  std::vector<Picture> pictures_;           // per material
  float size_ = 1.0f;
};

}  // namespace

std::shared_ptr<const Subject> load_subject(const std::string& path, double height) {
  return std::make_shared<const FileSubject>(path, height);
}

}  // namespace polyhull
