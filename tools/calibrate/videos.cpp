// SPDX-License-Identifier: LGPL-2.1-or-later
#include "calibrate/videos.h"

#include <fmt/format.h>
#include <gst/gst.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <mutex>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <optional>
#include <vector>

#include "base/error.h"
#include "base/picture.h"
#include "base/plain_text.h"
#include "base/thread_pool.h"

namespace polyhull::calibrate_tool {
namespace {

namespace fs = std::filesystem;
std::string ending_of(const fs::path& path) {
  return lower_case(path.extension().string());
}

// By its ending, else by whether it can be read as one; a picture, too, is a film of one frame, and a
// text one of its letters.
bool is_video(const fs::path& path) {
  constexpr std::array endings{".mkv", ".mp4", ".mov", ".avi", ".webm", ".m4v", ".mts", ".mxf"};
  // Of the last four cameras' smaller copies, thumbnails and lists.
  constexpr std::array others{".png", ".jpg", ".jpeg", ".txt", ".json", ".csv",
                              ".log", ".md",  ".lrv",  ".thm", ".xml",  ".m3u8"};
  const std::string ending = ending_of(path);
  if (std::ranges::find(endings, ending) != endings.end()) return true;
  if (ending.empty() || std::ranges::find(others, ending) != others.end()) return false;
  cv::VideoCapture video(path.string(), cv::CAP_FFMPEG);
  return video.isOpened() && video.grab() && video.grab();
}

std::map<std::string, fs::path> videos_in(const std::string& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error))
    throw Error(Error::Kind::not_found, "There is no folder '{}'.", folder);
  std::map<std::string, fs::path> videos;  // by camera
  fs::path pictures;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.is_directory()) pictures = entry.path();
    if (!entry.is_regular_file() || !is_video(entry.path())) continue;
    const auto [at, first] = videos.emplace(entry.path().stem().string(), entry.path());
    if (!first)
      throw Error(Error::Kind::bad_input, "'{}' and '{}' are both of camera '{}'. Leave one.",
                  at->second.string(), entry.path().string(), at->first);
  }
  if (!videos.empty() && !pictures.empty())
    throw Error(Error::Kind::bad_input,
                "'{}' holds videos and the folder '{}'. Give either videos, one per camera, or a "
                "folder of pictures per camera.",
                folder, pictures.filename().string());
  return videos;
}

Picture grey_of(const cv::Mat& frame) {
  cv::Mat grey;
  if (frame.channels() == 1)
    grey = frame;
  else
    cv::cvtColor(frame, grey, cv::COLOR_BGR2GRAY);
  Picture picture{grey.cols, grey.rows, 1, {}};
  picture.pixels.resize(grey.total());
  for (int y = 0; y < grey.rows; ++y)
    std::copy_n(grey.ptr<std::uint8_t>(y), grey.cols, picture.row(y));
  return picture;
}

cv::VideoCapture opened(const fs::path& path) {
  cv::VideoCapture video(path.string(), cv::CAP_FFMPEG);
  const double rate = video.isOpened() ? video.get(cv::CAP_PROP_FPS) : 0.0;
  if (!(rate > 0.0 && rate < 10000.0))
    throw Error(Error::Kind::bad_input,
                "'{}' cannot be read as a video. Convert it, with ffmpeg or gst-launch-1.0, to "
                "H.264 or MJPEG in a Matroska file.",
                path.string());
  // decodebin does not turn pictures either, and the rig must be of what it gives.
  video.set(cv::CAP_PROP_ORIENTATION_AUTO, 0.0);
  return video;
}

