// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A line of live cameras into hullbuild and what came out of it. Which instants its sets show is
/// read from the labels in the views' pictures (rigtestsrc's property stamp), not from time stamps.
#pragma once

#include <gst/gst.h>

#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace polyhull::test {

struct LiveOptions {
  int cameras = 4;
  int rate = 25;  ///< frames per second
  int width = 160, height = 120;
  bool figure = false;      ///< the walking figure, which takes its time to draw
  std::vector<int> delays;  ///< ms, of the cameras in turn
  int jitter = 0;           ///< ms
  /// From each camera to hullbuild.
  std::string branch = "queue ! silhouette sigma=1 tolerance=1";
  std::string source;  ///< further properties of rigtestsrc
  int linked = -1;     ///< so many of the cameras from the start, -1: all
  std::string hull;    ///< properties of hullbuild
  /// From hullbuild on.
  std::string tail = "fakesink sync=true";
};

/// A ring of such cameras, cam0, cam1 and so on, each like the built-in rig's first, written to a
/// file; returns its path.
std::string ring_rig(const LiveOptions& options);

/// What one set shows.
struct LiveSet {
  GstClockTime time;         ///< running time
  std::vector<int> numbers;  ///< frame numbers on the labels, -1: not to be read
  bool whole(int cameras) const;
  bool mixed() const;
};

struct LiveFigures {
  int sets = 0, incomplete = 0, mixed = 0, split = 0, unreadable = 0;
  int instants = 0;  ///< that were to be seen
  int shown = 0;     ///< by whole sets
  double share() const { return instants > 0 ? static_cast<double>(shown) / instants : 0.0; }
};

class LiveLine {
 public:
  /// Fails the test (or ends the program) where the line does not parse.
  explicit LiveLine(const LiveOptions& options);
  ~LiveLine();
  LiveLine(const LiveLine&) = delete;

  /// Plays on for \p seconds, as an application does: LATENCY messages are followed.
  void play(double seconds);
  void pause();
  /// One camera more, while playing: the next of those that are not linked yet.
  void join();
  void stop();

  /// Keeps \p threads cores busy for \p seconds, from now on, while play() goes on.
  static std::vector<std::thread> load(int threads, double seconds);

  /// What was seen of the instants from \p begin to \p end (running time, s).
  LiveFigures figures(double begin, double end) const;
  std::vector<LiveSet> sets() const;
  /// Running time of the pipeline, s.
  double now() const;
  /// The latency that hullbuild reports, ms.
  double latency() const;
  guint64 statistic(const char* element, const char* name) const;
  GstElement* element(const char* name) const;  ///< a new reference
  const std::vector<std::string>& warnings() const { return warnings_; }
  const std::string& error() const { return error_; }
  GstElement* pipeline() { return pipeline_; }

 private:
  static GstPadProbeReturn mesh_comes(GstPad* pad, GstPadProbeInfo* info, gpointer data);

  LiveOptions options_;
  int joined_ = 0;
  GstElement* pipeline_;
  GstElement* hull_;
  std::vector<std::string> warnings_;
  std::string error_;
  mutable std::mutex mutex_;  // protects sets_
  std::vector<LiveSet> sets_;
};

}  // namespace polyhull::test
