// SPDX-License-Identifier: LGPL-2.1-or-later
#include "take/payload_regions.h"

#include <algorithm>

#include "base/error.h"
#include "wire/mesh_generated.h"
#include "wire/payload.h"
#include "wire/view_table.h"

namespace polyhull {
namespace {

constexpr std::size_t worth_it = 32;  // bytes; shorter lists stay as they are

class Finder {
 public:
  Finder(PayloadKind kind, Bytes packet)
      : packet_(packet), payload_(kind, std::span<const Bytes>(&packet_, 1)) {
    buffer_ = payload_.flatbuffer();
    pixels_ = payload_header_size(buffer_.size());
  }

  void find_view() { add_pixels(verified_view(payload_)); }

  void find_mesh() {
    flatbuffers::Verifier verifier(buffer_.data(), buffer_.size());
    if (!wire::VerifyMeshBuffer(verifier)) return;
    const wire::Mesh& mesh = *wire::GetMesh(buffer_.data());
    found.metres_per_unit = mesh.metres_per_unit();
    add_hull(*mesh.hull());
    if (mesh.texturing()) add_texturing(*mesh.texturing());
    if (!mesh.views()) return;
    for (const wire::MeshView* view : *mesh.views()) {
      add(view->view()->points(), 2);
      add(view->view()->ends(), 1);
      add_pixels(*view->view());
    }
  }

  PayloadRegions finish() {
    auto& regions = found.regions;
    std::sort(regions.begin(), regions.end(),
              [](const Region& a, const Region& b) { return a.offset < b.offset; });
    // In a hostile FlatBuffer two lists can be one; more than there may be are no mesh's.
    std::size_t end = 0;
    std::erase_if(regions, [&](const Region& region) {
      if (region.offset < end) return true;
      end = std::size_t{region.offset} + region.size;
      return false;
    });
    if (regions.size() > most_regions) regions.resize(most_regions);
    for (std::size_t i = 0; i < regions.size(); ++i)
      if (vertices_at_ != 0 && regions[i].offset == vertices_at_ && regions[i].components == 3 &&
          regions[i].element == 4)
        found.vertices = i;
    return std::move(found);
  }

 private:
  template <class Element>
  void add(const flatbuffers::Vector<Element>* list, std::uint32_t components) {
    if (!list || list->size() * sizeof(Element) < worth_it) return;
    Region region;
    region.offset = static_cast<std::uint32_t>(
        payload_prefix_size + static_cast<std::size_t>(list->Data() - buffer_.data()));
    region.size = static_cast<std::uint32_t>(list->size() * sizeof(Element));
    region.element = sizeof(Element);
    region.components = components;
    found.regions.push_back(region);
  }

  void add_hull(const wire::Hull& hull) {
    if (hull.vertices() && hull.vertices()->size() * sizeof(float) >= worth_it)
      vertices_at_ =
          payload_prefix_size + static_cast<std::size_t>(hull.vertices()->Data() - buffer_.data());
    add(hull.vertices(), 3);
    add(hull.triangles(), 1);
    add(hull.loop_vertices(), 1);
    add(hull.loop_ends(), 1);
    add(hull.face_loop_ends(), 1);
    add(hull.normals(), 3);
    const auto* faces = hull.faces();
    if (!faces || faces->size() == 0) return;
    Region region;
    region.offset = static_cast<std::uint32_t>(
        payload_prefix_size +
        static_cast<std::size_t>(reinterpret_cast<const std::uint8_t*>(faces->Data()) -
                                 buffer_.data()));
    region.size = static_cast<std::uint32_t>(faces->size() * sizeof(wire::Face));
    region.element = 4;
    region.components = 4;
    found.regions.push_back(region);
  }

  void add_texturing(const wire::Texturing& texturing) {
    add(texturing.visible(), 1);
    add(texturing.best(), 1);
    const std::uint32_t vertices =
        texturing.normals() ? std::max(1u, texturing.normals()->size() / 3) : 1;
    add(texturing.weights(),
        std::max(1u, texturing.weights() ? texturing.weights()->size() / vertices : 1));
    add(texturing.normals(), 3);
    add(texturing.fill(), 1);
    if (texturing.maps())
      for (const wire::OcclusionMap* map : *texturing.maps()) {
        add(map->depth(), 1);
        add(map->fade(), 1);
      }
    if (texturing.flows())
      for (const wire::PictureFlow* flow : *texturing.flows()) add(flow->offsets(), 2);
  }

  /// The next of the blocks behind the header.
  void add_pixels(const wire::View& view) {
    const std::size_t offset = pixels_, size = payload_.take_block(view.pixels_size()).size();
    pixels_ += size;
    const std::uint32_t element = view.format() == wire::PixelFormat::rgba   ? 4
                                  : view.format() == wire::PixelFormat::grey ? 1
                                                                             : 0;
    if (view.coding() != wire::PixelCoding::raw || element == 0 || view.roi_width() > 32768 ||
        view.roi_height() > 32768 || view.roi_x() > 32768 || view.roi_y() > 32768 ||
        view.stride() != view.roi_width() * element ||
        size != std::size_t{view.stride()} * view.roi_height() || size == 0)
      return;
    Region region;
    region.kind = RegionKind::picture;
    region.offset = static_cast<std::uint32_t>(offset);
    region.size = static_cast<std::uint32_t>(size);
    region.element = element;
    region.x = view.roi_x();
    region.y = view.roi_y();
    region.width = view.roi_width();
    region.height = view.roi_height();
    found.regions.push_back(region);
  }

  PayloadRegions found;
  Bytes packet_;
  Payload payload_;
  Bytes buffer_;
  std::size_t pixels_ = 0;       // where the next block begins
  std::size_t vertices_at_ = 0;  // 0: there are none
};

}  // namespace

PayloadRegions find_regions(std::string_view caps, Bytes packet) {
  const bool view = caps.starts_with("application/x-polyhull-view");
  if (!view && !caps.starts_with("application/x-polyhull-mesh")) return {};
  try {
    Finder finder(view ? PayloadKind::view : PayloadKind::mesh, packet);
    if (view) {
      finder.find_view();
    } else {
      finder.find_mesh();
    }
    return finder.finish();
  } catch (const Error&) {
    return {};  // kept as the bytes that they are
  }
}

}  // namespace polyhull
