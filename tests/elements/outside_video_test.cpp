// SPDX-License-Identifier: LGPL-2.1-or-later
// An outside renderer's live video over SRT and RTP, its messages over UDP: trackstamp finds each frame's
// own, by the timecode and by the time that come through coder, network and decoder with it.
#include <gio/gio.h>
#include <gst/video/video.h>

#include <nlohmann/json.hpp>
#include <set>

#include "camera_announced.h"
#include "element_test.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

constexpr int numbers = 40;  // frames are told from each other modulo this

/// A UDP port that nobody has now.
int free_port() {
  g_autoptr(GSocket) socket =
      g_socket_new(G_SOCKET_FAMILY_IPV4, G_SOCKET_TYPE_DATAGRAM, G_SOCKET_PROTOCOL_UDP, nullptr);
  g_autoptr(GInetAddress) here = g_inet_address_new_loopback(G_SOCKET_FAMILY_IPV4);
  g_autoptr(GSocketAddress) any = g_inet_socket_address_new(here, 0);
  fail_unless(g_socket_bind(socket, any, FALSE, nullptr));
  g_autoptr(GSocketAddress) bound = g_socket_get_local_address(socket, nullptr);
  return g_inet_socket_address_get_port(G_INET_SOCKET_ADDRESS(bound));
}

/// The outside renderer: a grey of its own for each frame, and a message with its camera.
class Renderer {
 public:
  /// \p way: what the frames go through; \p messages: the UDP port where the messages are heard.
  Renderer(const std::string& way, int messages) {
    pipeline_ = parse(
        "videotestsrc is-live=true ! video/x-raw,format=I420,width=64,height=48,framerate=25/1 ! "
        "timecodestamper ! identity name=painter ! queue ! x264enc tune=zerolatency key-int-max=1 "
        "quantizer=10 pass=quant option-string=pic-struct=1 ! "
        "h264parse update-timecode=true ! " +
        way);
    to_ =
        g_socket_new(G_SOCKET_FAMILY_IPV4, G_SOCKET_TYPE_DATAGRAM, G_SOCKET_PROTOCOL_UDP, nullptr);
    GInetAddress* here = g_inet_address_new_loopback(G_SOCKET_FAMILY_IPV4);
    address_ = g_inet_socket_address_new(here, static_cast<guint16>(messages));
    g_object_unref(here);
    GstElement* painter = named(pipeline_, "painter");
    GstPad* pad = gst_element_get_static_pad(painter, "src");
    gst_pad_add_probe(pad, GST_PAD_PROBE_TYPE_BUFFER, paint, this, nullptr);
    gst_object_unref(pad);
    fail_if(gst_element_set_state(pipeline_, GST_STATE_PLAYING) == GST_STATE_CHANGE_FAILURE);
  }
  ~Renderer() {
    stop(pipeline_);
    g_object_unref(address_);
    g_object_unref(to_);
  }
  Renderer(const Renderer&) = delete;

 private:
  static GstPadProbeReturn paint(GstPad* pad, GstPadProbeInfo* info, gpointer data) {
    auto& self = *static_cast<Renderer*>(data);
    GstBuffer* buffer = gst_buffer_make_writable(GST_PAD_PROBE_INFO_BUFFER(info));
    GST_PAD_PROBE_INFO_DATA(info) = buffer;
    const int number = self.painted_++ % numbers;
    gst_buffer_memset(buffer, 0, static_cast<guint8>(40 + 4 * number), 64 * 48);
    g_autoptr(GstElement) painter = gst_pad_get_parent_element(pad);
    self.tell(painter, buffer, number);
    return GST_PAD_PROBE_OK;
  }
  void tell(GstElement* painter, GstBuffer* buffer, int number) {
    Announcement announcement;
    announcement.viewport = look_at({0, 1, 1.0 + number}, {0, 1, 0}, 40, 64, 48);
    auto said = nlohmann::json::parse(announcement_to_json(announcement));
    const GstVideoTimeCodeMeta* meta = gst_buffer_get_video_time_code_meta(buffer);
    fail_unless(meta != nullptr);
    g_autofree gchar* code = gst_video_time_code_to_string(&meta->tc);
    said["timecode"] = code;
    said["timecode_rate"] = {25, 1};
    g_autoptr(GstClock) clock = gst_element_get_clock(painter);
    const GstClockTimeDiff ago = GST_CLOCK_DIFF(
        gst_element_get_base_time(painter) + GST_BUFFER_PTS(buffer), gst_clock_get_time(clock));
    said["unix_time_ns"] = g_get_real_time() * 1000 - ago;
    const std::string line = said.dump() + "\n";
    g_socket_send_to(to_, address_, line.data(), line.size(), nullptr, nullptr);
  }

