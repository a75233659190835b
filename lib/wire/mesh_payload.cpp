// SPDX-License-Identifier: LGPL-2.1-or-later
#include "wire/mesh_payload.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "rig/rig.h"
#include "wire/flow_payload.h"
#include "wire/mesh_generated.h"
#include "wire/mesh_rules.h"
#include "wire/view_table.h"

namespace polyhull {
namespace {

constexpr std::size_t most_coefficients = 12;  // of a camera's distortion

template <typename T>
std::uint32_t count(const std::vector<T>& list, std::size_t each = 1) {
  if (list.size() * each > 0x3FFFFFFF) refuse_mesh("a list is too long for a payload");
  return static_cast<std::uint32_t>(list.size() * each);
}

flatbuffers::Offset<flatbuffers::Vector<double>> pack_vector(
    flatbuffers::FlatBufferBuilder& builder, const Vec3& v) {
  return builder.CreateVector(&v.x, 3);
}

flatbuffers::Offset<wire::Camera> pack_camera(flatbuffers::FlatBufferBuilder& builder,
                                              const Camera& camera) {
  const auto k = to_rows(camera.K);
  const auto r = to_rows(camera.R);
  const auto k_offset = builder.CreateVector(k.data(), k.size());
  const auto distortion = builder.CreateVector(camera.distortion);
  const auto r_offset = builder.CreateVector(r.data(), r.size());
  flatbuffers::Offset<flatbuffers::Vector<double>> colour;
  if (camera.colour != Mat3(1.0)) {
    const auto rows = to_rows(camera.colour);
    colour = builder.CreateVector(rows.data(), rows.size());
  }
  return wire::CreateCamera(builder, k_offset, distortion, r_offset, pack_vector(builder, camera.t),
                            colour);
}

// Enough room from the start: a builder that grows copies everything.
std::size_t expected_size(const Mesh& mesh) {
  const Hull& hull = mesh.hull;
  std::size_t size = 4096 + sizeof(Vec3f) * (hull.vertices.size() + hull.normals.size()) +
                     sizeof(HullFace) * hull.faces.size() +
                     sizeof(std::uint32_t) * (hull.triangles.size() + hull.loop_vertices.size() +
                                              hull.loop_ends.size() + hull.face_loop_ends.size());
  for (const MeshView& view : mesh.views)
    size += 1024 + sizeof(Vec2f) * view.view.contours.points.size() +
            sizeof(std::uint32_t) * view.view.contours.ends.size();
  if (!mesh.texturing) return size;
  for (const OcclusionMap& map : mesh.texturing->maps)
    size += 256 + sizeof(std::uint16_t) * map.depth.size() + map.fade.size();
  size += packed_flows_size(mesh.texturing->flows);
  return size + (sizeof(std::uint64_t) + 1) * mesh.texturing->visible.size() +
         sizeof(float) * mesh.texturing->weights.size() +
         sizeof(Vec3f) * mesh.texturing->normals.size() +
         sizeof(std::uint32_t) * mesh.texturing->fill.size() +
         sizeof(Vec3f) * mesh.texturing->gains.size();
}

/// Writes a mesh's FlatBuffer, or only lays it out: the long lists get their room, but not their
/// contents, so that its size is known at once.
class MeshPacker {
 public:
  MeshPacker(const Mesh& mesh, bool layout_only)
      : builder_(expected_size(mesh)), layout_only_(layout_only) {
    pack(mesh);
  }
  Bytes bytes() const { return {builder_.GetBufferPointer(), builder_.GetSize()}; }

 private:
  template <typename Element>
  flatbuffers::Offset<flatbuffers::Vector<Element>> list(const Element* data, std::uint32_t size) {
    if (!layout_only_) return builder_.CreateVector(data, size);
    Element* room = nullptr;
    return builder_.CreateUninitializedVector(size, &room);
  }
  template <typename Element>
  auto list(const std::vector<Element>& elements) {
    return list(elements.data(), count(elements));
  }
  auto list(const std::vector<Vec3f>& vectors) {
    return list(reinterpret_cast<const float*>(vectors.data()), count(vectors, 3));
  }

  flatbuffers::Offset<wire::Hull> pack_hull(const Hull& hull) {
    static_assert(sizeof(HullFace) == sizeof(wire::Face));
    const auto origin = pack_vector(builder_, hull.origin);
    const auto vertices = list(hull.vertices);
    const auto triangles = list(hull.triangles);
    const auto faces = builder_.CreateVectorOfStructs(
        reinterpret_cast<const wire::Face*>(hull.faces.data()), count(hull.faces));
    const auto loop_vertices = list(hull.loop_vertices);
    const auto loop_ends = list(hull.loop_ends);
    const auto face_loop_ends = list(hull.face_loop_ends);
    const auto normals = list(hull.normals);
    return wire::CreateHull(builder_, origin, vertices, triangles, faces, loop_vertices, loop_ends,
                            face_loop_ends, normals);
  }

