// SPDX-License-Identifier: LGPL-2.1-or-later
#include <gst/app/gstappsink.h>
#include <gst/check/gstharness.h>

#include <cmath>
#include <random>

#include "base/picture.h"
#include "elements/element_checks.h"
#include "elements/frames.h"
#include "elements/views.h"
#include "support/folder.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

constexpr int width = 161;
constexpr int height = 93;

/// Settings of the three elements, and the same for the one.
struct Settings {
  std::string key, blur, contour, all;
};

std::string chain_of(const Settings& s) {
  return "chromamatte name=c " + s.key + " ! gaussblur " + s.blur + " ! contourfind camera=cam1 " +
         s.contour;
}

std::string one_of(const Settings& s) {
  return "silhouette name=c camera=cam1 " + s.all;
}

/// Pictures that move: a textured subject before a noisy, uneven screen, in any 8-bit format.
class Pictures {
 public:
  explicit Pictures(const char* format) : caps_(video_caps(format, width, height)) {
    fail_unless(gst_video_info_from_caps(&info_, caps_));
    GstCaps* rgb = video_caps("RGBx", width, height);
    GstVideoInfo rgb_info;
    gst_video_info_from_caps(&rgb_info, rgb);
    for (int i = 0; i < count; ++i) {
      GstBuffer* picture = disk_frame(rgb, {30.0 + 15 * i, 45.0 + 3 * i, 26.0 - 2 * i});
      roughen(picture, i);
      frames_[i] = convert(picture, &rgb_info);
    }
    gst_caps_unref(rgb);
  }
  ~Pictures() {
    for (GstBuffer* frame : frames_) gst_buffer_unref(frame);
    gst_caps_unref(caps_);
  }
  static constexpr int count = 6;
  GstCaps* caps() const { return gst_caps_ref(caps_); }

  /// Pictures 2 and 3 are the same, and so are 5 and everything behind.
  GstBuffer* frame(int i) const {
    const int picture = i == 3 ? 2 : std::min(i, count - 1);
    GstBuffer* copy = gst_buffer_copy_deep(frames_[picture]);
    GST_BUFFER_PTS(copy) = i * GST_SECOND / 30;
    GST_BUFFER_OFFSET(copy) = i;
    return copy;
  }

 private:
  static void roughen(GstBuffer* picture, int seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0.0, 3.0);
    GstMapInfo map;
    gst_buffer_map(picture, &map, GST_MAP_READWRITE);
    for (gsize i = 0; i < map.size; ++i) {
      const double uneven = 1.0 + 0.0006 * (static_cast<double>(i % (width * 4)) / 4 - width / 2.0);
      map.data[i] =
          static_cast<std::uint8_t>(std::clamp(map.data[i] * uneven + noise(random), 0.0, 255.0));
    }
    gst_buffer_unmap(picture, &map);
  }

  GstBuffer* convert(GstBuffer* picture, GstVideoInfo* from) {
    GstVideoConverter* converter = gst_video_converter_new(from, &info_, nullptr);
    GstBuffer* out = gst_buffer_new_allocate(nullptr, GST_VIDEO_INFO_SIZE(&info_), nullptr);
    gst_buffer_memset(out, 0, 0, -1);
    GstVideoFrame in_frame, out_frame;
    gst_video_frame_map(&in_frame, from, picture, GST_MAP_READ);
    gst_video_frame_map(&out_frame, &info_, out, GST_MAP_WRITE);
    gst_video_converter_frame(converter, &in_frame, &out_frame);
    gst_video_frame_unmap(&in_frame);
    gst_video_frame_unmap(&out_frame);
    gst_video_converter_free(converter);
    gst_buffer_unref(picture);
    GST_BUFFER_DURATION(out) = GST_SECOND / 30;
    return out;
  }

  GstCaps* caps_;
  GstVideoInfo info_;
  GstBuffer* frames_[count];
};

