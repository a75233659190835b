// SPDX-License-Identifier: LGPL-2.1-or-later
// An application that embeds the chain: two threads of GStreamer do the work, the application reads
// the meshes from an appsink with the core library, changes a property while the stream runs, and
// reads numbers of hullbuild's stats at the end.
//   g++ -std=c++20 hull_volume.cpp $(pkg-config --cflags --libs polyhull gstreamer-app-1.0) -o
//   hull_volume
#include <gst/app/gstappsink.h>
#include <gst/gst.h>

#include <cstdio>
#include <string>
#include <vector>

#include "base/error.h"
#include "wire/mesh_payload.h"

namespace {

// Enclosed volume by the divergence theorem, in cubic world units.
double volume(const polyhull::Hull& hull) {
  double sum = 0.0;
  for (std::size_t i = 0; i + 2 < hull.triangles.size(); i += 3) {
    const polyhull::Vec3 a = hull.vertices[hull.triangles[i]];
    const polyhull::Vec3 b = hull.vertices[hull.triangles[i + 1]];
    const polyhull::Vec3 c = hull.vertices[hull.triangles[i + 2]];
    sum += glm::dot(a, glm::cross(b, c)) / 6.0;
  }
  return sum;
}

// The payload as one run of bytes, wherever its memories lie.
std::vector<std::uint8_t> bytes_of(GstBuffer* buffer) {
  std::vector<std::uint8_t> bytes(gst_buffer_get_size(buffer));
  gst_buffer_extract(buffer, 0, bytes.data(), bytes.size());
  return bytes;
}

// One counter and one figure of the element's stats. Asked for with the other type, or by a name
// that the element does not have, they are not there.
void print_stats(GstElement* hull) {
  GstStructure* stats = nullptr;
  g_object_get(hull, "stats", &stats, nullptr);
  guint64 sets = 0;
  double milliseconds = 0.0;
  if (gst_structure_get_uint64(stats, "sets", &sets) &&
      gst_structure_get_double(stats, "faces-ms", &milliseconds))
    std::printf("%" G_GUINT64_FORMAT " hulls, the last one's faces took %.2f ms\n", sets,
                milliseconds);
  gst_structure_free(stats);
}

}  // namespace

int main(int argc, char** argv) {
  gst_init(&argc, &argv);
  std::string description = "hullbuild name=hull ! appsink name=meshes sync=false ";
  for (const char* camera : {"cam0", "cam1", "cam2", "cam3"}) {
    description += std::string("rigtestsrc num-buffers=5 camera=") + camera +
                   " ! queue ! chromamatte ! gaussblur ! contourfind name=contours_" + camera +
                   " camera=" + camera + " ! hull. ";
  }
  GError* error = nullptr;
  GstElement* pipeline = gst_parse_launch(description.c_str(), &error);
  if (error) {
    std::fprintf(stderr, "the pipeline cannot be built: %s\n", error->message);
    return 1;
  }
  GstElement* contours = gst_bin_get_by_name(GST_BIN(pipeline), "contours_cam0");
  GstElement* hull = gst_bin_get_by_name(GST_BIN(pipeline), "hull");
  GstElement* meshes = gst_bin_get_by_name(GST_BIN(pipeline), "meshes");
  gst_element_set_state(pipeline, GST_STATE_PLAYING);

  int count = 0;
  while (GstSample* sample = gst_app_sink_pull_sample(GST_APP_SINK(meshes))) {
    const std::vector<std::uint8_t> bytes = bytes_of(gst_sample_get_buffer(sample));
    try {
      const polyhull::Mesh mesh = polyhull::read_mesh(bytes);
      std::printf("mesh %d: %zu vertices, %zu views, %.4f m3\n", count, mesh.hull.vertices.size(),
                  mesh.views.size(), volume(mesh.hull));
    } catch (const polyhull::Error& problem) {
      std::fprintf(stderr, "%s\n", problem.what());
    }
    gst_sample_unref(sample);
    ++count;
    g_object_set(contours, "tolerance", 0.5 + 0.5 * count, nullptr);  // coarser from frame to frame
  }
  print_stats(hull);
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(contours);
  gst_object_unref(hull);
  gst_object_unref(meshes);
  gst_object_unref(pipeline);
  return count > 0 ? 0 : 1;
}
