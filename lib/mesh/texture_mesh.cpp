// SPDX-License-Identifier: LGPL-2.1-or-later
#include "mesh/texture_mesh.h"

#include <optional>
#include <string_view>

#include "base/stopwatch.h"

namespace polyhull {

void MeshTexturer::texture(Mesh& mesh, const TextureSettings& settings) {
  std::vector<Camera> cameras;
  std::vector<FillPicture> pictures;
  for (const MeshView& view : mesh.views) {
    cameras.push_back(view.calibration);
    FillPicture& picture = pictures.emplace_back();
    if (view.view.format == PixelFormat::rgba)
      picture = {view.view.roi, view.view.stride, view.view.pixels, Mat3f(view.calibration.colour)};
  }
  mesh.texturing = texturer_.texture(mesh.hull, cameras, settings);
  Stopwatch watch;
  const std::optional<double> time =
      mesh.capture_time == no_time ? std::nullopt
                                   : std::optional(1e-9 * static_cast<double>(mesh.capture_time));
  if (settings.balance) {
    std::vector<std::string_view> names;
    for (const MeshView& view : mesh.views) names.push_back(view.view.camera);
    mesh.texturing->gains =
        balance_.update(mesh.hull, {cameras, pictures, *mesh.texturing, settings.threads}, names,
                        time, settings.balance_time);
    for (std::size_t k = 0; k < pictures.size(); ++k)
      pictures[k].colour = colour_of(*mesh.texturing, cameras[k], k);
  } else {
    balance_.reset();
  }
  seconds_balance_ = watch.lap();
  mesh.texturing->fill = fill_.find(mesh.hull, cameras, pictures, *mesh.texturing, settings);
  seconds_fill_ = watch.lap();
  if (settings.memory && settings.fill != TextureFill::grey)
    memory_.update(mesh.hull, {cameras, pictures, *mesh.texturing, settings.threads}, time,
                   settings.memory_time, mesh.texturing->fill);
  else
    memory_.reset();
  seconds_memory_ = watch.lap();
  aligned_ = {};
  if (settings.align == TextureAlign::flow) {
    mesh.texturing->flows =
        aligner_.find(mesh.hull, cameras, pictures, *mesh.texturing, settings.threads);
    aligned_ = aligner_.statistics();
  }
  seconds_align_ = watch.lap();
}

void texture_mesh(Mesh& mesh, const TextureSettings& settings) {
  MeshTexturer().texture(mesh, settings);
}

}  // namespace polyhull