/// The one pass and the chain, fed with the same frames, send the same bytes.
void check_identical(const Settings& settings, const char* format) {
  const Pictures pictures(format);
  GstHarness* chain = gst_harness_new_parse(chain_of(settings).c_str());
  GstHarness* one = gst_harness_new_parse(one_of(settings).c_str());
  gst_harness_set_src_caps(chain, pictures.caps());
  gst_harness_set_src_caps(one, pictures.caps());
  std::size_t points = 0;
  for (int i = 0; i < Pictures::count + 2; ++i) {
    const ReadView a = take_view(gst_harness_push_and_pull(chain, pictures.frame(i)));
    const ReadView b = take_view(gst_harness_push_and_pull(one, pictures.frame(i)));
    points += a.view.contours.points.size();
    fail_unless(a.view.contours == b.view.contours, "%s %s: frame %d: %u and %u vertices", format,
                settings.all.c_str(), i, (unsigned)a.view.contours.points.size(),
                (unsigned)b.view.contours.points.size());
    fail_unless(a.view.roi == b.view.roi, "%s %s: frame %d: region of interest", format,
                settings.all.c_str(), i);
    fail_unless(a.bytes == b.bytes, "%s %s: frame %d: pixels", format, settings.all.c_str(), i);
  }
  fail_unless(points > 0 || settings.all.find("roi-x") != std::string::npos, "%s: nothing keyed",
              settings.all.c_str());
  gst_harness_teardown(chain);
  gst_harness_teardown(one);
}

Settings with(const std::string& key, const std::string& blur, const std::string& contour,
              const std::string& all) {
  return {key, blur, contour, all};
}

}  // namespace

ELEMENT_TEST(says_what_it_is) {
  check_documented("silhouette");
}

ELEMENT_TEST(goes_up_and_down) {
  check_states(
      "videotestsrc num-buffers=30 pattern=ball background-color=0xff1ebe3c ! "
      "video/x-raw,format=NV12 ! silhouette camera=cam0 ! fakesink");
}

ELEMENT_TEST(same_bytes_as_the_chain_in_every_format) {
  for (const char* format :
       {"RGBx", "BGRx", "RGBA", "BGRA", "RGB", "BGR", "I420", "NV12", "YUY2", "UYVY", "I420_10LE",
        "v210", "Y42B", "I422_10LE", "Y444", "YVYU", "P010_10LE", "xBGR", "GBR_10LE"}) {
    check_identical({}, format);
  }
}

ELEMENT_TEST(same_bytes_as_the_chain_with_every_setting) {
  const Settings settings[] = {
      with("", "sigma=0", "", "sigma=0"),
      with("", "sigma=6", "tolerance=0", "sigma=6 tolerance=0"),
      with("", "threshold=100", "tolerance=3", "threshold=100 tolerance=3"),
      with("", "method=box passes=2", "", "blur-method=box passes=2"),
      with("", "method=recursive sigma=9", "", "blur-method=recursive sigma=9"),
      with("", "", "method=binary", "contour-method=binary"),
      with("", "", "correct-curvature=false min-area=0 min-edges=3",
           "correct-curvature=false min-area=0 min-edges=3"),
      with("method=prototype strength=40", "", "", "key-method=prototype strength=40"),
      with("choke=1.5", "", "", "choke=1.5"),
      with("", "", "steadiness=2", "steadiness=2"),
      with("resample=2", "", "", "resample=2"),
      with("close=2", "sigma=1", "", "close=2 sigma=1"),
      with("clip-black=0.1 spill=0.5", "", "", "clip-black=0.1 spill=0.5"),
      with("roi-x=20 roi-y=11 roi-width=70 roi-height=50", "", "",
           "roi-x=20 roi-y=11 roi-width=70 roi-height=50"),
      with("roi-x=2000", "", "", "roi-x=2000"),
      with("outside-polygon=\"10,10 100,5 80,90 20,80\"", "", "",
           "outside-polygon=\"10,10 100,5 80,90 20,80\""),
      with("inside-polygon=\"10,10 100,5 80,90 20,80\"", "", "keep-largest=1",
           "inside-polygon=\"10,10 100,5 80,90 20,80\" keep-largest=1"),
      with("key=auto", "sigma=20", "tolerance=0.1", "key=auto sigma=20 tolerance=0.1"),
      with("clip-black=0.3 clip-white=0.6 red-gain=1.2 blue-gain=0.8", "sigma=0.3", "",
           "clip-black=0.3 clip-white=0.6 red-gain=1.2 blue-gain=0.8 sigma=0.3"),
  };
  for (const Settings& s : settings) {
    check_identical(s, "NV12");
    check_identical(s, "BGRx");
  }
}