  flatbuffers::Offset<wire::Texturing> pack_texturing(const Texturing& texturing) {
    std::vector<flatbuffers::Offset<wire::OcclusionMap>> maps;
    for (const OcclusionMap& map : texturing.maps) {
      const auto depth = list(map.depth);
      const auto fade = list(map.fade);
      maps.push_back(wire::CreateOcclusionMap(builder_, map.x, map.y, map.step, map.width,
                                              map.height, map.near, map.far, depth, fade));
    }
    const auto map_list = builder_.CreateVector(maps);
    const auto untextured = builder_.CreateVector(&texturing.untextured.x, 3);
    const auto visible = list(texturing.visible);
    const auto best = list(texturing.best);
    const auto weights = list(texturing.weights);
    const auto normals = list(texturing.normals);
    const auto fill = list(texturing.fill);
    const auto gains = list(texturing.gains);
    const auto flows = pack_flows(builder_, texturing.flows);
    return wire::CreateTexturing(builder_, static_cast<wire::TextureMethod>(texturing.method),
                                 static_cast<wire::TextureMetric>(texturing.metric),
                                 texturing.cameras, untextured, visible, best, weights, normals,
                                 map_list, fill, gains, flows);
  }

  void pack(const Mesh& mesh) {
    std::vector<flatbuffers::Offset<wire::MeshView>> views;
    for (const MeshView& view : mesh.views) {
      const auto calibration = pack_camera(builder_, view.calibration);
      const auto packed = pack_view(builder_, view.view);
      views.push_back(wire::CreateMeshView(builder_, calibration, packed));
    }
    const auto view_list = builder_.CreateVector(views);
    const auto hull = pack_hull(mesh.hull);
    const auto up = pack_vector(builder_, mesh.up);
    flatbuffers::Offset<wire::Texturing> texturing;
    if (mesh.texturing) texturing = pack_texturing(*mesh.texturing);
    builder_.Finish(wire::CreateMesh(builder_, mesh.trigger, mesh.capture_time, up,
                                     mesh.metres_per_unit, hull, view_list, texturing,
                                     mesh.opacity));
  }

