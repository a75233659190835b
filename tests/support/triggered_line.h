// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A serialtrigger on a pseudo-terminal with cameras that answer its pulses. The program's own
/// write() takes the place of the C library's: it notes when the line goes, as a camera's trigger
/// input does, so that no scheduling stands between a pulse and its frame's time. Which pulse a
/// frame answers is counted there, too, and known from the frame's content.
#pragma once

#include <gst/gst.h>

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "support/terminal.h"

namespace polyhull::test {

struct TriggeredOptions {
  int cameras = 1;
  std::string trigger;           ///< properties of serialtrigger besides the device
  std::string stamp;             ///< properties of every triggerstamp
  std::int64_t delay = 4000000;  ///< ns from a pulse to the time of its frame
  std::int64_t jitter = 0;       ///< ns, to both sides
  std::int64_t transfer = 0;     ///< ns from that time to the frame's arrival
  /// How many frames camera \p camera sends for the \p pulse th packet; none: one. More are 1 ms
  /// apart.
  std::function<int(int camera, std::uint64_t pulse)> frames;
  /// Further elements, and what follows a triggerstamp.
  std::string beside, tail = "fakesink name=sink%d sync=false signal-handoffs=true";
};

/// A frame behind triggerstamp.
struct StampedFrame {
  std::uint64_t pulse;   ///< that it answers, counted on the line
  std::uint64_t number;  ///< that it was given; all ones: none
};

class TriggeredLine {
 public:
  explicit TriggeredLine(const TriggeredOptions& options);
  ~TriggeredLine();
  TriggeredLine(const TriggeredLine&) = delete;

  void play();
  /// Waits until so many pulses were seen on the line, or for \p seconds.
  bool wait_for_pulses(std::uint64_t count, double seconds = 20);
  /// Gives no more pulses, and waits for the frames on their way.
  void finish();
  /// A frame of no pulse, at the clock's time \p time.
  void stray(int camera, std::int64_t time);

  std::uint64_t pulses() const;
  std::vector<StampedFrame> frames(int camera);
  GstElement* element(const std::string& name) const;  ///< borrowed
  /// The latenesses that the trigger announced, ns.
  std::vector<gint64> latenesses();

  GstElement* pipeline;
  Terminal terminal;

 private:
  struct Camera;
  std::vector<std::unique_ptr<Camera>> cameras_;
};

}  // namespace polyhull::test
