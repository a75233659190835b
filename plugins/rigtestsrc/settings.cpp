// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/rigtestsrc/settings.h"

#include "studio/cameras/sensor_noise.h"

namespace polyhull::element {

template <>
GType enum_type<ScreenColour>() {
  return register_enum<ScreenColour>("PolyhullScreenColour",
                                     {{ScreenColour::green, "Green screen", "green"},
                                      {ScreenColour::blue, "Blue screen", "blue"}});
}

template <>
GType enum_type<RigOutput>() {
  return register_enum<RigOutput>(
      "PolyhullRigOutput",
      {{RigOutput::picture, "The camera's picture", "picture"},
       {RigOutput::keyed, "The picture with the true matte in alpha (RGBA, BGRA)", "keyed"},
       {RigOutput::matte, "The true matte: the share of a pixel that the subject covers (GRAY8)",
        "matte"},
       {RigOutput::depth, "The true depth at the pixel's centre (GRAY16_LE)", "depth"}});
}

template <>
GType enum_type<PictureQuality>() {
  return register_enum<PictureQuality>(
      "PolyhullPictureQuality",
      {{PictureQuality::fast, "Coarser where pixels are large, samples only at outlines", "fast"},
       {PictureQuality::exact, "Samples in all pixels", "exact"}});
}

namespace {

using S = RigTestSettings;
constexpr Property<RigTestSettings> properties[] = {
    property<&S::rig>("rig",
                      "Path of the rig file whose camera this is. Empty: the built-in rig, four "
                      "cameras cam0 to cam3 of 1024x768 around a stage of 4 m.",
                      0, 0, Change::when_ready),
    property<&S::camera>("camera", "Name of the camera in the rig. Empty: the rig's first camera.",
                         0, 0, Change::when_ready),
    property<&S::subject>(
        "subject",
        "What stands on the stage: \"figure\", the built-in walking person, \"hairy\", the same "
        "with a coat of hair thinner than pixels, or the path of an OBJ file with a closed surface "
        "(y up, metres), which turns once in ten seconds.",
        0, 0, Change::when_ready),
    property<&S::subject_height>("subject-height",
                                 "Height in metres to which a subject from a file is scaled, 0 to "
                                 "100. 0: its coordinates are taken as metres.",
                                 0.0, 100.0, Change::when_ready),
    property<&S::screen>("screen", "Colour of the screen behind the subject and of the floor."),
    property<&S::unevenness>("unevenness",
                             "Smooth change of the screen's brightness over the picture, as a "
                             "share of it, 0 to 0.9. 0: the screen has one colour.",
                             0.0, 0.9),
    property<&S::shadow>(
        "shadow",
        "Darkness of the subject's soft shadow on the floor, 0 (none) to 1 (black at the feet).",
        0.0, 1.0),
    property<&S::spill>(
        "spill",
        "Light of the screen's colour on the subject, most at its outline and below, 0 (none) to 1 "
        "(strong). With spill a point no longer has one colour for all cameras.",
        0.0, 1.0),
    property<&S::noise>("noise",
                        "Standard deviation of the sensor's Gaussian noise in 8-bit levels, 0 to "
                        "30. The same for the same seed, camera and frame number.",
                        0.0, largest_noise),
    property<&S::seed>("seed", "Chooses the noise, 0 to 4294967295.", 0, 4294967295.0),
    property<&S::linear_light>(
        "linear-light",
        "Mix subject and screen at the outline as light, as a lens does, instead of as picture "
        "values. A key that is linear in picture values is then slightly off."),
    property<&S::speed>(
        "speed",
        "Seconds of the subject's motion per second of stream time, -100 to 100. 0: it stands "
        "still. The built-in figure repeats its motion after ten seconds.",
        -100.0, 100.0),
    property<&S::start>("start", "Second of the motion that the stream starts with, 0 to 1000000.",
                        0.0, 1e6),
    property<&S::output>("output", "What the buffers hold: the picture or the truth about it.", 0,
                         0, Change::when_ready),
    property<&S::quality>(
        "quality",
        "How the subject's colours are found: at one point of each pixel that no outline touches, "
        "or from samples everywhere, which takes twice as long. Coverage and depth are the same.",
        0, 0, Change::when_ready),
    property<&S::depth_scale>("depth-scale",
                              "Metres per level of output=depth, 0.000001 to 1. Level 0 is where "
                              "the subject is not; depths beyond 65535 levels become 65535.",
                              1e-6, 1.0),
    property<&S::mesh_location>(
        "mesh-location",
        "File to which the subject's true surface is written for each frame, in the rig's world "
        "coordinates, with the colours that its points send out: .ply or .obj, with one %d (or "
        "%05d) for the frame number. Empty: none.",
        0, 0, Change::when_ready),
    property<&S::stamp>("stamp",
                        "Draw the frame number into the picture, as a label on the subject's chest "
                        "that programs can read, so that tests see which instant a picture shows."),
    property<&S::live>(
        "is-live",
        "Deliver frames at their time, as a camera does, and skip frames when late, instead of as "
        "fast as possible. Frame n has the time n / framerate, whenever the source was started.",
        0, 0, Change::when_ready),
    property<&S::delay>(
        "delay",
        "How much later than its time stamp says a live frame is sent, as cameras need for "
        "exposure and transfer, in nanoseconds (0 to 10 s). Reported as latency.",
        0, 10.0 * GST_SECOND),
    property<&S::jitter>(
        "jitter",
        "How much the delay varies from frame to frame, to both sides, in nanoseconds (0 to 1 s); "
        "the same for the same seed, camera and frame number.",
        0, 1.0 * GST_SECOND),
};

}  // namespace

std::span<const Property<RigTestSettings>> rig_test_properties() {
  return properties;
}

}  // namespace polyhull::element
