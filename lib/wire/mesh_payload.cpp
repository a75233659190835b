// SPDX-License-Identifier: LGPL-2.1-or-later
#include "wire/mesh_payload.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "rig/rig.h"
#include "wire/flow_payload.h"
#include "wire/mesh_generated.h"
#include "wire/view_table.h"

namespace polyhull {
namespace {

constexpr std::size_t most_textured_views = 64;
constexpr float most_gain = 16.0f;
constexpr std::size_t most_coefficients = 12;  // of a camera's distortion

[[noreturn]] void fail(const std::string& what) {
  throw Error(Error::Kind::bad_input, "Not a usable mesh: {}.", what);
}

bool finite(std::span<const float> numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](float x) { return std::isfinite(x); });
}

bool finite(std::span<const Vec3f> vectors) {
  return vectors.empty() || finite({&vectors.front().x, 3 * vectors.size()});
}

bool finite(const Vec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

// Whether `ends` never falls and its last is `total`.
bool partitions(std::span<const std::uint32_t> ends, std::size_t total) {
  return std::is_sorted(ends.begin(), ends.end()) && (ends.empty() ? 0 : ends.back()) == total;
}

bool below(std::span<const std::uint32_t> indices, std::size_t limit) {
  return std::all_of(indices.begin(), indices.end(),
                     [limit](std::uint32_t index) { return index < limit; });
}

void validate_hull(const Mesh& mesh) {
  const Hull& hull = mesh.hull;
  if (!finite(hull.origin) || !finite(hull.vertices)) fail("a vertex or the origin is not finite");
  if (hull.triangles.size() % 3 != 0) fail("the triangles' indices are no multiple of three");
  if (!below(hull.triangles, hull.vertices.size())) fail("a triangle's index is out of range");
  if (!below(hull.loop_vertices, hull.vertices.size())) fail("a loop's index is out of range");
  if (!partitions(hull.loop_ends, hull.loop_vertices.size()) ||
      !partitions(hull.face_loop_ends, hull.loop_ends.size()))
    fail("the loops' ends contradict each other");
  if (!hull.face_loop_ends.empty() && hull.face_loop_ends.size() != hull.faces.size())
    fail("there must be loops for every face or for none");
  if (!hull.normals.empty() && hull.normals.size() != hull.vertices.size())
    fail("there must be normals for every vertex or for none");
  for (const Vec3f& normal : hull.normals) {
    const float square = glm::dot(normal, normal);
    if (!(square > 0.98f && square < 1.02f)) fail("a normal is not of unit length");
  }
  const std::size_t triangles = hull.triangles.size() / 3;
  for (const HullFace& face : hull.faces) {
    if (face.view < -1 || face.view >= static_cast<std::int64_t>(mesh.views.size()))
      fail("a face belongs to a view that is not there");
    // A camera's frame carves, too, where the hull is told to keep what it does not see: four edges.
    const std::size_t edges =
        face.view < 0 ? 6 : mesh.views[face.view].view.contours.points.size() + 4;
    const bool planeless = face.view < 0 && face.edge == HullFace::no_edge;
    if (face.edge >= edges && !planeless)
      fail("a face belongs to a contour edge that is not there");
    if (face.first_triangle > triangles || face.triangle_count > triangles - face.first_triangle)
      fail("a face's triangles are out of range");
  }
}

void validate_map(const OcclusionMap& map) {
  constexpr int largest_side = 32768;
  if (map.width < 0 || map.height < 0 || map.width > largest_side || map.height > largest_side)
    fail("a depth map's size is out of range");
  const std::size_t texels = static_cast<std::size_t>(map.width) * map.height;
  if (map.depth.size() != texels || map.fade.size() != texels)
    fail("a depth map's size contradicts its contents");
  if (!std::isfinite(map.x) || !std::isfinite(map.y) || !std::isfinite(map.step) ||
      !(map.step > 0.0f) || !std::isfinite(map.near) || !std::isfinite(map.far))
    fail("a depth map's place is not finite");
}

void validate_texturing(const Mesh& mesh) {
  const Texturing& texturing = *mesh.texturing;
  const std::size_t triangles = mesh.hull.triangles.size() / 3;
  const std::size_t vertices = mesh.hull.vertices.size();
  const std::size_t views = mesh.views.size();
  if (views > most_textured_views) fail("a textured mesh may have at most 64 views");
  if (texturing.method != TextureMethod::direct && texturing.method != TextureMethod::blend)
    fail("unknown texture method");
  if (texturing.metric != TextureMetric::camera_normal &&
      texturing.metric != TextureMetric::viewing_angle &&
      texturing.metric != TextureMetric::lumigraph)
    fail("unknown texture metric");
  if (texturing.visible.size() != triangles || texturing.best.size() != triangles ||
      texturing.weights.size() != vertices * views || texturing.normals.size() != vertices)
    fail("the texturing does not fit the numbers of triangles, vertices and views");
  if (!finite(texturing.weights) || !finite(texturing.normals) ||
      !finite({&texturing.untextured.x, 3}))
    fail("the texturing has a number that is not finite");
  if (!texturing.fill.empty() && texturing.fill.size() != vertices)
    fail("there must be a fill colour for every vertex or for none");
  if (!texturing.gains.empty() && texturing.gains.size() != views)
    fail("there must be a gain for every view or for none");
  for (const Vec3f& gain : texturing.gains)
    for (int c = 0; c < 3; ++c)
      if (!(gain[c] > 0.0f && gain[c] <= most_gain)) fail("a view's gain is not above 0 and at most 16");
  if (!texturing.maps.empty() && texturing.maps.size() != views)
    fail("there must be a depth map for every view or for none");
  for (const OcclusionMap& map : texturing.maps) validate_map(map);
  if (const std::string fault = flows_fault(texturing); !fault.empty()) fail(fault);
  for (const std::uint64_t mask : texturing.visible)
    if (views < most_textured_views && (mask >> views) != 0)
      fail("a triangle is seen by a view that is not there");
  for (const std::int8_t best : texturing.best)
    if (best < -1 || best >= static_cast<int>(views))
      fail("a triangle is coloured by a view that is not there");
}

template <typename T>
std::uint32_t count(const std::vector<T>& list, std::size_t each = 1) {
  if (list.size() * each > 0x3FFFFFFF) fail("a list is too long for a payload");
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
  return wire::CreateCamera(builder, k_offset, distortion, r_offset,
                            pack_vector(builder, camera.t));
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
                                     mesh.metres_per_unit, hull, view_list, texturing));
  }

  flatbuffers::FlatBufferBuilder builder_;
  bool layout_only_;
};

