// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/composite/properties.h"

#include <algorithm>
#include <cmath>

#include "base/srgb.h"
#include "plugins/common/scene/parsed_property.h"
#include "scene/changes/mirror_choice.h"

namespace polyhull::element {

template <>
GType enum_type<ShadowQuality>() {
  return register_enum<ShadowQuality>(
      "PolyhullShadowQuality",
      {{ShadowQuality::off, "No shadow", "off"},
       {ShadowQuality::hard,
        "Of the light's middle alone: harder and darker than the scene's own shadows", "hard"},
       {ShadowQuality::fast, "4 rays a pixel; OpenGL: one look-up in each of 16 cells of the light",
        "fast"},
       {ShadowQuality::good,
        "12 rays a pixel; OpenGL: percentage-closer soft shadows of 4 look-ups in each cell",
        "good"},
       {ShadowQuality::best, "Up to 64 rays a pixel; OpenGL: of 16 look-ups in each cell",
        "best"}});
}

template <>
GType enum_type<Backend>() {
  return register_enum<Backend>(
      "PolyhullBackend",
      {{Backend::automatic,
        "OpenGL where pictures are in its memory or a graphics processor is at hand, else the "
        "processor",
        "auto"},
       {Backend::processor, "The processor, without an OpenGL context", "processor"},
       {Backend::gl, "OpenGL, whatever draws it", "gl"}});
}

template <>
GType enum_type<SubjectShape>() {
  return register_enum<SubjectShape>(
      "PolyhullSubjectShape",
      {{SubjectShape::mesh, "The mesh's triangles", "mesh"},
       {SubjectShape::image_based,
        "The silhouettes' intersection, ray by ray, whatever the mesh's triangles are",
        "image-based"}});
}

template <>
GType enum_type<Pivot>() {
  return register_enum<Pivot>(
      "PolyhullPivot", {{Pivot::rig_origin, "The origin of the cameras' coordinates", "rig-origin"},
                        {Pivot::box, "The centre of the hull's bounding box", "box"},
                        {Pivot::centroid, "The centre of gravity of the hull", "centroid"},
                        {Pivot::point, "The point pivot-x, pivot-y, pivot-z", "point"}});
}

template <>
GType enum_type<SubjectLighting>() {
  return register_enum<SubjectLighting>(
      "PolyhullSubjectLighting",
      {{SubjectLighting::off, "The studio's, as the cameras saw it", "off"},
       {SubjectLighting::shade,
        "The studio's, times the scene's where the subject is relative to the stage's middle",
        "shade"},
       {SubjectLighting::relit,
        "The same, and by the way each part of the body faces, relative to light from all sides",
        "relit"}});
}

template <>
GType enum_type<MirrorMode>() {
  return register_enum<MirrorMode>(
      "PolyhullMirrorMode",
      {{MirrorMode::off, "No mirror image", "off"},
       {MirrorMode::fresnel,
        "By the mirror's material: the subject takes the place of what the mirror showed",
        "fresnel"},
       {MirrorMode::plain, "Mixed in with the constant share reflection-alpha", "plain"}});
}

template <>
GType enum_type<AlphaCoding>() {
  return register_enum<AlphaCoding>(
      "PolyhullAlphaCoding",
      {{AlphaCoding::straight, "The covered part's own: what GStreamer's RGBA means", "straight"},
       {AlphaCoding::premultiplied, "Those times alpha, as they are added over another picture",
        "premultiplied"}});
}

template <>
GType enum_type<CompositeView>() {
  return register_enum<CompositeView>(
      "PolyhullCompositeView",
      {{CompositeView::composite, "The composite; of a background that is not opaque, the fill",
        "composite"},
       {CompositeView::key, "Its alpha as an opaque grey picture", "key"}});
}

template <>
GType enum_type<BlurRange>() {
  return register_enum<BlurRange>(
      "PolyhullBlurRange",
      {{BlurRange::off, "Nothing", "off"},
       {BlurRange::subject, "The subjects; the background's picture has it already", "subject"},
       {BlurRange::picture, "The scene and the subjects", "picture"}});
}

std::span<const Property<CompositeSettings>> composite_properties() {
  using S = CompositeSettings;
  constexpr double far = 1e6;
  static const Property<S> table[] = {
      property<&S::scene>(
          "scene",
          "Path of the glTF 2.0 file (.glb or .gltf) that the background shows, or one that ships, "
          "builtin:room or builtin:apartment. Used where the background does not announce its "
          "scene; unset, there is then no scene: nothing hides the subject, and it throws no "
          "shadow. While playing the next one is loaded beside the last one, which live frames "
          "have until then; a file that was written anew is loaded again when it is set again."),
      property<&S::exposure>(
          "exposure",
          "Picture value (1 is white) per unit of the scene's radiance (0 to 1e6), where the "
          "background does not announce it; 0 takes the scene's own.",
          0, far),
      property<&S::backend>("backend", "What draws the pictures."),
      property<&S::subject>("subject",
                            "As what subjects are drawn. image-based needs no hull (hullbuild "
                            "surface=none) and no hulltexture, and is drawn by the processor."),
      property<&S::shadow>("shadow",
                           "How exactly the subject's shadows of the scene's lights are drawn. How "
                           "soft each is depends on the size of its light."),
      property<&S::mirror>("mirror",
                           "How the subject's images in the scene's planar mirrors are drawn: "
                           "where there are more than eight, in those in which it is largest."),
      property<&S::reflection_alpha>("reflection-alpha",
                                     "Share of the mirror image in mirror=plain (0 to 1).", 0, 1),
      property<&S::mirror_depth>(
          "mirror-depth",
          "By way of how many mirrors, one seen in the other, the subject is seen (1 to 4).", 1, 4),
      parsed_property<&S::mirrors, parse_mirror_choice>(
          "mirrors",
          "Which of the scene's planar mirrors show the subject: auto for all, or the names of "
          "nodes, semicolons between and those with spaces in quotes; a minus before a name leaves "
          "its mirrors out.",
          "auto, or names of nodes as in floor; \"tall mirror\" or -window"),
      property<&S::alpha>(
          "alpha",
          "What the colours beside an alpha below 1 are, of the background and of the output "
          "alike. NV12 and I420 have no alpha: the background counts as opaque then."),
      property<&S::view>("view",
                         "What the output shows: a switcher gets fill and key from two outputs."),
      property<&S::edge_samples>("edge-samples",
                                 "Samples per pixel at the subject's edges (0 to 16; the processor "
                                 "takes 8 at most): 0 and 1 draw hard edges.",
                                 0, 16),
      property<&S::soft_edges>("soft-edges",
                               "Whether outlines are as soft as the mattes in the views' alpha, "
                               "for hair and fur; otherwise they are the hull's polygons."),
      property<&S::depth_of_field>(
          "depth-of-field", "What is blurred where it is nearer or farther than focus-distance."),
      property<&S::aperture>("aperture",
                             "Diameter of the lens's entrance pupil, focal length over f-number, "
                             "in millimetres (0 to 1000); 0 takes what the background announces of "
                             "a tracked lens, and where that is nothing all is sharp.",
                             0, 1000),
      property<&S::focus_distance>(
          "focus-distance",
          "How far from the eye things are sharp, along the optical axis, in metres (0 to 1e6); 0 "
          "takes what the background announces of a tracked lens, else 3.",
          0, far),
      property<&S::motion_blur>("motion-blur",
                                "What is blurred where the viewport moves from frame to frame. A "
                                "person's own motion is blurred in the cameras' pictures."),
      property<&S::shutter_angle>(
          "shutter-angle",
          "How long the viewport's shutter is open for motion-blur: in degrees, of which 360 are "
          "the time from a frame to the next (0 to 360).",
          0, 360),
      property<&S::falloff_a1>(
          "falloff-a1",
          "How the picture's linear light falls off from its middle, as OpenTrackIO's exposure "
          "fall-off: it is multiplied by 1 + a1 r² + a2 r⁴ + a3 r⁶, r being the distance from the "
          "principal point over the focal length (-100 to 100). -1.84, 1.81, -0.73 is the natural "
          "fall-off of an ideal lens, cos⁴; 0, 0, 0 is none.",
          -100, 100),
      property<&S::falloff_a2>("falloff-a2", "As falloff-a1 (-100 to 100).", -100, 100),
      property<&S::falloff_a3>("falloff-a3", "As falloff-a1 (-100 to 100).", -100, 100),
      property<&S::grain>(
          "grain",
          "Grain of the sensor: the standard deviation of each channel's code, as a share of white "
          "(0 to 1); 0 is none. It depends on the frame's time alone.",
          0, 1),
      property<&S::grain_size>("grain-size", "How wide a grain is, in pixels (1 to 50).", 1, 50),
      property<&S::async_readback>("async-readback",
                                   "Whether a picture that OpenGL draws for system memory (RGBA) "
                                   "is handed on one frame later, so that nothing waits for the "
                                   "graphics processor. The latency has that frame in it."),
      property<&S::skip>("skip",
                         "Whether work that changes no pixel is left out. The picture is the same "
                         "without, only slower: for tests."),
      property<&S::navigate>(
          "navigate",
          "Whether mouse and keys that a video sink sends back move the viewport. Where the "
          "background announces its camera they are passed on to its source instead."),
      property<&S::max_mesh_age>(
          "max-mesh-age",
          "How much older than the background's frame a mesh may be, in nanoseconds, before it is "
          "no longer shown (0 to 18446744073709551615, which is for ever).",
          0, 18446744073709551615.0),
      property<&S::max_latency>(
          "max-latency",
          "How late meshes and frames may come, in nanoseconds (0 to 60 s), to be waited for in a "
          "live stream. The wait fits itself to what has come in the last ten seconds.",
          0, 60.0 * GST_SECOND),
  };
  return table;
}

RenderSettings render_settings(const CompositeSettings& settings) {
  RenderSettings out;
  out.shadow = settings.shadow;
  out.mirror = settings.mirror;
  out.reflection_alpha = static_cast<float>(settings.reflection_alpha);
  out.mirror_depth = settings.mirror_depth;
  out.alpha = settings.alpha;
  out.edge_samples = settings.edge_samples;
  out.soft_edges = settings.soft_edges;
  out.skip = settings.skip;
  return out;
}

ViewportLens lens_settings(const CompositeSettings& settings, const Announcement* announced) {
  ViewportLens lens;
  if (settings.depth_of_field != BlurRange::off) {
    lens.subject_only = settings.depth_of_field == BlurRange::subject;
    if (settings.aperture > 0.0)
      lens.aperture = 1e-3 * settings.aperture;
    else if (announced)
      lens.aperture = announced->aperture;
    if (settings.focus_distance > 0.0)
      lens.focus_distance = settings.focus_distance;
    else if (announced && announced->focus_distance > 0.0)
      lens.focus_distance = announced->focus_distance;
    // Trackers tell what they like; no lens is wider, or focuses nearer.
    lens.aperture = std::min(lens.aperture, 1.0);
    lens.focus_distance = std::clamp(lens.focus_distance, 1e-3, 1e6);
  }
  if (settings.motion_blur != BlurRange::off) {
    lens.still_background = settings.motion_blur == BlurRange::subject;
    lens.shutter = settings.shutter_angle / 360.0;
  }
  lens.falloff = {settings.falloff_a1, settings.falloff_a2, settings.falloff_a3};
  lens.grain = settings.grain;
  lens.grain_size = settings.grain_size;
  return lens;
}

std::span<const Property<PlacementSettings>> placement_properties() {
  using S = PlacementSettings;
  constexpr double far = 1e6;
  static const Property<S> table[] = {
      property<&S::translate_x>(
          "translate-x", "Moves the subject along the scene's x axis, in metres (-1e6 to 1e6).",
          -far, far),
      property<&S::translate_y>("translate-y", "Moves the subject up, in metres (-1e6 to 1e6).",
                                -far, far),
      property<&S::translate_z>(
          "translate-z", "Moves the subject along the scene's z axis, in metres (-1e6 to 1e6).",
          -far, far),
      property<&S::rotate_x>("rotate-x",
                             "Turns the subject about the x axis through its pivot, in degrees "
                             "(-1e6 to 1e6); x first, then y, then z.",
                             -far, far),
      property<&S::rotate_y>("rotate-y",
                             "Turns the subject about the vertical axis, in degrees (-1e6 to 1e6).",
                             -far, far),
      property<&S::rotate_z>(
          "rotate-z", "Turns the subject about the z axis, in degrees (-1e6 to 1e6).", -far, far),
      property<&S::scale>("scale",
                          "Size of the subject (0.001 to 1000), about its pivot; 1 is life-size.",
                          0.001, 1000),
      property<&S::pivot>("pivot",
                          "About which point the subject is turned and scaled. The default keeps "
                          "feet on the floor while it moves, and a turn turns its walk, too."),
      property<&S::pivot_x>("pivot-x",
                            "Of pivot=point, in the scene's metres (-1e6 to 1e6), where the "
                            "subject stands before it is placed.",
                            -far, far),
      property<&S::pivot_y>("pivot-y", "As pivot-x.", -far, far),
      property<&S::pivot_z>("pivot-z", "As pivot-x.", -far, far),
      property<&S::light>(
          "light",
          "The light that the subject is seen in. With shade it darkens in the scene's shadows and "
          "goes through pools of light: its colours are multiplied by the scene's light where each "
          "part of it is, relative to the light a metre above the scene's origin, past other "
          "subjects. With relit it is also shaded by the way each part faces that light and by "
          "what the body hides of it from itself."),
      property<&S::relight>("relight",
                            "How much of the shading that the scene's light gives the body's form "
                            "light=relit draws (0 to 1): 0 is as shade.",
                            0, 1),
      property<&S::match>(
          "match",
          "Set to true, sets exposure and the slopes once to what a white surface is in the "
          "scene's light where the subject stands, from the next frame on, and is false again."),
      property<&S::exposure>("exposure",
                             "By how many stops the subject is made brighter (-10 to 10), with its "
                             "mirror image and in linear light.",
                             -10, 10),
      property<&S::slope_red>("slope-red",
                              "Gain of the subject's red (0 to 16): white balance by one channel "
                              "against another. Slopes, offsets, powers and saturation are those "
                              "of the ASC Color Decision List, in linear light.",
                              0, 16),
      property<&S::slope_green>("slope-green", "As slope-red (0 to 16).", 0, 16),
      property<&S::slope_blue>("slope-blue", "As slope-red (0 to 16).", 0, 16),
      property<&S::offset_red>(
          "offset-red",
          "Lift of the subject's red: is added after the slope, as a share of white (-1 to 1).", -1,
          1),
      property<&S::offset_green>("offset-green", "As offset-red (-1 to 1).", -1, 1),
      property<&S::offset_blue>("offset-blue", "As offset-red (-1 to 1).", -1, 1),
      property<&S::power_red>("power-red",
                              "Power that the subject's red is raised to after the offset, the "
                              "inverse of a gamma (0.1 to 10): below 1 mid-tones become brighter.",
                              0.1, 10),
      property<&S::power_green>("power-green", "As power-red (0.1 to 10).", 0.1, 10),
      property<&S::power_blue>("power-blue", "As power-red (0.1 to 10).", 0.1, 10),
      property<&S::saturation>(
          "saturation", "How colourful the subject is (0 to 4): 0 is grey, 1 as it was.", 0, 4),
  };
  return table;
}

SubjectPlacement placement(const PlacementSettings& s) {
  return {{s.translate_x, s.translate_y, s.translate_z},
          {s.rotate_x, s.rotate_y, s.rotate_z},
          s.scale,
          s.pivot,
          {s.pivot_x, s.pivot_y, s.pivot_z}};
}

Grade grade(const PlacementSettings& s) {
  return {Vec3f(std::exp2(s.exposure) * Vec3(s.slope_red, s.slope_green, s.slope_blue)),
          Vec3f(Vec3(s.offset_red, s.offset_green, s.offset_blue)),
          Vec3f(Vec3(s.power_red, s.power_green, s.power_blue)), static_cast<float>(s.saturation)};
}

void set_white(PlacementSettings& settings, const Vec3f& white) {
  const double luma = glm::dot(luminance_weights<double>, Vec3(white));
  settings.exposure = std::clamp(std::log2(luma), -10.0, 10.0);
  const Vec3 slope = glm::clamp(Vec3(white) / luma, Vec3(0.0), Vec3(16.0));
  settings.slope_red = slope.x;
  settings.slope_green = slope.y;
  settings.slope_blue = slope.z;
}

}  // namespace polyhull::element
