// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Time per pass: on the CPU until the commands are issued, and on the graphics processor where it
/// can tell. GPU times are read some frames later, so that nothing waits for them.
#pragma once

#include <epoxy/gl.h>

#include <array>

#include "base/stopwatch.h"

namespace polyhull::gl {

/// In the order in which they run; read_back stays the last.
enum class Pass { upload, shadow_maps, scene_depth, shadow, mirror, subject, blend, read_back };
inline constexpr std::size_t pass_count = static_cast<std::size_t>(Pass::read_back) + 1;
const char* pass_name(Pass pass);

/// Times the passes of frame after frame, with the context current.
class PassTimer {
 public:
  PassTimer() { gpu_.fill(-1.0); }
  ~PassTimer();
  void begin(Pass pass);
  void end();
  void next_frame();  ///< collects finished GPU times

  /// Whether end() waits until the pass has been drawn, for benchmarks: then its CPU time is its own
  /// and not that of what was still being drawn before it. At first: no.
  void wait_for_passes(bool wait) { waits_ = wait; }

  double cpu_milliseconds(Pass pass) const { return cpu_[static_cast<std::size_t>(pass)]; }
  /// Of the latest frame whose time is known; negative: not known.
  double gpu_milliseconds(Pass pass) const { return gpu_[static_cast<std::size_t>(pass)]; }

 private:
  static constexpr std::size_t frames = 4;
  bool available();
  std::array<std::array<GLuint, pass_count>, frames> queries_{};
  std::array<std::array<bool, pass_count>, frames> pending_{};
  std::array<double, pass_count> cpu_{};
  std::array<double, pass_count> gpu_;
  std::size_t frame_ = 0;
  std::size_t running_ = 0;
  int available_ = -1;
  bool waits_ = false;
  Stopwatch watch_;
};

}  // namespace polyhull::gl