// Frames a second: what the file says, unless the times of its first frames, but for gaps, say
// another: phones' files say the mean, gaps and all, and recorders of browsers a thousand.
double rate_of(const fs::path& path) {
  constexpr std::size_t looked_at = 100;
  constexpr double same = 1e-3, clock_step = 0.0015;  // seconds: some files count milliseconds
  cv::VideoCapture video = opened(path);
  const double said = video.get(cv::CAP_PROP_FPS);
  std::vector<double> steps;
  double last = 0.0;
  for (std::size_t i = 0; i < looked_at && video.grab(); ++i) {
    const double time = video.get(cv::CAP_PROP_POS_MSEC) / 1000.0;
    if (i > 0 && time > last) steps.push_back(time - last);
    last = time;
  }
  if (steps.size() < 3) return said;
  std::ranges::sort(steps);
  const double usual = steps[steps.size() / 2];
  double span = 0.0, count = 0.0;
  for (const double step : steps)
    if (std::abs(step - usual) < 0.25 * usual) span += step, ++count;
  return std::abs(said * span / count - 1.0) < std::max(same, clock_step / span) ? said
                                                                                 : count / span;
}

std::string turn_note(const fs::path& path) {
  const long turn = std::lround(opened(path).get(cv::CAP_PROP_ORIENTATION_META)) % 360;
  if (turn == 0) return "";
  return fmt::format(
      "'{}' has {} in its header, as phones write it. The pictures are taken as they are stored, "
      "as decodebin gives them: put no videoflip into the pipeline.",
      path.string(), std::abs(turn) == 180 ? "half a turn" : "a quarter turn");
}

// When the first frame is shown by the file's own times, seconds; 0 where GStreamer cannot tell. (OpenCV
// counts from that frame on.)
double first_time(const fs::path& path) {
  gst_init(nullptr, nullptr);
  g_autoptr(GstElement) pipeline = gst_parse_launch(
      "filesrc name=file ! decodebin ! video/x-raw(ANY) ! fakesink name=sink", nullptr);
  if (!pipeline) return 0.0;
  g_autoptr(GstElement) file = gst_bin_get_by_name(GST_BIN(pipeline), "file");
  g_autoptr(GstElement) sink = gst_bin_get_by_name(GST_BIN(pipeline), "sink");
  g_object_set(file, "location", path.c_str(), nullptr);
  gst_element_set_state(pipeline, GST_STATE_PAUSED);
  g_autoptr(GstBus) bus = gst_element_get_bus(pipeline);
  g_autoptr(GstMessage) message = gst_bus_timed_pop_filtered(
      bus, 20 * GST_SECOND,
      static_cast<GstMessageType>(GST_MESSAGE_ASYNC_DONE | GST_MESSAGE_ERROR | GST_MESSAGE_EOS));
  g_autoptr(GstSample) sample = nullptr;
  if (message && GST_MESSAGE_TYPE(message) == GST_MESSAGE_ASYNC_DONE)
    g_object_get(sink, "last-sample", &sample, nullptr);
  guint64 time = GST_CLOCK_TIME_NONE;
  if (sample) {
    time = GST_BUFFER_PTS(gst_sample_get_buffer(sample));
    // Matroska counts from the recording's begin, which GStreamer takes off; in MP4 what reordered frames
    // need comes first, and an edit list tells the begin.
    if (const std::string ending = ending_of(path); ending != ".mkv" && ending != ".webm")
      time = gst_segment_to_running_time(gst_sample_get_segment(sample), GST_FORMAT_TIME, time);
  }
  gst_element_set_state(pipeline, GST_STATE_NULL);
  return GST_CLOCK_TIME_IS_VALID(time) ? static_cast<double>(time) / GST_SECOND : 0.0;
}

// How many frames after the earliest one each video begins.
std::vector<long> first_numbers(const std::vector<std::pair<std::string, fs::path>>& videos,
                                double rate) {
  std::vector<double> times;
  for (const auto& [camera, path] : videos) times.push_back(first_time(path));
  const double first = *std::ranges::min_element(times);
  std::vector<long> numbers;
  for (const double time : times) numbers.push_back(std::lround((time - first) * rate));
  return numbers;
}

