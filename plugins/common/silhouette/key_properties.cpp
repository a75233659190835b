// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/silhouette/key_properties.h"

#include <array>

#include "base/error.h"

namespace polyhull::element {

template <>
GType enum_type<KeyMethod>() {
  return register_enum<KeyMethod>(
      "PolyhullKeyMethod",
      {{KeyMethod::threshold,
        "Background where the key channel exceeds the larger of the other two by strength, unless "
        "the pixel is brighter than bright-threshold",
        "prototype"},
       {KeyMethod::soft,
        "Matte linear in the mixture of screen and foreground, calibrated by a sample of each",
        "soft"},
       {KeyMethod::difference,
        "Distance from the clean plate, tolerant of soft shadows; needs no screen", "difference"}});
}

template <>
GType enum_type<KeyColour>() {
  return register_enum<KeyColour>(
      "PolyhullKeyColour",
      {{KeyColour::green, "Green screen", "green"},
       {KeyColour::blue, "Blue screen", "blue"},
       {KeyColour::custom, "The colour given by key-colour", "colour"},
       {KeyColour::automatic, "The screen's colour is found in the picture", "auto"}});
}

template <>
GType enum_type<KeyView>() {
  return register_enum<KeyView>(
      "PolyhullKeyView",
      {{KeyView::composite, "The despilled picture with the matte as its alpha", "composite"},
       {KeyView::matte, "The matte as an opaque grey picture", "matte"},
       {KeyView::status, "Background black, foreground white, everything in between coloured",
        "status"},
       {KeyView::spill, "What the removal of spill takes away, opaque", "spill"},
       {KeyView::split,
        "Four opaque pictures of half the size: above the frame, with the colours found for screen "
        "and foreground, and the matte; below status, and the composite on grey",
        "split"}});
}

namespace {

using S = KeyValues;
constexpr std::array table{
    property<&S::method>("method", "How the matte is made."),
    property<&S::key>(
        "key",
        "Which colour the screen has: green or blue, for which any shade is found in the picture; "
        "auto for yellow, red and every other hue; or colour, for the one in key-colour."),
    property<&S::key_colour>("key-colour",
                             "Colour of the screen as 0xRRGGBB, used with key=colour. Brightness "
                             "does not matter, except that a colour without hue, such as black, is "
                             "keyed by its distance as method=difference does.",
                             0, 0xffffff),
    property<&S::strength>(
        "strength",
        "Margin in levels from 0 to 255 by which the key channel must exceed the larger of the "
        "other two for a pixel to be background. Used by method=prototype only.",
        0, 255),
    property<&S::bright_threshold>(
        "bright-threshold",
        "Pixels whose red, green and blue add up to more than this, from 0 to 765 levels, are "
        "foreground. Used by method=prototype only.",
        0, 765),
    property<&S::red_gain>(
        "red-gain",
        "Factor from 0 to 4 on red, applied to the keying decision only and not to the picture.",
        0.0, 4.0),
    property<&S::blue_gain>(
        "blue-gain",
        "Factor from 0 to 4 on blue, applied to the keying decision only and not to the picture.",
        0.0, 4.0),
    property<&S::roi_x>("roi-x",
                        "First column in pixels of the region of interest, from 0 to 32767. "
                        "Outside of the region everything is background.",
                        0, 32767),
    property<&S::roi_y>("roi-y", "First row in pixels of the region of interest, from 0 to 32767.",
                        0, 32767),
    property<&S::roi_width>("roi-width",
                            "Columns in pixels of the region of interest, from 0 to 32767. 0 "
                            "reaches to the right edge of the frame.",
                            0, 32767),
    property<&S::roi_height>("roi-height",
                             "Rows in pixels of the region of interest, from 0 to 32767. 0 reaches "
                             "to the lower edge of the frame.",
                             0, 32767),
    property<&S::screen_colour>("screen-colour",
                                "Colour of the screen as the camera sees it, 0xRRGGBB, for "
                                "method=soft. -1 samples it from the picture.",
                                -1, 0xffffff),
    property<&S::foreground_colour>("foreground-colour",
                                    "Colour of the subject near its edge, 0xRRGGBB, for "
                                    "method=soft. -1 samples it from the picture.",
                                    -1, 0xffffff),
    property<&S::resample>("resample",
                           "Frames, from 0 to 100000, after which screen and foreground are "
                           "sampled from the picture again, for cameras and lamps that change. 0 "
                           "samples once, when the stream starts or a setting changes.",
                           0, 100000),
    property<&S::clip_black>("clip-black",
                             "Matte values below this fraction, from 0 to 1, become background; "
                             "the values between clip-black and clip-white are stretched.",
                             0.0, 1.0),
    property<&S::clip_white>("clip-white",
                             "Matte values above this fraction, from 0 to 1, become foreground. It "
                             "must be larger than clip-black.",
                             0.0, 1.0),
    property<&S::choke>("choke",
                        "Pixels, from -32 to 32, by which the matte is shaved off along its "
                        "outline, for example to lose a coloured rim. Negative values grow it.",
                        -32.0, 32.0),
    property<&S::close>(
        "close",
        "Pixels, from 0 to 32: gaps and holes in the matte up to twice this width are closed; with "
        "method=difference what shows a coloured background there takes the colours around.",
        0.0, 32.0),
    property<&S::spill>(
        "spill",
        "Fraction from 0 to 1 of the key colour's spill that is taken out of the kept pixels: all "
        "of it at the matte's edges; where the matte is solid only a tenth of the screen's hue, "
        "for what has more is of that colour itself.",
        0.0, 1.0),
    property<&S::clean_plate>("clean-plate",
                              "Path of a picture (PNG or JPEG, the frame's size) of the stage "
                              "without the subject. Used by method=difference, and by method=soft "
                              "for the screen's colour at each pixel. Empty uses none."),
    property<&S::learn_plate>(
        "learn-plate",
        "Setting this to a number of frames, from 1 to 1000, averages the next frames into the "
        "clean plate; the stage must be empty meanwhile. 0 learns nothing and keeps what there is.",
        0, 1000),
    property<&S::difference_low>("difference-low",
                                 "Distance in levels, from 0 to 442, from the clean plate up to "
                                 "which a pixel is background. Used by method=difference only.",
                                 0.0, 442.0),
    property<&S::difference_high>(
        "difference-high",
        "Distance in levels, from 0 to 442, from the clean plate from which on a pixel is "
        "foreground. It must be larger than difference-low. Used by method=difference only.",
        0.0, 442.0),
    property<&S::shadow_darkest>(
        "shadow-darkest",
        "Fraction from 0 to 1 of its light that a background pixel keeps at least in the subject's "
        "shadow; 1 tolerates no shadow. Used by method=difference only.",
        0.0, 1.0),
    property<&S::light_brightest>(
        "light-brightest",
        "Factor from 1 to 4 up to which a background pixel may become brighter than the clean "
        "plate, for example by reflected light. Used by method=difference only.",
        1.0, 4.0),
    property<&S::outside_mask>("outside-mask",
                               "Path of a grey picture of the frame's size: where it is not black, "
                               "the matte is background. Empty uses none."),
    property<&S::inside_mask>("inside-mask",
                              "Path of a grey picture of the frame's size: where it is not black, "
                              "the matte is foreground. Empty uses none."),
    property<&S::outside_polygon>(
        "outside-polygon",
        "Corners as \"x,y x,y x,y\" in pixels, several polygons separated by semicolons: outside "
        "of them the matte is background. Empty uses none."),
    property<&S::inside_polygon>(
        "inside-polygon",
        "Corners as \"x,y x,y x,y\" in pixels, several polygons separated by semicolons: inside of "
        "them the matte is foreground. Empty uses none."),
    property<&S::rig>("rig",
                      "Path of a rig file with bounds: outside of the bounds, seen by the camera "
                      "that the property camera names, the matte is background. Empty uses none."),
};

}  // namespace

std::span<const Property<KeyValues>> key_properties() {
  return table;
}

std::span<const Property<KeyViewValues>> key_view_properties() {
  static constexpr std::array table{
      property<&KeyViewValues::view>("view",
                                     "What the output shows; everything but composite is for an "
                                     "operator who adjusts the key."),
  };
  return table;
}

void configure_key(KeyConfiguration& configuration, GstElement* element, Statistics& statistics,
                   const KeyValues& values, const std::string& camera, int width, int height,
                   const std::function<void(const KeySettings&)>& accept) {
  try {
    configuration.apply(values, camera, width, height, accept);
  } catch (const Error& error) {
    if (!configuration.has_settings(width, height)) throw;
    statistics.warn(element, "refused-settings",
                    std::string(error.what()) + " Keying goes on with the settings of before.");
  }
}

void declare_key_statistics(Statistics& statistics) {
  statistics.declare({"frames", "refused-settings", "frames-without-screen", "frames-without-plate",
                      "screen-colour", "foreground-colour", "plate-frames-left"});
  statistics.set("screen-signal", 0.0);
  statistics.set("foreground-signal", 0.0);
}

void report_calibration(const KeyCalibration& calibration, GstElement* element,
                        Statistics& statistics) {
  if (calibration.lacks == KeyLack::screen) {
    statistics.warn(element, "frames-without-screen",
                    "No screen of the key's colour was found in the picture, so all of it counts "
                    "as foreground until one is seen; set key to the screen's colour (or to auto), "
                    "or give its colour as screen-colour.");
  } else if (calibration.lacks == KeyLack::plate) {
    statistics.warn(
        element, "frames-without-plate",
        "The difference method has no clean plate to compare with and takes pure green or blue for "
        "the background; set clean-plate to a picture of the empty stage or learn-plate to a "
        "number of frames, or set key=colour with key-colour for a background of one colour.");
  }
  const auto packed = [](const Rgb& c) {
    return static_cast<std::uint64_t>(c[0]) << 16 | static_cast<std::uint64_t>(c[1]) << 8 | c[2];
  };
  statistics.set_count("screen-colour", packed(calibration.screen));
  statistics.set_count("foreground-colour", packed(calibration.foreground));
  statistics.set("screen-signal", calibration.screen_signal);
  statistics.set("foreground-signal", calibration.foreground_signal);
  statistics.set_count("plate-frames-left",
                       static_cast<std::uint64_t>(calibration.plate_frames_left));
}

void report_score(const KeyScore& score, Statistics& statistics) {
  statistics.set("score", score.score());
  statistics.set("subject-percent", 100.0 * score.subject);
  statistics.set("doubtful-subject-percent", 100.0 * score.doubtful_subject);
  statistics.set("doubtful-screen-percent", 100.0 * score.doubtful_screen);
}

}  // namespace polyhull::element