ELEMENT_TEST(settings_that_change_in_the_stream_change_both) {
  const Pictures pictures("BGRx");
  GstHarness* chain = gst_harness_new_parse("chromamatte ! gaussblur ! contourfind camera=c");
  GstHarness* one = gst_harness_new_parse("silhouette camera=c");
  gst_harness_set_src_caps(chain, pictures.caps());
  gst_harness_set_src_caps(one, pictures.caps());
  GstElement* key = gst_harness_find_element(chain, "chromamatte");
  GstElement* blur = gst_harness_find_element(chain, "gaussblur");
  GstElement* find = gst_harness_find_element(chain, "contourfind");
  GstElement* all = gst_harness_find_element(one, "silhouette");
  const auto set = [&](GstElement* element, const char* name, const char* value) {
    gst_util_set_object_arg(G_OBJECT(element), name, value);
    gst_util_set_object_arg(G_OBJECT(all), name, value);
  };
  for (int i = 0; i < 24; ++i) {
    switch (i) {
      case 7:
        set(key, "roi-width", "80");
        break;
      case 9:
        set(blur, "sigma", "5");
        break;
      case 11:
        set(find, "tolerance", "0.3");
        break;
      case 13:
        set(key, "spill", "0.2");
        break;
      case 15:
        set(key, "choke", "2");
        break;
      case 17:
        set(find, "min-area", "1e6");
        break;
      case 18:
        set(find, "min-area", "5");
        break;
      case 19:
        set(key, "inside-polygon", "5,5 30,5 20,40");
        break;
      case 21:
        set(blur, "sigma", "0");
        break;
      default:
        break;
    }
    const ReadView a = take_view(gst_harness_push_and_pull(chain, pictures.frame(i)));
    const ReadView b = take_view(gst_harness_push_and_pull(one, pictures.frame(i)));
    fail_unless(a.bytes == b.bytes, "frame %d", i);
  }
  fail_unless(statistic(all, "reused") >= 2, "nothing was reused");
  for (GstElement* element : {key, blur, find, all}) gst_object_unref(element);
  gst_harness_teardown(chain);
  gst_harness_teardown(one);
}

ELEMENT_TEST(reuse_changes_nothing_but_the_time) {
  const Pictures pictures("NV12");
  GstHarness* on = gst_harness_new_parse("silhouette camera=c");
  GstHarness* off = gst_harness_new_parse("silhouette camera=c reuse=false");
  gst_harness_set_src_caps(on, pictures.caps());
  gst_harness_set_src_caps(off, pictures.caps());
  GstElement* all = gst_harness_find_element(on, "silhouette");
  for (int i = 0; i < 12; ++i) {
    const ReadView a = take_view(gst_harness_push_and_pull(on, pictures.frame(i)));
    const ReadView b = take_view(gst_harness_push_and_pull(off, pictures.frame(i)));
    fail_unless(a.bytes == b.bytes, "frame %d", i);
  }
  // The second of equal frames is copied, the third and later ones are reused.
  fail_unless_equals_int(static_cast<int>(statistic(all, "reused")), 5);
  gst_object_unref(all);
  gst_harness_teardown(on);
  gst_harness_teardown(off);
}

