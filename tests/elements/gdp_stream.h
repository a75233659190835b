// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Views of one camera, as they are and as gdppay packs them.
#pragma once

#include <gst/app/gstappsink.h>

#include <cstring>
#include <string>
#include <vector>

#include "element_checks.h"
#include "views.h"
#include "wire/packet.h"

namespace polyhull::test {

using Packet = std::vector<std::uint8_t>;

struct GdpStream {
  std::vector<Packet> payloads;     ///< of the frames
  std::vector<Packet> packets;      ///< with the frames' packets and all others
  std::vector<std::size_t> frames;  ///< which packets are the frames'

  /// The bytes of the packets [first, last) one after the other.
  Packet bytes(std::size_t first, std::size_t last) const {
    Packet all;
    for (std::size_t i = first; i < last; ++i)
      all.insert(all.end(), packets[i].begin(), packets[i].end());
    return all;
  }
  Packet bytes() const { return bytes(0, packets.size()); }
  /// Everything before the first frame.
  Packet head() const { return bytes(0, frames.front()); }
};

inline std::vector<Packet> pull_all(GstElement* pipeline, const char* name) {
  GstElement* sink = gst_bin_get_by_name(GST_BIN(pipeline), name);
  std::vector<Packet> all;
  while (GstSample* sample = gst_app_sink_pull_sample(GST_APP_SINK(sink))) {
    all.push_back(bytes_of(gst_sample_get_buffer(sample)));
    gst_sample_unref(sample);
  }
  gst_object_unref(sink);
  return all;
}

/// \p count frames of the chain \p source. \p payer: gdppay's properties.
inline GdpStream record_stream(const std::string& source, const std::string& payer = "") {
  GstElement* pipeline = parse(source +
                               " ! tee name=t t. ! queue max-size-buffers=0 max-size-bytes=0 "
                               "max-size-time=0 ! appsink name=views sync=false t. ! queue "
                               "max-size-buffers=0 max-size-bytes=0 max-size-time=0 ! gdppay " +
                               payer + " ! appsink name=packets sync=false");
  // Without a clock no view says when it came: those stamped once it runs would be older, for a live
  // pipeline that starts later, than the others.
  gst_pipeline_use_clock(GST_PIPELINE(pipeline), nullptr);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  GdpStream stream;
  stream.payloads = pull_all(pipeline, "views");
  Packet all;
  for (const Packet& part : pull_all(pipeline, "packets"))
    all.insert(all.end(), part.begin(), part.end());
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(pipeline);
  for (std::size_t at = 0; at < all.size();) {
    const PacketHeader header = read_packet_header(Bytes(all).subspan(at));
    if (header.kind == PacketKind::buffer) stream.frames.push_back(stream.packets.size());
    const std::size_t end = at + packet_header_size + header.size;
    fail_unless(end <= all.size(), "gdppay's stream is cut");
    stream.packets.emplace_back(all.begin() + static_cast<std::ptrdiff_t>(at),
                                all.begin() + static_cast<std::ptrdiff_t>(end));
    at = end;
  }
  fail_if(stream.frames.empty(), "no frame came of %s", source.c_str());
  fail_unless_equals_uint64(stream.frames.size(), stream.payloads.size());
  return stream;
}

}  // namespace polyhull::test
