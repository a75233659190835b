// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/tracksrc/properties.h"

#include "base/error.h"

namespace polyhull::element {

template <>
GType enum_type<TrackProtocol>() {
  return register_enum<TrackProtocol>(
      "PolyhullTrackProtocol",
      {{TrackProtocol::automatic, "By each packet's first byte", "auto"},
       {TrackProtocol::freed, "FreeD, packets D1", "freed"},
       {TrackProtocol::opentrackio, "OpenTrackIO, JSON or CBOR", "opentrackio"}});
}

template <>
GType enum_type<TrackTimes>() {
  return register_enum<TrackTimes>(
      "PolyhullTrackTimes",
      {{TrackTimes::arrival, "When its packet came", "arrival"},
       {TrackTimes::sender, "The sender's time, where it tells one, as if no packet had waited",
        "sender"},
       {TrackTimes::clock, "The sender's time, on the pipeline's clock, which is the sender's",
        "clock"}});
}

template <>
GType enum_type<FreeDChecksum>() {
  return register_enum<FreeDChecksum>(
      "PolyhullFreeDChecksum",
      {{FreeDChecksum::required, "It must be right", "required"},
       {FreeDChecksum::zero_is_none, "It must be right, or 0, as of senders that make none",
        "zero-is-none"},
       {FreeDChecksum::ignored, "Whatever it is", "ignored"}});
}

std::span<const Property<TrackInputSettings>> track_input_properties() {
  using S = TrackInputSettings;
  constexpr double far = 1e6;
  static const Property<S> table[] = {
      property<&S::protocol>("protocol", "The language of the packets."),
      property<&S::address>("address",
                            "IPv4 address to listen on: 0.0.0.0 for all of this machine's, one of "
                            "them, or a multicast group, which is joined (OpenTrackIO: 239.135.1.N "
                            "for source number N, 235.135.1.N by its version 1.0.0).",
                            0, 0, Change::when_ready),
      property<&S::port>("port",
                         "UDP port to listen on (0 to 65535); with 0 the system chooses a free "
                         "one, which stats tells.",
                         0, 65535, Change::when_ready),
      property<&S::multicast_iface>("multicast-iface",
                                    "Network interface on which a multicast group is joined, such "
                                    "as eth1. Empty: the system's choice.",
                                    0, 0, Change::when_ready),
      property<&S::location>("location",
                             "Path of a recorded track that is played instead of listening: of the "
                             "property record, tcpdump or Wireshark. Empty: listen.",
                             0, 0, Change::when_ready),
      property<&S::record>("record",
                           "Path of a file that all packets are written to with their times, "
                           "whatever they hold. What it held before is lost. Empty: none.",
                           0, 0, Change::when_ready),
      property<&S::source>(
          "source",
          "The only camera to follow: \"freed N\" for FreeD's camera N, or an OpenTrackIO source's "
          "identifier. Empty: the first that is heard, until it has been silent for a second."),
      property<&S::axes>(
          "axes",
          "Of FreeD: which of the packet's x, y and z (the height) are the tracker's x, y and z, "
          "each once; a minus in front turns one around, as in y-xz."),
      property<&S::invert_pan>("invert-pan", "Of FreeD: whether pan grows to the left."),
      property<&S::invert_tilt>("invert-tilt", "Of FreeD: whether tilt grows downwards."),
      property<&S::invert_roll>("invert-roll", "Of FreeD: whether roll grows counter-clockwise."),
      property<&S::offset_x>("offset-x", "Of FreeD: metres added to x, after axes (-1e6 to 1e6).",
                             -far, far),
      property<&S::offset_y>("offset-y", "Of FreeD: metres added to y, after axes (-1e6 to 1e6).",
                             -far, far),
      property<&S::offset_z>("offset-z",
                             "Of FreeD: metres added to z, the height, after axes (-1e6 to 1e6).",
                             -far, far),
      property<&S::offset_pan>("offset-pan",
                               "Of FreeD: degrees added to pan, after its inversion (-360 to 360).",
                               -360.0, 360.0),
      property<&S::offset_tilt>(
          "offset-tilt", "Of FreeD: degrees added to tilt, after its inversion (-360 to 360).",
          -360.0, 360.0),
      property<&S::offset_roll>(
          "offset-roll", "Of FreeD: degrees added to roll, after its inversion (-360 to 360).",
          -360.0, 360.0),
      property<&S::checksum>("checksum",
                             "Of FreeD: what the last byte of a packet must be for it to be used."),
      property<&S::zoom_is_focal_length>(
          "zoom-is-focal-length",
          "Of FreeD: whether zoom holds the focal length in hundredths of a millimetre and no "
          "encoder's value. The field of view then follows it, with sensor-width."),
      property<&S::lens_file>("lens-file",
                              "Path of a table that tells, for the encoders' values in packets, "
                              "what of the lens they do not: focal length or field of view, "
                              "distortion, focus distance, entrance pupil. Empty: none.",
                              0, 0, Change::when_ready),
      property<&S::sensor_width>(
          "sensor-width",
          "Width of the part of the sensor that the picture shows, in millimetres (0 to 1000), "
          "where packets do not tell. 0: unknown; the field of view is then the receiver's.",
          0.0, 1000.0),
      property<&S::times>("times",
                          "What says when a pose was true. Without a time of the sender's, as in "
                          "FreeD, it is always the arrival."),
      property<&S::delay>("delay",
                          "How long a pose has been true by its time, in nanoseconds (0 to 10 s): "
                          "when its packet arrives, or with times=clock, when the sender says.",
                          0, 10e9),
      property<&S::smoothing>("smoothing",
                              "Over which time poses are averaged, in nanoseconds (0 to 2 s). A "
                              "pose is given the time in the middle, so that motion is not late, "
                              "but comes later by half of it: latency and stats have that in them.",
                              0, static_cast<double>(Track::memory_ns)),
      property<&S::prediction>(
          "prediction",
          "How far motion goes on after the last pose for a frame that is later, in nanoseconds (0 "
          "to 1 s). 0: the camera stands where it was last seen.",
          0, 1e9),
  };
  return table;
}

namespace {

/// Sets order and signs from text such as "y-xz".
void set_axes(FreeDSettings& freed, const std::string& text) {
  std::size_t at = 0;
  bool named[3] = {};
  for (int i = 0; i < 3; ++i) {
    const bool minus = at < text.size() && text[at] == '-';
    at += minus;
    const int axis = at < text.size() ? text[at++] - 'x' : -1;
    if (axis < 0 || axis > 2) break;
    freed.axis[static_cast<std::size_t>(i)] = axis;
    freed.sign[i] = minus ? -1.0 : 1.0;
    named[axis] = true;
    if (i == 2 && at == text.size() && named[0] && named[1] && named[2]) return;
  }
  throw Error(Error::Kind::bad_input,
              "axes={} does not name each of x, y and z once, as xyz or y-xz do.", text);
}

}  // namespace

PoseReaderSettings reader_settings(const TrackInputSettings& s) {
  PoseReaderSettings out;
  out.protocol = s.protocol;
  set_axes(out.freed, s.axes);
  out.freed.turn_sign = {s.invert_pan ? -1.0 : 1.0, s.invert_tilt ? -1.0 : 1.0,
                         s.invert_roll ? -1.0 : 1.0};
  out.freed.offset = {s.offset_x, s.offset_y, s.offset_z};
  out.freed.turn_offset = {s.offset_pan, s.offset_tilt, s.offset_roll};
  out.freed.checksum = s.checksum;
  out.freed.zoom_is_focal_length = s.zoom_is_focal_length;
  out.sensor_width_mm = s.sensor_width;
  return out;
}

TrackSettings track_settings(const TrackInputSettings& s) {
  TrackSettings out;
  out.times = s.times;
  out.delay_ns = static_cast<std::int64_t>(s.delay);
  out.smoothing_ns = static_cast<std::int64_t>(s.smoothing);
  return out;
}

}  // namespace polyhull::element