/// Each setting counts at once, also while the picture stands still.
ELEMENT_TEST(settings_count_on_a_still_picture) {
  const Pictures pictures("NV12");
  for (const auto& [name, value] : {std::pair{"tolerance", "4"},
                                    {"keep-largest", "1"},
                                    {"min-area", "5000"},
                                    {"contour-method", "binary"},
                                    {"sigma", "4"},
                                    {"key", "blue"}}) {
    GstHarness* on = gst_harness_new_parse("silhouette camera=c min-area=0 tolerance=0.5");
    GstHarness* off =
        gst_harness_new_parse("silhouette camera=c min-area=0 tolerance=0.5 reuse=false");
    gst_harness_set_src_caps(on, pictures.caps());
    gst_harness_set_src_caps(off, pictures.caps());
    GstElement* elements[] = {gst_harness_find_element(on, "silhouette"),
                              gst_harness_find_element(off, "silhouette")};
    // From picture 5 on they are all the same.
    for (int i = 5; i < 12; ++i) {
      if (i == 9)
        for (GstElement* element : elements)
          gst_util_set_object_arg(G_OBJECT(element), name, value);
      const ReadView a = take_view(gst_harness_push_and_pull(on, pictures.frame(i)));
      const ReadView b = take_view(gst_harness_push_and_pull(off, pictures.frame(i)));
      fail_unless(a.view.contours == b.view.contours, "%s: frame %d", name, i);
    }
    fail_unless(statistic(elements[0], "reused") >= 2);
    for (GstElement* element : elements) gst_object_unref(element);
    gst_harness_teardown(on);
    gst_harness_teardown(off);
  }
}

/// The tolerance that adaptive chooses counts at once, too.
ELEMENT_TEST(late_frames_coarsen_a_still_picture) {
  const Pictures pictures("NV12");
  GstHarness* on = gst_harness_new_parse("silhouette camera=c adaptive=true tolerance=0.3");
  GstHarness* off =
      gst_harness_new_parse("silhouette camera=c adaptive=true tolerance=0.3 reuse=false");
  gst_harness_set_src_caps(on, pictures.caps());
  gst_harness_set_src_caps(off, pictures.caps());
  std::size_t points[2];
  for (int i = 0; i < 10; ++i) {
    if (i == 5)
      for (int event = 0; event < 120; ++event)
        for (GstHarness* h : {on, off})
          gst_harness_push_upstream_event(
              h, gst_event_new_qos(GST_QOS_TYPE_OVERFLOW, 1.5, 0, event * GST_SECOND / 30));
    const auto frame = [&] {
      GstBuffer* buffer = pictures.frame(5);
      // Later than the events tell of, or the base class drops it.
      GST_BUFFER_PTS(buffer) = i * 10 * GST_SECOND;
      return buffer;
    };
    const ReadView a = take_view(gst_harness_push_and_pull(on, frame()));
    const ReadView b = take_view(gst_harness_push_and_pull(off, frame()));
    fail_unless(a.view.contours == b.view.contours, "frame %d", i);
    points[i / 5] = a.view.contours.points.size();
  }
  fail_unless(points[1] < points[0], "%zu and %zu vertices", points[0], points[1]);
  gst_harness_teardown(on);
  gst_harness_teardown(off);
}

/// QoS events coarsen and refine the one pass's polygons as they do contourfind's.
ELEMENT_TEST(late_frames_coarsen_the_contours) {
  const Pictures pictures("BGRx");
  GstHarness* chain = gst_harness_new_parse(
      "chromamatte ! gaussblur ! contourfind camera=c adaptive=true tolerance=0.3");
  GstHarness* one = gst_harness_new_parse("silhouette camera=c adaptive=true tolerance=0.3");
  gst_harness_set_src_caps(chain, pictures.caps());
  gst_harness_set_src_caps(one, pictures.caps());
  std::size_t points[3];
  int event = 0;
  const auto send = [&](double proportion, int until) {
    for (; event < until; ++event)
      for (GstHarness* h : {chain, one})
        gst_harness_push_upstream_event(
            h, gst_event_new_qos(GST_QOS_TYPE_OVERFLOW, proportion, 0, event * GST_SECOND / 30));
  };
  for (int round = 0; round < 3; ++round) {
    if (round == 1) send(1.5, 120);
    if (round == 2) send(0.3, 3000);
    // Later than the events tell of, or the base class drops it.
    const auto frame = [&] {
      GstBuffer* buffer = pictures.frame(round);
      GST_BUFFER_PTS(buffer) = round * 150 * GST_SECOND;
      return buffer;
    };
    const ReadView a = take_view(gst_harness_push_and_pull(chain, frame()));
    const ReadView b = take_view(gst_harness_push_and_pull(one, frame()));
    fail_unless(a.bytes == b.bytes, "round %d", round);
    points[round] = b.view.contours.points.size();
  }
  fail_unless(points[1] < points[0] && points[1] < points[2], "%u, %u, %u vertices",
              (unsigned)points[0], (unsigned)points[1], (unsigned)points[2]);
  gst_harness_teardown(chain);
  gst_harness_teardown(one);
}

