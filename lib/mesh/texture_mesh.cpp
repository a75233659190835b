// SPDX-License-Identifier: LGPL-2.1-or-later
#include "mesh/texture_mesh.h"

#include "base/stopwatch.h"

namespace polyhull {

void MeshTexturer::texture(Mesh& mesh, const TextureSettings& settings) {
  std::vector<Camera> cameras;
  std::vector<FillPicture> pictures;
  for (const MeshView& view : mesh.views) {
    cameras.push_back(view.calibration);
    FillPicture& picture = pictures.emplace_back();
    if (view.view.format == PixelFormat::rgba)
      picture = {view.view.roi, view.view.stride, view.view.pixels};
  }
  mesh.texturing = texturer_.texture(mesh.hull, cameras, settings);
  Stopwatch watch;
  mesh.texturing->fill = fill_.find(mesh.hull, cameras, pictures, *mesh.texturing, settings);
  seconds_fill_ = watch.lap();
}

void texture_mesh(Mesh& mesh, const TextureSettings& settings) {
  MeshTexturer().texture(mesh, settings);
}

}  // namespace polyhull
