// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// hullexport: writes meshes to files: GLB (textured by the camera pictures if the mesh went
/// through hulltexture), PLY or OBJ, by the ending of `location`. With a number in the name
/// (hull-%05d.glb) each mesh becomes a file, without one a single file holds the first or the last
/// mesh. For each file an element message "hullexport-file" with location, index, timestamp and
/// running-time is posted.
///
/// Properties that matter: `location`; `keep`, the first or the last mesh; `every`, to thin a
/// sequence.
///
/// gst-launch-1.0 hullbuild name=hull ! hulltexture ! hullexport location=out.glb
///     rigtestsrc camera=cam0 num-buffers=3 ! chromamatte ! gaussblur ! contourfind camera=cam0 !
///     hull. rigtestsrc camera=cam1 num-buffers=3 ! chromamatte ! gaussblur ! contourfind
///     camera=cam1 ! hull.
#include "plugins/hullexport/hullexport.h"

#include <gst/base/gstbasesink.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <optional>

#include "base/error.h"
#include "files/mesh_files.h"
#include "plugins/common/claimed_location.h"
#include "plugins/common/guard.h"
#include "plugins/common/memory/payload_buffer.h"
#include "plugins/common/property_table.h"
#include "plugins/common/statistics.h"
#include "plugins/common/numbered_name.h"

GST_DEBUG_CATEGORY_STATIC(hullexport_debug);
#define GST_CAT_DEFAULT hullexport_debug

