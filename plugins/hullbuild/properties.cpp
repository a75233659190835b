// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/hullbuild/properties.h"

namespace polyhull::element {

template <>
GType enum_type<MissingCamera>() {
  return register_enum<MissingCamera>(
      "PolyhullMissingCamera",
      {{MissingCamera::drop_set, "Drop sets that are not complete", "drop-set"},
       {MissingCamera::drop_camera, "Build the hull without the missing cameras", "drop-camera"},
       {MissingCamera::hold, "Use the missing camera's last view for up to hold-time", "hold"},
       {MissingCamera::freeze,
        "Drop sets that are not complete for up to hold-time, so that the last whole one stays on "
        "the screen, then build without the missing cameras",
        "freeze"}});
}

template <>
GType enum_type<Unseen>() {
  return register_enum<Unseen>(
      "PolyhullUnseen",
      {{Unseen::carve, "What a camera does not see is outside the hull", "carve"},
       {Unseen::keep, "A camera says nothing about what it does not see; needs bounds", "keep"}});
}

template <>
GType enum_type<Repair>() {
  return register_enum<Repair>(
      "PolyhullRepair",
      {{Repair::off, "Silhouettes are taken as they are", "off"},
       {Repair::holes, "Holes that the other cameras prove wrong are filled", "holes"},
       {Repair::both, "And pieces of background that no other camera confirms are dropped",
        "both"}});
}

template <>
GType enum_type<HullSurface>() {
  return register_enum<HullSurface>(
      "PolyhullHullSurface",
      {{HullSurface::polyhedral, "The visual hull as a closed mesh", "polyhedral"},
       {HullSurface::none,
        "No hull is built, meshes carry the views alone: for composite subject=image-based",
        "none"}});
}

namespace {

using S = HullSettings;
constexpr double longest = 60.0 * GST_SECOND;
constexpr Property<S> table[] = {
    property<&S::rig>("rig",
                      "Path of the rig file with the cameras' calibration. Unset: the rig that the "
                      "views bring, as takesrc's do, else the built-in rig of four cameras. A "
                      "change while playing takes effect with the next set."),
    property<&S::sync_tolerance>(
        "sync-tolerance",
        "How far the times of views of one set may differ, in nanoseconds (0 to 60 s), where views "
        "carry no trigger number: timecodes, else capture times, else running times. Keep it below "
        "half the time between frames.",
        0, longest),
    property<&S::max_wait>(
        "max-wait",
        "How long a live set waits for missing views beyond the latency of the sources and of the "
        "stages between, in nanoseconds (0 to 60 s). Unset (18446744073709551615): as long as the "
        "cameras have shown to need in the last ten seconds, up to max-latency. It is part of the "
        "latency that the element reports.",
        0, static_cast<double>(G_MAXUINT64)),
    property<&S::max_latency>("max-latency",
                              "How late views may come, in nanoseconds (0 to 60 s), to be waited "
                              "for where max-wait is unset. Views that come later are of no use: "
                              "their whole instant is dropped, for all cameras.",
                              0, longest),
    property<&S::missing_camera>("missing-camera",
                                 "What to do with a set that lacks the view of a camera."),
    property<&S::hold_time>(
        "hold-time",
        "For how long missing-camera=freeze keeps the last whole set, and missing-camera=hold a "
        "camera's last view, in nanoseconds (0 to 60 s); after that the hull is built without the "
        "camera, or, where the others are not enough, fades out.",
        0, longest),
    property<&S::min_cameras>(
        "min-cameras",
        "Sets with fewer views than this (1 to 1024) are dropped, and the subject fades out. 0: "
        "three, or as many as are connected where those are fewer, which bound the subject.",
        0, 1024),
    property<&S::weld_distance>(
        "weld-distance",
        "Merges vertices nearer than this, in world units (0 to 1e9). The hull is exact and closed "
        "without it; merging can make it touch itself.",
        0.0, 1e9),
    property<&S::unseen>("unseen", "What to do with space that a camera does not see."),
    property<&S::use_bounds>("use-bounds", "Whether the hull is limited to the rig's bounds."),
    property<&S::max_deviation>("max-deviation",
                                "How far simplification may move the surface to remove slivers, in "
                                "world units (0 to 1e9); 0 keeps the exact hull.",
                                0.0, 1e9),
    property<&S::repair>("repair",
                         "What of silhouettes that contradict the other cameras' is mended before "
                         "the hull is built."),
    property<&S::check_cameras>(
        "check-cameras",
        "Whether to look if silhouettes contradict each other, with four cameras or more: the "
        "figure contradiction-percent of stats, and a warning that names the camera."),
    property<&S::adaptive>("adaptive",
                           "Whether contours are coarsened while a live stream's sets come faster "
                           "than they can be made and taken on, by up to 8 pixels. Works with any "
                           "sink, and with sources on other machines."),
    property<&S::surface>("surface",
                          "Whether a hull is built. Without one all work on it is left out, repair "
                          "too, and a mesh is the views of one instant."),
    property<&S::threads>("threads",
                          "How many threads of the pool that all elements share may build the hull "
                          "(1 to 256); 0 means all of them.",
                          0, 256),
    property<&S::pool_threads>(
        "pool-threads",
        "Size of the pool of threads that all polyhull elements of the process share (1 to 256); 0 "
        "means as many as the machine has cores, which are also the most that are used. The last "
        "element to set it decides.",
        0, 256),
};

}  // namespace

std::span<const Property<HullSettings>> hull_properties() {
  return table;
}

}  // namespace polyhull::element
