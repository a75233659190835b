// SPDX-License-Identifier: LGPL-2.1-or-later
// Videos as pictures for polyhull-calibrate: which frame has which number, and which side is up.
#include "calibrate/videos.h"

#include <fmt/format.h>
#include <gst/gst.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

#include "base/picture.h"
#include "support/folder.h"

namespace polyhull::calibrate_tool {
namespace {

namespace fs = std::filesystem;

// Forty frames at 10 a second, each of which tells its number by the upper half; the lower one is black.
void write_pictures(const fs::path& folder) {
  fs::create_directories(folder);
  for (int n = 0; n < 40; ++n) {
    Picture picture{64, 48, 1, std::vector<std::uint8_t>(64 * 48, 16)};
    std::fill_n(picture.pixels.begin(), 64 * 24, static_cast<std::uint8_t>(40 + 5 * n));
    save_picture(picture, (folder / fmt::format("{:02}.png", n)).string());
  }
}

// Which frame a picture of such a video shows.
double shown_in(const fs::path& file) {
  return (load_picture(file.string(), 1).row(8)[32] - 40.0) / 5.0;
}

// Writes pictures at 10 frames a second as a video, but for those of the numbers \p without.
void write_video(const std::string& pictures, const std::string& muxer, const fs::path& to,
                 std::set<long> without) {
  gst_init(nullptr, nullptr);
  struct Gaps {
    std::set<long> numbers;
    long next = 0;
  } gaps{std::move(without)};
  GstElement* pipeline = gst_parse_launch(
      fmt::format("multifilesrc location={}/%02d.png stop-index=39 caps=image/png,framerate=10/1 ! "
                  "pngdec ! jpegenc quality=95 ! identity name=last ! {} ! filesink location={}",
                  pictures, muxer, to.string())
          .c_str(),
      nullptr);
  ASSERT_NE(pipeline, nullptr);
  GstElement* last = gst_bin_get_by_name(GST_BIN(pipeline), "last");
  GstPad* pad = gst_element_get_static_pad(last, "src");
  gst_pad_add_probe(
      pad, GST_PAD_PROBE_TYPE_BUFFER,
      [](GstPad*, GstPadProbeInfo*, gpointer data) {
        auto* g = static_cast<Gaps*>(data);
        return g->numbers.contains(g->next++) ? GST_PAD_PROBE_DROP : GST_PAD_PROBE_OK;
      },
      &gaps, nullptr);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  GstBus* bus = gst_element_get_bus(pipeline);
  GstMessage* end = gst_bus_timed_pop_filtered(
      bus, 30 * GST_SECOND, static_cast<GstMessageType>(GST_MESSAGE_EOS | GST_MESSAGE_ERROR));
  EXPECT_TRUE(end != nullptr && GST_MESSAGE_TYPE(end) == GST_MESSAGE_EOS);
  if (end) gst_message_unref(end);
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(bus);
  gst_object_unref(pad);
  gst_object_unref(last);
  gst_object_unref(pipeline);
}

// Gives a QuickTime file half a turn, as a phone held upside down does: its first track's matrix.
void turn_video(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  const std::size_t at = bytes.find("tkhd") - 4 + 48;
  for (const std::size_t entry : {0, 16}) bytes.replace(at + entry, 4, "\xff\xff\x00\x00", 4);
  std::ofstream(path, std::ios::binary) << bytes;
}

}  // namespace

TEST(CalibrateVideos, CountByTimeAndStayUnturned) {
  const test::Folder folder;
  const fs::path pictures = folder / "pictures", videos = folder / "videos";
  fs::create_directories(videos);
  write_pictures(pictures);
  const std::set<long> gaps{1, 2, 3, 4, 11, 20, 21, 22, 35};
  write_video(pictures.string(), "matroskamux", videos / "a.mkv", {});
  write_video(pictures.string(), "matroskamux", videos / "b.mkv", gaps);
  write_video(pictures.string(), "qtmux", videos / "c.mov", {});
  turn_video(videos / "c.mov");
  const fs::path out = folder / "out";
  const UnpackedVideos unpacked =
      unpack_videos(videos.string(), 0.1, out.string(), VideoStart::first_frames,
                    [](const std::string&, double) {});
  const std::string& notes = unpacked.notes;
  EXPECT_FALSE(unpacked.starts_differ);
  EXPECT_NE(notes.find("b.mkv' lacks 9 of 40 frames"), std::string::npos) << notes;
  EXPECT_NE(notes.find("c.mov' has half a turn in its header"), std::string::npos) << notes;
  EXPECT_EQ(std::ranges::count(notes, '\n'), 2) << notes;
  for (const std::string camera : {"a", "b", "c"})
    for (int n = 0; n < 40; ++n) {
      const fs::path file = out / camera / fmt::format("{:06}.png", n);
      ASSERT_EQ(fs::exists(file), camera != "b" || !gaps.contains(n)) << file;
      if (!fs::exists(file)) continue;
      const Picture picture = load_picture(file.string(), 1);
      EXPECT_NEAR(picture.row(8)[32], 40 + 5 * n, 2) << file;
      EXPECT_NEAR(picture.row(40)[32], 16, 2) << file;
    }
}

// Cameras' and broadcasters' files, beside what is none; and a header that tells a wrong rate, as of
// frames left out.
TEST(CalibrateVideos, OfAnyFormatAndRatesByTheirTimes) {
  const test::Folder folder;
  const fs::path pictures = folder / "pictures", videos = folder / "videos";
  fs::create_directories(videos);
  write_pictures(pictures);
  write_video(pictures.string(), "qtmux", videos / "a.MOV", {8, 9, 18, 27, 28, 29});
  const std::string decoded = "jpegdec ! videoconvert ! video/x-raw,format=I420 ! ";
  const std::string h264 =
      decoded + "x264enc tune=zerolatency quantizer=10 pass=quant ! h264parse ! ";
  write_video(pictures.string(), decoded + "y4menc", videos / "b.y4m", {});
  write_video(pictures.string(), h264 + "mxfmux", videos / "c.mxf", {});
  write_video(pictures.string(), h264 + "mpegtsmux", videos / "e.MTS", {});
  write_video(pictures.string(), "qtmux", videos / "d.m4v", {});
  for (const char* name : {"notes.txt", "notes", "notes.doc"})
    std::ofstream(videos / name) << "recorded today";
  fs::copy_file(pictures / "00.png", videos / "stage.png");
  ASSERT_TRUE(holds_videos(videos.string()));
  const fs::path out = folder / "out";
  const std::string notes =
      unpack_videos(videos.string(), 0.1, out.string(), VideoStart::first_frames,
                    [](const std::string&, double) {})
          .notes;
  EXPECT_NE(notes.find("a.MOV' lacks 6 of 40 frames"), std::string::npos) << notes;
  // JPEG's levels are full; the others' are taken for video's, 16 to 235.
  const auto brightness = [](const std::string& camera, int n) {
    return camera == "a" || camera == "d" ? 40 + 5 * n : (24 + 5 * n) * 255 / 219;
  };
  for (const char* camera : {"a", "b", "c", "d", "e"})
    for (const int n : {0, 7, 10, 30, 39}) {
      const Picture picture =
          load_picture((out / camera / fmt::format("{:06}.png", n)).string(), 1);
      EXPECT_NEAR(picture.row(8)[32], brightness(camera, n), 2) << camera;
    }
  EXPECT_EQ(std::distance(fs::directory_iterator(out), {}), 5);
}

// What the files' times tell, where their recorder kept them.
TEST(CalibrateVideos, FirstFramesThatAreMissing) {
  const test::Folder folder;
  const fs::path pictures = folder / "pictures", videos = folder / "videos";
  fs::create_directories(videos);
  write_pictures(pictures);
  write_video(pictures.string(), "matroskamux", videos / "a.mkv", {});
  write_video(pictures.string(), "matroskamux", videos / "b.mkv", {0, 1, 2, 7});
  write_video(pictures.string(), "matroskamux", videos / "c.mkv", {0, 1, 2, 3, 4});
  for (const VideoStart start : {VideoStart::first_frames, VideoStart::file_times}) {
    const bool timed = start == VideoStart::file_times;
    const fs::path out = folder / (timed ? "timed" : "begun");
    const UnpackedVideos unpacked =
        unpack_videos(videos.string(), 0.1, out.string(), start, [](const std::string&, double) {});
    EXPECT_TRUE(unpacked.starts_differ);
    EXPECT_EQ(unpacked.notes.find("b.mkv' lacks its first 3 frames") != std::string::npos, timed)
        << unpacked.notes;
    EXPECT_EQ(unpacked.notes.find("c.mkv' lacks its first 5 frames") != std::string::npos, timed)
        << unpacked.notes;
    for (const auto& [camera, missing] : {std::pair{"a", 0}, {"b", 3}, {"c", 5}})
      for (const int n : {6, 20, 30}) {
        const fs::path file = out / camera / fmt::format("{:06}.png", n);
        ASSERT_TRUE(fs::exists(file)) << file;
        EXPECT_NEAR(shown_in(file), timed ? n : n + missing, 0.5) << file;
      }
  }
}

}  // namespace polyhull::calibrate_tool
