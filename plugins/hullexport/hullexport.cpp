// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// hullexport: writes meshes to files: GLB (textured by the camera pictures if the mesh went
/// through hulltexture), PLY or OBJ, by the ending of `location`. With a number in the name
/// (hull-%05d.glb) each mesh becomes a file, without one a single file holds the first or the last
/// mesh. For each file an element message "hullexport-file" with location, index, timestamp and
/// running-time is posted.
#include <gst/base/gstbasesink.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <optional>

#include "base/error.h"
#include "base/stopwatch.h"
#include "files/claimed_location.h"
#include "files/mesh_files.h"
#include "files/numbered_name.h"
#include "plugins/common/element.h"
#include "plugins/common/guard.h"
#include "plugins/common/log.h"
#include "plugins/common/memory/payload_buffer.h"

GST_DEBUG_CATEGORY_STATIC(hullexport_debug);
#define GST_CAT_DEFAULT hullexport_debug

namespace polyhull::element {

enum class KeptMesh { last, first };

template <>
GType enum_type<KeptMesh>() {
  return register_enum<KeptMesh>(
      "PolyhullKeptMesh",
      {{KeptMesh::last, "The last mesh, written at the end of the stream", "last"},
       {KeptMesh::first, "The first mesh that is not empty", "first"}});
}

}  // namespace polyhull::element

namespace {

using namespace polyhull;
using namespace polyhull::element;

struct Settings {
  std::string location;
  KeptMesh keep = KeptMesh::last;
  std::uint32_t every = 1;
  bool textured = true;
  bool double_precision = true;
  std::uint32_t jpeg_quality = 90;
};

struct HullExport {
  static constexpr char type_name[] = "PolyhullHullExport";
  static GType base_type() { return GST_TYPE_BASE_SINK; }
  static void class_init(gpointer klass);

  explicit HullExport(gpointer object) {
    statistics.declare({"files", "meshes-fading", "meshes-unusable"});
    gst_base_sink_set_sync(GST_BASE_SINK(object), FALSE);
  }
  ~HullExport() { gst_clear_buffer(&last); }

  Settings settings;  // under the object lock

