// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Views of one camera, as they are and as gdppay packs them.
#pragma once

#include <gst/app/gstappsink.h>
#include <sys/wait.h>
#include <unistd.h>

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
  g_autoptr(GstElement) sink = gst_bin_get_by_name(GST_BIN(pipeline), name);
  std::vector<Packet> all;
  while (GstSample* sample = gst_app_sink_pull_sample(GST_APP_SINK(sink))) {
    all.push_back(bytes_of(gst_sample_get_buffer(sample)));
    gst_sample_unref(sample);
  }
  return all;
}

/// What gdppay, with \p payer as its properties, makes of the chain \p source, and with \p payloads
/// the frames before it.
inline Packet packed_by_gdppay(const std::string& source, const std::string& payer,
                               std::vector<Packet>* payloads = nullptr) {
  // Outside of checks, too: no fail_unless().
  GError* error = nullptr;
  GstElement* pipeline =
      gst_parse_launch((source +
                        " ! tee name=t t. ! queue max-size-buffers=0 max-size-bytes=0 "
                        "max-size-time=0 ! appsink name=views sync=false t. ! queue "
                        "max-size-buffers=0 max-size-bytes=0 max-size-time=0 ! gdppay " +
                        payer + " ! appsink name=packets sync=false")
                           .c_str(),
                       &error);
  g_assert_no_error(error);
  // Without a clock no view says when it came: those stamped once it runs would be older, for a live
  // pipeline that starts later, than the others.
  gst_pipeline_use_clock(GST_PIPELINE(pipeline), nullptr);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  const std::vector<Packet> frames = pull_all(pipeline, "views");
  if (payloads != nullptr) *payloads = frames;
  Packet all;
  for (const Packet& part : pull_all(pipeline, "packets"))
    all.insert(all.end(), part.begin(), part.end());
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(pipeline);
  return all;
}

/// The stream whose bytes are \p all.
inline GdpStream stream_of(const Packet& all) {
  GdpStream stream;
  for (std::size_t at = 0; at < all.size();) {
    const Bytes rest = Bytes(all).subspan(at);
    const PacketHeader header = read_packet_header(rest);
    const std::size_t size = packet_header_size + header.size;
    g_assert(size <= rest.size());
    if (header.kind == PacketKind::buffer) {
      stream.frames.push_back(stream.packets.size());
      const Bytes payload = rest.subspan(packet_header_size, header.size);
      stream.payloads.emplace_back(payload.begin(), payload.end());
    }
    stream.packets.emplace_back(rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(size));
    at += size;
  }
  return stream;
}

/// The frames of the chain \p source. \p payer: gdppay's properties.
inline GdpStream record_stream(const std::string& source, const std::string& payer = "") {
  std::vector<Packet> payloads;
  const GdpStream stream = stream_of(packed_by_gdppay(source, payer, &payloads));
  fail_if(stream.frames.empty(), "no frame came of %s", source.c_str());
  fail_unless(stream.payloads == payloads);
  return stream;
}

/// The same for before_cases(), by a process of its own: this one, which cases are forked from (but for
/// CK_FORK=no), must have no thread of a pipeline before them.
inline GdpStream record_before_checks(const std::string& source) {
  int pipe_ends[2];
  g_assert(pipe(pipe_ends) == 0);
  const pid_t recorder = fork();
  g_assert(recorder >= 0);
  if (recorder == 0) {
    const Packet all = packed_by_gdppay(source, "");
    for (std::size_t at = 0; at < all.size();) {
      const ssize_t count = write(pipe_ends[1], all.data() + at, all.size() - at);
      if (count <= 0) _exit(1);
      at += static_cast<std::size_t>(count);
    }
    _exit(0);
  }
  close(pipe_ends[1]);
  Packet all;
  std::uint8_t bytes[65536];
  for (ssize_t count; (count = read(pipe_ends[0], bytes, sizeof bytes)) > 0;)
    all.insert(all.end(), bytes, bytes + count);
  close(pipe_ends[0]);
  int status = 0;
  g_assert(waitpid(recorder, &status, 0) == recorder && WIFEXITED(status) &&
           WEXITSTATUS(status) == 0);
  GdpStream stream = stream_of(all);
  g_assert(!stream.frames.empty());
  return stream;
}

}  // namespace polyhull::test