namespace polyhull::element {

enum class KeptMesh { last, first };

template <>
GType enum_type<KeptMesh>() {
  static const GEnumValue values[] = {
      {static_cast<gint>(KeptMesh::last), "The last mesh, written at the end of the stream",
       "last"},
      {static_cast<gint>(KeptMesh::first), "The first mesh that is not empty", "first"},
      {0, nullptr, nullptr}};
  static const GType type = register_enum("PolyhullKeptMesh", values);
  return type;
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

struct Private {
  Settings settings;  // under the object lock

  Statistics statistics{"hullexport-stats"};
  std::optional<ClaimedLocation> claim;  // from READY to PAUSED until the element stops
  std::optional<NumberedName> name;      // the rest belongs to the streaming thread
  GstBuffer* last = nullptr;             // for keep=last, until the end
  bool first_written = false;
  std::uint64_t meshes = 0;  // that came in
  std::uint64_t index = 0;   // of the next file
};

struct PolyhullHullExport {
  GstBaseSink parent;
  Private* priv;
};

struct PolyhullHullExportClass {
  GstBaseSinkClass parent_class;
};

enum { first_setting = 1 };
guint stats_id;

std::span<const Property<Settings>> properties() {
  using S = Settings;
  static const Property<S> table[] = {
      property<&S::location>(
          "location", "Location",
          "File to write; its ending, .glb, .ply or .obj, says the format. With a number in it, "
          "such "
          "as hull-%05d.glb, each mesh becomes a file of its own, counted from 0.",
          0, 0, Change::when_ready),
      property<&S::keep>(
          "keep", "Kept mesh",
          "Which mesh a location without a number holds. The last one is written when "
          "the stream ends or the element stops.",
          0, 0, Change::when_ready),
      property<&S::every>("every", "Every",
                          "Writes only every n-th mesh of a numbered sequence (1 to 1000000).", 1,
                          1000000),
      property<&S::textured>("textured", "Textured",
                             "Whether GLB and OBJ files carry the camera pictures, if the mesh has "
                             "been textured."),
      property<&S::double_precision>(
          "double-precision", "Double precision",
          "Whether PLY files hold coordinates as double instead of float."),
      property<&S::jpeg_quality>(
          "jpeg-quality", "JPEG quality",
          "Quality of the pictures in GLB files (1 to 100); 0 writes them as "
          "PNG, without loss.",
          0, 100),
  };
  return table;
}

GType polyhull_hull_export_get_type();
G_DEFINE_TYPE(PolyhullHullExport, polyhull_hull_export, GST_TYPE_BASE_SINK)

PolyhullHullExport* self_of(gpointer object) {
  return static_cast<PolyhullHullExport*>(object);
}

void set_property_value(GObject* object, guint id, const GValue* value, GParamSpec* spec) {
  Private& priv = *self_of(object)->priv;
  if (!set_property(object, properties(), first_setting, priv.settings, id, value))
    G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
}

void get_property_value(GObject* object, guint id, GValue* value, GParamSpec* spec) {
  Private& priv = *self_of(object)->priv;
  if (id == stats_id)
    g_value_take_boxed(value, priv.statistics.structure());
  else if (!get_property(object, properties(), first_setting, priv.settings, id, value))
    G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
}

void post_file(PolyhullHullExport* self, const std::string& path, std::uint64_t index,
               GstBuffer* buffer) {
  const GstClockTime time = GST_BUFFER_PTS(buffer);
  const GstSegment& segment = GST_BASE_SINK(self)->segment;
  const GstClockTime running = segment.format == GST_FORMAT_TIME
                                   ? gst_segment_to_running_time(&segment, GST_FORMAT_TIME, time)
                                   : GST_CLOCK_TIME_NONE;
  gst_element_post_message(
      GST_ELEMENT_CAST(self),
      gst_message_new_element(
          GST_OBJECT(self),
          gst_structure_new("hullexport-file", "location", G_TYPE_STRING, path.c_str(), "index",
                            G_TYPE_UINT64, static_cast<guint64>(index), "timestamp", G_TYPE_UINT64,
                            time, "running-time", G_TYPE_UINT64, running, nullptr)));
}

void write_file(PolyhullHullExport* self, GstBuffer* buffer, const Mesh& mesh) {
  Private& priv = *self->priv;
  const Settings settings = snapshot(self, priv.settings);
  const MeshFileOptions options{settings.textured, settings.double_precision,
                                static_cast<int>(settings.jpeg_quality)};
  const std::uint64_t index = priv.index++;
  const std::string path = priv.name->name(index);
  const auto begin = std::chrono::steady_clock::now();
  write_mesh_file(mesh, path, options);
  const std::chrono::duration<double, std::milli> taken = std::chrono::steady_clock::now() - begin;
  priv.statistics.count("files");
  priv.statistics.set("write-ms", taken.count());
  post_file(self, path, index, buffer);
}

GstFlowReturn render(GstBaseSink* base, GstBuffer* buffer) {
  PolyhullHullExport* self = self_of(base);
  Private& priv = *self->priv;
  return guarded(GST_ELEMENT_CAST(self), GST_FLOW_ERROR, [&]() -> GstFlowReturn {
    const Settings settings = snapshot(self, priv.settings);
    const bool due = priv.meshes++ % settings.every == 0;
    if (priv.name->numbered() ? !due : settings.keep == KeptMesh::first && priv.first_written)
      return GST_FLOW_OK;
    std::optional<MeshBuffer> mesh;
    try {
      mesh.emplace(buffer);
    } catch (const Error& error) {
      priv.statistics.warn(GST_ELEMENT_CAST(self), "meshes-unusable",
                           std::string("A buffer was not written: ") + error.what());
      return GST_FLOW_OK;
    }
    if (priv.name->numbered()) {
      write_file(self, buffer, mesh->mesh());
    } else if (settings.keep == KeptMesh::last) {
      gst_buffer_replace(&priv.last, buffer);
    } else if (!mesh->mesh().hull.empty()) {
      write_file(self, buffer, mesh->mesh());
      priv.first_written = true;
    }
    return GST_FLOW_OK;
  });
}

gboolean write_last(PolyhullHullExport* self) {
  Private& priv = *self->priv;
  if (priv.last == nullptr) return TRUE;
  const gboolean written = guarded(GST_ELEMENT_CAST(self), gboolean{FALSE}, [&]() -> gboolean {
    write_file(self, priv.last, MeshBuffer(priv.last).mesh());
    return TRUE;
  });
  gst_clear_buffer(&priv.last);
  return written;
}

gboolean event(GstBaseSink* base, GstEvent* event) {
  // The base class takes the event, and posts EOS when it has returned: the file is complete by
  // then.
  if (GST_EVENT_TYPE(event) == GST_EVENT_EOS) {
    PolyhullHullExport* self = self_of(base);
    if (!write_last(self)) {
      gst_event_unref(event);
      return FALSE;
    }
    const Private& priv = *self->priv;
    const bool wants_first =
        !priv.name->numbered() && snapshot(self, priv.settings).keep == KeptMesh::first;
    if (priv.meshes == 0) {
      GST_ELEMENT_WARNING(self, STREAM, FAILED,
                          ("The stream ended before a mesh came: no file was written."), (nullptr));
    } else if (wants_first && !priv.first_written) {
      GST_ELEMENT_WARNING(self, STREAM, FAILED,
                          ("No file was written: all meshes of the stream were empty. Look for "
                           "what keeps the cameras from seeing a foreground."),
                          (nullptr));
    }
  }
  return GST_BASE_SINK_CLASS(polyhull_hull_export_parent_class)->event(base, event);
}

/// Looks at what is to be written. Not in GstBaseSink::start, after whose failure the base class
/// would post a second error that says nothing.
gboolean open(PolyhullHullExport* self) {
  Private& priv = *self->priv;
  return guarded(GST_ELEMENT_CAST(self), gboolean{FALSE}, [&]() -> gboolean {
    const std::string location = snapshot(self, priv.settings).location;
    if (location.empty())
      throw Error(Error::Kind::not_found,
                  "hullexport has no file to write; set location=hull-%05d.glb or the like");
    priv.name.emplace(location);
    priv.claim.reset();
    if (!is_mesh_file_name(priv.name->name(0)))
      throw Error(Error::Kind::unsupported,
                  "\"" + location +
                      "\" has an ending that hullexport cannot write; use .glb, .ply "
                      "or .obj");
    std::filesystem::path folder = std::filesystem::path(priv.name->name(0)).parent_path();
    if (folder.empty()) folder = ".";
    if (access(folder.c_str(), W_OK | X_OK) != 0)
      throw Error(Error::Kind::io, "the folder of \"" + location +
                                       "\" cannot be written to: " + std::strerror(errno));
    priv.claim.emplace(location);
    priv.statistics.reset();
    priv.first_written = false;
    priv.meshes = priv.index = 0;
    return TRUE;
  });
}

gboolean stop(GstBaseSink* base) {
  const gboolean written = write_last(self_of(base));
  self_of(base)->priv->claim.reset();
  return written;
}

GstStateChangeReturn change_state(GstElement* element, GstStateChange transition) {
  if (transition == GST_STATE_CHANGE_READY_TO_PAUSED && !open(self_of(element)))
    return GST_STATE_CHANGE_FAILURE;
  return GST_ELEMENT_CLASS(polyhull_hull_export_parent_class)->change_state(element, transition);
}

void polyhull_hull_export_init(PolyhullHullExport* self) {
  self->priv = new Private;
  self->priv->statistics.declare({"files", "meshes-unusable"});
  gst_base_sink_set_sync(GST_BASE_SINK(self), FALSE);
}

void finalize(GObject* object) {
  Private* priv = self_of(object)->priv;
  gst_clear_buffer(&priv->last);
  delete priv;
  G_OBJECT_CLASS(polyhull_hull_export_parent_class)->finalize(object);
}

void polyhull_hull_export_class_init(PolyhullHullExportClass* klass) {
  GST_DEBUG_CATEGORY_INIT(hullexport_debug, "hullexport", 0, "meshes to files");
  GObjectClass* object_class = G_OBJECT_CLASS(klass);
  object_class->set_property = set_property_value;
  object_class->get_property = get_property_value;
  object_class->finalize = finalize;
  stats_id = install_properties(object_class, properties(), first_setting);
  g_object_class_install_property(
      object_class, stats_id,
      statistics_property(
          "Counters since the start: files (written), meshes-unusable (buffers that "
          "were no mesh); write-ms, the milliseconds the last file took."));
  GstElementClass* element_class = GST_ELEMENT_CLASS(klass);
  gst_element_class_set_static_metadata(element_class, "Hull exporter", "Sink/File",
                                        "Writes hulls as GLB (textured), PLY or OBJ files",
                                        "polyhull");
  element_class->change_state = change_state;
  GstCaps* caps = gst_caps_from_string(mesh_caps);
  gst_element_class_add_pad_template(
      element_class, gst_pad_template_new("sink", GST_PAD_SINK, GST_PAD_ALWAYS, caps));
  gst_caps_unref(caps);
  GstBaseSinkClass* base_class = GST_BASE_SINK_CLASS(klass);
  base_class->render = render;
  base_class->event = event;
  base_class->stop = stop;
}

}  // namespace

GST_ELEMENT_REGISTER_DEFINE(hullexport, "hullexport", GST_RANK_NONE,
                            polyhull_hull_export_get_type())
