// SPDX-License-Identifier: LGPL-2.1-or-later
#include "calibrate/live.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <iostream>
#include <thread>

#include "base/error.h"
#include "base/thread_pool.h"
#include "calibrate/guide_drawing.h"

namespace polyhull::calibrate_tool {
namespace {

namespace fs = std::filesystem;
using calibration::BoardGuide;
using calibration::View;
using Views = std::vector<std::optional<View>>;

/// Cameras without a common trigger take a moving board at different places; within this they are
/// of one frame or neighbouring ones, which show a board that stands still at one place.
constexpr GstClockTime one_instant = 60 * GST_MSECOND;
/// From one look to the next, as a part of the picture's width.
constexpr double still = 0.0015;

volatile std::sig_atomic_t interrupted = 0;

void interrupt(int signal) {
  interrupted = 1;
  std::signal(signal, SIG_DFL);
}

/// Until the first Ctrl-C, which ends the take and not the program.
class Interruption {
 public:
  Interruption() : before_(std::signal(SIGINT, interrupt)) {}
  ~Interruption() { std::signal(SIGINT, before_); }

 private:
  void (*before_)(int);
};

void make_empty(const std::string& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error || !fs::is_directory(folder))
    throw Error(Error::Kind::bad_input, "The folder '{}' cannot be made: {}.", folder,
                error.message());
  if (!fs::is_empty(folder, error))
    throw Error(Error::Kind::bad_input,
                "The folder '{}' is not empty; give a new one for the live cameras' pictures.",
                folder);
}

bool stands_still(const View& now, const std::optional<View>& before, int width) {
  if (!before) return false;
  double sum = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < now.ids.size(); ++i) {
    const auto at = std::ranges::find(before->ids, now.ids[i]);
    if (at == before->ids.end()) continue;
    sum += glm::length(now.corners[i] -
                       before->corners[static_cast<std::size_t>(at - before->ids.begin())]);
    ++count;
  }
  return count > 0 && sum < still * width * count;
}

class LivePictures {
 public:
  LivePictures(const LiveTake& how, const calibration::Target& target)
      : how_(how), finder_(target), cameras_(how.sources), last_(how.sources.size()) {
    if (!how.show.empty()) window_.emplace(how.show);
    for (const LiveSource& source : how.sources) names_.push_back(source.name);
  }

  void run() {
    wait_for_all();
    std::vector<calibration::TakeCamera> cameras;
    for (std::size_t c = 0; c < names_.size(); ++c)
      cameras.push_back({names_[c], last_[c].width, last_[c].height, {}});
    BoardGuide guide(std::move(cameras), how_.enough);
    Views before(names_.size());
    auto next = std::chrono::steady_clock::now();
    while (interrupted == 0 && !guide.enough() && cameras_.take(one_instant, pictures_)) {
      Views views = look();
      keep(guide, views, before);
      if (window_) window_->show(draw_guide(guide, names_, last_, views));
      before = std::move(views);
      next = std::max(next, std::chrono::steady_clock::now() - std::chrono::seconds(1)) +
             std::chrono::microseconds(static_cast<std::int64_t>(1e6 * how_.every));
      while (interrupted == 0 && std::chrono::steady_clock::now() < next)
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    if (guide.instants() == 0)
      throw Error(Error::Kind::bad_input, "No camera has seen the board standing still for {:g} s.",
                  how_.every);
  }

 private:
  void wait_for_all() {
    for (int tries = 0; tries < 10; ++tries) {
      const bool open = cameras_.take(GST_CLOCK_TIME_NONE, pictures_);
      for (std::size_t c = 0; c < last_.size(); ++c)
        if (pictures_[c]) last_[c] = std::move(*pictures_[c]);
      if (!open || std::ranges::none_of(last_, &Picture::empty)) break;
    }
    for (std::size_t c = 0; c < last_.size(); ++c)
      if (last_[c].empty())
        throw Error(Error::Kind::bad_input, "Camera '{}' has sent no picture.", names_[c]);
  }

  Views look() {
    Views views(names_.size());
    parallel_each(names_.size(), 1, 0, [&](std::size_t c) {
      if (!pictures_[c]) return;
      if (pictures_[c]->width != last_[c].width || pictures_[c]->height != last_[c].height)
        throw Error(Error::Kind::bad_input, "Camera '{}' has changed from {}x{} to {}x{}.",
                    names_[c], last_[c].width, last_[c].height, pictures_[c]->width,
                    pictures_[c]->height);
      last_[c] = std::move(*pictures_[c]);
      views[c] = finder_.find(last_[c]);
      if (views[c]) views[c]->camera = c;
    });
    return views;
  }

  void keep(BoardGuide& guide, const Views& views, const Views& before) {
    std::vector<View> steady;
    for (std::size_t c = 0; c < views.size(); ++c)
      if (views[c] && stands_still(*views[c], before[c], last_[c].width))
        steady.push_back(*views[c]);
    if (!guide.add(steady)) return;
    for (const View& view : steady) {
      const fs::path folder = fs::path(how_.folder) / names_[view.camera];
      fs::create_directories(folder);
      save_picture(last_[view.camera],
                   (folder / fmt::format("{:04}.png", guide.instants() - 1)).string());
    }
    if (how_.quiet) return;
    std::cerr << guide.instants() << " instants";
    for (std::size_t c = 0; c < names_.size(); ++c) {
      const std::string wish = guide.wish(c);
      std::cerr << fmt::format("; {}: {} views, {:.0f} % covered, {}", names_[c], guide.views(c),
                               100.0 * guide.coverage(c), wish.empty() ? "done" : wish);
    }
    std::cerr << std::endl;
  }

  const LiveTake& how_;
  calibration::BoardFinder finder_;
  LiveCameras cameras_;
  std::optional<Window> window_;
  std::vector<std::string> names_;
  std::vector<std::optional<Picture>> pictures_;
  std::vector<Picture> last_;
};

}  // namespace

void take_live(const LiveTake& take, const calibration::Target& target) {
  gst_init(nullptr, nullptr);
  make_empty(take.folder);
  const Interruption until;
  LivePictures(take, target).run();
}

}  // namespace polyhull::calibrate_tool