ELEMENT_TEST(the_clean_plate_works_like_the_chain) {
  const Folder folder;
  const std::string path = folder.file("plate.png");
  Picture plate{width, height, 3, {}};
  for (int i = 0; i < width * height; ++i) {
    for (const int v : {30, 190, 60}) plate.pixels.push_back(static_cast<std::uint8_t>(v));
  }
  save_picture(plate, path);
  const std::string key = "clean-plate=" + path;
  check_identical(with(key + " method=difference", "", "", key + " key-method=difference"), "I420");
  check_identical(with(key, "", "", key), "BGRx");
  check_identical(with("learn-plate=2 method=difference", "", "tolerance=2",
                       "learn-plate=2 key-method=difference tolerance=2"),
                  "NV12");
}

ELEMENT_TEST(bad_input_is_refused_with_a_sentence) {
  const std::string front =
      "videotestsrc num-buffers=3 ! video/x-raw,format=NV12,width=64,height=48 ! silhouette ";
  for (const char* properties : {"clean-plate=/nowhere/plate.png", "outside-polygon=\"1,2\"",
                                 "clip-black=1 clip-white=0", "rig=/nowhere/rig.json"}) {
    fail_if(run_to_end(front + properties + " ! fakesink").empty(), "%s was accepted", properties);
  }
}

ELEMENT_TEST(changes_size_and_format_in_the_stream) {
  GstHarness* h = gst_harness_new("silhouette");
  const struct {
    const char* format;
    int w, h;
  } rounds[] = {
      {"RGBx", 64, 48}, {"BGR", 33, 21}, {"RGBA", 200, 7}, {"BGRx", 1, 1}, {"RGB", 64, 48}};
  for (const auto& round : rounds) {
    GstCaps* caps = video_caps(round.format, round.w, round.h);
    gst_harness_set_src_caps(h, gst_caps_ref(caps));
    const ReadView read = take_view(gst_harness_push_and_pull(
        h, disk_frame(caps, {round.w / 2.0, round.h / 2.0, round.h / 2.5})));
    fail_unless_equals_int(read.view.width, round.w);
    gst_caps_unref(caps);
  }
  gst_harness_teardown(h);
}

ELEMENT_TEST(survives_flush_and_seek) {
  expect_survives_flush_and_seek(
      "videotestsrc num-buffers=100 pattern=ball background-color=0xff1ebe3c ! "
      "video/x-raw,format=YUY2 ! silhouette ! fakesink sync=false");
}

ELEMENT_TEST(views_outlive_the_element) {
  const Pictures pictures("NV12");
  GstHarness* h = gst_harness_new_parse("silhouette");
  gst_harness_set_src_caps(h, pictures.caps());
  GstBuffer* first = gst_harness_push_and_pull(h, pictures.frame(0));
  const std::vector<std::uint8_t> bytes = bytes_of(first);
  for (int i = 1; i < 12; ++i) {
    gst_buffer_unref(gst_harness_push_and_pull(h, pictures.frame(i)));
  }
  gst_harness_teardown(h);
  fail_unless(bytes_of(first) == bytes);
  gst_buffer_unref(first);
}