  flatbuffers::FlatBufferBuilder builder_;
  bool layout_only_;
};

template <std::size_t N, typename Element>
std::array<Element, N> unpack_array(const flatbuffers::Vector<Element>* numbers, const char* what) {
  if (!numbers || numbers->size() != N)
    refuse_mesh(fmt::format("{} must have {} numbers", what, N));
  std::array<Element, N> result;
  std::memcpy(result.data(), numbers->Data(), sizeof result);
  return result;
}

Vec3 unpack_vector(const flatbuffers::Vector<double>* numbers, const char* what) {
  const auto v = unpack_array<3>(numbers, what);
  return {v[0], v[1], v[2]};
}

Camera unpack_camera(const wire::Camera& table, const View& view) {
  Camera camera;
  camera.name = view.camera;
  camera.width = view.width;
  camera.height = view.height;
  camera.K = from_rows(unpack_array<9>(table.k(), "K"));
  // Looked at before it is copied: in a hostile FlatBuffer all cameras can share one long list.
  if (table.distortion() && table.distortion()->size() > most_coefficients)
    refuse_mesh(fmt::format("camera '{}' has {} distortion coefficients", view.camera,
                            table.distortion()->size()));
  camera.distortion = unpack_numbers<double>(table.distortion());
  camera.R = from_rows(unpack_array<9>(table.r(), "R"));
  camera.t = unpack_vector(table.t(), "t");
  if (table.colour())
    camera.colour = from_rows(unpack_array<9>(table.colour(), "the colour matrix"));
  return camera;
}

std::size_t packed_size(const wire::View& view) {
  return sizeof(wire::View) + view.camera()->size() +
         (view.points() ? sizeof(float) * view.points()->size() : 0) +
         (view.ends() ? sizeof(std::uint32_t) * view.ends()->size() : 0);
}

Hull unpack_hull(const wire::Hull& table) {
  Hull hull;
  hull.origin = unpack_vector(table.origin(), "the origin");
  hull.vertices = unpack_numbers<Vec3f>(table.vertices());
  hull.triangles = unpack_numbers<std::uint32_t>(table.triangles());
  if (table.faces() && table.faces()->size() > 0) {
    hull.faces.resize(table.faces()->size());
    std::memcpy(static_cast<void*>(hull.faces.data()), table.faces()->Data(),
                hull.faces.size() * sizeof(HullFace));
  }
  hull.loop_vertices = unpack_numbers<std::uint32_t>(table.loop_vertices());
  hull.loop_ends = unpack_numbers<std::uint32_t>(table.loop_ends());
  hull.face_loop_ends = unpack_numbers<std::uint32_t>(table.face_loop_ends());
  hull.normals = unpack_numbers<Vec3f>(table.normals());
  return hull;
}

OcclusionMap unpack_map(const wire::OcclusionMap& table) {
  OcclusionMap map;
  map.x = table.x();
  map.y = table.y();
  map.step = table.step();
  // Beyond 31 bits they turn negative, which validate_mesh() refuses.
  map.width = static_cast<int>(table.width());
  map.height = static_cast<int>(table.height());
  map.near = table.near();
  map.far = table.far();
  map.depth = unpack_numbers<std::uint16_t>(table.depth());
  map.fade = unpack_numbers<std::uint8_t>(table.fade());
  return map;
}

std::size_t packed_size(const wire::OcclusionMap& map) {
  return sizeof(wire::OcclusionMap) + (map.depth() ? 2 * map.depth()->size() : 0) +
         (map.fade() ? map.fade()->size() : 0);
}

Texturing unpack_texturing(const wire::Texturing& table, std::size_t buffer_size) {
  Texturing texturing;
  texturing.method = static_cast<TextureMethod>(table.method());
  texturing.metric = static_cast<TextureMetric>(table.metric());
  texturing.cameras = table.cameras();
  const auto grey = unpack_array<3>(table.untextured(), "the colour of what no camera sees");
  texturing.untextured = Vec3f(grey[0], grey[1], grey[2]);
  texturing.visible = unpack_numbers<std::uint64_t>(table.visible());
  texturing.best = unpack_numbers<std::int8_t>(table.best());
  texturing.weights = unpack_numbers<float>(table.weights());
  texturing.normals = unpack_numbers<Vec3f>(table.normals());
  texturing.fill = unpack_numbers<std::uint32_t>(table.fill());
  texturing.gains = unpack_numbers<Vec3f>(table.gains());
  if (table.maps()) {
    std::size_t unpacked = 0;
    for (const wire::OcclusionMap* map : *table.maps()) {
      unpacked += packed_size(*map);
      if (unpacked > buffer_size) refuse_mesh("its depth maps share their contents");
      texturing.maps.push_back(unpack_map(*map));
    }
  }
  texturing.flows = unpack_flows(table.flows(), buffer_size);
  return texturing;
}

}  // namespace

std::vector<std::uint8_t> write_mesh_header(const Mesh& mesh) {
  validate_mesh(mesh);
  std::uint64_t pixels_size = 0;
  for (const MeshView& view : mesh.views) pixels_size += view.view.pixels.size();
  return write_payload_header(PayloadKind::mesh, MeshPacker(mesh, false).bytes(), pixels_size);
}

std::size_t mesh_header_size(const Mesh& mesh) {
  return payload_header_size(MeshPacker(mesh, true).bytes().size());
}

std::vector<std::uint8_t> write_mesh(const Mesh& mesh) {
  std::vector<std::uint8_t> bytes = write_mesh_header(mesh);
  for (const MeshView& view : mesh.views)
    bytes.insert(bytes.end(), view.view.pixels.begin(), view.view.pixels.end());
  return bytes;
}

Mesh read_mesh(std::span<const Bytes> segments) {
  Payload payload(PayloadKind::mesh, segments);
  const Bytes buffer = payload.flatbuffer();
  flatbuffers::Verifier verifier(buffer.data(), buffer.size());
  if (!wire::VerifyMeshBuffer(verifier)) refuse_mesh("its FlatBuffer is damaged");
  const wire::Mesh& table = *wire::GetMesh(buffer.data());
  Mesh mesh;
  mesh.trigger = table.trigger();
  mesh.capture_time = table.capture_time();
  mesh.up = unpack_vector(table.up(), "up");
  mesh.metres_per_unit = table.metres_per_unit();
  mesh.opacity = table.opacity();
  mesh.hull = unpack_hull(*table.hull());
  if (table.views()) {
    std::size_t unpacked = 0;
    for (const wire::MeshView* entry : *table.views()) {
      // In a hostile FlatBuffer a few bytes can point to the same long list again and again.
      unpacked += packed_size(*entry->view());
      if (unpacked > buffer.size()) refuse_mesh("its views share their contents");
      MeshView view;
      view.view = unpack_view(*entry->view(), payload);
      view.calibration = unpack_camera(*entry->calibration(), view.view);
      mesh.views.push_back(std::move(view));
    }
  }
  payload.finish();
  if (table.texturing()) mesh.texturing = unpack_texturing(*table.texturing(), buffer.size());
  validate_mesh(mesh);
  return mesh;
}

Mesh read_mesh(Bytes bytes) {
  return read_mesh({&bytes, 1});
}

}  // namespace polyhull
