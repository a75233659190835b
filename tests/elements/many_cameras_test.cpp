// SPDX-License-Identifier: LGPL-2.1-or-later
// More cameras than a GstBuffer holds memories: hulls go on as objects, and their bytes are whole.
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "builtin/default_rig.h"
#include "element_checks.h"
#include "support/folder.h"
#include "wire/mesh_payload.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

/// \p count cameras: the default rig's first, turned around the stage.
Rig ring(int count) {
  Rig rig = default_rig();
  const Camera first = rig.cameras.front();
  rig.cameras.clear();
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * M_PI * i / count, c = std::cos(angle), s = std::sin(angle);
    Camera camera = first;
    camera.name = "cam" + std::to_string(i);
    camera.R = first.R * Mat3(c, 0, s, 0, 1, 0, -s, 0, c);
    rig.cameras.push_back(camera);
  }
  return rig;
}

/// The bytes of the last textured hull of \p count cameras, with \p behind after hulltexture.
std::vector<std::uint8_t> textured(int count, const std::string& behind) {
  const Folder folder;
  std::ofstream(folder.file("ring.json")) << rig_to_json(ring(count));
  std::string line = "hullbuild name=h rig=" + folder.path + "/ring.json ! hulltexture ! " +
                     behind + " fakesink name=out enable-last-sample=true ";
  for (int i = 0; i < count; ++i)
    line += fmt::format(
        "rigtestsrc rig={}/ring.json camera=cam{} num-buffers=2 ! video/x-raw,framerate=25/1 ! "
        "silhouette camera=cam{} ! queue ! h. ",
        folder.path, i, i);
  GstElement* pipeline = parse(line);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  check_ended(wait_for_end(pipeline, 120 * GST_SECOND));
  GstElement* sink = named(pipeline, "out");
  GstSample* sample = nullptr;
  g_object_get(sink, "last-sample", &sample, nullptr);
  fail_unless(sample != nullptr);
  GstBuffer* buffer = gst_sample_get_buffer(sample);
  GstMapInfo map;
  fail_unless(gst_buffer_map(buffer, &map, GST_MAP_READ));
  std::vector<std::uint8_t> bytes(map.data, map.data + map.size);
  gst_buffer_unmap(buffer, &map);
  gst_sample_unref(sample);
  stop(pipeline);
  return bytes;
}

}  // namespace

ELEMENT_TEST(test_hulls_of_many_cameras) {
  // 15 pixel blocks fill a buffer with the header; 16 and more do not go into it one by one.
  for (const int count : {15, 16, 20}) {
    const auto bytes = textured(count, "");
    const Mesh mesh = read_mesh(Bytes(bytes));
    fail_unless_equals_int(mesh.views.size(), count);
    fail_if(mesh.hull.empty());
    for (const MeshView& view : mesh.views) {
      fail_if(view.view.pixels.empty());
      // The subject is in the middle of its region: opaque there.
      std::size_t opaque = 0;
      for (std::size_t i = 3; i < view.view.pixels.size(); i += 4)
        opaque += view.view.pixels[i] == 255 ? 1 : 0;
      fail_unless(opaque > view.view.pixels.size() / 40, "%s has other pixels than its own",
                  view.view.camera.c_str());
    }
    // As one run, through an element that reads bytes, and as an object again.
    const auto wired = textured(count, "gdppay ! gdpdepay ! hulltexture ! ");
    fail_unless_equals_int(read_mesh(Bytes(wired)).views.size(), count);
    fail_unless_equals_int(wired.size(), bytes.size());
  }
}