  GstElement* pipeline_;
  GSocket* to_;
  GSocketAddress* address_;
  int painted_ = 0;
};

/// Takes 60 frames that have a message; each must have its own.
void expect_own_messages(const std::string& video, const char* match, int messages) {
  GstElement* pipeline = parse(
      "udpsrc address=127.0.0.1 port=" + std::to_string(messages) + " ! plate.scene " + video +
      " ! avdec_h264 ! trackstamp name=plate scene-wait=3000000000 scene-match=" + match +
      " ! fakesink sync=false");
  GstElement* plate = named(pipeline, "plate");
  CameraLog log;
  log_cameras(plate, log);
  fail_if(gst_element_set_state(pipeline, GST_STATE_PLAYING) == GST_STATE_CHANGE_FAILURE);
  wait_for_statistic(plate, "frames-announced", 64);
  fail_unless_equals_int(gst_element_set_state(pipeline, GST_STATE_NULL), GST_STATE_CHANGE_SUCCESS);
  int announced = 0, alone = 0;
  std::set<int> seen;
  for (const Shown& frame : log.frames) {
    if (frame.camera.width == 0) {
      ++alone;  // before the first message, or the clock's first report
      fail_unless_equals_int(announced, 0);
      continue;
    }
    const int painted = static_cast<int>(std::lround((frame.bytes[24 * 64 + 32] - 40) / 4.0));
    const int told = static_cast<int>(std::lround(frame.camera.centre().z)) - 1;
    fail_unless(painted == told, "frame %d has the message of %d", painted, told);
    seen.insert(painted);
    ++announced;
  }
  fail_unless(announced >= 60 && seen.size() > 30, "%d announced, %d not", announced, alone);
  gst_object_unref(pipeline);
}

}  // namespace

ELEMENT_TEST(test_srt_by_timecode) {
  const int port = free_port(), messages = free_port();
  const std::string place = "uri=srt://127.0.0.1:" + std::to_string(port) + "?mode=";
  const Renderer renderer(
      "mpegtsmux alignment=7 ! srtsink wait-for-connection=false " + place + "listener", messages);
  expect_own_messages("srtsrc " + place + "caller ! tsdemux ! h264parse", "timecode", messages);
}

ELEMENT_TEST(test_rtp_by_clock) {
  const int port = free_port(), reports = free_port(), messages = free_port();
  const Renderer renderer(
      "rtph264pay config-interval=-1 ! out.send_rtp_sink_0 "
      "rtpbin name=out rtcp-sync-send-time=false out.send_rtp_src_0 ! "
      "udpsink host=127.0.0.1 port=" +
          std::to_string(port) +
          " out.send_rtcp_src_0 ! udpsink host=127.0.0.1 sync=false async=false port=" +
          std::to_string(reports),
      messages);
  expect_own_messages(
      "udpsrc address=127.0.0.1 port=" + std::to_string(port) +
          " caps=application/x-rtp,media=video,encoding-name=H264,payload=96,clock-rate=90000 ! "
          "in.recv_rtp_sink_0 udpsrc address=127.0.0.1 port=" +
          std::to_string(reports) +
          " ! in.recv_rtcp_sink_0 rtpbin name=in latency=100 add-reference-timestamp-meta=true "
          "in. ! rtph264depay ! h264parse",
      "clock", messages);
}