template <std::size_t N, typename Element>
std::array<Element, N> unpack_array(const flatbuffers::Vector<Element>* numbers, const char* what) {
  if (!numbers || numbers->size() != N) fail(fmt::format("{} must have {} numbers", what, N));
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
    fail(fmt::format("camera '{}' has {} distortion coefficients", view.camera,
                     table.distortion()->size()));
  camera.distortion = unpack_numbers<double>(table.distortion());
  camera.R = from_rows(unpack_array<9>(table.r(), "R"));
  camera.t = unpack_vector(table.t(), "t");
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
  // Beyond 31 bits they turn negative, which validate_map() refuses.
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
      if (unpacked > buffer_size) fail("its depth maps share their contents");
      texturing.maps.push_back(unpack_map(*map));
    }
  }
  texturing.flows = unpack_flows(table.flows(), buffer_size);
  return texturing;
}

// Whoever shows, counts or writes by a camera's name would take one for the other.
void check_names(const std::vector<MeshView>& views) {
  std::vector<std::string_view> names;
  for (const MeshView& view : views) names.push_back(view.view.camera);
  std::sort(names.begin(), names.end());
  const auto twice = std::adjacent_find(names.begin(), names.end());
  if (twice != names.end())
    fail(fmt::format("two of its views are of camera '{}'; each camera may have one view", *twice));
}

}  // namespace

void validate_mesh(const Mesh& mesh) {
  if (!finite(mesh.up) || !(glm::length(mesh.up) > 0.0)) fail("up is no direction");
  if (!std::isfinite(mesh.metres_per_unit) || !(mesh.metres_per_unit > 0.0))
    fail("the length of its unit is not positive");
  for (const MeshView& view : mesh.views) {
    if (view.calibration.name != view.view.camera || view.calibration.width != view.view.width ||
        view.calibration.height != view.view.height)
      fail(fmt::format("view '{}' has another camera's name or size", view.view.camera));
    validate_view(view.view);
    validate_camera(view.calibration, fmt::format("mesh: camera '{}'", view.calibration.name));
  }
  check_names(mesh.views);
  validate_hull(mesh);
  if (mesh.texturing) validate_texturing(mesh);
}

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
  if (!wire::VerifyMeshBuffer(verifier)) fail("its FlatBuffer is damaged");
  const wire::Mesh& table = *wire::GetMesh(buffer.data());
  Mesh mesh;
  mesh.trigger = table.trigger();
  mesh.capture_time = table.capture_time();
  mesh.up = unpack_vector(table.up(), "up");
  mesh.metres_per_unit = table.metres_per_unit();
  mesh.hull = unpack_hull(*table.hull());
  if (table.views()) {
    std::size_t unpacked = 0;
    for (const wire::MeshView* entry : *table.views()) {
      // In a hostile FlatBuffer a few bytes can point to the same long list again and again.
      unpacked += packed_size(*entry->view());
      if (unpacked > buffer.size()) fail("its views share their contents");
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