  Statistics statistics{"hullexport-stats"};
  std::optional<ClaimedLocation> claim;  // from READY to PAUSED until the element stops
  std::optional<NumberedName> name;      // the rest belongs to the streaming thread
  GstBuffer* last = nullptr;             // for keep=last, until the end
  bool first_written = false;
  std::uint64_t meshes = 0;  // that came in
  std::uint64_t index = 0;   // of the next file
};

std::span<const Property<Settings>> properties() {
  using S = Settings;
  static const Property<S> table[] = {
      property<&S::location>(
          "location",
          "File to write; its ending, .glb, .ply or .obj, says the format. With a number in it, "
          "such as hull-%05d.glb, each mesh becomes a file of its own, counted from 0.",
          0, 0, Change::when_ready),
      property<&S::keep>("keep",
                         "Which mesh a location without a number holds. The last one is written "
                         "when the stream ends or the element stops.",
                         0, 0, Change::when_ready),
      property<&S::every>("every",
                          "Writes only every n-th mesh of a numbered sequence (1 to 1000000).", 1,
                          1000000),
      property<&S::textured>(
          "textured",
          "Whether GLB and OBJ files carry the camera pictures, if the mesh has been textured."),
      property<&S::double_precision>(
          "double-precision", "Whether PLY files hold coordinates as double instead of float."),
      property<&S::jpeg_quality>(
          "jpeg-quality",
          "Quality of the pictures in GLB files (1 to 100); 0 writes them as PNG, without loss.", 0,
          100),
  };
  return table;
}

void post_file(GstBaseSink* base, const std::string& path, std::uint64_t index, GstBuffer* buffer) {
  const GstClockTime time = GST_BUFFER_PTS(buffer);
  const GstSegment& segment = base->segment;
  const GstClockTime running = segment.format == GST_FORMAT_TIME
                                   ? gst_segment_to_running_time(&segment, GST_FORMAT_TIME, time)
                                   : GST_CLOCK_TIME_NONE;
  gst_element_post_message(
      GST_ELEMENT_CAST(base),
      gst_message_new_element(
          GST_OBJECT(base),
          gst_structure_new("hullexport-file", "location", G_TYPE_STRING, path.c_str(), "index",
                            G_TYPE_UINT64, static_cast<guint64>(index), "timestamp", G_TYPE_UINT64,
                            time, "running-time", G_TYPE_UINT64, running, nullptr)));
}

void write_file(GstBaseSink* base, GstBuffer* buffer, const Mesh& mesh) {
  HullExport& self = state_of<HullExport>(base);
  const Settings settings = snapshot(base, self.settings);
  const MeshFileOptions options{settings.textured, settings.double_precision,
                                static_cast<int>(settings.jpeg_quality)};
  const std::uint64_t index = self.index++;
  const std::string path = self.name->name(index);
  const Stopwatch watch;
  write_mesh_file(mesh, path, options);
  self.statistics.set("write-ms", watch.milliseconds());
  self.statistics.count("files");
  GST_DEBUG_OBJECT(base, "'%s' is written: %zu triangles in %.1f ms", path.c_str(),
                   mesh.hull.triangles.size() / 3, watch.milliseconds());
  post_file(base, path, index, buffer);
}

GstFlowReturn render(GstBaseSink* base, GstBuffer* buffer) {
  HullExport& self = state_of<HullExport>(base);
  return guarded(GST_ELEMENT_CAST(base), GST_FLOW_ERROR, [&]() -> GstFlowReturn {
    const Settings settings = snapshot(base, self.settings);
    const bool due = self.meshes++ % settings.every == 0;
    const bool skipped =
        self.name->numbered() ? !due : settings.keep == KeptMesh::first && self.first_written;
    GST_LOG_OBJECT(base, "%s: %" GST_PTR_FORMAT,
                   !skipped                ? "taken"
                   : self.name->numbered() ? "left out by every"
                                           : "left out by keep=first",
                   printed(buffer));
    if (skipped) return GST_FLOW_OK;
    std::optional<MeshBuffer> mesh;
    try {
      mesh.emplace(buffer);
    } catch (const Error& error) {
      self.statistics.warn(GST_ELEMENT_CAST(base), "meshes-unusable",
                           fmt::format("A buffer was not written: {}", error.what()));
      return GST_FLOW_OK;
    }
    if (mesh->mesh().opacity < 1.0f) {
      GST_LOG_OBJECT(base, "left out, as the subject fades: %" GST_PTR_FORMAT, printed(buffer));
      self.statistics.count("meshes-fading");
    } else if (self.name->numbered()) {
      write_file(base, buffer, mesh->mesh());
    } else if (settings.keep == KeptMesh::last) {
      gst_buffer_replace(&self.last, buffer);
    } else if (!mesh->mesh().hull.empty()) {
      write_file(base, buffer, mesh->mesh());
      self.first_written = true;
    }
    return GST_FLOW_OK;
  });
}

gboolean write_last(GstBaseSink* base) {
  HullExport& self = state_of<HullExport>(base);
  if (self.last == nullptr) return TRUE;
  const gboolean written = guarded(GST_ELEMENT_CAST(base), gboolean{FALSE}, [&]() -> gboolean {
    write_file(base, self.last, MeshBuffer(self.last).mesh());
    return TRUE;
  });
  gst_clear_buffer(&self.last);
  return written;
}

gboolean event(GstBaseSink* base, GstEvent* event) {
  // The base class takes the event, and posts EOS when it has returned: the file is complete by
  // then.
  if (GST_EVENT_TYPE(event) == GST_EVENT_EOS) {
    if (!write_last(base)) {
      gst_event_unref(event);
      return FALSE;
    }
    const HullExport& self = state_of<HullExport>(base);
    const bool wants_first =
        !self.name->numbered() && snapshot(base, self.settings).keep == KeptMesh::first;
    if (self.meshes == 0) {
      GST_ELEMENT_WARNING(base, STREAM, FAILED,
                          ("No file was written: the stream ended before a mesh came. Look for "
                           "what keeps the views from hullbuild."),
                          (nullptr));
    } else if (wants_first && !self.first_written) {
      GST_ELEMENT_WARNING(base, STREAM, FAILED,
                          ("No file was written: all meshes of the stream were empty. Look for "
                           "what keeps the cameras from seeing a foreground."),
                          (nullptr));
    }
  }
  return GST_BASE_SINK_CLASS(parent_class<HullExport>())->event(base, event);
}

/// Looks at what is to be written. Not in GstBaseSink::start, after whose failure the base class
/// would post a second error that says nothing.
gboolean open(GstElement* element) {
  HullExport& self = state_of<HullExport>(element);
  return guarded(element, gboolean{FALSE}, [&]() -> gboolean {
    const std::string location = snapshot(element, self.settings).location;
    if (location.empty())
      throw Error(Error::Kind::not_found,
                  "There is no file to write; set location=hull-%05d.glb or the like.");
    self.name.emplace(location);
    self.claim.reset();
    if (!is_mesh_file_name(self.name->name(0)))
      throw Error(Error::Kind::unsupported,
                  "'{}' has an ending that hullexport cannot write; use {}.", location,
                  mesh_file_endings());
    std::filesystem::path folder = std::filesystem::path(self.name->name(0)).parent_path();
    if (folder.empty()) folder = ".";
    if (access(folder.c_str(), W_OK | X_OK) != 0)
      throw Error(Error::Kind::io,
                  "The folder of '{}' cannot be written to: {}. Make the folder, or set location "
                  "to another one.",
                  location, std::strerror(errno));
    self.claim.emplace(location);
    self.statistics.reset();
    self.first_written = false;
    self.meshes = self.index = 0;
    return TRUE;
  });
}

gboolean stop(GstBaseSink* base) {
  const gboolean written = write_last(base);
  state_of<HullExport>(base).claim.reset();
  return written;
}

GstStateChangeReturn change_state(GstElement* element, GstStateChange transition) {
  if (transition == GST_STATE_CHANGE_READY_TO_PAUSED && !open(element))
    return GST_STATE_CHANGE_FAILURE;
  return GST_ELEMENT_CLASS(parent_class<HullExport>())->change_state(element, transition);
}

void HullExport::class_init(gpointer klass) {
  GST_DEBUG_CATEGORY_INIT(hullexport_debug, "hullexport", 0, "meshes to files");
  add_properties<HullExport>(klass, properties(), &HullExport::settings);
  add_statistics<HullExport>(klass,
                             "Counters since the start: files (written), meshes-fading (of a "
                             "subject that fades: left out), meshes-unusable (buffers that were no "
                             "mesh); write-ms, the milliseconds the last file took.");
  set_metadata(klass, "Hull exporter", "Sink/File",
               "Writes hulls as GLB (textured), PLY or OBJ files");
  add_template(klass, "sink", GST_PAD_SINK, mesh_caps);
  GST_ELEMENT_CLASS(klass)->change_state = change_state;
  GstBaseSinkClass* base_class = GST_BASE_SINK_CLASS(klass);
  base_class->render = render;
  base_class->event = event;
  base_class->stop = stop;
}

}  // namespace

GST_ELEMENT_REGISTER_DEFINE(hullexport, "hullexport", GST_RANK_NONE, type_of<HullExport>())
