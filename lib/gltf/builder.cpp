// SPDX-License-Identifier: LGPL-2.1-or-later
#include "gltf/builder.h"

#include <algorithm>
#include <cmath>

namespace polyhull {

GltfBuilder::GltfBuilder() {
  model.asset.version = "2.0";
  model.asset.generator = "polyhull";
  model.buffers.emplace_back();
  model.scenes.emplace_back();
  model.defaultScene = 0;
}

int GltfBuilder::add_view(const void* data, std::size_t size, int target) {
  std::vector<unsigned char>& bytes = model.buffers[0].data;
  bytes.resize((bytes.size() + 3) / 4 * 4);
  tinygltf::BufferView view;
  view.buffer = 0;
  view.byteOffset = bytes.size();
  view.byteLength = size;
  view.target = target;
  const auto* begin = static_cast<const unsigned char*>(data);
  bytes.insert(bytes.end(), begin, begin + size);
  return add(model.bufferViews, std::move(view));
}

int GltfBuilder::add_positions(const std::vector<Vec3f>& positions) {
  Vec3f low(INFINITY), high(-INFINITY);
  for (const Vec3f& p : positions) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  const int accessor = add_accessor(positions);
  model.accessors[accessor].minValues = {low.x, low.y, low.z};
  model.accessors[accessor].maxValues = {high.x, high.y, high.z};
  return accessor;
}

int GltfBuilder::add_texture(const std::vector<std::uint8_t>& encoded,
                             const std::string& mime_type) {
  tinygltf::Image image;
  image.bufferView = add_view(encoded.data(), encoded.size());
  image.mimeType = mime_type;
  tinygltf::Texture texture;
  texture.source = add(model.images, std::move(image));
  return add(model.textures, std::move(texture));
}

void GltfBuilder::use(const char* extension) {
  auto& used = model.extensionsUsed;
  if (std::find(used.begin(), used.end(), extension) == used.end()) used.emplace_back(extension);
}

}  // namespace polyhull