// The numbers of a video's frames from 0, by their times, so that frames that were not recorded
// are missed and not counted over; frames without a time follow the one before.
class FrameNumbers {
 public:
  explicit FrameNumbers(double rate) : rate_(rate) {}
  // Of the frame that was grabbed last; nothing where it has the number of the one before.
  std::optional<long> next(const cv::VideoCapture& video) {
    const double seconds = video.get(cv::CAP_PROP_POS_MSEC) / 1000.0;
    const long by_time = std::lround(std::max(0.0, seconds) * rate_);
    const bool timed = seconds > seconds_;
    seconds_ = std::max(seconds, seconds_);
    if (timed && by_time <= last_) return std::nullopt;
    const long number = timed ? by_time : last_ + 1;
    missing_ += number - last_ - 1;
    last_ = number;
    return number;
  }
  long missing() const { return missing_; }
  long count() const { return last_ + 1; }

 private:
  double rate_;
  double seconds_ = -1.0;
  long last_ = -1;
  long missing_ = 0;
};

}  // namespace

bool holds_videos(const std::string& folder) {
  return !videos_in(folder).empty();
}

ScratchFolder::ScratchFolder() {
  std::error_code error;
  std::string path = (fs::temp_directory_path(error) / "polyhull-calibrate-XXXXXX").string();
  if (error || mkdtemp(path.data()) == nullptr)
    throw Error(Error::Kind::not_found,
                "No folder for the videos' pictures can be made in '{}'. Set TMPDIR to a folder "
                "that can be written.",
                fs::path(path).parent_path().string());
  path_ = path;
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

UnpackedVideos unpack_videos(const std::string& folder, double seconds, const std::string& out,
                             VideoStart start, const calibration::Progress& progress) {
  const std::map<std::string, fs::path> found = videos_in(folder);
  const std::vector<std::pair<std::string, fs::path>> videos(found.begin(), found.end());
  const double rate = rate_of(videos.front().second);
  for (const auto& [camera, path] : videos) {
    const double own = rate_of(path);
    if (std::abs(own - rate) > 1e-2 * rate)
      throw Error(Error::Kind::bad_input,
                  "'{}' has {:.3f} frames a second, '{}' {:.3f}. Frames of one number must be of "
                  "one instant: record all cameras at one rate.",
                  path.string(), own, videos.front().second.string(), rate);
  }
  const long step = std::max(1L, std::lround(std::min(1e6, seconds) * rate));
  const std::vector<long> first = first_numbers(videos, rate);
  std::vector<std::string> notes(videos.size());
  std::mutex telling;
  std::size_t done = 0;
  parallel_each(videos.size(), 1, 0, [&](std::size_t v) {
    const fs::path pictures = fs::path(out) / videos[v].first;
    fs::create_directories(pictures);
    cv::VideoCapture video = opened(videos[v].second);
    cv::Mat frame;
    FrameNumbers numbers(rate);
    const long before = start == VideoStart::file_times ? first[v] : 0;
    while (video.grab()) {
      const std::optional<long> own = numbers.next(video);
      if (!own) continue;
      const long number = before + *own;
      if (number % step != 0 || !video.retrieve(frame) || frame.empty()) continue;
      save_picture(grey_of(frame), (pictures / fmt::format("{:06}.png", number)).string());
    }
    if (numbers.count() == 0)
      throw Error(Error::Kind::bad_input, "'{}' has no frames.", videos[v].second.string());
    notes[v] = turn_note(videos[v].second);
    if (numbers.missing() > 0)
      notes[v] += fmt::format("{}'{}' lacks {} of {} frames by their times, which count.",
                              notes[v].empty() ? "" : "\n", videos[v].second.string(),
                              numbers.missing(), numbers.count());
    if (before > 0)
      notes[v] += fmt::format("{}'{}' lacks its first {} frames by its times in the file.",
                              notes[v].empty() ? "" : "\n", videos[v].second.string(), before);
    const std::lock_guard lock(telling);
    progress(fmt::format("taking pictures from {} videos", videos.size()),
             static_cast<double>(++done) / static_cast<double>(videos.size()));
  });
  UnpackedVideos result;
  for (const std::string& note : notes) result.notes += note.empty() ? "" : note + "\n";
  result.starts_differ = std::ranges::any_of(first, [](long number) { return number != 0; });
  return result;
}

}  // namespace polyhull::calibrate_tool
